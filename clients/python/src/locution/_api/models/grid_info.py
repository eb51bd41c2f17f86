from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="GridInfo")


@_attrs_define
class GridInfo:
    """`nav_msgs/MapMetaData`.

    Attributes:
        resolution (float): Metres per cell.
        width (int): Cells.
        height (int): Cells.
        origin (Pose): A pose in the plane, equally a rigid transform.
    """

    resolution: float
    width: int
    height: int
    origin: Pose
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        resolution = self.resolution

        width = self.width

        height = self.height

        origin = self.origin.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "resolution": resolution,
                "width": width,
                "height": height,
                "origin": origin,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        resolution = d.pop("resolution")

        width = d.pop("width")

        height = d.pop("height")

        origin = Pose.from_dict(d.pop("origin"))

        grid_info = cls(
            resolution=resolution,
            width=width,
            height=height,
            origin=origin,
        )

        grid_info.additional_properties = d
        return grid_info

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
