from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="ChannelRobot")


@_attrs_define
class ChannelRobot:
    """A robot that follows a channel.

    Attributes:
        robot (str): Its name.
        map_version (int): The version that it said to have.
        is_current (bool): Whether the channel points there.
        at_s (int): When it said so, seconds since 1970.
    """

    robot: str
    map_version: int
    is_current: bool
    at_s: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        robot = self.robot

        map_version = self.map_version

        is_current = self.is_current

        at_s = self.at_s

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "robot": robot,
                "map_version": map_version,
                "is_current": is_current,
                "at_s": at_s,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        robot = d.pop("robot")

        map_version = d.pop("map_version")

        is_current = d.pop("is_current")

        at_s = d.pop("at_s")

        channel_robot = cls(
            robot=robot,
            map_version=map_version,
            is_current=is_current,
            at_s=at_s,
        )

        channel_robot.additional_properties = d
        return channel_robot

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
