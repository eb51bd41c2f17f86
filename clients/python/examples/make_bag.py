"""Makes a bag of a CARMEN log: python make_bag.py drive.log drive.mcap

The ending says which: `.mcap` (ROS 2), `.bag` (ROS 1), no ending (folder of a ROS 2 bag). The laser is on /scan, the
odometry on /odom at other times than the scans, and the laser's place on /tf_static.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from locution import Recording, Scan, open_recording
from locution.models import Pose

EPOCH_NS = 1_700_000_000_000_000_000
"""Added to simulated times, which begin at 0."""
ODOMETRY_PERIOD_NS = 50_000_000
TRANSFORMS = "tf2_msgs/msg/TFMessage"


@dataclass(frozen=True)
class Message:
    """A message and its topic."""

    topic: str
    kind: str
    timestamp_ns: int
    content: Any


class Maker:
    """Makes the messages of one ROS."""

    def __init__(self, is_ros1: bool, is_upside_down: bool) -> None:
        self.store: Typestore = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
        if TRANSFORMS not in self.store.types:
            self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
        self._counter = {"seq": 0} if is_ros1 else {}
        self._is_upside_down = is_upside_down

    def messages(self, recording: Recording) -> Iterator[Message]:
        """What a robot would have recorded, by time."""
        scans = list(recording.scans)
        stamps = np.array([scan.timestamp_ns for scan in scans], dtype=np.int64)
        poses = np.array([(p.x, p.y, p.theta) for p in (scan.odom_from_robot for scan in scans)])
        poses[:, 2] = np.unwrap(poses[:, 2])
        yield self._mounting(int(stamps[0]), recording.geometry.robot_from_laser or Pose(0.0, 0.0, 0.0))
        made = [self._scan(recording, scan) for scan in scans]
        # Beyond both ends, so that every scan lies between two messages.
        for at_ns in range(int(stamps[0]) - 7_000_000, int(stamps[-1]) + ODOMETRY_PERIOD_NS, ODOMETRY_PERIOD_NS):
            x, y, theta = (float(np.interp(at_ns, stamps, poses[:, axis])) for axis in range(3))
            made.append(self._odometry(at_ns, x, y, theta))
        yield from sorted(made, key=lambda message: message.timestamp_ns)

    def _make(self, kind: str, *values: Any, **members: Any) -> Any:
        return self.store.types[kind](*values, **members)

    def _header(self, timestamp_ns: int, frame: str) -> Any:
        seconds, nanoseconds = divmod(EPOCH_NS + timestamp_ns, 10**9)
        stamp = self._make("builtin_interfaces/msg/Time", seconds, nanoseconds)
        return self._make("std_msgs/msg/Header", **self._counter, stamp=stamp, frame_id=frame)

    def _vector(self, x: float, y: float, z: float) -> Any:
        return self._make("geometry_msgs/msg/Vector3", x, y, z)

    def _scan(self, recording: Recording, scan: Scan) -> Message:
        geometry, ranges = recording.geometry, scan.ranges_m
        first = geometry.angle_min_rad
        last = first + (len(ranges) - 1) * geometry.angle_increment_rad
        if self._is_upside_down:
            first, last, ranges = -last, -first, ranges[::-1]
        content = self._make(
            "sensor_msgs/msg/LaserScan",
            header=self._header(scan.timestamp_ns, "laser"),
            angle_min=first,
            angle_max=last,
            angle_increment=geometry.angle_increment_rad,
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.05,
            range_max=geometry.range_max_m,
            ranges=np.where(ranges >= geometry.range_max_m, np.inf, ranges).astype(np.float32),
            intensities=np.zeros(0, dtype=np.float32),
        )
        return Message("/scan", "sensor_msgs/msg/LaserScan", EPOCH_NS + scan.timestamp_ns, content)

    def _odometry(self, timestamp_ns: int, x: float, y: float, theta: float) -> Message:
        turn = self._make("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2))
        at = self._make("geometry_msgs/msg/Pose", self._make("geometry_msgs/msg/Point", x, y, 0.0), turn)
        still = self._make("geometry_msgs/msg/Twist", self._vector(0.0, 0.0, 0.0), self._vector(0.0, 0.0, 0.0))
        content = self._make(
            "nav_msgs/msg/Odometry",
            header=self._header(timestamp_ns, "odom"),
            child_frame_id="base_link",
            pose=self._make("geometry_msgs/msg/PoseWithCovariance", at, np.zeros(36)),
            twist=self._make("geometry_msgs/msg/TwistWithCovariance", still, np.zeros(36)),
        )
        return Message("/odom", "nav_msgs/msg/Odometry", EPOCH_NS + timestamp_ns, content)

    def _mounting(self, timestamp_ns: int, mount: Pose) -> Message:
        """The laser on the robot: turned about z, and over about its own x where it hangs upside down."""
        sin, cos = math.sin(mount.theta / 2), math.cos(mount.theta / 2)
        turn = (cos, sin, 0.0, 0.0) if self._is_upside_down else (0.0, 0.0, sin, cos)
        transform = self._make(
            "geometry_msgs/msg/Transform",
            self._vector(mount.x, mount.y, 0.2),
            self._make("geometry_msgs/msg/Quaternion", *turn),
        )
        stamped = self._make(
            "geometry_msgs/msg/TransformStamped", self._header(timestamp_ns, "base_link"), "laser", transform
        )
        return Message("/tf_static", TRANSFORMS, EPOCH_NS + timestamp_ns, self._make(TRANSFORMS, [stamped]))


def write_bag(recording: Recording, path: Path, *, is_upside_down: bool = False) -> None:
    """Writes a bag in the form that the path's ending says."""
    maker = Maker(path.suffix == ".bag", is_upside_down)
    if path.suffix == ".mcap":
        _write_mcap(maker, recording, path)
    elif path.suffix == ".bag":
        _write_ros1(maker, recording, path)
    else:
        _write_ros2(maker, recording, path)


def _write_mcap(maker: Maker, recording: Recording, path: Path) -> None:
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2", library="locution")
        channels: dict[str, int] = {}
        for message in maker.messages(recording):
            if message.topic not in channels:
                definition, _ = maker.store.generate_msgdef(message.kind, ros_version=2)
                schema = writer.register_schema(message.kind, "ros2msg", definition.encode())
                channels[message.topic] = writer.register_channel(message.topic, "cdr", schema)
            data = bytes(maker.store.serialize_cdr(message.content, message.kind))
            writer.add_message(channels[message.topic], message.timestamp_ns, data, message.timestamp_ns)
        writer.finish()  # type: ignore[no-untyped-call]


def _write_ros1(maker: Maker, recording: Recording, path: Path) -> None:
    with Bag1Writer(path) as writer:
        connections: dict[str, Any] = {}
        for message in maker.messages(recording):
            if message.topic not in connections:
                connection = writer.add_connection(message.topic, message.kind, typestore=maker.store)
                connections[message.topic] = connection
            data = maker.store.serialize_ros1(message.content, message.kind)
            writer.write(connections[message.topic], message.timestamp_ns, data)


def _write_ros2(maker: Maker, recording: Recording, path: Path) -> None:
    with Bag2Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections: dict[str, Any] = {}
        for message in maker.messages(recording):
            if message.topic not in connections:
                connection = writer.add_connection(message.topic, message.kind, typestore=maker.store)
                connections[message.topic] = connection
            data = maker.store.serialize_cdr(message.content, message.kind)
            writer.write(connections[message.topic], message.timestamp_ns, data)


def main() -> None:
    """Reads a log and writes a bag."""
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("log", type=Path, help="a CARMEN log, such as `locution simulate` writes")
    arguments.add_argument("bag", type=Path, help="NAME.mcap, NAME.bag, or a folder")
    arguments.add_argument("--upside-down", action="store_true", help="hang the laser upside down")
    chosen = arguments.parse_args()
    write_bag(open_recording(chosen.log), chosen.bag, is_upside_down=chosen.upside_down)
    print(f"{chosen.bag} is written")


if __name__ == "__main__":
    main()
