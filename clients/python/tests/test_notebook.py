"""The notebook runs from top to bottom."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from conftest import PACKAGE
from nbclient import NotebookClient

from locution import Client


def test_the_notebook_maps_a_bag_and_localizes(client: Client, binary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LOCUTION_URL", client.url)
    monkeypatch.setenv("LOCUTION_BINARY", str(binary))
    notebook = nbformat.read(PACKAGE / "examples/map_a_bag.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "kept without outputs"
    resources = {"metadata": {"path": str(PACKAGE / "examples")}}
    NotebookClient(notebook, timeout=120, resources=resources).execute()
    drawn = [
        output for cell in notebook.cells for output in cell.get("outputs", []) if "image/png" in output.get("data", {})
    ]
    assert drawn, "the map is shown"
    assert "image: office.pgm" in notebook.cells[-1].outputs[0].text
