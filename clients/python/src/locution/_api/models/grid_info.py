from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.ros_pose import RosPose
    from ..models.ros_time import RosTime


T = TypeVar("T", bound="GridInfo")


@_attrs_define
class GridInfo:
    """`nav_msgs/MapMetaData`.

    Attributes:
        map_load_time (RosTime): `builtin_interfaces/Time`.
        resolution (float): Metres per cell.
        width (int): Cells.
        height (int): Cells.
        origin (RosPose): `geometry_msgs/Pose`.
    """

    map_load_time: RosTime
    resolution: float
    width: int
    height: int
    origin: RosPose
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        map_load_time = self.map_load_time.to_dict()

        resolution = self.resolution

        width = self.width

        height = self.height

        origin = self.origin.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "map_load_time": map_load_time,
                "resolution": resolution,
                "width": width,
                "height": height,
                "origin": origin,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.ros_pose import RosPose  # noqa: PLC0415
        from ..models.ros_time import RosTime  # noqa: PLC0415

        d = dict(src_dict)
        map_load_time = RosTime.from_dict(d.pop("map_load_time"))

        resolution = d.pop("resolution")

        width = d.pop("width")

        height = d.pop("height")

        origin = RosPose.from_dict(d.pop("origin"))

        grid_info = cls(
            map_load_time=map_load_time,
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
