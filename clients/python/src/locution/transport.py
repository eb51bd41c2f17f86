"""Requests with patience: busy servers are asked again when they said to."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import cbor2
import httpx

from .errors import LocutionError, Refused, Unreachable
from .routes import Route

Value = str | int | float | bool | None
"""What a parameter may be; None leaves it out."""


class Body(Protocol):
    """A generated model."""

    @classmethod
    def from_dict(cls: type[B], src_dict: Mapping[str, Any]) -> B:
        """Reads the model from members of JSON."""
        ...


B = TypeVar("B", bound=Body)


@dataclass(frozen=True)
class RetryPolicy:
    """When to ask again; seconds."""

    patience_s: float = 60.0
    """No request is repeated after this long."""
    first_pause_s: float = 0.1
    """First pause where the server names none; doubled every time."""
    longest_pause_s: float = 5.0
    """Longest pause where the server names none."""


class Transport:
    """Sends requests and repeats them while the server is busy or does not answer.

    Every request of this API may be repeated: batches are idempotent by their sequence number.
    """

    def __init__(
        self, url: str, key: str | None, retry: RetryPolicy, timeout_s: float, via: httpx.BaseTransport | None
    ) -> None:
        headers = {"authorization": f"Bearer {key}"} if key else {}
        timeout = httpx.Timeout(timeout_s, connect=10.0)
        self.url = url.rstrip("/")
        self._retry = retry
        self._http = httpx.Client(base_url=self.url, headers=headers, timeout=timeout, transport=via)

    def close(self) -> None:
        """Closes the connections."""
        self._http.close()

    def is_answered(self, route: Route) -> bool:
        """Whether a route answers well; asked once, without patience."""
        try:
            return self._http.request(route.method, route.of(), timeout=5.0).is_success
        except httpx.HTTPError:
            return False

    def send(
        self,
        route: Route,
        *names: str,
        query: Mapping[str, Value] | None = None,
        json: object | None = None,
        cbor: object | None = None,
        content: bytes | None = None,
        accept: str = "application/json",
    ) -> httpx.Response:
        """The answer of an operation.

        Raises:
            Refused: the server said no.
            Unreachable: no answer came within the patience.
        """
        headers = {"accept": accept}
        if cbor is not None:
            headers["content-type"], content = "application/cbor", cbor2.dumps(cbor)
        elif content is not None:
            headers["content-type"] = "application/octet-stream"
        parameters = {name: _written(value) for name, value in (query or {}).items() if value is not None}
        deadline = time.monotonic() + self._retry.patience_s
        pause_s = self._retry.first_pause_s
        while True:
            failure: LocutionError
            wait_s = pause_s
            try:
                response = self._http.request(
                    route.method,
                    route.of(*names),
                    params=parameters,
                    json=json,
                    content=content,
                    headers=headers,
                )
                if response.is_success:
                    return response
                failure = Refused.of(response)
                if response.status_code not in (429, 503):
                    raise failure
                wait_s = _retry_after_s(response, pause_s)
            except httpx.TransportError as error:
                failure = Unreachable(f"no answer from {self.url}: {error or type(error).__name__}")
            if time.monotonic() + wait_s > deadline:
                raise failure
            time.sleep(wait_s)
            pause_s = min(2.0 * pause_s, self._retry.longest_pause_s)

    def get(
        self,
        model: type[B],
        route: Route,
        *names: str,
        query: Mapping[str, Value] | None = None,
        json: object | None = None,
        cbor: object | None = None,
    ) -> B:
        """The answer of an operation as a model; raises as `send`."""
        return model.from_dict(self.send(route, *names, query=query, json=json, cbor=cbor).json())

    def all(self, model: type[B], route: Route, *names: str, query: Mapping[str, Value] | None = None) -> Iterator[B]:
        """The items of a paged list, page after page; raises as `send`."""
        cursor: str | None = None
        while True:
            page = self.send(route, *names, query={**(query or {}), "cursor": cursor}).json()
            yield from map(model.from_dict, page["items"])
            cursor = page.get("next_cursor")
            if cursor is None:
                return


def _written(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _retry_after_s(response: httpx.Response, otherwise_s: float) -> float:
    said = response.headers.get("retry-after", "")
    return float(said) if said.isdigit() else otherwise_s
