from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.labeled_stretch import Label


T = TypeVar("T", bound="LabelAnswer")


@_attrs_define
class LabelAnswer:
    """Where a question fits.

    Attributes:
        places (list[Label]): The stretches, in the order of the question.
        is_reversed (bool): Whether the run drove them the other way round.
        confidence (float): The least sure of its labels.
    """

    places: list[Label]
    is_reversed: bool
    confidence: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        places = []
        for places_item_data in self.places:
            places_item = places_item_data.to_dict()
            places.append(places_item)

        is_reversed = self.is_reversed

        confidence = self.confidence

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "places": places,
                "is_reversed": is_reversed,
                "confidence": confidence,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.labeled_stretch import Label  # noqa: PLC0415

        d = dict(src_dict)
        places = []
        _places = d.pop("places")
        for places_item_data in _places:
            places_item = Label.from_dict(places_item_data)

            places.append(places_item)

        is_reversed = d.pop("is_reversed")

        confidence = d.pop("confidence")

        label_answer = cls(
            places=places,
            is_reversed=is_reversed,
            confidence=confidence,
        )

        label_answer.additional_properties = d
        return label_answer

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
