"""ROS 1 bags, ROS 2 bags and MCAP files, read twice: first what is small, then the scans as they are asked for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from mcap.decoder import DecoderFactory
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap_ros1.decoder import DecoderFactory as Ros1DecoderFactory
from mcap_ros2.decoder import DecoderFactory as Ros2DecoderFactory
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.typesys import Stores, get_typestore

from ..errors import RecordingError
from ..recording import Recording, Scan, run_name
from .laser_scans import BeamLayout
from .odometry import OdometryTrack
from .topics import RosOptions, Topics, choose_topics
from .transforms import Frames, Mounting, frame_name, yaw_of


class _Source(Protocol):
    """An open bag."""

    types: dict[str, str]
    counts: dict[str, int]

    def messages(self, topics: list[str]) -> Iterator[tuple[str, Any]]:
        """Topic and decoded message, in the order of the bag."""
        ...


class _McapSource:
    def __init__(self, file: Any) -> None:
        factories: list[DecoderFactory] = [Ros1DecoderFactory(), Ros2DecoderFactory()]
        self._reader = make_reader(file, decoder_factories=factories)
        summary = self._reader.get_summary()
        self.types: dict[str, str] = {}
        self.counts: dict[str, int] = {}
        if summary is None or not summary.channels:
            for schema, channel, _ in self._reader.iter_messages():
                self.types[channel.topic] = schema.name if schema else ""
                self.counts[channel.topic] = self.counts.get(channel.topic, 0) + 1
            return
        counted = summary.statistics.channel_message_counts if summary.statistics else {}
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            self.types[channel.topic] = schema.name if schema else ""
            self.counts[channel.topic] = counted.get(channel.id, 0)

    def messages(self, topics: list[str]) -> Iterator[tuple[str, Any]]:
        for _, channel, _, message in self._reader.iter_decoded_messages(topics=topics):
            yield channel.topic, message


class _RosbagSource:
    def __init__(self, reader: AnyReader) -> None:
        self._reader = reader
        self.types = {connection.topic: connection.msgtype for connection in reader.connections}
        self.counts = {topic: info.msgcount for topic, info in reader.topics.items()}

    def messages(self, topics: list[str]) -> Iterator[tuple[str, Any]]:
        connections = [connection for connection in self._reader.connections if connection.topic in topics]
        for connection, _, data in self._reader.messages(connections=connections) if connections else ():
            yield connection.topic, self._reader.deserialize(data, connection.msgtype)


@contextmanager
def _open_mcap(path: Path) -> Iterator[_Source]:
    with path.open("rb") as file:
        yield _McapSource(file)


@contextmanager
def _open_rosbag(path: Path) -> Iterator[_Source]:
    # Bags of older ROS 2 carry no message definitions; those of its long-term release fit them.
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        yield _RosbagSource(reader)


def _open(path: Path) -> AbstractContextManager[_Source]:
    return _open_mcap(path) if path.is_file() and path.suffix != ".bag" else _open_rosbag(path)


def stamp_ns(message: Any) -> int:
    """The time in a message's header, in whichever ROS' spelling."""
    stamp = message.header.stamp
    if hasattr(stamp, "nanosec"):
        return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
    return int(stamp.secs) * 1_000_000_000 + int(stamp.nsecs)


def open_bag(path: Path, options: RosOptions) -> Recording:
    """Opens a bag; see `open_recording`."""
    try:
        with _open(path) as source:
            topics = choose_topics(source.types, options)
            track, frames, robot_frame = _read_motion(source, topics, options)
            first = next((message for _, message in source.messages([topics.scan])), None)
            num_scans = source.counts.get(topics.scan, 0)
        if first is None:
            raise RecordingError(f"{topics.scan} carries no scan")
        if not len(track):
            raise RecordingError(f"no odometry on {topics.odometry or 'tf, from a frame named odom'}")
        notes = [f"{topics.scan} with odometry of {topics.odometry or ' and '.join(topics.transforms)}"]
        mounting = _mounting(frames, robot_frame, first.header.frame_id, options, notes)
        layout = BeamLayout(first, mounting, options.range_max)
    except (McapError, AnyReaderError, OSError) as error:
        raise RecordingError(f"{path}: {error}") from error
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    scans = _BagScans(path, topics.scan, layout, track)
    return Recording(run_name(path), layout.geometry, scans, num_scans, notes)


def _read_motion(source: _Source, topics: Topics, options: RosOptions) -> tuple[OdometryTrack, Frames, str]:
    """Odometry, the frames, and which of them the odometry moves."""
    track, frames = OdometryTrack(options.max_gap_s), Frames()
    robot_frame = options.robot_frame or ""
    for _, message in source.messages(topics.static_transforms):
        for transform in message.transforms:
            frames.add(transform)
    wanted = topics.transforms + ([topics.odometry] if topics.odometry else [])
    for topic, message in source.messages(wanted):
        if topic == topics.odometry:
            robot_frame = robot_frame or frame_name(message.child_frame_id)
            at = message.pose.pose
            track.add(stamp_ns(message), at.position.x, at.position.y, yaw_of(at.orientation))
            continue
        for transform in message.transforms:
            parent = frame_name(transform.header.frame_id).rsplit("/", 1)[-1]
            if topics.odometry is None and parent == "odom":
                robot_frame = robot_frame or frame_name(transform.child_frame_id)
                moved = transform.transform
                track.add(stamp_ns(transform), moved.translation.x, moved.translation.y, yaw_of(moved.rotation))
            elif parent not in ("odom", "map"):
                frames.add(transform)
    return track, frames, robot_frame or "base_link"


def _mounting(frames: Frames, robot_frame: str, laser_frame: str, options: RosOptions, notes: list[str]) -> Mounting:
    matrix = frames.between(robot_frame, laser_frame)
    if options.robot_from_laser is not None:
        is_upside_down = matrix is not None and Mounting.of(matrix).is_upside_down
        return Mounting(*options.robot_from_laser, is_upside_down=is_upside_down)
    if matrix is None:
        notes.append(f"nothing says where {laser_frame} sits on {robot_frame}; taken to be its centre")
        return Mounting(0.0, 0.0, 0.0)
    mounting = Mounting.of(matrix)
    if mounting.is_upside_down:
        notes.append(f"{laser_frame} hangs upside down")
    return mounting


@dataclass(frozen=True)
class _BagScans:
    """The scans of a bag, read anew every time they are walked."""

    path: Path
    topic: str
    layout: BeamLayout
    track: OdometryTrack

    def __iter__(self) -> Iterator[Scan]:
        with _open(self.path) as source:
            for _, message in source.messages([self.topic]):
                timestamp_ns = stamp_ns(message)
                at = self.track.at(timestamp_ns)
                if at is not None:
                    yield Scan(timestamp_ns, at, self.layout.ranges_m(message))
