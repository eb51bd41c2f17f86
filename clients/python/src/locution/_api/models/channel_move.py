from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="ChannelMove")


@_attrs_define
class ChannelMove:
    """One move of a channel.

    Attributes:
        map_version (int): Where it points since.
        at_s (int): When it was moved, seconds since 1970.
        by (str): Name of the key that moved it.
    """

    map_version: int
    at_s: int
    by: str
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        map_version = self.map_version

        at_s = self.at_s

        by = self.by

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "map_version": map_version,
                "at_s": at_s,
                "by": by,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        map_version = d.pop("map_version")

        at_s = d.pop("at_s")

        by = d.pop("by")

        channel_move = cls(
            map_version=map_version,
            at_s=at_s,
            by=by,
        )

        channel_move.additional_properties = d
        return channel_move

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
