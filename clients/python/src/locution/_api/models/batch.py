from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define

if TYPE_CHECKING:
    from ..models.scan import Scan


T = TypeVar("T", bound="Batch")


@_attrs_define
class Batch:
    """Scans to append to a run.

    Attributes:
        first_sequence (int): Sequence number of the first scan; the first scan of a run has 0. Example: 0.
        scans (list[Scan]): In order.
    """

    first_sequence: int
    scans: list[Scan]

    def to_dict(self) -> dict[str, Any]:
        first_sequence = self.first_sequence

        scans = []
        for scans_item_data in self.scans:
            scans_item = scans_item_data.to_dict()
            scans.append(scans_item)

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "first_sequence": first_sequence,
                "scans": scans,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.scan import Scan  # noqa: PLC0415

        d = dict(src_dict)
        first_sequence = d.pop("first_sequence")

        scans = []
        _scans = d.pop("scans")
        for scans_item_data in _scans:
            scans_item = Scan.from_dict(scans_item_data)

            scans.append(scans_item)

        batch = cls(
            first_sequence=first_sequence,
            scans=scans,
        )

        return batch
