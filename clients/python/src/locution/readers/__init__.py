"""Recordings from files: CARMEN logs, ROS 1 and ROS 2 bags, MCAP. No ROS is needed."""

from __future__ import annotations

import gzip
from pathlib import Path

from ..errors import RecordingError
from ..recording import Recording
from .carmen import read_carmen
from .topics import RosOptions

__all__ = ["RosOptions", "open_recording"]

_MCAP_MAGIC = b"\x89MCAP0\r\n"
_BAG_MAGIC = b"#ROSBAG V"


def open_recording(path: str | Path, options: RosOptions | None = None) -> Recording:
    """Opens a recording, whatever its format; told by its content.

    Args:
        path: A CARMEN log (plain or gzipped), a `.bag` of ROS 1, the folder of a ROS 2 bag, or an `.mcap` file.
        options: Which topics and frames of a bag count; found when not said.

    Raises:
        RecordingError: a file that is none of these, or from which no scans with odometry can be had.
    """
    path = Path(path)
    options = options or RosOptions()
    if path.is_dir():
        return _open_bag(path, options)
    try:
        with path.open("rb") as file:
            head = file.read(16)
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror}") from error
    if head.startswith(_MCAP_MAGIC) or head.startswith(_BAG_MAGIC):
        return _open_bag(path, options)
    if head.startswith(b"SQLite format 3"):
        if (path.parent / "metadata.yaml").exists():
            return _open_bag(path.parent, options)
        raise RecordingError(f"{path}: a ROS 2 bag is read by its folder, with the metadata.yaml in it")
    unpack = gzip.open if head.startswith(b"\x1f\x8b") else open
    try:
        with unpack(path, "rt", encoding="utf-8", errors="replace") as lines:
            return read_carmen(path, lines, options.range_max)
    except (OSError, EOFError) as error:
        raise RecordingError(f"{path}: {error}") from error


def _open_bag(path: Path, options: RosOptions) -> Recording:
    try:
        from .bags import open_bag
    except ImportError as error:
        raise RecordingError(f"{path}: bags need more packages: pip install 'locution-client[bags]'") from error
    return open_bag(path, options)
