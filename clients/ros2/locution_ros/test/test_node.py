"""The node against a real server: one robot maps a floor, the next is told where it is. ROS is stubbed."""

from __future__ import annotations

import re
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import stub_ros
from conftest import empty, sent, start
from locution import Client, Recording, open_recording

from locution_ros.conversion import set_quaternion, set_time

stub_ros.install()
from locution_ros import node as node_module  # noqa: E402

PACKAGE = Path(__file__).resolve().parents[1]
WORLD = PACKAGE.parents[2] / "clients/cli/worlds/office.yaml"
SITE = "office"


@pytest.fixture
def url(binary: str, tmp_path: Path) -> Iterator[str]:
    server, address = start(binary, 0, tmp_path / "data")
    try:
        yield address
    finally:
        server.terminate()
        server.wait(timeout=30)


def recorded(binary: str, folder: Path, name: str, route: str, seed: int) -> Recording:
    command = [binary, "simulate", "--world", WORLD, "--route", route, "--seed", str(seed), "--out", folder / name]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return open_recording(folder / f"{name}.log")


def drive(node: Any, recording: Recording, until: threading.Event | None = None) -> None:
    """Hands the recording to the node as ROS would: odometry and scan, one after the other."""
    geometry = recording.geometry
    for scan in recording.scans:
        if until is not None and until.is_set():
            return
        odometry = empty("nav_msgs/msg/Odometry")
        set_time(odometry.header.stamp, scan.timestamp_ns)
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = scan.odom_from_robot.x, scan.odom_from_robot.y
        set_quaternion(odometry.pose.pose.orientation, scan.odom_from_robot.theta)
        laser = empty("sensor_msgs/msg/LaserScan")
        set_time(laser.header.stamp, scan.timestamp_ns)
        laser.header.frame_id = "laser"
        laser.angle_min, laser.angle_increment = geometry.angle_min_rad, geometry.angle_increment_rad
        laser.range_min, laser.range_max, laser.ranges = 0.05, geometry.range_max_m, scan.ranges_m
        node.subscriptions_made["scan"](laser)
        node.subscriptions_made["odom"](odometry)
        if until is not None:
            time.sleep(0.004)


def wait_for(condition: Any, seconds: float = 60.0) -> None:
    ends = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < ends, "waited in vain"
        time.sleep(0.05)


def mounting() -> Any:
    transform = empty("geometry_msgs/msg/Transform")
    transform.rotation.w = 1.0
    return transform


@pytest.fixture
def parameters(url: str, tmp_path: Path) -> Iterator[dict[str, Any]]:
    stub_ros.Node.parameters = {
        "url": url,
        "site": SITE,
        "robot": "porter",
        "spool_directory": str(tmp_path / "spool"),
        "map_period_s": 0.2,
        "batch_period_s": 0.05,
        "publish_initialpose": True,
    }
    stub_ros.Buffer.mounting = None
    yield stub_ros.Node.parameters


def test_a_robot_maps_and_the_next_is_told_where_it_is(
    binary: str,
    parameters: dict[str, Any],
    tmp_path: Path,
) -> None:
    first = recorded(binary, tmp_path, "first", "9.5,13 9.5,24.3 22.6,24.3 29.3,24.3 29.3,10.7 9.5,10.7", 3)
    site = Client(parameters["url"]).site(SITE)
    mapper = node_module.LocutionNode()
    drive(mapper, first.last(0.5))
    assert any("no scan is taken: laser does not exist" in text for text in mapper.said)
    stub_ros.Buffer.mounting = mounting()
    drive(mapper, first)
    mapper.stop()
    # What the last moments left in the spool goes out with the next start.
    follower = node_module.LocutionNode()
    wait_for(lambda: site.exists() and [run.state for run in site.runs()] == ["finished"])
    (run,) = site.runs()
    assert run.num_scans >= first.num_scans - 1
    assert re.fullmatch(r"porter-\d{8}T\d{6}Z", run.run)
    built = site.build(progress=False)
    wait_for(lambda: follower.published["map"])
    grid = follower.published["map"][0]
    assert (grid.info.height, grid.info.width) == built.grid().cells.shape

    answers: list[Any] = []
    feedback: list[Any] = []
    done = threading.Event()
    goal = SimpleNamespace(
        request=SimpleNamespace(timeout_s=90.0),
        is_cancel_requested=False,
        publish_feedback=feedback.append,
        succeed=lambda: answers.append("succeeded"),
        abort=lambda: answers.append("aborted"),
    )

    def act() -> None:
        answers.append(stub_ros.ActionServer.last.execute_callback(goal))
        done.set()

    acting = threading.Thread(target=act)
    acting.start()
    wait_for(lambda: follower._tracker.is_wanted)
    later = recorded(binary, tmp_path, "later", "22,24.3 29.3,24.3 29.3,10.7 12,10.7", 4)
    drive(follower, later, until=done)
    acting.join(timeout=100)
    assert answers[0] == "succeeded"
    result = answers[1]
    assert result.converged and result.probability > 0.9 and result.map_version >= built.version
    wait_for(lambda: follower.published["initialpose"])
    given = follower.published["initialpose"][0]
    given.pose.covariance = np.array(given.pose.covariance)
    assert sent(given, "geometry_msgs/msg/PoseWithCovarianceStamped").header.frame_id == "map"
    follower.timers_made[0]()
    assert [stub_ros.Broadcaster.sent[-1].header.frame_id, stub_ros.Broadcaster.sent[-1].child_frame_id] == [
        "map",
        "odom",
    ]
    assert follower.services["~/publish_initialpose"](None, SimpleNamespace()).success
    follower.stop()
    parameters["map_channel"] = "stable"
    waiting = node_module.LocutionNode()
    time.sleep(0.5)
    assert not waiting.published["map"], "there is no such channel yet"
    version = site.move_channel("stable").map_version
    wait_for(lambda: waiting.published["map"] and list(site.channel_robots("stable")))
    assert [(r.robot, r.map_version, r.is_current) for r in site.channel_robots("stable")] == [
        ("porter", version, True)
    ]
    waiting.stop()


def test_an_action_that_takes_too_long_is_aborted(parameters: dict[str, Any]) -> None:
    node = node_module.LocutionNode()
    answers: list[str] = []
    goal = SimpleNamespace(
        request=SimpleNamespace(timeout_s=0.3),
        is_cancel_requested=False,
        publish_feedback=lambda _: None,
        succeed=lambda: answers.append("succeeded"),
        abort=lambda: answers.append("aborted"),
    )
    assert not stub_ros.ActionServer.last.execute_callback(goal).converged
    assert answers == ["aborted"]
    assert not node.services["~/publish_initialpose"](None, SimpleNamespace()).success
    node.stop()


def test_parameters_stand_in_the_file_with_their_defaults() -> None:
    text = (PACKAGE / "config/locution.yaml").read_text()
    rows = dict(re.findall(r"^    (\w+): *([^#\n]*?) *(?:#.*)?$", text, re.MULTILINE))
    written = {
        name: str(value).lower() if isinstance(value, bool) else str(value)
        for name, value in node_module.PARAMETERS.items()
    }
    assert {name: value.strip('"') for name, value in rows.items()} == written
