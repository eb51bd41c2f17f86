from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.place_label import PlaceLabel
from ..models.route_turn import RouteTurn

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
    """

    place: int
    label: PlaceLabel
    length_m: float
    turn: RouteTurn
    text: str
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        place = self.place

        label = self.label.value

        length_m = self.length_m

        turn = self.turn.value

        text = self.text

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

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        place = d.pop("place")

        label = PlaceLabel(d.pop("label"))

        length_m = d.pop("length_m")

        turn = RouteTurn(d.pop("turn"))

        text = d.pop("text")

        route_step = cls(
            place=place,
            label=label,
            length_m=length_m,
            turn=turn,
            text=text,
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
