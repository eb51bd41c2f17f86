from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define

if TYPE_CHECKING:
    from ..models.geometry import Geometry
    from ..models.scan import Scan


T = TypeVar("T", bound="ExampleQuery")


@_attrs_define
class ExampleQuery:
    """A short recording that is asked about and not stored.

    Attributes:
        geometry (Geometry): What all scans of a run share.
        scans (list[Scan]): In order of driving; some metres of it.
    """

    geometry: Geometry
    scans: list[Scan]

    def to_dict(self) -> dict[str, Any]:
        geometry = self.geometry.to_dict()

        scans = []
        for scans_item_data in self.scans:
            scans_item = scans_item_data.to_dict()
            scans.append(scans_item)

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "geometry": geometry,
                "scans": scans,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.geometry import Geometry  # noqa: PLC0415
        from ..models.scan import Scan  # noqa: PLC0415

        d = dict(src_dict)
        geometry = Geometry.from_dict(d.pop("geometry"))

        scans = []
        _scans = d.pop("scans")
        for scans_item_data in _scans:
            scans_item = Scan.from_dict(scans_item_data)

            scans.append(scans_item)

        example_query = cls(
            geometry=geometry,
            scans=scans,
        )

        return example_query
