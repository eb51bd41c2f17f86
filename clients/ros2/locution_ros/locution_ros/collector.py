"""Scans wait here until the odometry around them is known."""

from __future__ import annotations

from collections import deque
from typing import Any

from locution import Scan
from locution.models import Geometry
from locution.readers.bags import stamp_ns
from locution.readers.laser_scans import BeamLayout
from locution.readers.odometry import OdometryTrack
from locution.readers.transforms import Mounting, yaw_of

MAX_PENDING = 200
"""Scans that wait for odometry; when it does not come the oldest are left out."""
MAX_GAP_S = 1.0
"""Longest time between odometry messages that is bridged."""


class Collector:
    """Pairs `sensor_msgs/LaserScan` with `nav_msgs/Odometry`, interpolated to the scan's time."""

    def __init__(self) -> None:
        self._track = OdometryTrack(MAX_GAP_S)
        self._pending: deque[Any] = deque()
        self._layout: BeamLayout | None = None
        self.num_left_out = 0
        """Scans that no odometry was near."""

    @property
    def geometry(self) -> Geometry | None:
        """The laser, once its first scan and its mounting are known."""
        return self._layout.geometry if self._layout else None

    def mount(self, first_scan: Any, mounting: Mounting) -> None:
        """Fixes the beams of the run."""
        self._layout = BeamLayout(first_scan, mounting)

    def add_odometry(self, message: Any) -> list[Scan]:
        """Takes an odometry message; answers the scans whose pose is now known."""
        at, timestamp_ns = message.pose.pose, stamp_ns(message)
        last_ns = self._track.last_ns
        if last_ns is not None and timestamp_ns < last_ns - int(MAX_GAP_S * 1e9):
            # The clock was set back; what lies ahead of it now says nothing of the scans to come.
            self._track = OdometryTrack(MAX_GAP_S)
        self._track.add(timestamp_ns, at.position.x, at.position.y, yaw_of(at.orientation))
        return self._ready()

    def add_scan(self, message: Any) -> list[Scan]:
        """Takes a scan; answers the scans whose pose is now known."""
        self._pending.append(message)
        while len(self._pending) > MAX_PENDING:
            self._pending.popleft()
            self.num_left_out += 1
        return self._ready()

    def _ready(self) -> list[Scan]:
        ready: list[Scan] = []
        last_ns = self._track.last_ns
        while self._layout and last_ns is not None and self._pending:
            timestamp_ns = stamp_ns(self._pending[0])
            if timestamp_ns > last_ns:
                break
            message = self._pending.popleft()
            at = self._track.at(timestamp_ns)
            if at is None:
                self.num_left_out += 1
                continue
            ready.append(Scan(timestamp_ns, at, self._layout.ranges_m(message)))
            self._track.forget_before(timestamp_ns)
        return ready
