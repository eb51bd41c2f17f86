"""A real server, and bags of a simulated drive, shared by all tests."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from locution import Client, Recording, Site, open_recording

PACKAGE = Path(__file__).resolve().parents[1]
REPOSITORY = PACKAGE.parents[1]
sys.path.insert(0, str(PACKAGE / "examples"))

from make_bag import write_bag  # noqa: E402


@pytest.fixture(scope="session")
def binary() -> Path:
    """The built `locution`."""
    said = os.environ.get("LOCUTION_BINARY")
    candidates = [Path(said)] if said else [REPOSITORY / "target" / kind / "locution" for kind in ("release", "debug")]
    for candidate in candidates:
        if candidate.exists():
            return candidate.resolve()
    pytest.fail(f"no server binary at {', '.join(map(str, candidates))}: build it, or set LOCUTION_BINARY")


@pytest.fixture(scope="session")
def drives(binary: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two simulated drives through one floor: `drive.log` and `later.log`, each with its truth."""
    folder = tmp_path_factory.mktemp("drives")
    world = REPOSITORY / "clients/cli/worlds/office.yaml"
    route = "9.5,13 9.5,24.3 22.6,24.3 29.3,24.3 29.3,10.7 9.5,10.7 9.5,24.3 20,24.3"
    for name, way, seed in (("drive", route, 3), ("later", "22,24.3 29.3,24.3 29.3,10.7 15,10.7", 4)):
        command = [binary, "simulate", "--world", world, "--route", way, "--seed", str(seed), "--out", folder / name]
        subprocess.run(command, check=True, capture_output=True, timeout=120)
    return folder


@pytest.fixture(scope="session")
def drive(drives: Path) -> Recording:
    """The recording that is mapped."""
    return open_recording(drives / "drive.log")


@pytest.fixture(scope="session")
def later(drives: Path) -> Recording:
    """A robot that comes later and does not know where it is."""
    return open_recording(drives / "later.log")


@pytest.fixture(scope="session", params=["drive.mcap", "drive.bag", "drive"])
def bag(request: pytest.FixtureRequest, drive: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The drive as MCAP, as a bag of ROS 1 and as one of ROS 2, with a laser that hangs upside down."""
    path: Path = tmp_path_factory.mktemp("bags") / request.param
    write_bag(drive, path, is_upside_down=True)
    return path


@pytest.fixture(scope="session")
def client(binary: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A client of a server of its own."""
    folder = tmp_path_factory.mktemp("server")
    command = [binary, "serve", "--address", "127.0.0.1:0", "--data-directory", folder / "data"]
    with (folder / "log").open("w") as errors:
        server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
    assert server.stdout is not None
    url = next((line.split()[-1] for line in server.stdout if line.startswith("listening on ")), None)
    assert url, (folder / "log").read_text()
    try:
        with Client(url) as client:
            yield client
        assert server.poll() is None, (folder / "log").read_text()
    finally:
        server.terminate()
        server.wait(timeout=30)


@pytest.fixture(scope="session")
def mapped(client: Client, drive: Recording) -> Site:
    """A site whose map is built from the drive."""
    site = client.site("mapped")
    site.replay(drive, robot="porter", progress=False)
    site.build(progress=False)
    return site
