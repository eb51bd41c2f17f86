from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.ros_time import RosTime


T = TypeVar("T", bound="GridHeader")


@_attrs_define
class GridHeader:
    """`std_msgs/Header`.

    Attributes:
        stamp (RosTime): `builtin_interfaces/Time`.
        frame_id (str): `map`.
    """

    stamp: RosTime
    frame_id: str
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        stamp = self.stamp.to_dict()

        frame_id = self.frame_id

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "stamp": stamp,
                "frame_id": frame_id,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.ros_time import RosTime  # noqa: PLC0415

        d = dict(src_dict)
        stamp = RosTime.from_dict(d.pop("stamp"))

        frame_id = d.pop("frame_id")

        grid_header = cls(
            stamp=stamp,
            frame_id=frame_id,
        )

        grid_header.additional_properties = d
        return grid_header

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
