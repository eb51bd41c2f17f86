"""Which topics of a bag carry the laser and the odometry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import RecordingError

_USUAL_SCANS = ("scan", "base_scan", "scan_front", "front/scan", "laser/scan")
_USUAL_ODOMETRY = ("odom", "wheel_odom", "odometry", "odom/wheel")


@dataclass(frozen=True)
class RosOptions:
    """Which topics and frames of a bag count; what is None is found."""

    scan_topic: str | None = None
    """Topic of `sensor_msgs/LaserScan`."""
    odometry_topic: str | None = None
    """Topic of `nav_msgs/Odometry`; where a bag has none, odometry is read from `/tf`."""
    robot_frame: str | None = None
    """The robot's frame; that of the odometry unless said."""
    robot_from_laser: tuple[float, float, float] | None = None
    """Where the laser sits (x, y, theta), instead of what `/tf_static` says."""
    range_max: float | None = None
    """Readings at or above this many metres met nothing, instead of what the messages say."""
    max_gap_s: float = 1.0
    """Scans between odometry messages that are farther apart than this are left out."""


@dataclass(frozen=True)
class Topics:
    """What is read of a bag."""

    scan: str
    odometry: str | None
    transforms: list[str]
    """`/tf`, under whatever namespace."""
    static_transforms: list[str]


def kind_of(type_name: str) -> str:
    """`sensor_msgs/LaserScan` of `sensor_msgs/msg/LaserScan`, as ROS 1 says it."""
    return type_name.replace("/msg/", "/")


def choose_topics(types: Mapping[str, str], options: RosOptions) -> Topics:
    """Chooses among topics and their types.

    Raises:
        RecordingError: no laser, no odometry, or several of which none is the usual one; names them.
    """

    def of(kind: str) -> list[str]:
        return sorted(topic for topic, type_name in types.items() if kind_of(type_name) == kind)

    transforms = of("tf2_msgs/TFMessage") + of("tf/tfMessage")
    static = [topic for topic in transforms if topic.endswith("tf_static")]
    moving = [topic for topic in transforms if topic not in static]
    scan = _choose("laser", of("sensor_msgs/LaserScan"), options.scan_topic, _USUAL_SCANS, "scan_topic")
    if scan is None:
        held = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(types.items())) or "nothing"
        raise RecordingError(f"no topic of sensor_msgs/LaserScan; the bag holds {held}")
    odometry = _choose("odometry", of("nav_msgs/Odometry"), options.odometry_topic, _USUAL_ODOMETRY, "odometry_topic")
    if odometry is None and not moving:
        raise RecordingError("neither nav_msgs/Odometry nor /tf: without odometry a recording says nothing")
    return Topics(scan, odometry, moving, static)


def _choose(what: str, found: list[str], said: str | None, usual: tuple[str, ...], argument: str) -> str | None:
    if said is not None:
        if said not in found:
            raise RecordingError(f"no {what} topic {said}; the bag has {', '.join(found) or 'none'}")
        return said
    if len(found) <= 1:
        return found[0] if found else None
    for name in usual:
        for topic in found:
            if topic.strip("/") == name:
                return topic
    raise RecordingError(f"several {what} topics: {', '.join(found)}; choose one with {argument}")
