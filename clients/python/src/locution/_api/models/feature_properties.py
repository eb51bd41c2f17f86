from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.feature_kind import FeatureKind
from ..types import UNSET, Unset

T = TypeVar("T", bound="FeatureProperties")


@_attrs_define
class FeatureProperties:
    """What is said of a feature; null is what does not apply to it.

    Attributes:
        feature (FeatureKind): What a feature of a map is.
        component (int): Component of the map in whose frame it is.
        rooms (list[int]): Ids of the rooms beside a room, or joined by a door.
        id (None | str | Unset): Id of the room or of the annotation.
        label (None | str | Unset): Of a room `room`, `corridor` or `hall`; of an annotation its kind.
        name (None | str | Unset): What people call it.
        area_m2 (float | None | Unset): Of a room, square metres.
        width_m (float | None | Unset): Of a door, metres.
    """

    feature: FeatureKind
    component: int
    rooms: list[int]
    id: None | str | Unset = UNSET
    label: None | str | Unset = UNSET
    name: None | str | Unset = UNSET
    area_m2: float | None | Unset = UNSET
    width_m: float | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        feature = self.feature.value

        component = self.component

        rooms = self.rooms

        id: None | str | Unset
        if isinstance(self.id, Unset):
            id = UNSET
        else:
            id = self.id

        label: None | str | Unset
        if isinstance(self.label, Unset):
            label = UNSET
        else:
            label = self.label

        name: None | str | Unset
        if isinstance(self.name, Unset):
            name = UNSET
        else:
            name = self.name

        area_m2: float | None | Unset
        if isinstance(self.area_m2, Unset):
            area_m2 = UNSET
        else:
            area_m2 = self.area_m2

        width_m: float | None | Unset
        if isinstance(self.width_m, Unset):
            width_m = UNSET
        else:
            width_m = self.width_m

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "feature": feature,
                "component": component,
                "rooms": rooms,
            }
        )
        if id is not UNSET:
            field_dict["id"] = id
        if label is not UNSET:
            field_dict["label"] = label
        if name is not UNSET:
            field_dict["name"] = name
        if area_m2 is not UNSET:
            field_dict["area_m2"] = area_m2
        if width_m is not UNSET:
            field_dict["width_m"] = width_m

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        feature = FeatureKind(d.pop("feature"))

        component = d.pop("component")

        rooms = cast(list[int], d.pop("rooms"))

        def _parse_id(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        id = _parse_id(d.pop("id", UNSET))

        def _parse_label(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        label = _parse_label(d.pop("label", UNSET))

        def _parse_name(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        name = _parse_name(d.pop("name", UNSET))

        def _parse_area_m2(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        area_m2 = _parse_area_m2(d.pop("area_m2", UNSET))

        def _parse_width_m(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        width_m = _parse_width_m(d.pop("width_m", UNSET))

        feature_properties = cls(
            feature=feature,
            component=component,
            rooms=rooms,
            id=id,
            label=label,
            name=name,
            area_m2=area_m2,
            width_m=width_m,
        )

        feature_properties.additional_properties = d
        return feature_properties

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
