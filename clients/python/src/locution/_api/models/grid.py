from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.grid_header import GridHeader
    from ..models.grid_info import GridInfo


T = TypeVar("T", bound="Grid")


@_attrs_define
class Grid:
    """An occupancy grid, field by field a message of `nav_msgs/OccupancyGrid`.

    Attributes:
        header (GridHeader): `std_msgs/Header`.
        info (GridInfo): `nav_msgs/MapMetaData`.
        data (list[int]): Row by row from the lower left: 0 free, 100 occupied, −1 unknown.
    """

    header: GridHeader
    info: GridInfo
    data: list[int]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        header = self.header.to_dict()

        info = self.info.to_dict()

        data = self.data

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "header": header,
                "info": info,
                "data": data,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.grid_header import GridHeader  # noqa: PLC0415
        from ..models.grid_info import GridInfo  # noqa: PLC0415

        d = dict(src_dict)
        header = GridHeader.from_dict(d.pop("header"))

        info = GridInfo.from_dict(d.pop("info"))

        data = cast(list[int], d.pop("data"))

        grid = cls(
            header=header,
            info=info,
            data=data,
        )

        grid.additional_properties = d
        return grid

    @property
    def additional_keys(self) -> list[str]:
        return list(self.additional_properties.keys())

    def __getitem__(self, key: str) -> Any:
        return self.additional_properties[key]

    def __setitem__(self, key: str, value: Any) -> None:
        self.additional_properties[key] = value

    def __delitem__(self, key: str) -> None:
        del self.additional_properties[key]

    def __contains__(self, key: str) -> bool:
        return key in self.additional_properties
