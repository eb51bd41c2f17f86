from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="MapStatistics")


@_attrs_define
class MapStatistics:
    """Figures of a map.

    Attributes:
        num_matches (int): Matches, whatever became of them.
        num_verified (int): Matches that hold the map together.
        num_keyframes (int): Keyframes.
        length_m (float): Metres driven by all runs.
        duration_s (float): Seconds that building took.
    """

    num_matches: int
    num_verified: int
    num_keyframes: int
    length_m: float
    duration_s: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        num_matches = self.num_matches

        num_verified = self.num_verified

        num_keyframes = self.num_keyframes

        length_m = self.length_m

        duration_s = self.duration_s

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "num_matches": num_matches,
                "num_verified": num_verified,
                "num_keyframes": num_keyframes,
                "length_m": length_m,
                "duration_s": duration_s,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        num_matches = d.pop("num_matches")

        num_verified = d.pop("num_verified")

        num_keyframes = d.pop("num_keyframes")

        length_m = d.pop("length_m")

        duration_s = d.pop("duration_s")

        map_statistics = cls(
            num_matches=num_matches,
            num_verified=num_verified,
            num_keyframes=num_keyframes,
            length_m=length_m,
            duration_s=duration_s,
        )

        map_statistics.additional_properties = d
        return map_statistics

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
