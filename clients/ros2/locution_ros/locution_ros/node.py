"""The node: topics, transforms, services and the action around the parts that do the work."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from locution import Client, LocutionError, RecordingError, Refused, RetryPolicy
from locution.readers.transforms import Mounting, matrix_of
from locution_interfaces.action import Autolocalize
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger
from tf2_ros import Buffer, TransformBroadcaster, TransformException, TransformListener

from .collector import Collector
from .conversion import fill_occupancy_grid, fill_pose_with_covariance, fill_transform
from .forwarder import Forwarder, ForwarderThread
from .spool import Spool
from .tracker import Place, Tracker

ACTION_PATIENCE_S = 120.0
"""How long an action lasts that states no end."""
LONGEST_PAUSE_S = 30.0
"""Longest pause between two attempts to reach the server."""
PARAMETERS: dict[str, Any] = {
    "url": "http://127.0.0.1:7070",
    "site": "",
    "robot": "robot",
    "api_key": "",
    "forward": True,
    "scan_topic": "scan",
    "odom_topic": "odom",
    "batch_size": 50,
    "batch_period_s": 1.0,
    "spool_directory": "",
    "spool_max_mb": 500,
    "publish_map": True,
    "map_component": 0,
    "map_channel": "",
    "map_period_s": 10.0,
    "publish_tf": True,
    "localize_on_start": False,
    "publish_initialpose": False,
    "map_frame": "map",
    "odom_frame": "odom",
    "base_frame": "base_link",
}
"""Every parameter and its default, as in config/locution.yaml."""


class LocutionNode(Node):
    """Sends scans and odometry to a server; brings its map and the robot's place in it back."""

    def __init__(self) -> None:
        super().__init__("locution")
        said = {name: self.declare_parameter(name, default).value for name, default in PARAMETERS.items()}
        if not said["site"]:
            raise ValueError("the parameter 'site' must name the building")
        self._said = said
        self._collector, self._collecting = Collector(), threading.Lock()
        self._run_id: int | None = None
        self._was_full = False
        self._map_version: int | None = None
        self._map_looked_at = float("-inf")
        self._initialpose_given: Place | None = None
        self._key = said["api_key"] or os.environ.get("LOCUTION_API_KEY")
        self._client = self._connect()
        self._tracker = Tracker(self._client.site(said["site"]), said["robot"])
        self._start_forwarding()
        self._offer_interfaces()
        self._stopping = threading.Event()
        self._worker = threading.Thread(target=self._work, name="locution-worker", daemon=True)
        self._worker.start()
        if said["localize_on_start"]:
            self._tracker.start()

    def _connect(self) -> Client:
        # A client belongs to one thread, and the threads here are patient themselves.
        return Client(self._said["url"], self._key, retry=RetryPolicy(patience_s=0.0), timeout_s=30.0)

    def _start_forwarding(self) -> None:
        self._spool: Spool | None = None
        self._forwarder: ForwarderThread | None = None
        if not self._said["forward"]:
            return
        folder = Path(self._said["spool_directory"] or Path.home() / ".ros" / "locution")
        path = folder / f"{self._said['site']}-{self._said['robot']}.sqlite"
        self._spool = Spool(path, self._said["spool_max_mb"] * 1_000_000)
        self._spool.end()
        site = self._connect().site(self._said["site"])
        forwarder = Forwarder(self._spool, site, self._said["batch_size"], self._tell)
        self._forwarder = ForwarderThread(forwarder, self._said["batch_period_s"], LONGEST_PAUSE_S, self._tell)
        self._forwarder.start()

    def _offer_interfaces(self) -> None:
        latched = QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE
        )
        self._maps = self.create_publisher(OccupancyGrid, "map", latched)
        self._initialposes = self.create_publisher(PoseWithCovarianceStamped, "initialpose", 1)
        self._broadcaster = TransformBroadcaster(self)
        self._frames = Buffer()
        self._listener = TransformListener(self._frames, self)
        # As sensors publish, but with room for the time that a commit to a slow disk takes.
        sensors = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(LaserScan, self._said["scan_topic"], self._on_scan, sensors)
        self.create_subscription(Odometry, self._said["odom_topic"], self._on_odometry, sensors)
        self.create_service(Trigger, "~/localize", self._on_localize)
        self.create_service(Trigger, "~/publish_initialpose", self._on_initialpose)
        self._action = ActionServer(
            self,
            Autolocalize,
            "autolocalize",
            execute_callback=self._on_autolocalize,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
        self.create_timer(0.05, self._publish_transform)

    def _tell(self, text: str) -> None:
        self.get_logger().warning(text)

    # what the robot sees

    def _on_scan(self, message: Any) -> None:
        with self._collecting:
            if self._collector.geometry is None and not self._mount(message):
                return
            ready = self._collector.add_scan(message)
        self._take(ready)

    def _on_odometry(self, message: Any) -> None:
        with self._collecting:
            ready = self._collector.add_odometry(message)
        self._take(ready)

    def _mount(self, message: Any) -> bool:
        """Learns where the laser sits, and begins a run; false while nobody says it."""
        base, laser = self._said["base_frame"], message.header.frame_id
        try:
            transform = self._frames.lookup_transform(base, laser, Time()).transform
            self._collector.mount(message, Mounting.of(matrix_of(transform.translation, transform.rotation)))
        except (TransformException, RecordingError) as error:
            self.get_logger().warning(f"no scan is taken: {error}", throttle_duration_sec=5.0)
            return False
        if self._spool is not None and self._collector.geometry is not None:
            # One run from power-on to power-off: odometry begins anew with each.
            run = f"{self._said['robot']}-{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}"
            self._run_id = self._spool.begin(run, self._said["robot"], self._collector.geometry)
            self.get_logger().info(f"run {run} of site {self._said['site']} begins")
        return True

    def _take(self, ready: list[Any]) -> None:
        self._tracker.offer(ready)
        if self._spool is None or self._run_id is None:
            return
        is_full = not all([self._spool.append(self._run_id, scan) for scan in ready])
        if is_full and not self._was_full:
            self._tell("the spool takes no more scans; they are lost until the server answers")
        if ready:
            self._was_full = is_full

    # what the server says

    def _work(self) -> None:
        pause_s = 0.5
        while not self._stopping.is_set():
            try:
                geometry = self._collector.geometry
                if self._tracker.is_wanted and geometry is not None and self._tracker.step(geometry):
                    self._on_answer()
                if self._said["publish_map"]:
                    self._look_at_map()
                pause_s = 0.5
            except LocutionError as error:
                self.get_logger().warning(str(error), throttle_duration_sec=30.0)
                pause_s = min(2.0 * pause_s, LONGEST_PAUSE_S)
            self._stopping.wait(pause_s)

    def _on_answer(self) -> None:
        place = self._tracker.place
        if place is not None and self._initialpose_given is None and self._said["publish_initialpose"]:
            self._give_initialpose(place)

    def _look_at_map(self) -> None:
        now = time.monotonic()
        if now - self._map_looked_at < self._said["map_period_s"]:
            return
        self._map_looked_at = now
        try:
            site = self._client.site(self._said["site"])
            channel = self._said["map_channel"]
            served = site.map(site.channel(channel).map_version if channel else None)
            if served.version == self._map_version:
                return
            grid = served.grid(self._said["map_component"])
        except Refused as refused:
            if refused.status in (404, 409):
                return
            raise
        stamp_ns = self.get_clock().now().nanoseconds
        self._maps.publish(fill_occupancy_grid(OccupancyGrid(), self._said["map_frame"], stamp_ns, grid))
        self._map_version = served.version
        self.get_logger().info(f"map version {served.version} is published")
        if channel:
            site.report_channel_robot(channel, self._said["robot"], served.version)

    def _publish_transform(self) -> None:
        place = self._tracker.place
        if place is None or not self._said["publish_tf"]:
            return
        stamp_ns = self.get_clock().now().nanoseconds
        frames = self._said["map_frame"], self._said["odom_frame"]
        transform = fill_transform(TransformStamped(), *frames, stamp_ns, place.map_from_odom)
        self._broadcaster.sendTransform(transform)

    # what others ask

    def _pose_of(self, place: Place) -> Any:
        best = place.best
        return fill_pose_with_covariance(
            PoseWithCovarianceStamped(),
            self._said["map_frame"],
            place.timestamp_ns,
            best.map_from_robot,
            best.covariance,
        )

    def _give_initialpose(self, place: Place) -> None:
        self._initialposes.publish(self._pose_of(place))
        self._initialpose_given = place

    def _on_localize(self, _: Any, response: Any) -> Any:
        self._begin_to_localize()
        response.success, response.message = True, "drive; map -> odom is published once one place is left"
        return response

    def _begin_to_localize(self) -> None:
        self._initialpose_given = None
        self._tracker.start()

    def _on_initialpose(self, _: Any, response: Any) -> Any:
        place = self._tracker.place
        response.success = place is not None
        response.message = "published" if place else "the robot is not localised: call ~/localize and drive"
        if place is not None:
            self._give_initialpose(place)
        return response

    def _on_autolocalize(self, goal: Any) -> Any:
        self._begin_to_localize()
        ends = time.monotonic() + (goal.request.timeout_s or ACTION_PATIENCE_S)
        while self._tracker.place is None and time.monotonic() < ends and not self._stopping.is_set():
            if goal.is_cancel_requested:
                goal.canceled()
                return self._result()
            answer = self._tracker.answer
            if answer is not None:
                best = max((found.probability for found in answer.hypotheses), default=0.0)
                feedback = Autolocalize.Feedback()
                feedback.state, feedback.travel_m = answer.state.value, float(answer.travel_m)
                feedback.probability = float(best)
                goal.publish_feedback(feedback)
            time.sleep(0.2)
        if self._tracker.place is None:
            goal.abort()
        else:
            goal.succeed()
        return self._result()

    def _result(self) -> Any:
        result = Autolocalize.Result()
        place = self._tracker.place
        result.converged = place is not None
        if place is not None:
            result.pose = self._pose_of(place)
            result.probability, result.map_version = float(place.best.probability), place.map_version
            result.component = place.best.component
        return result

    def stop(self) -> None:
        """Ends the run and the threads; what the server does not have yet stays in the spool."""
        self._stopping.set()
        if self._spool is not None:
            self._spool.end()
        if self._forwarder is not None:
            self._forwarder.stop(timeout_s=5.0)
        self._worker.join(timeout=5.0)


def main() -> None:
    """Runs the node until it is told to stop."""
    rclpy.init()
    node = LocutionNode()
    executor = MultiThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.stop()
        node.destroy_node()
        rclpy.try_shutdown()
