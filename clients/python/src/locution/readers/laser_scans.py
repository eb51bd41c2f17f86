"""`sensor_msgs/LaserScan` as the readings of one fixed laser."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import RecordingError
from ..models import Geometry
from ..recording import Floats, Ranges, clean_ranges, pose
from .transforms import Mounting

_ANGLE_TOLERANCE_RAD = 1e-4


class BeamLayout:
    """The beams of a run: those of its first message, from right to left as seen from above.

    A laser that hangs upside down, or turns clockwise, sends them the other way round. Some lasers send a reading
    more or less from turn to turn; each beam then takes the reading nearest to it.
    """

    def __init__(self, first: Any, mounting: Mounting, range_max: float | None = None) -> None:
        self._sign = -1.0 if mounting.is_upside_down else 1.0
        angles, _ = self._ordered(first, np.empty(len(first.ranges)))
        if len(angles) < 2:
            raise RecordingError(f"a scan of {len(angles)} readings")
        self._angles = angles
        self.range_max = float(range_max or first.range_max)
        if not (np.isfinite(self.range_max) and self.range_max > 0.0):
            raise RecordingError(f"the scans state a range_max of {self.range_max}; say range_max in metres")
        self.geometry = Geometry(
            num_ranges=len(angles),
            angle_min_rad=float(angles[0]),
            angle_increment_rad=float(angles[-1] - angles[0]) / (len(angles) - 1),
            range_max_m=self.range_max,
            robot_from_laser=pose(*mounting.robot_from_laser),
        )

    def _ordered(self, message: Any, ranges: Any) -> tuple[Floats, Any]:
        increment = float(message.angle_increment)
        if not increment:
            raise RecordingError("the scans state an angle_increment of 0")
        angles: Floats = self._sign * (float(message.angle_min) + increment * np.arange(len(ranges), dtype=np.float64))
        return (angles, ranges) if self._sign * increment > 0.0 else (angles[::-1], ranges[::-1])

    def ranges_m(self, message: Any) -> Ranges:
        """The readings of a message at the beams of the run."""
        cleaned = clean_ranges(message.ranges, float(message.range_min), self.range_max)
        angles, ranges = self._ordered(message, cleaned)
        same = len(angles) == len(self._angles)
        if same and abs(angles[0] - self._angles[0]) + abs(angles[-1] - self._angles[-1]) < _ANGLE_TOLERANCE_RAD:
            return np.ascontiguousarray(ranges)
        if len(angles) == 0:
            return np.zeros(len(self._angles), dtype=np.float32)
        right = np.clip(np.searchsorted(angles, self._angles), 1, max(len(angles) - 1, 1))
        left = right - 1
        right = np.minimum(right, len(angles) - 1)
        nearest = np.where(self._angles - angles[left] <= angles[right] - self._angles, left, right)
        taken: Ranges = np.asarray(ranges[nearest], dtype=np.float32)
        # Where no reading is near, nothing is known.
        taken[np.abs(angles[nearest] - self._angles) > abs(self.geometry.angle_increment_rad)] = 0.0
        return taken
