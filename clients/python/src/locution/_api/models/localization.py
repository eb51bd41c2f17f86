from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.localization_state import LocalizationState

if TYPE_CHECKING:
    from ..models.hypothesis import Hypothesis


T = TypeVar("T", bound="Localization")


@_attrs_define
class Localization:
    """A localisation as it stands.

    Attributes:
        id (str): Its name.
        map_version (int): The map version it looks in.
        state (LocalizationState): How sure an answer is.
        next_sequence (int): The sequence number to send next.
        travel_m (float): Metres driven since it began.
        hypotheses (list[Hypothesis]): Likeliest first.
    """

    id: str
    map_version: int
    state: LocalizationState
    next_sequence: int
    travel_m: float
    hypotheses: list[Hypothesis]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        id = self.id

        map_version = self.map_version

        state = self.state.value

        next_sequence = self.next_sequence

        travel_m = self.travel_m

        hypotheses = []
        for hypotheses_item_data in self.hypotheses:
            hypotheses_item = hypotheses_item_data.to_dict()
            hypotheses.append(hypotheses_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "id": id,
                "map_version": map_version,
                "state": state,
                "next_sequence": next_sequence,
                "travel_m": travel_m,
                "hypotheses": hypotheses,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.hypothesis import Hypothesis  # noqa: PLC0415

        d = dict(src_dict)
        id = d.pop("id")

        map_version = d.pop("map_version")

        state = LocalizationState(d.pop("state"))

        next_sequence = d.pop("next_sequence")

        travel_m = d.pop("travel_m")

        hypotheses = []
        _hypotheses = d.pop("hypotheses")
        for hypotheses_item_data in _hypotheses:
            hypotheses_item = Hypothesis.from_dict(hypotheses_item_data)

            hypotheses.append(hypotheses_item)

        localization = cls(
            id=id,
            map_version=map_version,
            state=state,
            next_sequence=next_sequence,
            travel_m=travel_m,
            hypotheses=hypotheses,
        )

        localization.additional_properties = d
        return localization

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
