from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.point import Point


T = TypeVar("T", bound="Door")


@_attrs_define
class Door:
    """A door of a room.

    Attributes:
        position (Point): A position.
        width_m (float): Diameter of the largest disc that passes through it, metres.
        rooms (list[int]): Ids of the rooms that it joins.
    """

    position: Point
    width_m: float
    rooms: list[int]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        position = self.position.to_dict()

        width_m = self.width_m

        rooms = self.rooms

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "position": position,
                "width_m": width_m,
                "rooms": rooms,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.point import Point  # noqa: PLC0415

        d = dict(src_dict)
        position = Point.from_dict(d.pop("position"))

        width_m = d.pop("width_m")

        rooms = cast(list[int], d.pop("rooms"))

        door = cls(
            position=position,
            width_m=width_m,
            rooms=rooms,
        )

        door.additional_properties = d
        return door

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
