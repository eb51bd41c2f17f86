"""Scans wait on disk, in order and within bounds, and leave only when the server has them."""

from __future__ import annotations

import signal
import socket
import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import start
from locution import Client, Refused, RetryPolicy, Scan, Unreachable
from locution.models import Geometry, Problem, Receipt, Run, RunState
from locution.recording import pose

from locution_ros.forwarder import Forwarder, ForwarderThread
from locution_ros.spool import Spool

GEOMETRY = Geometry(
    num_ranges=5, angle_min_rad=-1.0, angle_increment_rad=0.5, range_max_m=10.0, robot_from_laser=pose(0, 0, 0)
)
PLENTY = 10_000_000


def scan(index: int) -> Scan:
    ranges = np.array([1.0, 2.0, np.inf, 0.0, 1.0 + index % 7], dtype=np.float32)
    return Scan(index * 100_000_000, pose(0.01 * index, 0.0, 0.0), ranges)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "spool.sqlite"


def test_what_was_taken_is_there_after_the_process_ends(path: Path) -> None:
    spool = Spool(path, PLENTY)
    run = spool.begin("r1", "robot", GEOMETRY)
    assert all(spool.append(run, scan(index)) for index in range(5))
    spool.acknowledge(run, 2)
    # The process ends without closing anything.
    again = Spool(path, PLENTY)
    oldest = again.oldest()
    assert oldest and (oldest.run, oldest.geometry, oldest.next_sequence, oldest.is_closed) == (
        "r1",
        GEOMETRY,
        5,
        False,
    )
    kept = again.read(oldest.id, 2, 10)
    assert [each.timestamp_ns for each in kept] == [200_000_000, 300_000_000, 400_000_000]
    np.testing.assert_array_equal(kept[0].ranges_m, scan(2).ranges_m)
    assert again.num_waiting == 3


def test_a_full_spool_refuses_and_goes_on_without_a_gap(path: Path) -> None:
    spool = Spool(path, max_bytes=3 * 20)
    run = spool.begin("r1", "robot", GEOMETRY)
    assert [spool.append(run, scan(index)) for index in range(5)] == [True, True, True, False, False]
    spool.acknowledge(run, 1)
    assert spool.append(run, scan(9))
    oldest = spool.oldest()
    assert oldest and oldest.next_sequence == 4
    assert Spool(path, max_bytes=3 * 20).append(run, scan(10)) is False


class Server:
    """What the API promises of runs, in memory; breaks down as it is told."""

    def __init__(self) -> None:
        self.runs: dict[str, list[Scan]] = {}
        self.finished: set[str] = set()
        self.failures: list[Exception] = []
        self.loses_answers = False

    def _fail(self) -> None:
        if self.failures:
            raise self.failures.pop(0)

    def exists(self) -> bool:
        return True

    def create(self) -> None:
        raise AssertionError("it stands")

    def make_run(self, run: str, geometry: Geometry, robot: str | None = None) -> Run:
        self._fail()
        scans = self.runs.setdefault(run, [])
        state = RunState.FINISHED if run in self.finished else RunState.OPEN
        return Run(run, geometry, state, len(scans), len(scans), 0, 0, robot)

    def append(self, run: str, first_sequence: int, scans: list[Scan]) -> Receipt:
        self._fail()
        stored = self.runs[run]
        if first_sequence > len(stored):
            raise refusal(409, len(stored))
        new = scans[len(stored) - first_sequence :]
        stored.extend(new)
        if self.loses_answers:
            self.loses_answers = False
            raise Unreachable("the answer was lost")
        return Receipt(len(stored), 0, 0)

    def finish(self, run: str) -> Run:
        self._fail()
        self.finished.add(run)
        return self.make_run(run, GEOMETRY)


def refusal(status: int, expected_sequence: int | None = None) -> Refused:
    return Refused(Problem("about:blank", "no", status, "no", expected_sequence=expected_sequence))


def drain(forwarder: Forwarder) -> None:
    for _ in range(1000):
        try:
            if not forwarder.step():
                return
        except (Refused, Unreachable):
            continue
    raise AssertionError("never done")


def test_every_scan_arrives_once_and_in_order_whatever_breaks(path: Path) -> None:
    spool, server, told = Spool(path, PLENTY), Server(), []
    forwarder = Forwarder(spool, server, 3, told.append)
    first = spool.begin("r1", "robot", GEOMETRY)
    for index in range(10):
        spool.append(first, scan(index))
    server.failures = [Unreachable("no route"), refusal(503)]
    server.loses_answers = True
    drain(forwarder)
    assert [each.timestamp_ns for each in server.runs["r1"]] == [scan(index).timestamp_ns for index in range(10)]
    assert not server.finished and spool.num_waiting == 0
    spool.append(first, scan(10))
    second = spool.begin("r2", "robot", GEOMETRY)
    spool.append(second, scan(20))
    drain(forwarder)
    assert (len(server.runs["r1"]), len(server.runs["r2"]), server.finished) == (11, 1, {"r1"})
    assert told == []


def test_a_run_that_the_server_will_not_have_holds_up_no_other(path: Path) -> None:
    spool, server, told = Spool(path, PLENTY), Server(), []
    bad = spool.begin("bad", "robot", GEOMETRY)
    spool.append(bad, scan(0))
    good = spool.begin("good", "robot", GEOMETRY)
    spool.append(good, scan(1))
    server.failures = [refusal(422)]
    drain(Forwarder(spool, server, 10, told.append))
    assert list(server.runs) == ["good"]
    assert "run bad is refused and kept" in told[0]
    assert spool.num_waiting == 1


def test_a_server_that_is_killed_twice_while_a_robot_drives_misses_no_scan(
    binary: str, path: Path, tmp_path: Path
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    site = Client(f"http://127.0.0.1:{port}", retry=RetryPolicy(patience_s=0.0)).site("office")
    spool = Spool(path, PLENTY)
    told: list[str] = []
    # Nothing listens yet: the robot was switched on first.
    thread = ForwarderThread(Forwarder(spool, site, 7, told.append), 0.02, 0.1, told.append)
    thread.start()
    run = spool.begin("r1", "robot", GEOMETRY)
    done = threading.Event()
    for round_ in range(3):
        for index in range(100):
            assert spool.append(run, scan(100 * round_ + index))
            done.wait(0.002)
        server, _ = start(binary, port, tmp_path / "data")
        if round_ < 2:
            done.wait(0.3)
            server.send_signal(signal.SIGKILL)
            server.wait(timeout=10)
    spool.end()
    for _ in range(600):
        if spool.oldest() is None:
            break
        done.wait(0.05)
    thread.stop(timeout_s=5.0)
    try:
        assert spool.oldest() is None, told
        stored = list(site.scans("r1"))
        assert [each.timestamp_ns for each in stored] == [scan(index).timestamp_ns for index in range(300)]
        assert site.run("r1").state == RunState.FINISHED
        assert any("scans are kept until the server answers" in text for text in told)
    finally:
        server.terminate()
        server.wait(timeout=30)
