from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.channel_move import ChannelMove
    from ..models.vda_map import VdaMap


T = TypeVar("T", bound="MapChannel")


@_attrs_define
class MapChannel:
    """A name that stands for a version of the map.

    Attributes:
        channel (str): Its name. Example: stable.
        map_version (int): Where it points. This version is kept as long as it does.
        moves (list[ChannelMove]): The last moves, the newest first.
        vda5050 (VdaMap): The map of a channel in the words of VDA 5050, as its action `downloadMap` wants them.
        map_version_before (int | None | Unset): Where it pointed before, and goes when the last move is taken back.
    """

    channel: str
    map_version: int
    moves: list[ChannelMove]
    vda5050: VdaMap
    map_version_before: int | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        channel = self.channel

        map_version = self.map_version

        moves = []
        for moves_item_data in self.moves:
            moves_item = moves_item_data.to_dict()
            moves.append(moves_item)

        vda5050 = self.vda5050.to_dict()

        map_version_before: int | None | Unset
        if isinstance(self.map_version_before, Unset):
            map_version_before = UNSET
        else:
            map_version_before = self.map_version_before

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "channel": channel,
                "map_version": map_version,
                "moves": moves,
                "vda5050": vda5050,
            }
        )
        if map_version_before is not UNSET:
            field_dict["map_version_before"] = map_version_before

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.channel_move import ChannelMove  # noqa: PLC0415
        from ..models.vda_map import VdaMap  # noqa: PLC0415

        d = dict(src_dict)
        channel = d.pop("channel")

        map_version = d.pop("map_version")

        moves = []
        _moves = d.pop("moves")
        for moves_item_data in _moves:
            moves_item = ChannelMove.from_dict(moves_item_data)

            moves.append(moves_item)

        vda5050 = VdaMap.from_dict(d.pop("vda5050"))

        def _parse_map_version_before(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        map_version_before = _parse_map_version_before(d.pop("map_version_before", UNSET))

        map_channel = cls(
            channel=channel,
            map_version=map_version,
            moves=moves,
            vda5050=vda5050,
            map_version_before=map_version_before,
        )

        map_channel.additional_properties = d
        return map_channel

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
