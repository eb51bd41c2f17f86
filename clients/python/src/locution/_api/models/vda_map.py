from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="VdaMap")


@_attrs_define
class VdaMap:
    """The map of a channel in the words of VDA 5050, as its action `downloadMap` wants them.

    Attributes:
        map_id (str): Name of the site.
        map_version (str): Number of the version.
        map_download_link (str): Where its grid is on this server.
        map_hash (str): Digest of everything that the version holds, in hexadecimal: equal digests, equal maps.
    """

    map_id: str
    map_version: str
    map_download_link: str
    map_hash: str
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        map_id = self.map_id

        map_version = self.map_version

        map_download_link = self.map_download_link

        map_hash = self.map_hash

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "mapId": map_id,
                "mapVersion": map_version,
                "mapDownloadLink": map_download_link,
                "mapHash": map_hash,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        map_id = d.pop("mapId")

        map_version = d.pop("mapVersion")

        map_download_link = d.pop("mapDownloadLink")

        map_hash = d.pop("mapHash")

        vda_map = cls(
            map_id=map_id,
            map_version=map_version,
            map_download_link=map_download_link,
            map_hash=map_hash,
        )

        vda_map.additional_properties = d
        return vda_map

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
