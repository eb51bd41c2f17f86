"""Patience, refusals and the list of routes; against answers made here and the API's document."""

from __future__ import annotations

import json
from collections.abc import Callable

import httpx
import pytest
from conftest import REPOSITORY

from locution import Client, Refused, RetryPolicy, Unreachable, routes

HASTE = RetryPolicy(patience_s=0.3, first_pause_s=0.01, longest_pause_s=0.02)


def client_of(answer: Callable[[httpx.Request], httpx.Response]) -> Client:
    return Client("http://server", "secret", retry=HASTE, transport=httpx.MockTransport(answer))


def test_every_operation_of_the_document_is_known_and_no_other() -> None:
    document = json.loads((REPOSITORY / "openapi/openapi.json").read_text())
    documented = {
        (operation["operationId"], method.upper(), path)
        for path, item in document["paths"].items()
        for method, operation in item.items()
    }
    known = {(r.operation, r.method, r.path) for r in vars(routes).values() if isinstance(r, routes.Route)}
    assert known == documented


def test_names_are_escaped_in_paths() -> None:
    assert routes.GET_RUN.of("a/b", "c d") == "/v1/sites/a%2Fb/runs/c%20d"


def test_a_busy_server_is_asked_again() -> None:
    calls: list[str] = []

    def answer(request: httpx.Request) -> httpx.Response:
        calls.append(request.headers["authorization"])
        if len(calls) < 3:
            return httpx.Response(503, headers={"retry-after": "0"}, json={"detail": "busy"})
        return httpx.Response(200, json={"items": [], "next_cursor": None})

    assert list(client_of(answer).sites()) == []
    assert calls == ["Bearer secret"] * 3


def test_a_refusal_carries_the_problem_and_is_not_repeated() -> None:
    calls = 0

    def answer(_: httpx.Request) -> httpx.Response:
        nonlocal calls
        calls += 1
        problem = {"title": "Invalid scan", "detail": "a range is negative", "field": "scans[3].ranges_m[17]"}
        return httpx.Response(
            422, json={"type": "https://locution.dev/problems/invalid-scan", "status": 422, **problem}
        )

    with pytest.raises(Refused, match=r"^422: scans\[3\]\.ranges_m\[17\]: a range is negative$") as refused:
        client_of(answer).site("office").status()
    assert (refused.value.status, refused.value.expected_sequence, calls) == (422, None, 1)


def test_an_answer_of_something_between_is_a_refusal_too() -> None:
    with pytest.raises(Refused, match="502: <html>bad gateway"):
        client_of(lambda _: httpx.Response(502, text="<html>bad gateway</html>")).site("office").status()


def test_a_server_that_is_not_there_is_told() -> None:
    def answer(_: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("connection refused")

    client = client_of(answer)
    with pytest.raises(Unreachable, match="no answer from http://server: connection refused"):
        client.site("office").status()
    assert not client.is_ready()


def test_lists_are_read_page_after_page() -> None:
    def answer(request: httpx.Request) -> httpx.Response:
        cursor = int(request.url.params.get("cursor", "0"))
        site = {"site": f"s{cursor}", "state": "serving", "num_runs": 0, "num_scans": 0, "num_observations": 0}
        site |= {"num_words": 0, "bytes_on_disk": 0, "generation": 0}
        return httpx.Response(200, json={"items": [site], "next_cursor": str(cursor + 1) if cursor < 2 else None})

    assert [site.site for site in client_of(answer).sites()] == ["s0", "s1", "s2"]
