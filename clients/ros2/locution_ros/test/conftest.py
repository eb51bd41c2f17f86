"""Messages of ROS 2 by their definitions, without ROS; and real servers."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

STORE = get_typestore(Stores.ROS2_HUMBLE)


def empty(kind: str) -> Any:
    """A message with every member at its default, as ROS makes it; members that it does not have cannot be set."""
    members: dict[str, Any] = {}
    for name, (node, what) in STORE.fielddefs[kind][1]:
        if node == Nodetype.BASE:
            members[name] = {"string": "", "bool": False}.get(what[0], 0)
        elif node == Nodetype.NAME:
            members[name] = empty(what)
        elif node == Nodetype.ARRAY:
            members[name] = np.zeros(what[1])
        else:
            members[name] = []
    made = STORE.types[kind](**members)
    allowed = {field.name for field in dataclasses.fields(made)}

    def set_member(message: Any, name: str, value: Any) -> None:
        assert name in allowed, f"{kind} has no member {name}"
        object.__setattr__(message, name, value)

    made.__class__ = type(kind, (type(made),), {"__setattr__": set_member})
    return made


def sent(message: Any, kind: str) -> Any:
    """The message as another process receives it: every member had the type that its definition says."""
    return STORE.deserialize_cdr(STORE.serialize_cdr(message, kind), kind)


@pytest.fixture
def binary() -> Iterator[str]:
    said = os.environ.get("LOCUTION_BINARY")
    if not said:
        pytest.skip("skipped: LOCUTION_BINARY names no server")
    yield said


def start(binary: str, port: int, data: Path) -> tuple[subprocess.Popen[str], str]:
    """A server and its address."""
    command = [binary, "serve", "--address", f"127.0.0.1:{port}", "--data-directory", str(data)]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert server.stdout
    url = next((line.split()[-1] for line in server.stdout if line.startswith("listening on ")), None)
    assert url, "the server does not start"
    return server, url
