from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define

T = TypeVar("T", bound="RobotReport")


@_attrs_define
class RobotReport:
    """What a robot says of itself.

    Attributes:
        map_version (int): The version of the map that it has loaded.
    """

    map_version: int

    def to_dict(self) -> dict[str, Any]:
        map_version = self.map_version

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "map_version": map_version,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        map_version = d.pop("map_version")

        robot_report = cls(
            map_version=map_version,
        )

        return robot_report
