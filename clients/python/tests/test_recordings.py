"""Files become the recordings that they hold."""

from __future__ import annotations

import gzip
import os
import subprocess
from pathlib import Path

import attrs
import numpy as np
import pytest
from conftest import REPOSITORY, write_bag

from locution import Client, Recording, RecordingError, RosOptions, open_recording

DATASETS = Path(os.environ.get("LOCUTION_DATASETS", REPOSITORY.parent / "shared/datasets"))


def test_a_bag_holds_the_drive_it_was_made_of(bag: Path, drive: Recording) -> None:
    found = open_recording(bag)
    assert found.name == "drive"
    assert found.num_scans == drive.num_scans
    assert "laser hangs upside down" in found.notes
    expected = drive.geometry
    assert found.geometry.num_ranges == expected.num_ranges
    assert abs(found.geometry.angle_min_rad - expected.angle_min_rad) < 1e-6
    assert abs(found.geometry.angle_increment_rad - expected.angle_increment_rad) < 1e-6
    scans = list(zip(found.scans, drive.scans, strict=True))
    start_ns = scans[0][0].timestamp_ns - scans[0][1].timestamp_ns
    for read, made in scans:
        np.testing.assert_array_equal(read.ranges_m, np.where(made.ranges_m >= 30.0, np.inf, made.ranges_m))
        assert read.timestamp_ns - start_ns == made.timestamp_ns
        at, was = read.odom_from_robot, made.odom_from_robot
        # The odometry of the bag is 20 Hz and straight between its messages.
        assert np.hypot(at.x - was.x, at.y - was.y) < 0.01
        assert abs(np.angle(np.exp(1j * (at.theta - was.theta)))) < 0.02


def test_a_bag_is_walked_as_often_as_one_likes_and_from_any_scan(bag: Path) -> None:
    found = open_recording(bag)
    later = [scan.timestamp_ns for batch in found.batches(7, first=100) for scan in batch]
    assert later == [scan.timestamp_ns for scan in found.scans][100:]


def test_what_is_said_wins_over_what_the_bag_says(bag: Path) -> None:
    found = open_recording(bag, RosOptions(robot_from_laser=(0.2, 0.0, 0.1), range_max=5.0))
    mount = found.geometry.robot_from_laser
    assert mount and (mount.x, mount.y, mount.theta) == (0.2, 0.0, 0.1)
    assert found.geometry.range_max_m == 5.0
    assert max(float(r[np.isfinite(r)].max()) for r in (scan.ranges_m for scan in found.scans)) < 5.0
    with pytest.raises(RecordingError, match="no laser topic /nose"):
        open_recording(bag, RosOptions(scan_topic="/nose"))


def test_files_that_are_no_recordings_are_refused_by_name(tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("nothing of a robot\n")
    with pytest.raises(RecordingError, match=r"notes\.txt.*no CARMEN log"):
        open_recording(text)
    with pytest.raises(RecordingError, match=r"absent\.mcap.*No such file"):
        open_recording(tmp_path / "absent.mcap")
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"\x89MCAP0\r\n" + bytes(40))
    with pytest.raises(RecordingError, match=r"broken\.mcap"):
        open_recording(broken)
    (tmp_path / "empty").mkdir()
    with pytest.raises(RecordingError, match="empty"):
        open_recording(tmp_path / "empty")


def test_a_bag_that_was_cut_off_says_so(drive: Recording, tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    write_bag(drive.last(2.0), whole)
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with pytest.raises(RecordingError, match=r"cut\.mcap"):
        list(open_recording(cut).scans)


def test_a_line_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    log = tmp_path / "log.gz"
    log.write_bytes(gzip.compress(b"# head\nFLASER 3 1.0 2.0\n"))
    with pytest.raises(RecordingError, match="line 2"):
        open_recording(log)


def test_logs_are_read_as_the_command_line_reads_them(client: Client, drives: Path, binary: Path) -> None:
    """Geometry and scans of the whole drive, and of the head of every public log that is at hand."""
    logs = [drives / "drive.log"]
    for packed in sorted(DATASETS.glob("laser/*.log.gz")):
        head = drives / f"head-{packed.name.removesuffix('.gz')}"
        with gzip.open(packed, "rt", errors="replace") as lines:
            head.write_text("".join(line for line, _ in zip(lines, range(4000), strict=False)))
        logs.append(head)
    site = client.site("both-readers")
    command = [binary, "replay", "--url", client.url, "--site", site.name, "--keep-open", *logs]
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    for log in logs:
        ours = open_recording(log)
        theirs = site.run(ours.name)
        # What a recording leaves unsaid the server answers as it takes it.
        assert theirs.geometry == attrs.evolve(ours.geometry, range_min_m=0.0), log.name
        assert theirs.num_scans == ours.num_scans
        scan = next(iter(site.scans(ours.name, limit=1)))
        first = next(iter(ours.scans))
        assert (scan.timestamp_ns, scan.odom_from_robot) == (first.timestamp_ns, first.odom_from_robot)
