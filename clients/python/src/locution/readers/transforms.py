"""Frames of a bag: where the laser sits on the robot, and odometry that is told as a transform."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..errors import RecordingError
from ..recording import Floats

_TILT_MAX_RAD = math.radians(15.0)


def frame_name(name: str) -> str:
    """A frame as ROS 2 names it, without the slash of old bags."""
    return name.lstrip("/")


def yaw_of(rotation: Any) -> float:
    """The turn about z of a quaternion message."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def matrix_of(translation: Any, rotation: Any) -> Floats:
    """The 4×4 matrix of a transform message."""
    q = np.array([rotation.x, rotation.y, rotation.z, rotation.w], dtype=np.float64)
    norm = float(np.linalg.norm(q))
    if not norm > 1e-6:
        raise RecordingError("a transform whose rotation is zero")
    x, y, z, w = q / norm
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = (translation.x, translation.y, translation.z)
    return matrix


class Frames:
    """The tree of frames that do not move against each other: child → (parent, parent_from_child)."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Floats]] = {}

    def add(self, message: Any) -> None:
        """Takes one `TransformStamped`; the first that is said of a frame stays."""
        child = frame_name(message.child_frame_id)
        transform = message.transform
        matrix = matrix_of(transform.translation, transform.rotation)
        self._parents.setdefault(child, (frame_name(message.header.frame_id), matrix))

    def _to_ancestors(self, frame: str) -> dict[str, Floats]:
        """Every frame above, and ancestor_from_frame."""
        found = {frame: np.eye(4)}
        while frame in self._parents:
            parent, matrix = self._parents[frame]
            if parent in found:
                break
            found[parent] = matrix @ found[frame]
            frame = parent
        return found

    def between(self, target: str, source: str) -> Floats | None:
        """target_from_source, when both hang on one tree."""
        above_target = self._to_ancestors(frame_name(target))
        for frame, from_source in self._to_ancestors(frame_name(source)).items():
            if frame in above_target:
                return np.asarray(np.linalg.inv(above_target[frame]) @ from_source)
        return None


class Mounting:
    """How a laser sits on its robot: x, y, theta, and whether it hangs upside down."""

    def __init__(self, x: float, y: float, theta: float, is_upside_down: bool = False) -> None:
        self.robot_from_laser = (x, y, theta)
        self.is_upside_down = is_upside_down

    @classmethod
    def of(cls, robot_from_laser: Floats) -> Mounting:
        """The mounting of a 4×4 matrix.

        Raises:
            RecordingError: a laser that does not scan level.
        """
        up = float(robot_from_laser[2, 2])
        tilt_rad = math.acos(min(abs(up), 1.0))
        if tilt_rad > _TILT_MAX_RAD:
            raise RecordingError(
                f"the laser is tilted by {math.degrees(tilt_rad):.0f} degrees; only level lasers can be mapped"
            )
        # The laser's x axis keeps its direction on the floor when it is turned over about it.
        theta = math.atan2(float(robot_from_laser[1, 0]), float(robot_from_laser[0, 0]))
        return cls(float(robot_from_laser[0, 3]), float(robot_from_laser[1, 3]), theta, up < 0.0)
