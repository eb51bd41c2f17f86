"""Answers of the server as messages of ROS. The message classes are handed in, so that no ROS is needed to test it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from locution import OccupancyGrid
from locution.models import Pose
from locution.recording import pose

_PLANE = (0, 1, 5)
"""Rows of x, y and yaw among the six of a pose's covariance."""


def compose(a: Pose, b: Pose) -> Pose:
    """The pose of c in a's first frame, of b_from_c and a_from_b."""
    sin, cos = math.sin(a.theta), math.cos(a.theta)
    turn = a.theta + b.theta
    return pose(a.x + cos * b.x - sin * b.y, a.y + sin * b.x + cos * b.y, math.atan2(math.sin(turn), math.cos(turn)))


def inverse(a: Pose) -> Pose:
    """The same relation, seen from the other side."""
    sin, cos = math.sin(a.theta), math.cos(a.theta)
    return pose(-cos * a.x - sin * a.y, sin * a.x - cos * a.y, -a.theta)


def set_quaternion(rotation: Any, theta: float) -> None:
    """A turn about z."""
    rotation.x, rotation.y = 0.0, 0.0
    rotation.z, rotation.w = math.sin(0.5 * theta), math.cos(0.5 * theta)


def set_time(stamp: Any, timestamp_ns: int) -> None:
    """A time as ROS 2 has it."""
    stamp.sec, stamp.nanosec = divmod(timestamp_ns, 1_000_000_000)


def covariance_of_six(covariance: Sequence[Sequence[float]]) -> list[float]:
    """36 numbers, row by row, of the 3 by 3 of x, y and yaw. What a plane does not have is known to be 0."""
    six = np.zeros((6, 6))
    six[np.ix_(_PLANE, _PLANE)] = np.asarray(covariance, dtype=np.float64)
    return [float(number) for number in six.ravel()]


def fill_pose_with_covariance(
    message: Any, frame: str, timestamp_ns: int, at: Pose, covariance: Sequence[Sequence[float]]
) -> Any:
    """A `geometry_msgs/PoseWithCovarianceStamped`, such as `/initialpose` takes."""
    message.header.frame_id = frame
    set_time(message.header.stamp, timestamp_ns)
    inner = message.pose.pose
    inner.position.x, inner.position.y, inner.position.z = at.x, at.y, 0.0
    set_quaternion(inner.orientation, at.theta)
    message.pose.covariance = covariance_of_six(covariance)
    return message


def fill_transform(message: Any, parent: str, child: str, timestamp_ns: int, at: Pose) -> Any:
    """A `geometry_msgs/TransformStamped`."""
    message.header.frame_id, message.child_frame_id = parent, child
    set_time(message.header.stamp, timestamp_ns)
    moved = message.transform.translation
    moved.x, moved.y, moved.z = at.x, at.y, 0.0
    set_quaternion(message.transform.rotation, at.theta)
    return message


def fill_occupancy_grid(message: Any, frame: str, timestamp_ns: int, grid: OccupancyGrid) -> Any:
    """A `nav_msgs/OccupancyGrid`."""
    message.header.frame_id = frame
    set_time(message.header.stamp, timestamp_ns)
    set_time(message.info.map_load_time, timestamp_ns)
    message.info.resolution = grid.resolution_m
    message.info.height, message.info.width = grid.cells.shape
    corner = message.info.origin
    corner.position.x, corner.position.y, corner.position.z = grid.map_from_grid.x, grid.map_from_grid.y, 0.0
    set_quaternion(corner.orientation, grid.map_from_grid.theta)
    message.data = grid.cells.ravel().tolist()
    return message
