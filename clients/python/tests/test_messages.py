"""What messages of ROS become: beams, mountings, odometry, topics. No server."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from locution import Recording, RecordingError, RosOptions
from locution.readers.laser_scans import BeamLayout
from locution.readers.odometry import OdometryTrack
from locution.readers.topics import choose_topics
from locution.readers.transforms import Frames, Mounting


def scan(ranges: list[float], angle_min: float, increment: float) -> Any:
    return SimpleNamespace(ranges=ranges, angle_min=angle_min, angle_increment=increment, range_min=0.1, range_max=10.0)


def ends(layout: BeamLayout, message: Any) -> list[tuple[float, float]]:
    """Where the beams end, seen from the robot, by the plain formula."""
    geometry = layout.geometry
    mount = geometry.robot_from_laser
    assert mount
    angles = mount.theta + geometry.angle_min_rad + geometry.angle_increment_rad * np.arange(geometry.num_ranges)
    ranges = layout.ranges_m(message)
    return [(mount.x + r * math.cos(a), mount.y + r * math.sin(a)) for r, a in zip(ranges, angles, strict=True)]


def test_readings_that_say_nothing_are_told_from_those_that_met_nothing() -> None:
    message = scan([1.0, math.inf, math.nan, 0.05, 10.0, -math.inf, 12.0], -1.0, 0.3)
    ranges = BeamLayout(message, Mounting(0, 0, 0)).ranges_m(message)
    np.testing.assert_array_equal(ranges, np.array([1, np.inf, 0, 0, np.inf, 0, np.inf], dtype=np.float32))


@pytest.mark.parametrize("increment", [0.5, -0.5])
@pytest.mark.parametrize("is_upside_down", [False, True])
def test_beams_end_where_the_three_dimensional_transform_says(increment: float, is_upside_down: bool) -> None:
    message = scan([1.0, 2.0, 3.0], 0.2, increment)
    yaw = 0.7
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    over = np.diag([1, -1, -1]) if is_upside_down else np.eye(3)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn @ over, (0.3, -0.1, 0.5)
    expected = [
        (matrix @ [r * math.cos(0.2 + i * increment), r * math.sin(0.2 + i * increment), 0, 1])[:2]
        for i, r in enumerate(message.ranges)
    ]
    layout = BeamLayout(message, Mounting.of(matrix))
    assert layout.geometry.angle_increment_rad > 0
    np.testing.assert_allclose(sorted(ends(layout, message)), sorted(map(tuple, expected)), atol=1e-6)


def test_a_laser_that_is_tilted_is_refused() -> None:
    tilted = np.eye(4)
    tilted[:3, :3] = [[1, 0, 0], [0, math.cos(0.6), -math.sin(0.6)], [0, math.sin(0.6), math.cos(0.6)]]
    with pytest.raises(RecordingError, match="34 degrees"):
        Mounting.of(tilted)


def test_a_scan_with_a_reading_more_is_read_at_the_beams_of_the_first() -> None:
    first = scan([1.0, 2.0, 3.0, 4.0], 0.0, 0.1)
    layout = BeamLayout(first, Mounting(0, 0, 0))
    longer = scan([9.0, 1.1, 2.1, 3.1, 4.1], -0.09, 0.1)
    np.testing.assert_allclose(layout.ranges_m(longer), [1.1, 2.1, 3.1, 4.1])
    shorter = scan([1.2, 2.2], 0.01, 0.1)
    np.testing.assert_allclose(layout.ranges_m(shorter), [1.2, 2.2, 2.2, 0.0])
    np.testing.assert_allclose(layout.ranges_m(scan([], 0.0, 0.1)), np.zeros(4))


def test_odometry_is_interpolated_across_half_a_turn() -> None:
    track = OdometryTrack(max_gap_s=1.0)
    track.add(0, 0.0, 0.0, math.pi - 0.1)
    track.add(1_000_000_000, 1.0, 2.0, -math.pi + 0.3)
    track.add(500_000_000, 9.0, 9.0, 0.0)
    between = track.at(500_000_000)
    assert between
    assert (between.x, between.y) == (0.5, 1.0)
    assert math.isclose(between.theta, -math.pi + 0.1, abs_tol=1e-9)


def test_moments_without_odometry_near_them_have_no_pose() -> None:
    track = OdometryTrack(max_gap_s=1.0)
    assert track.at(0) is None
    track.add(0, 0.0, 0.0, 0.0)
    track.add(5_000_000_000, 1.0, 0.0, 0.0)
    assert track.at(2_000_000_000) is None
    assert track.at(7_000_000_000) is None
    ahead = track.at(5_500_000_000)
    assert ahead and ahead.x == 1.0


def test_topics_are_found_by_type_or_asked_for_by_name() -> None:
    laser, odometry, tf = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage"
    found = choose_topics({"/x/scan_raw": laser, "/wheel": odometry, "/tf": tf, "/tf_static": tf}, RosOptions())
    assert (found.scan, found.odometry, found.static_transforms) == ("/x/scan_raw", "/wheel", ["/tf_static"])
    usual = choose_topics({"/rear": laser, "/scan": laser, "/odom": odometry, "/ekf": odometry}, RosOptions())
    assert (usual.scan, usual.odometry) == ("/scan", "/odom")
    two = {"/front": laser, "/rear": laser, "/odom": odometry}
    assert choose_topics(two, RosOptions(scan_topic="/rear")).scan == "/rear"
    with pytest.raises(RecordingError, match="/front, /rear; choose one with scan_topic"):
        choose_topics(two, RosOptions())
    with pytest.raises(RecordingError, match="no laser topic /nose"):
        choose_topics(two, RosOptions(scan_topic="/nose"))
    with pytest.raises(RecordingError, match=r"the bag holds /points \(sensor_msgs/msg/PointCloud2\)"):
        choose_topics({"/points": "sensor_msgs/msg/PointCloud2"}, RosOptions())
    with pytest.raises(RecordingError, match="without odometry"):
        choose_topics({"/scan": laser}, RosOptions())


def test_frames_meet_at_their_common_ancestor() -> None:
    def transform(parent: str, child: str, x: float, y: float) -> Any:
        turn = SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0)
        moved = SimpleNamespace(translation=SimpleNamespace(x=x, y=y, z=0.0), rotation=turn)
        header = SimpleNamespace(frame_id=parent)
        return SimpleNamespace(header=header, child_frame_id=child, transform=moved)

    frames = Frames()
    for edge in (("/base_footprint", "base_link", 0.0, 0.1), ("base_footprint", "mast", 1.0, 0.0)):
        frames.add(transform(*edge))
    frames.add(transform("mast", "/laser", 0.5, 0.0))
    matrix = frames.between("base_link", "laser")
    assert matrix is not None
    np.testing.assert_allclose(matrix[:2, 3], [1.5, -0.1])
    assert frames.between("base_link", "camera") is None


def test_arrays_that_do_not_fit_are_refused_and_clockwise_lasers_turned_over() -> None:
    laser = {"angle_min": 1.0, "angle_increment": -0.5, "range_max": 5.0}
    recording = Recording.from_arrays(
        "r", ranges=[[1, 2, 3]], timestamps_ns=[7], odometry=[[0, 0, 0]], robot_from_laser=(0.1, 0, 0), **laser
    )
    (only,) = recording.scans
    assert recording.geometry.angle_min_rad == 0.0
    np.testing.assert_array_equal(only.ranges_m, [3, 2, 1])
    with pytest.raises(RecordingError, match=r"\(1, 3\)"):
        Recording.from_arrays("r", ranges=[[1, 2, 3]], timestamps_ns=[7, 8], odometry=[[0, 0, 0]], **laser)
