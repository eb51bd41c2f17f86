"""One robot that asks where it is: a session on the server, fed in batches, and what it says of odom in the map."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Protocol

from locution import Scan
from locution.models import Geometry, Hypothesis, Localization, LocalizationState, Pose

from .conversion import compose, inverse

MAX_WAITING = 400
"""Scans that wait for the server; when it does not answer the oldest are left out, since only the last metres count."""


class Session(Protocol):
    """What the tracker asks of a session (`locution.LocalizationSession`)."""

    answer: Localization

    def append(self, scans: list[Scan]) -> Localization:
        """Adds scans."""
        ...

    def close(self) -> None:
        """Ends it."""
        ...


class SessionSite(Protocol):
    """What the tracker asks of a site (`locution.Site`)."""

    def localization(self, geometry: Geometry, robot: str | None = None) -> Session:
        """Opens a session."""
        ...


@dataclass(frozen=True)
class Place:
    """Where the robot was found, at the time of a scan."""

    timestamp_ns: int
    best: Hypothesis
    map_from_odom: Pose
    map_version: int


class Tracker:
    """Takes scans from one thread and asks the server from another."""

    def __init__(self, site: SessionSite, robot: str) -> None:
        self._site, self._robot = site, robot
        self._lock = threading.Lock()
        self._waiting: list[Scan] = []
        self._session: Session | None = None
        self._is_wanted = False
        self._round = 0
        self.answer: Localization | None = None
        """What the server said last in this session."""
        self.place: Place | None = None
        """The place, once only one is left; kept when it is later lost, until another is found."""

    def start(self) -> None:
        """Forgets what is known and asks from now on."""
        with self._lock:
            self._is_wanted, self._waiting, self.answer, self.place = True, [], None, None
            self._round += 1

    @property
    def is_wanted(self) -> bool:
        """Whether somebody wants to know."""
        return self._is_wanted

    def offer(self, scans: list[Scan]) -> None:
        """Takes scans while somebody wants to know."""
        with self._lock:
            if self._is_wanted:
                self._waiting = [*self._waiting, *scans][-MAX_WAITING:]

    def step(self, geometry: Geometry) -> bool:
        """Asks about what waits; false when nothing does.

        Raises:
            LocutionError: as the server says; the session begins anew with the next step.
        """
        with self._lock:
            scans, self._waiting = self._waiting, []
            is_fresh, began_in = self.answer is None, self._round
        if not scans:
            return False
        try:
            if is_fresh:
                self.close()
            if self._session is None:
                self._session = self._site.localization(geometry, self._robot)
            self._take(self._session.append(scans), scans[-1], began_in)
        except Exception:
            self._session = None
            raise
        return True

    def _take(self, answer: Localization, last: Scan, began_in: int) -> None:
        with self._lock:
            # Somebody began anew while the server thought; this is about the time before.
            if began_in != self._round:
                return
            self.answer = answer
            best = max(answer.hypotheses, key=lambda found: found.probability, default=None)
            if best is not None and answer.state == LocalizationState.CONVERGED:
                map_from_odom = compose(best.map_from_robot, inverse(last.odom_from_robot))
                self.place = Place(last.timestamp_ns, best, map_from_odom, answer.map_version)

    def close(self) -> None:
        """Ends the session on the server, if there is one."""
        session, self._session = self._session, None
        if session is not None:
            session.close()
