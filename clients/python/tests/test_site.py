"""A building from its first scan to an answer, against a real server."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from locution import Client, Recording, Refused, Site, open_recording, to_frame
from locution.models import LabelPattern, LocalizationState, PlaceLabel, RunState, WordPattern


def truth_of(drives: Path, name: str) -> np.ndarray:
    """Time, x, y, theta of every scan."""
    rows = [line.split() for line in (drives / f"{name}.truth").read_text().splitlines() if line[:1] != "#"]
    return np.array(rows, dtype=np.float64)


def test_a_bag_becomes_a_map_that_nav2_loads(client: Client, bag: Path, drives: Path, tmp_path: Path) -> None:
    site = client.site(f"from-{bag.suffix.strip('.') or 'ros2'}")
    run = site.replay(bag, robot="porter", progress=False)
    assert (run.state, run.num_scans) == (RunState.FINISHED, open_recording(bag).num_scans)
    built = site.build(progress=False)
    assert (built.components, built.runs()) == ([0], ["drive"])

    trajectory = built.trajectory("drive")
    truth = truth_of(drives, "drive")[:, 1:3]
    assert aligned_error_m(trajectory.poses[:, :2], truth) < 0.1

    page = built.to_nav2(tmp_path / "maps" / "office")
    lines = dict(line.split(": ", 1) for line in page.read_text().splitlines())
    assert lines["image"] == "office.pgm"
    grid = built.grid()
    magic, width, height, top, pixels = (tmp_path / "maps" / "office.pgm").read_bytes().split(maxsplit=4)[:5]
    assert (magic, int(top)) == (b"P5", 255)
    assert grid.cells.shape == (int(height), int(width))
    picture = np.frombuffer(pixels, dtype=np.uint8).reshape(grid.cells.shape)[::-1]
    # Read as nav2 reads it: p = (255 - pixel) / 255 against the thresholds of the page.
    occupancy = (255.0 - picture) / 255.0
    np.testing.assert_array_equal(occupancy > float(lines["occupied_thresh"]), grid.cells == 100)
    np.testing.assert_array_equal(occupancy < float(lines["free_thresh"]), grid.cells == 0)
    origin = [float(number) for number in lines["origin"].strip("[]").split(",")]
    assert origin[:2] == [grid.map_from_grid.x, grid.map_from_grid.y]


def aligned_error_m(found: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square distance after the best rigid motion."""
    a, b = found - found.mean(axis=0), truth - truth.mean(axis=0)
    u, _, v = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1.0, np.linalg.det(u @ v)]) @ v
    return float(np.sqrt(((a @ turn - b) ** 2).sum(axis=1).mean()))


def test_an_upload_goes_on_where_it_was_interrupted(client: Client, drive: Recording) -> None:
    site = client.site("interrupted")
    site.create()
    site.make_run(drive.name, drive.geometry, "porter")
    begun = [next(drive.batches(150))]
    site.append(drive.name, 0, begun[0])
    # The answer was lost, and the robot repeats the batch.
    assert site.append(drive.name, 0, begun[0]).next_sequence == 150
    run = site.replay(drive, robot="porter", batch_size=64, finish=False, progress=False)
    assert (run.state, run.num_scans) == (RunState.OPEN, drive.num_scans)
    with pytest.raises(Refused) as refused:
        site.append(drive.name, drive.num_scans + 5, begun[0])
    assert refused.value.expected_sequence == drive.num_scans
    assert site.replay(drive, robot="porter", progress=False).state == RunState.FINISHED
    assert site.replay(drive, robot="porter", progress=False).num_scans == drive.num_scans
    stored = list(site.scans(drive.name, limit=500))
    for scan, sent in zip(stored, drive.scans, strict=True):
        there = np.array([np.nan if r is None else r for r in scan.ranges_m], dtype=np.float32)
        is_return = sent.ranges_m < drive.geometry.range_max_m
        np.testing.assert_array_equal(there, np.where(is_return, sent.ranges_m, np.float32(np.nan)))
        assert scan.odom_from_robot == sent.odom_from_robot


def test_matches_are_a_table_and_take_a_persons_word(mapped: Site) -> None:
    table = to_frame(mapped.matches(state="verified"))
    assert len(table) > 0
    assert {"id", "earlier.run", "later.first", "evidence.bits", "probability"} <= set(table.columns)
    chosen = mapped.match(table.id[0])
    assert mapped.veto(chosen).decision == "veto"
    assert mapped.confirm(chosen.id).decision == "confirm"
    mapped.undecide(chosen)
    assert not mapped.match(chosen.id).decision
    assert {match.direction for match in mapped.matches(direction="same")} <= {"same"}


def test_a_robot_that_comes_later_is_told_where_it_is(mapped: Site, later: Recording, drives: Path) -> None:
    answer = mapped.localize(later, progress=False)
    assert answer.state == LocalizationState.CONVERGED
    best = max(answer.hypotheses, key=lambda found: found.probability)
    # The map's frame is that of its first run, whose start is known in the world.
    start, there = truth_of(drives, "drive")[0, 1:], truth_of(drives, "later")[answer.next_sequence - 1, 1:]
    origin = mapped.map().trajectory("drive").poses[0]
    turn = origin[2] - start[2]
    step = there[:2] - start[:2]
    x = origin[0] + np.cos(turn) * step[0] - np.sin(turn) * step[1]
    y = origin[1] + np.sin(turn) * step[0] + np.cos(turn) * step[1]
    assert np.hypot(best.map_from_robot.x - x, best.map_from_robot.y - y) < 0.3


def test_a_session_is_driven_scan_by_scan(mapped: Site, later: Recording) -> None:
    with mapped.localization(later.geometry, "guest") as session:
        assert session.best is None or session.best.probability <= 1.0
        for batch in later.batches(25):
            session.append(batch)
            if session.is_converged:
                break
        assert session.refresh().next_sequence == session.answer.next_sequence > 0
    with pytest.raises(Refused) as gone:
        session.refresh()
    assert gone.value.status == 404


def test_an_example_is_found_in_the_site_and_among_all_sites(client: Client, mapped: Site, later: Recording) -> None:
    answer = mapped.ask_example(later)
    assert answer.state == LocalizationState.CONVERGED
    assert answer.places[0].run == "drive"
    assert 10.0 < answer.travel_m <= 26.0
    assert mapped.name in {each.site for each in client.ask_example(later)}


def test_words_labels_places_and_ways_are_answered(client: Client, mapped: Site) -> None:
    words = list(mapped.words("drive"))
    assert words and words[0].id.level == 0
    pattern = [WordPattern(class_=word.class_, size=word.size) for word in words[3:6]]
    assert mapped.query_words(pattern, limit=2)[0].run == "drive"
    assert client.query_words(pattern, limit=5)
    corridors = mapped.query_labels([LabelPattern(label=PlaceLabel.CORRIDOR, length_min_m=3.0)], limit=2)
    assert corridors and corridors[0].places[0].label == "corridor"
    assert {label.run for label in mapped.labels()} == {"drive"}
    assert all(place.length_m > 0 for place in mapped.places())
    assert next(iter(mapped.observations("drive"))).scan_seq >= 0
    trajectory = mapped.trajectory("drive")
    (x0, y0, _), (x1, y1, _) = trajectory.poses[0], trajectory.poses[400]
    assert mapped.route((x0, y0), (x1, y1)).length_m > 1.0
    with pytest.raises(Refused, match="no other run shares the frame"):
        next(mapped.changes())


def test_the_map_comes_in_every_form(mapped: Site) -> None:
    built = mapped.map()
    assert built.picture_png().startswith(b"\x89PNG") and built.grid_png().startswith(b"\x89PNG")
    assert "<svg" in built.picture_svg()
    assert "VERTEX_SE2" in built.graph_g2o()
    num_poses = len(built.trajectory("drive").poses)
    assert len(built.trajectory_tum().splitlines()) >= num_poses
    assert len(mapped.trajectory_tum("drive", "odom").splitlines()) >= num_poses
    left, right, bottom, top = built.grid().extent
    poses = built.trajectory("drive").poses
    assert left < poses[:, 0].min() < poses[:, 0].max() < right
    assert bottom < poses[:, 1].min() < poses[:, 1].max() < top


def test_a_site_is_saved_brought_back_and_deleted(client: Client, mapped: Site) -> None:
    copy = client.site("copy")
    assert copy.restore(mapped.backup()).num_scans == mapped.status().num_scans
    assert copy.map().version == mapped.map().version
    copy.delete()
    assert not copy.exists()
    assert next(job.state.value for job in mapped.jobs()) == "done"
    assert "locution" in client.metrics()
    assert client.is_ready() and client.is_alive() and client.page_url.endswith("/ui")
