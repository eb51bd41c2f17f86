from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

T = TypeVar("T", bound="ChannelTarget")


@_attrs_define
class ChannelTarget:
    """Where a channel is to point.

    Attributes:
        map_version (int | None | Unset): A version of the map that is kept; the serving one unless said.
    """

    map_version: int | None | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        map_version: int | None | Unset
        if isinstance(self.map_version, Unset):
            map_version = UNSET
        else:
            map_version = self.map_version

        field_dict: dict[str, Any] = {}

        field_dict.update({})
        if map_version is not UNSET:
            field_dict["map_version"] = map_version

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)

        def _parse_map_version(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        map_version = _parse_map_version(d.pop("map_version", UNSET))

        channel_target = cls(
            map_version=map_version,
        )

        return channel_target
