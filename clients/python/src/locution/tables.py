"""Answers as tables."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import pandas as pd


class _Model(Protocol):
    def to_dict(self) -> dict[str, Any]: ...


def to_frame(items: Iterable[_Model]) -> pd.DataFrame:
    """A table of matches, runs, labels, places or any other answers, a row each.

    Members of members become columns such as `earlier.run` and `evidence.bits`; needs pandas.
    """
    import pandas as pd

    return pd.json_normalize([item.to_dict() for item in items])
