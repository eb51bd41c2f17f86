"""From the spool to the server, in order, whatever happens to the connection."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol

from locution import LocutionError, Refused, Scan
from locution.models import Geometry, Receipt, Run, RunState

from .spool import Spool, SpooledRun


class RunSite(Protocol):
    """What the forwarder asks of a site (`locution.Site`)."""

    def exists(self) -> bool:
        """Whether it stands."""
        ...

    def create(self) -> object:
        """Makes it."""
        ...

    def make_run(self, run: str, geometry: Geometry, robot: str | None = None) -> Run:
        """Makes a run or finds it."""
        ...

    def append(self, run: str, first_sequence: int, scans: list[Scan]) -> Receipt:
        """Appends scans."""
        ...

    def finish(self, run: str) -> Run:
        """Ends a run."""
        ...


class Forwarder:
    """Sends what is spooled. What the server says it has decides where to go on, so nothing is lost or sent twice."""

    def __init__(self, spool: Spool, site: RunSite, batch_size: int, tell: Callable[[str], None]) -> None:
        self._spool, self._site, self._batch_size, self._tell = spool, site, batch_size, tell
        self._begun: tuple[int, int] | None = None
        """The run that the server has been asked about, and its next sequence number there."""

    def step(self) -> bool:
        """Sends one batch; false when there is nothing to send now.

        Raises:
            LocutionError: the server does not answer, or is busy; to be tried again later.
        """
        run = self._spool.oldest()
        if run is None:
            return False
        try:
            return self._advance(run)
        except Refused as refused:
            self._begun = None
            if refused.status == 409 and refused.expected_sequence is not None:
                # Asked anew what the server has; it goes on from there.
                self._tell(f"run {run.run}: the server expects scan {refused.expected_sequence}")
                return True
            if refused.status in (401, 403, 404, 408, 429) or refused.status >= 500:
                raise
            self._tell(f"run {run.run} is refused and kept in the spool: {refused}")
            self._spool.refuse(run.id, str(refused))
            return True
        except LocutionError:
            self._begun = None
            raise

    def _advance(self, run: SpooledRun) -> bool:
        if self._begun is None or self._begun[0] != run.id:
            if not self._site.exists():
                self._site.create()
            stored = self._site.make_run(run.run, run.geometry, run.robot)
            if stored.state == RunState.FINISHED:
                self._spool.forget(run.id)
                return True
            self._begun = (run.id, stored.next_sequence)
            self._spool.acknowledge(run.id, stored.next_sequence)
        sequence = self._begun[1]
        scans = self._spool.read(run.id, sequence, self._batch_size)
        if scans:
            receipt = self._site.append(run.run, sequence, scans)
            self._begun = (run.id, receipt.next_sequence)
            self._spool.acknowledge(run.id, receipt.next_sequence)
            return True
        if not run.is_closed:
            return False
        if run.next_sequence > 0:
            self._site.finish(run.run)
        self._spool.forget(run.id)
        self._begun = None
        return True


class ForwarderThread(threading.Thread):
    """Steps a forwarder until it is told to stop; pauses while there is nothing to send or nobody to send to."""

    def __init__(
        self, forwarder: Forwarder, period_s: float, longest_pause_s: float, tell: Callable[[str], None]
    ) -> None:
        super().__init__(name="locution-forwarder", daemon=True)
        self._forwarder, self._period_s, self._longest_pause_s, self._tell = forwarder, period_s, longest_pause_s, tell
        self._stopping = threading.Event()

    def run(self) -> None:
        """Sends until stopped."""
        pause_s, is_told = self._period_s, False
        while not self._stopping.is_set():
            try:
                while not self._stopping.is_set() and self._forwarder.step():
                    pass
                if is_told:
                    self._tell("the server answers again")
                pause_s, is_told = self._period_s, False
            except LocutionError as error:
                if not is_told:
                    self._tell(f"scans are kept until the server answers: {error}")
                is_told, pause_s = True, min(2.0 * pause_s, self._longest_pause_s)
            self._stopping.wait(pause_s)

    def stop(self, timeout_s: float) -> None:
        """Ends the thread after the request that it is at."""
        self._stopping.set()
        self.join(timeout_s)
