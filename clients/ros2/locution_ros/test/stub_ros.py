"""The parts of ROS 2 that the node touches, as plain objects that tests call and look into."""

from __future__ import annotations

import sys
import types
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

from conftest import STORE, empty
from rosbags.typesys import get_types_from_msg

ACTION = Path(__file__).resolve().parents[2] / "locution_interfaces/action/Autolocalize.action"


def message(kind: str) -> Callable[[], Any]:
    """A class of messages: called, it makes one."""
    return lambda: empty(kind)


def action() -> Any:
    """The action with the members that its file defines."""
    for part, text in zip(("Goal", "Result", "Feedback"), ACTION.read_text().split("---"), strict=True):
        STORE.register(get_types_from_msg(text, f"locution_interfaces/msg/{part}"))
    parts = {part: message(f"locution_interfaces/msg/{part}") for part in ("Goal", "Result", "Feedback")}
    return SimpleNamespace(**parts)


class Node:
    """Remembers what was declared, and hands messages over at once."""

    parameters: ClassVar[dict[str, Any]] = {}

    def __init__(self, name: str) -> None:
        self.name = name
        self.subscriptions_made: dict[str, Callable[[Any], None]] = {}
        self.published: dict[str, list[Any]] = {}
        self.services: dict[str, Callable[[Any, Any], Any]] = {}
        self.timers_made: list[Callable[[], None]] = []
        self.said: list[str] = []

    def declare_parameter(self, name: str, default: Any) -> Any:
        return SimpleNamespace(value=self.parameters.get(name, default))

    def get_logger(self) -> Any:
        def say(text: str, throttle_duration_sec: float = 0.0) -> None:
            self.said.append(text)

        return SimpleNamespace(info=say, warning=say)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=5_000_000_000))

    def create_publisher(self, kind: Any, topic: str, qos: Any) -> Any:
        self.published[topic] = []
        return SimpleNamespace(publish=self.published[topic].append)

    def create_subscription(self, kind: Any, topic: str, callback: Callable[[Any], None], qos: Any) -> None:
        self.subscriptions_made[topic] = callback

    def create_service(self, kind: Any, name: str, callback: Callable[[Any, Any], Any]) -> None:
        self.services[name] = callback

    def create_timer(self, period_s: float, callback: Callable[[], None]) -> None:
        self.timers_made.append(callback)


class ActionServer:
    """Remembers what it calls."""

    last: Any = None

    def __init__(self, node: Node, kind: Any, name: str, **callbacks: Any) -> None:
        ActionServer.last = SimpleNamespace(name=name, **callbacks)


class TransformError(Exception):
    """What tf2 raises."""


class Buffer:
    """Knows one mounting, or none."""

    mounting: Any = None

    def lookup_transform(self, target: str, source: str, time: Any) -> Any:
        if self.mounting is None:
            raise TransformError(f"{source} does not exist")
        return SimpleNamespace(transform=self.mounting)


class Broadcaster:
    """Keeps what was sent."""

    sent: ClassVar[list[Any]] = []

    def __init__(self, node: Node) -> None:
        Broadcaster.sent = []

    def sendTransform(self, transform: Any) -> None:  # noqa: N802 - tf2 spells it so
        Broadcaster.sent.append(transform)


def install() -> None:
    """Puts the stubs where the node imports from."""
    values: dict[str, dict[str, Any]] = {
        "rclpy": {},
        "rclpy.action": {"ActionServer": ActionServer, "CancelResponse": SimpleNamespace(ACCEPT=1)},
        "rclpy.callback_groups": {"ReentrantCallbackGroup": SimpleNamespace},
        "rclpy.executors": {"ExternalShutdownException": Exception, "MultiThreadedExecutor": SimpleNamespace},
        "rclpy.node": {"Node": Node},
        "rclpy.qos": {
            "DurabilityPolicy": SimpleNamespace(TRANSIENT_LOCAL=1),
            "QoSProfile": SimpleNamespace,
            "ReliabilityPolicy": SimpleNamespace(RELIABLE=1, BEST_EFFORT=2),
        },
        "rclpy.time": {"Time": SimpleNamespace},
        "geometry_msgs": {},
        "geometry_msgs.msg": {
            name: message(f"geometry_msgs/msg/{name}") for name in ("PoseWithCovarianceStamped", "TransformStamped")
        },
        "nav_msgs": {},
        "nav_msgs.msg": {name: message(f"nav_msgs/msg/{name}") for name in ("OccupancyGrid", "Odometry")},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"LaserScan": message("sensor_msgs/msg/LaserScan")},
        "std_srvs": {},
        "std_srvs.srv": {"Trigger": SimpleNamespace},
        "tf2_ros": {
            "Buffer": Buffer,
            "TransformBroadcaster": Broadcaster,
            "TransformException": TransformError,
            "TransformListener": lambda buffer, node: None,
        },
        "locution_interfaces": {},
        "locution_interfaces.action": {"Autolocalize": action()},
    }
    for name, members in values.items():
        module = types.ModuleType(name)
        vars(module).update(members)
        sys.modules[name] = module
