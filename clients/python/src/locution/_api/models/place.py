from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.place_label import PlaceLabel

if TYPE_CHECKING:
    from ..models.point import Point


T = TypeVar("T", bound="Place")


@_attrs_define
class Place:
    """A place: driven ground of one label, voted over all passes.

    Attributes:
        place (int): Its number in the component.
        label (PlaceLabel): What kind of place it is.
        confidence (float): Share of the votes that agree, from 0 to 1.
        centre (Point): A position.
        length_m (float): Metres of the longest pass through it.
        outline (list[Point]): Border of the ground that was driven, counter-clockwise.
    """

    place: int
    label: PlaceLabel
    confidence: float
    centre: Point
    length_m: float
    outline: list[Point]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        place = self.place

        label = self.label.value

        confidence = self.confidence

        centre = self.centre.to_dict()

        length_m = self.length_m

        outline = []
        for outline_item_data in self.outline:
            outline_item = outline_item_data.to_dict()
            outline.append(outline_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "place": place,
                "label": label,
                "confidence": confidence,
                "centre": centre,
                "length_m": length_m,
                "outline": outline,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.point import Point  # noqa: PLC0415

        d = dict(src_dict)
        place = d.pop("place")

        label = PlaceLabel(d.pop("label"))

        confidence = d.pop("confidence")

        centre = Point.from_dict(d.pop("centre"))

        length_m = d.pop("length_m")

        outline = []
        _outline = d.pop("outline")
        for outline_item_data in _outline:
            outline_item = Point.from_dict(outline_item_data)

            outline.append(outline_item)

        place = cls(
            place=place,
            label=label,
            confidence=confidence,
            centre=centre,
            length_m=length_m,
            outline=outline,
        )

        place.additional_properties = d
        return place

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
