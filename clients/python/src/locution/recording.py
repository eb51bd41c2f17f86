"""Recordings as arrays: what a laser saw, when, and where the odometry said the robot was."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import RecordingError
from .models import Geometry, Pose

Floats = npt.NDArray[np.float64]
Ranges = npt.NDArray[np.float32]
TRAVEL_ASKED_M = 25.0
"""What counts of a recording that is asked about; the server looks at no more."""


@dataclass(frozen=True)
class Scan:
    """One sweep of the laser.

    A reading is metres, infinite where the beam met nothing, and 0 where it says nothing at all.
    """

    timestamp_ns: int
    odom_from_robot: Pose
    ranges_m: Ranges

    def to_wire(self) -> dict[str, Any]:
        """The scan as a CBOR body carries it."""
        return {
            "timestamp_ns": self.timestamp_ns,
            "odom_from_robot": self.odom_from_robot.to_dict(),
            "ranges_m": self.ranges_m.astype("<f4", copy=False).tobytes(),
        }


@dataclass(frozen=True)
class Recording:
    """The scans of one robot from power-on, and the laser that all of them share.

    `scans` may be any iterable that can be walked more than once, so that a bag need not fit into memory.
    """

    name: str
    geometry: Geometry
    scans: Iterable[Scan]
    num_scans: int
    """How many scans there are, as far as it is known before all are read."""
    notes: list[str] = field(default_factory=list)
    """What the reader chose, assumed or left out, for people."""

    @classmethod
    def from_arrays(
        cls,
        name: str,
        *,
        ranges: npt.ArrayLike,
        timestamps_ns: npt.ArrayLike,
        odometry: npt.ArrayLike,
        angle_min: float,
        angle_increment: float,
        range_max: float,
        range_min: float = 0.0,
        robot_from_laser: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> Recording:
        """A recording of arrays, with the fields of `sensor_msgs/LaserScan`.

        Args:
            name: Name of the run.
            ranges: (n, beams), metres.
            timestamps_ns: (n,), integer nanoseconds.
            odometry: (n, 3), x, y, theta of the robot, metres and radians.
            angle_min: Direction of the first beam in the laser's frame, radians.
            angle_increment: From one beam to the next, radians; negative where the laser turns clockwise.
            range_max: Readings at or above it met nothing, metres.
            range_min: Readings below it say nothing, metres.
            robot_from_laser: x, y, theta of the laser on the robot.

        Raises:
            RecordingError: arrays that do not fit each other.
        """
        readings = np.asarray(ranges, dtype=np.float32)
        poses = np.asarray(odometry, dtype=np.float64)
        stamps = np.asarray(timestamps_ns).astype(np.int64)
        if readings.ndim != 2 or poses.shape != (len(readings), 3) or stamps.shape != (len(readings),):
            raise RecordingError(
                f"ranges {readings.shape}, odometry {poses.shape} and timestamps {stamps.shape} "
                "are not (n, beams), (n, 3) and (n,)"
            )
        if angle_increment < 0.0:
            angle_min += (readings.shape[1] - 1) * angle_increment
            angle_increment, readings = -angle_increment, readings[:, ::-1]
        readings = clean_ranges(readings, range_min, range_max)
        geometry = Geometry(
            num_ranges=readings.shape[1],
            angle_min_rad=angle_min,
            angle_increment_rad=angle_increment,
            range_max_m=range_max,
            robot_from_laser=pose(*robot_from_laser),
        )
        scans = [Scan(int(stamp), pose(*at), row) for stamp, at, row in zip(stamps, poses, readings, strict=True)]
        return cls(name=name, geometry=geometry, scans=scans, num_scans=len(scans))

    def batches(self, size: int, first: int = 0) -> Iterator[list[Scan]]:
        """The scans from number `first` on, `size` at a time."""
        batch: list[Scan] = []
        for index, scan in enumerate(self.scans):
            if index < first:
                continue
            batch.append(scan)
            if len(batch) == size:
                yield batch
                batch = []
        if batch:
            yield batch

    def last(self, travel_m: float = TRAVEL_ASKED_M) -> Recording:
        """The end of the recording: the last metres that were driven by odometry."""
        scans = list(self.scans)
        travelled_m = 0.0
        first = len(scans) - 1
        while first > 0 and travelled_m < travel_m:
            here, before = scans[first].odom_from_robot, scans[first - 1].odom_from_robot
            travelled_m += float(np.hypot(here.x - before.x, here.y - before.y))
            first -= 1
        kept = scans[max(first, 0) :]
        return Recording(self.name, self.geometry, kept, len(kept), self.notes)


def pose(x: float, y: float, theta: float) -> Pose:
    """A pose of three numbers of any kind."""
    return Pose(x=float(x), y=float(y), theta=float(theta))


def clean_ranges(ranges: npt.ArrayLike, range_min: float, range_max: float) -> Ranges:
    """Readings as the server wants them: infinite without a return, 0 where they say nothing (REP 117)."""
    readings = np.array(ranges, dtype=np.float32)
    is_void = np.isnan(readings) | (readings < range_min) | (readings <= 0.0)
    readings[readings >= range_max] = np.inf
    readings[is_void] = 0.0
    return readings


def run_name(path: Path) -> str:
    """The name of a file without its endings, in the characters that names of runs may have."""
    stem = path.name
    for ending in (".gz", ".log", ".clf", ".carmen", ".txt", ".mcap", ".bag", ".db3"):
        stem = stem.removesuffix(ending)
    return re.sub(r"[^A-Za-z0-9._-]", "-", stem.lstrip("."))[:64] or "run"
