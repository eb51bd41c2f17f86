"""Scans are paired with odometry, and the tracker makes map from odom of what the server says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from conftest import empty
from locution import Scan, Unreachable
from locution.models import Geometry, Hypothesis, Localization, LocalizationState
from locution.readers.transforms import Mounting
from locution.recording import pose

from locution_ros.collector import MAX_PENDING, Collector
from locution_ros.conversion import compose, set_quaternion, set_time
from locution_ros.tracker import Tracker

SECOND = 1_000_000_000


def laser(timestamp_ns: int) -> Any:
    message = empty("sensor_msgs/msg/LaserScan")
    set_time(message.header.stamp, timestamp_ns)
    message.angle_min, message.angle_increment = -0.5, 0.5
    message.range_min, message.range_max = 0.1, 10.0
    message.ranges = np.array([1.0, math.inf, 3.0], dtype=np.float32)
    return message


def odometry(timestamp_ns: int, x: float) -> Any:
    message = empty("nav_msgs/msg/Odometry")
    set_time(message.header.stamp, timestamp_ns)
    message.pose.pose.position.x = x
    set_quaternion(message.pose.pose.orientation, 0.0)
    return message


def mounted() -> Collector:
    collector = Collector()
    collector.mount(laser(0), Mounting(0.2, 0.0, 0.0))
    return collector


def test_a_scan_waits_for_the_odometry_after_it() -> None:
    collector = mounted()
    assert collector.add_odometry(odometry(0, 0.0)) == []
    assert collector.add_scan(laser(SECOND // 4)) == []
    (ready,) = collector.add_odometry(odometry(SECOND, 1.0))
    assert (ready.timestamp_ns, ready.odom_from_robot.x) == (SECOND // 4, 0.25)
    (late,) = collector.add_scan(laser(SECOND // 2))
    assert late.odom_from_robot.x == 0.5
    assert collector.geometry and collector.geometry.num_ranges == 3


def test_scans_without_odometry_are_counted_and_kept_within_bounds() -> None:
    collector = mounted()
    for index in range(MAX_PENDING + 5):
        assert collector.add_scan(laser(index)) == []
    assert collector.num_left_out == 5
    collector.add_odometry(odometry(100 * SECOND, 0.0))
    assert collector.num_left_out == MAX_PENDING + 5
    assert collector.add_scan(laser(101 * SECOND)) == []


def test_a_clock_that_is_set_back_is_followed() -> None:
    collector = mounted()
    collector.add_odometry(odometry(100 * SECOND, 0.0))
    collector.add_odometry(odometry(5 * SECOND, 1.0))
    collector.add_scan(laser(5 * SECOND + SECOND // 2))
    (ready,) = collector.add_odometry(odometry(6 * SECOND, 2.0))
    assert ready.odom_from_robot.x == 1.5


def answered(state: LocalizationState, num_scans: int, travel_m: float, found: list[Hypothesis]) -> Localization:
    return Localization(
        id="1",
        map_version=3,
        state=state,
        next_sequence=num_scans,
        travel_m=travel_m,
        hypotheses=found,
        expires_in_s=60.0,
        probability_elsewhere=0.0,
        missing=[],
    )


class Session:
    """A server that is sure after 20 scans."""

    def __init__(self) -> None:
        self.num_scans = 0
        self.is_closed = False
        self.fails = False
        self.answer = answered(LocalizationState.LOST, 0, 0.0, [])

    def append(self, scans: list[Scan]) -> Localization:
        if self.fails:
            raise Unreachable("gone")
        self.num_scans += len(scans)
        state = LocalizationState.CONVERGED if self.num_scans >= 20 else LocalizationState.AMBIGUOUS
        found = [
            Hypothesis(0, pose(5.0, 1.0, 1.0), [[0.01] * 3] * 3, 0.9),
            Hypothesis(0, pose(0, 0, 0), [[0.0] * 3] * 3, 0.1),
        ]
        self.answer = answered(state, self.num_scans, 2.0, found)
        return self.answer

    def close(self) -> None:
        self.is_closed = True


class Site:
    """Opens sessions."""

    def __init__(self) -> None:
        self.sessions: list[Session] = []

    def localization(self, geometry: Geometry, robot: str | None = None) -> Session:
        self.sessions.append(Session())
        return self.sessions[-1]


def some(num_scans: int) -> list[Scan]:
    ranges = np.ones(3, dtype=np.float32)
    return [Scan(index, pose(2.0, 1.0, 0.5), ranges) for index in range(num_scans)]


@pytest.fixture
def geometry() -> Geometry:
    return Geometry(3, -0.5, 0.5, 10.0, pose(0, 0, 0))


def test_odom_lies_where_the_robot_would_be_in_the_map(geometry: Geometry) -> None:
    site = Site()
    tracker = Tracker(site, "robot")
    tracker.offer(some(30))
    assert not tracker.is_wanted and not tracker.step(geometry)
    tracker.start()
    tracker.offer(some(10))
    assert tracker.step(geometry) and tracker.place is None and tracker.answer
    tracker.offer(some(10))
    tracker.step(geometry)
    place = tracker.place
    assert place and place.map_version == 3
    robot = compose(place.map_from_odom, pose(2.0, 1.0, 0.5))
    assert (robot.x, robot.y, robot.theta) == (pytest.approx(5.0), pytest.approx(1.0), pytest.approx(1.0))


def test_asking_anew_forgets_the_place_and_takes_another_session(geometry: Geometry) -> None:
    site = Site()
    tracker = Tracker(site, "robot")
    tracker.start()
    tracker.offer(some(25))
    tracker.step(geometry)
    assert tracker.place
    tracker.start()
    assert tracker.place is None
    tracker.offer(some(5))
    tracker.step(geometry)
    assert len(site.sessions) == 2 and site.sessions[0].is_closed and tracker.place is None


def test_a_session_that_breaks_is_opened_again_with_the_next_scans(geometry: Geometry) -> None:
    site = Site()
    tracker = Tracker(site, "robot")
    tracker.start()
    tracker.offer(some(5))
    tracker.step(geometry)
    site.sessions[0].fails = True
    tracker.offer(some(5))
    with pytest.raises(Unreachable):
        tracker.step(geometry)
    tracker.offer(some(25))
    tracker.step(geometry)
    assert len(site.sessions) == 2 and tracker.place
