"""Scans that wait for the server, on disk: what is in here survives the end of the process and a lost connection."""

from __future__ import annotations

import json
import sqlite3
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from locution import Scan
from locution.models import Geometry
from locution.recording import pose

_SCHEMA = """
CREATE TABLE IF NOT EXISTS runs (
    id INTEGER PRIMARY KEY, run TEXT UNIQUE NOT NULL, robot TEXT NOT NULL, geometry TEXT NOT NULL,
    next_sequence INTEGER NOT NULL DEFAULT 0, is_closed INTEGER NOT NULL DEFAULT 0, refusal TEXT
);
CREATE TABLE IF NOT EXISTS scans (
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE, sequence INTEGER NOT NULL,
    timestamp_ns INTEGER NOT NULL, x REAL NOT NULL, y REAL NOT NULL, theta REAL NOT NULL, ranges BLOB NOT NULL,
    PRIMARY KEY (run_id, sequence)
) WITHOUT ROWID;
"""


@dataclass(frozen=True)
class SpooledRun:
    """A run of which something waits."""

    id: int
    run: str
    robot: str
    geometry: Geometry
    next_sequence: int
    is_closed: bool


class Spool:
    """A bounded queue of runs and their scans, in the order in which they were driven.

    A full spool refuses new scans, so that the sequence of what it took stays whole. May be used by several threads.
    """

    def __init__(self, path: Path, max_bytes: int) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._lock = threading.Lock()
        self._max_bytes = max_bytes
        self._database = sqlite3.connect(path, check_same_thread=False, isolation_level=None)
        # Written ahead and synced at checkpoints: the end of the process loses nothing, a power cut the last moments.
        self._database.execute("PRAGMA journal_mode = WAL")
        self._database.execute("PRAGMA synchronous = NORMAL")
        self._database.execute("PRAGMA foreign_keys = ON")
        self._database.executescript(_SCHEMA)
        (held,) = self._database.execute("SELECT COALESCE(SUM(LENGTH(ranges)), 0) FROM scans").fetchone()
        self._num_bytes = int(held)

    def close(self) -> None:
        """Closes the file."""
        with self._lock:
            self._database.close()

    @property
    def num_waiting(self) -> int:
        """How many scans wait."""
        with self._lock:
            return int(self._database.execute("SELECT COUNT(*) FROM scans").fetchone()[0])

    def begin(self, run: str, robot: str, geometry: Geometry) -> int:
        """Begins a run; every earlier one ends. Answers its number."""
        with self._lock:
            self._database.execute("UPDATE runs SET is_closed = 1")
            written = json.dumps(geometry.to_dict())
            cursor = self._database.execute(
                "INSERT INTO runs (run, robot, geometry) VALUES (?, ?, ?)", (run, robot, written)
            )
            return int(cursor.lastrowid or 0)

    def append(self, run_id: int, scan: Scan) -> bool:
        """Takes the next scan of a run; false when the spool is full or the server refused the run."""
        ranges = scan.ranges_m.astype("<f4", copy=False).tobytes()
        with self._lock:
            row = self._database.execute("SELECT next_sequence, refusal FROM runs WHERE id = ?", (run_id,)).fetchone()
            if row is None or row[1] is not None or self._num_bytes + len(ranges) > self._max_bytes:
                return False
            at = scan.odom_from_robot
            values = (run_id, row[0], scan.timestamp_ns, at.x, at.y, at.theta, ranges)
            self._database.execute("BEGIN")
            self._database.execute("INSERT INTO scans VALUES (?, ?, ?, ?, ?, ?, ?)", values)
            self._database.execute("UPDATE runs SET next_sequence = next_sequence + 1 WHERE id = ?", (run_id,))
            self._database.execute("COMMIT")
            self._num_bytes += len(ranges)
            return True

    def end(self) -> None:
        """Ends the run that is open, if there is one."""
        with self._lock:
            self._database.execute("UPDATE runs SET is_closed = 1")

    def oldest(self) -> SpooledRun | None:
        """The first run that has not been sent to its end, unless the server refused it."""
        with self._lock:
            row = self._database.execute(
                "SELECT id, run, robot, geometry, next_sequence, is_closed FROM runs WHERE refusal IS NULL "
                "ORDER BY id LIMIT 1"
            ).fetchone()
        if row is None:
            return None
        geometry = Geometry.from_dict(json.loads(row[3]))
        return SpooledRun(row[0], row[1], row[2], geometry, row[4], bool(row[5]))

    def read(self, run_id: int, first_sequence: int, limit: int) -> list[Scan]:
        """Scans of a run from a sequence number on."""
        with self._lock:
            rows: Sequence[tuple[int, float, float, float, bytes]] = self._database.execute(
                "SELECT timestamp_ns, x, y, theta, ranges FROM scans WHERE run_id = ? AND sequence >= ? "
                "ORDER BY sequence LIMIT ?",
                (run_id, first_sequence, limit),
            ).fetchall()
        return [
            Scan(timestamp_ns, pose(x, y, theta), np.frombuffer(ranges, dtype="<f4"))
            for timestamp_ns, x, y, theta, ranges in rows
        ]

    def acknowledge(self, run_id: int, next_sequence: int) -> None:
        """Drops what the server has on its disk: everything before a sequence number."""
        with self._lock:
            which = "WHERE run_id = ? AND sequence < ?"
            (freed,) = self._database.execute(
                f"SELECT COALESCE(SUM(LENGTH(ranges)), 0) FROM scans {which}", (run_id, next_sequence)
            ).fetchone()
            self._database.execute(f"DELETE FROM scans {which}", (run_id, next_sequence))
            self._num_bytes -= int(freed)

    def forget(self, run_id: int) -> None:
        """Drops a run that the server has whole."""
        with self._lock:
            self._database.execute("DELETE FROM runs WHERE id = ?", (run_id,))

    def refuse(self, run_id: int, reason: str) -> None:
        """Notes that the server will not have a run; its scans are kept for a person to look at."""
        with self._lock:
            self._database.execute("UPDATE runs SET refusal = ?, is_closed = 1 WHERE id = ?", (reason, run_id))
