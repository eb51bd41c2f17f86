""" "Where am I": recordings and robots that ask for their place in a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from . import routes
from .models import Geometry, Hypothesis, Localization, LocalizationState
from .readers import RosOptions, open_recording
from .recording import Recording, Scan
from .transport import Transport


def as_recording(recording: Recording | str | Path, options: RosOptions | None) -> Recording:
    """The recording itself, or the one in a file."""
    return recording if isinstance(recording, Recording) else open_recording(recording, options)


def batch_body(first_sequence: int, scans: Sequence[Scan]) -> dict[str, Any]:
    """The CBOR body of scans."""
    return {"first_sequence": first_sequence, "scans": [scan.to_wire() for scan in scans]}


def example_body(recording: Recording | str | Path, options: RosOptions | None) -> dict[str, Any]:
    """The CBOR body that asks about the end of a recording."""
    asked = as_recording(recording, options).last()
    return {"geometry": asked.geometry.to_dict(), "scans": [scan.to_wire() for scan in asked.scans]}


class LocalizationSession:
    """A robot that asks where it is while it drives; nothing of it is added to the map.

    Used as a context, it is closed at the end.
    """

    def __init__(self, transport: Transport, site: str, geometry: Geometry, robot: str | None) -> None:
        self._transport, self._site = transport, site
        body = {"geometry": geometry.to_dict(), "robot": robot}
        self.answer = transport.get(Localization, routes.OPEN_LOCALIZATION, site, json=body)

    def __enter__(self) -> LocalizationSession:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def append(self, scans: Sequence[Scan]) -> Localization:
        """Adds the next scans and says where the robot now may be."""
        body = batch_body(self.answer.next_sequence, scans)
        names = (self._site, self.answer.id)
        self.answer = self._transport.get(Localization, routes.APPEND_LOCALIZATION_BATCH, *names, cbor=body)
        return self.answer

    def refresh(self) -> Localization:
        """The localisation as it stands."""
        self.answer = self._transport.get(Localization, routes.GET_LOCALIZATION, self._site, self.answer.id)
        return self.answer

    @property
    def is_converged(self) -> bool:
        """Whether one place is left."""
        return self.answer.state == LocalizationState.CONVERGED

    @property
    def best(self) -> Hypothesis | None:
        """The likeliest place, if there is any."""
        return max(self.answer.hypotheses, key=lambda found: found.probability, default=None)

    def close(self) -> None:
        """Ends the session on the server."""
        self._transport.send(routes.CLOSE_LOCALIZATION, self._site, self.answer.id)
