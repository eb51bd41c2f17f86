"""The way in: a server and its sites."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType

import httpx

from . import routes
from .localization import example_body
from .models import ExampleAnswer, SiteSummary, WordAnswer, WordPattern, WordQuery
from .readers import RosOptions
from .recording import Recording
from .site import Site
from .transport import RetryPolicy, Transport


class Client:
    """A connection to one server. Not shared between threads; make one for each.

    Args:
        url: Such as `http://127.0.0.1:7070`.
        key: API key, where the server asks for one.
        retry: How long busy or absent servers are asked again.
        timeout_s: How long one answer may take.
        transport: Another way to reach the server, such as one of a test.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:7070",
        key: str | None = None,
        *,
        retry: RetryPolicy | None = None,
        timeout_s: float = 60.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self._transport = Transport(url, key, retry or RetryPolicy(), timeout_s, transport)

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connections."""
        self._transport.close()

    @property
    def url(self) -> str:
        """Address of the server."""
        return self._transport.url

    @property
    def page_url(self) -> str:
        """Where a person looks at sites, runs and maps."""
        return self.url + routes.GET_UI.of()

    def is_ready(self) -> bool:
        """Whether the server is ready to work; asked once, without patience."""
        return self._transport.is_answered(routes.GET_READINESS)

    def is_alive(self) -> bool:
        """Whether the process lives; asked once, without patience."""
        return self._transport.is_answered(routes.GET_HEALTH)

    def metrics(self) -> str:
        """Counters and histograms of the server in Prometheus' text format."""
        return self._transport.send(routes.GET_METRICS, accept="*/*").text

    def site(self, name: str) -> Site:
        """A site by its name; nothing is asked or made yet."""
        return Site(self._transport, name)

    def sites(self) -> Iterator[SiteSummary]:
        """All sites that the key may see."""
        return self._transport.all(SiteSummary, routes.LIST_SITES)

    def ask_example(self, recording: Recording | str | Path, options: RosOptions | None = None) -> list[ExampleAnswer]:
        """In which site, and where, was this recorded? The likeliest site first; nothing is stored."""
        body = example_body(recording, options)
        answers = self._transport.send(routes.QUERY_EXAMPLE_EVERYWHERE, cbor=body).json()
        return [ExampleAnswer.from_dict(answer) for answer in answers]

    def query_words(self, words: Sequence[WordPattern], limit: int | None = None) -> list[WordAnswer]:
        """Where, in all sites, these words are driven one after the other; best fit first."""
        body = WordQuery(words=list(words), limit=limit).to_dict()
        answers = self._transport.send(routes.QUERY_WORDS_EVERYWHERE, json=body).json()
        return [WordAnswer.from_dict(answer) for answer in answers]
