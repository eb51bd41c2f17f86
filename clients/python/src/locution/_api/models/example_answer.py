from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.localization_state import LocalizationState

if TYPE_CHECKING:
    from ..models.example_place import ExamplePlace


T = TypeVar("T", bound="ExampleAnswer")


@_attrs_define
class ExampleAnswer:
    """Where the example ends, in one site.

    Attributes:
        site (str): The site.
        map_version (int): The map version looked in.
        state (LocalizationState): How sure an answer is.
        travel_m (float): Metres that the example drives.
        places (list[ExamplePlace]): Places where the robot was at the end of the example, likeliest first.
    """

    site: str
    map_version: int
    state: LocalizationState
    travel_m: float
    places: list[ExamplePlace]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        site = self.site

        map_version = self.map_version

        state = self.state.value

        travel_m = self.travel_m

        places = []
        for places_item_data in self.places:
            places_item = places_item_data.to_dict()
            places.append(places_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "site": site,
                "map_version": map_version,
                "state": state,
                "travel_m": travel_m,
                "places": places,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.example_place import ExamplePlace  # noqa: PLC0415

        d = dict(src_dict)
        site = d.pop("site")

        map_version = d.pop("map_version")

        state = LocalizationState(d.pop("state"))

        travel_m = d.pop("travel_m")

        places = []
        _places = d.pop("places")
        for places_item_data in _places:
            places_item = ExamplePlace.from_dict(places_item_data)

            places.append(places_item)

        example_answer = cls(
            site=site,
            map_version=map_version,
            state=state,
            travel_m=travel_m,
            places=places,
        )

        example_answer.additional_properties = d
        return example_answer

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
