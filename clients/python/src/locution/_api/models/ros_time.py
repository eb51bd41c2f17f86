from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="RosTime")


@_attrs_define
class RosTime:
    """`builtin_interfaces/Time`.

    Attributes:
        sec (int): Seconds.
        nanosec (int): And nanoseconds.
    """

    sec: int
    nanosec: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        sec = self.sec

        nanosec = self.nanosec

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "sec": sec,
                "nanosec": nanosec,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        sec = d.pop("sec")

        nanosec = d.pop("nanosec")

        ros_time = cls(
            sec=sec,
            nanosec=nanosec,
        )

        ros_time.additional_properties = d
        return ros_time

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
