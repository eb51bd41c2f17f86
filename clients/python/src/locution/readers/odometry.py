"""Odometry between its messages."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np

from ..models import Pose
from ..recording import pose


class OdometryTrack:
    """Where the odometry says the robot was, at any moment between its messages."""

    def __init__(self, max_gap_s: float) -> None:
        self._max_gap_ns = int(max_gap_s * 1e9)
        self._stamps: list[int] = []
        self._poses: list[tuple[float, float, float]] = []

    def __len__(self) -> int:
        return len(self._stamps)

    def add(self, timestamp_ns: int, x: float, y: float, theta: float) -> None:
        """Takes one message; what is not later than the last, or not finite, is passed over."""
        if (self._stamps and timestamp_ns <= self._stamps[-1]) or not np.isfinite((x, y, theta)).all():
            return
        self._stamps.append(timestamp_ns)
        self._poses.append((x, y, theta))

    def forget_before(self, timestamp_ns: int) -> None:
        """Drops what no later moment needs."""
        keep_from = max(bisect_left(self._stamps, timestamp_ns) - 1, 0)
        del self._stamps[:keep_from], self._poses[:keep_from]

    @property
    def last_ns(self) -> int | None:
        """Time of the last message."""
        return self._stamps[-1] if self._stamps else None

    def at(self, timestamp_ns: int) -> Pose | None:
        """The pose at a moment: between two messages in proportion; None where no messages are near on both sides.

        A moment just before the first or after the last message takes that message.
        """
        if not self._stamps:
            return None
        after = bisect_left(self._stamps, timestamp_ns)
        if after in (0, len(self._stamps)):
            end = min(after, len(self._stamps) - 1)
            is_near = abs(self._stamps[end] - timestamp_ns) <= self._max_gap_ns
            return pose(*self._poses[end]) if is_near else None
        before_ns, after_ns = self._stamps[after - 1], self._stamps[after]
        if after_ns - before_ns > self._max_gap_ns:
            return None
        part = (timestamp_ns - before_ns) / (after_ns - before_ns)
        x0, y0, theta0 = self._poses[after - 1]
        x1, y1, theta1 = self._poses[after]
        turn = np.arctan2(np.sin(theta1 - theta0), np.cos(theta1 - theta0))
        theta = theta0 + part * turn
        return pose(x0 + part * (x1 - x0), y0 + part * (y1 - y0), np.arctan2(np.sin(theta), np.cos(theta)))
