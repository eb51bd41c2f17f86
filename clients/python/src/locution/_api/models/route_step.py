from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.place_label import PlaceLabel
from ..models.route_turn import RouteTurn
from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.point import Point


T = TypeVar("T", bound="RouteStep")


@_attrs_define
class RouteStep:
    """One place on a route.

    Attributes:
        place (int): Number of the place.
        label (PlaceLabel): What kind of place it is.
        length_m (float): Way through it, metres.
        turn (RouteTurn): How a place is left.
        text (str): What a person would say.
        room (int | None | Unset): Id of the room in which it lies; null where no room is known.
        door (None | Point | Unset):
    """

    place: int
    label: PlaceLabel
    length_m: float
    turn: RouteTurn
    text: str
    room: int | None | Unset = UNSET
    door: None | Point | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.point import Point  # noqa: PLC0415

        place = self.place

        label = self.label.value

        length_m = self.length_m

        turn = self.turn.value

        text = self.text

        room: int | None | Unset
        if isinstance(self.room, Unset):
            room = UNSET
        else:
            room = self.room

        door: dict[str, Any] | None | Unset
        if isinstance(self.door, Unset):
            door = UNSET
        elif isinstance(self.door, Point):
            door = self.door.to_dict()
        else:
            door = self.door

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "place": place,
                "label": label,
                "length_m": length_m,
                "turn": turn,
                "text": text,
            }
        )
        if room is not UNSET:
            field_dict["room"] = room
        if door is not UNSET:
            field_dict["door"] = door

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.point import Point  # noqa: PLC0415

        d = dict(src_dict)
        place = d.pop("place")

        label = PlaceLabel(d.pop("label"))

        length_m = d.pop("length_m")

        turn = RouteTurn(d.pop("turn"))

        text = d.pop("text")

        def _parse_room(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        room = _parse_room(d.pop("room", UNSET))

        def _parse_door(data: object) -> None | Point | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                door_type_0 = Point.from_dict(data)

                return door_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | Point | Unset, data)

        door = _parse_door(d.pop("door", UNSET))

        route_step = cls(
            place=place,
            label=label,
            length_m=length_m,
            turn=turn,
            text=text,
            room=room,
            door=door,
        )

        route_step.additional_properties = d
        return route_step

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
