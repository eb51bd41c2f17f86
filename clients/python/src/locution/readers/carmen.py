"""CARMEN text logs, as most public recordings of 2D lasers are kept.

One message a line; the two kinds that carry a scan of the front laser together with raw odometry:
- `FLASER n r1..rn x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp`,
- `ROBOTLASER1 type start fov resolution range_max accuracy remission n r1..rn m remissions..
  laser_x laser_y laser_theta robot_x robot_y robot_theta … ipc_timestamp host logger_timestamp`.

Some logs carry a corrected pose in `x y theta`, so odometry is only ever read from `odom_*`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from ..models import Geometry, Pose
from ..recording import Floats, Ranges, Recording, Scan, pose, run_name

_COMMON_NUM_RANGES = (90, 180, 181, 360, 361)
"""Numbers of readings of the common laser of 180 degrees."""


@dataclass(frozen=True)
class _Line:
    kind: str
    beams: tuple[float, float] | None
    range_max: float | None
    ranges: Ranges
    laser: list[float]
    robot: list[float]
    timestamp_ns: int


def read_carmen(path: Path, lines: Iterable[str], range_max: float | None) -> Recording:
    """Reads a log; only messages of the kind that is seen first are taken.

    Raises:
        RecordingError: a line that cannot be read, with its number, or a log without scans.
    """
    taken: list[_Line] = []
    field_of_view_rad: float | None = None
    for number, line in enumerate(lines, start=1):
        words = line.split()
        try:
            if words[:1] == ["PARAM"]:
                field_of_view_rad = _field_of_view_rad(words) or field_of_view_rad
                continue
            if words[:1] not in (["FLASER"], ["ROBOTLASER1"]):
                continue
            scan = _flaser(words) if words[0] == "FLASER" else _robot_laser(words)
        except (ValueError, IndexError, InvalidOperation) as error:
            raise RecordingError(f"{path}, line {number}: cannot be read ({error})") from error
        if taken and scan.kind != taken[0].kind:
            continue
        if taken and len(scan.ranges) != len(taken[0].ranges):
            raise RecordingError(
                f"{path}, line {number}: {len(scan.ranges)} readings, but the first scan has {len(taken[0].ranges)}"
            )
        taken.append(scan)
    if not taken:
        raise RecordingError(f"{path}: no bag, and no CARMEN log with FLASER or ROBOTLASER1 messages")
    try:
        angle_min, increment = taken[0].beams or _flaser_beams(len(taken[0].ranges), field_of_view_rad)
    except ValueError as error:
        raise RecordingError(f"{path}: {error}") from error
    geometry = Geometry(
        num_ranges=len(taken[0].ranges),
        angle_min_rad=angle_min,
        angle_increment_rad=increment,
        range_max_m=range_max or _range_max(taken),
        robot_from_laser=_mounting(taken),
    )
    scans = [Scan(line.timestamp_ns, pose(*line.robot), line.ranges) for line in taken]
    return Recording(run_name(path), geometry, scans, len(scans))


def _readings(words: list[str], at: int) -> tuple[Ranges, list[str]]:
    """The readings counted at `at`, and the words after them; error codes of the sensor become no return."""
    count = int(words[at])
    texts = words[at + 1 : at + 1 + count]
    if count < 2 or len(texts) < count:
        raise ValueError(f"{len(texts)} of {count} readings")
    ranges = np.array(texts, dtype=np.float64).astype(np.float32)
    ranges[~(np.isfinite(ranges) & (ranges >= 0.0))] = np.inf
    return ranges, words[at + 1 + count :]


def _flaser(words: list[str]) -> _Line:
    ranges, rest = _readings(words, 1)
    numbers = [float(word) for word in rest[:6]]
    return _Line("FLASER", None, None, ranges, numbers[:3], _pose(numbers[3:]), _nanoseconds(rest[6]))


def _robot_laser(words: list[str]) -> _Line:
    angle_min, field_of_view, resolution, range_max = (float(word) for word in words[2:6])
    ranges, rest = _readings(words, 8)
    rest = rest[1 + int(rest[0]) :]
    numbers = [float(word) for word in rest[:11]]
    increment = resolution or field_of_view / len(ranges)
    stated = float(np.float32(range_max)) if range_max > 0.0 else None
    at = _nanoseconds(rest[11])
    return _Line("ROBOTLASER1", (angle_min, increment), stated, ranges, numbers[:3], _pose(numbers[3:6]), at)


def _pose(numbers: list[float]) -> list[float]:
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise ValueError("a pose of three numbers is wanted")
    return numbers


def _nanoseconds(seconds: str) -> int:
    """Exact, which floating point is not."""
    return int(Decimal(seconds) * 1_000_000_000)


def _field_of_view_rad(words: list[str]) -> float | None:
    """What a PARAM line says of the front laser's field of view, in degrees or radians."""
    name = words[1].lower() if len(words) > 2 else ""
    is_front = any(part in name for part in ("front_laser_", "frontlaser_", "laser_laser1_"))
    if not (is_front and name.endswith(("_fov", "_field_of_view"))):
        return None
    value = float(words[2])
    if not value > 0.0:
        return None
    return value if value <= math.tau + 1e-3 else math.radians(value)


def _flaser_beams(num_ranges: int, field_of_view_rad: float | None) -> tuple[float, float]:
    """Direction of the first beam and the angle to the next; an even number leaves out the last beam."""
    num_gaps = num_ranges - num_ranges % 2
    is_thinned = num_ranges < 180 and num_ranges % 2 == 1 and 180 % (num_ranges - 1) == 0
    if field_of_view_rad is None and not (num_ranges in _COMMON_NUM_RANGES or is_thinned):
        raise ValueError(
            f"a FLASER message of {num_ranges} readings does not tell which angle they cover; begin the log with "
            "a line 'PARAM laser_front_laser_fov DEGREES'"
        )
    angle = math.pi if field_of_view_rad is None else field_of_view_rad
    return -0.5 * angle, angle / num_gaps


def _range_max(taken: list[_Line]) -> float:
    """Where "no return" begins: the first code that is frequent at the top of the sensor's scale."""
    readings = np.concatenate([line.ranges for line in taken])
    readings = readings[np.isfinite(readings)]
    if np.count_nonzero(readings > 200.0) * 2 > len(readings):
        raise RecordingError("most readings are beyond 200 m: they must be metres, not millimetres")
    largest = np.float32(readings.max(initial=0.0))
    band = readings[readings >= np.float32(0.97) * largest]
    if len(band) * 10_000 >= len(readings):
        values, counts = np.unique(band, return_counts=True)
        frequent = values[counts * 100 >= len(band)]
        inferred = float(frequent[0] if len(frequent) else largest)
    else:
        inferred = float(largest) + 0.01
    stated = taken[0].range_max
    return max(inferred if stated is None else min(stated, inferred), 0.01)


def _mounting(taken: list[_Line]) -> Pose:
    """Where the laser sits, by the two poses of each line; the robot's centre where they do not agree."""
    laser = np.array([line.laser for line in taken])
    robot = np.array([line.robot for line in taken])
    between = relative(robot, laser)
    center = np.sort(between, axis=0)[len(between) // 2]
    spread = np.sort(np.hypot(*(between - center)[:, :2].T))[len(between) // 2]
    turns = np.abs(relative(center[None], between)[:, 2])
    if spread > 0.02 or np.sort(turns)[len(turns) // 2] > 0.02:
        return pose(0.0, 0.0, 0.0)
    return pose(*(np.round(center, 4) + 0.0))


def relative(origin: Floats, poses: Floats) -> Floats:
    """Poses seen from other poses, row by row."""
    step = poses - origin
    sin, cos = np.sin(origin[:, 2]), np.cos(origin[:, 2])
    turn = np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2]))
    return np.stack([cos * step[:, 0] + sin * step[:, 1], cos * step[:, 1] - sin * step[:, 0], turn], axis=1)
