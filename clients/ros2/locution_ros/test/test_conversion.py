"""Answers of the server become messages that ROS takes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import empty, sent
from locution import OccupancyGrid
from locution.models import Pose

from locution_ros.conversion import (
    compose,
    fill_occupancy_grid,
    fill_pose_with_covariance,
    fill_transform,
    inverse,
)

NS = 1_700_000_000_123_456_789


def test_a_grid_keeps_its_rows_its_corner_and_its_unknown_cells() -> None:
    cells = np.array([[0, 100, -1], [-1, 0, 0]], dtype=np.int8)
    grid = OccupancyGrid(cells, 0.05, Pose(-1.0, -2.0, 0.0))
    message = fill_occupancy_grid(empty("nav_msgs/msg/OccupancyGrid"), "map", NS, grid)
    assert isinstance(message.data, list) and message.data == [0, 100, -1, -1, 0, 0]
    message.data = np.array(message.data, dtype=np.int8)
    got = sent(message, "nav_msgs/msg/OccupancyGrid")
    assert (got.info.width, got.info.height) == (3, 2)
    assert got.info.resolution == pytest.approx(0.05)
    assert (got.info.origin.position.x, got.info.origin.position.y, got.info.origin.orientation.w) == (-1.0, -2.0, 1.0)
    assert (got.header.frame_id, got.header.stamp.sec, got.header.stamp.nanosec) == ("map", 1_700_000_000, 123_456_789)


def test_a_pose_carries_its_covariance_where_ros_looks_for_it() -> None:
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    covariance = [[1.0, 2.0, 3.0], [2.0, 5.0, 6.0], [3.0, 6.0, 9.0]]
    message = fill_pose_with_covariance(empty(kind), "map", NS, Pose(1.0, 2.0, math.pi / 2), covariance)
    message.pose.covariance = np.array(message.pose.covariance)
    got = sent(message, kind)
    found = {index: number for index, number in enumerate(got.pose.covariance) if number}
    assert found == {0: 1.0, 1: 2.0, 5: 3.0, 6: 2.0, 7: 5.0, 11: 6.0, 30: 3.0, 31: 6.0, 35: 9.0}
    turn = got.pose.pose.orientation
    assert (turn.z, turn.w) == (pytest.approx(math.sqrt(0.5)), pytest.approx(math.sqrt(0.5)))


def test_a_transform_names_both_frames() -> None:
    kind = "geometry_msgs/msg/TransformStamped"
    got = sent(fill_transform(empty(kind), "map", "odom", NS, Pose(1.0, -2.0, 0.0)), kind)
    assert (got.header.frame_id, got.child_frame_id) == ("map", "odom")
    assert (got.transform.translation.x, got.transform.translation.y) == (1.0, -2.0)


def test_poses_are_composed_and_inverted_as_matrices_are() -> None:
    def matrix(p: Pose) -> np.ndarray:
        return np.array(
            [[math.cos(p.theta), -math.sin(p.theta), p.x], [math.sin(p.theta), math.cos(p.theta), p.y], [0, 0, 1]]
        )

    a, b = Pose(1.0, 2.0, 2.5), Pose(-0.5, 0.3, 1.2)
    np.testing.assert_allclose(matrix(compose(a, b)), matrix(a) @ matrix(b), atol=1e-12)
    np.testing.assert_allclose(matrix(inverse(a)), np.linalg.inv(matrix(a)), atol=1e-12)
