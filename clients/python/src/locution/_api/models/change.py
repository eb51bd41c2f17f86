from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.change_kind import ChangeKind
from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.change_visit import ChangeVisit
    from ..models.point import Point


T = TypeVar("T", bound="Change")


@_attrs_define
class Change:
    """An area that changed: something came or went.

    Attributes:
        kind (ChangeKind): What became of something that stood or stands there.
        component (int): Component of the map in whose frame the positions are.
        centre (Point): A position.
        low (Point): A position.
        high (Point): A position.
        area_m2 (float): Surface that changed, square metres.
        confidence (float): How clearly the scans and densities of both sessions tell, from 0 to 1.
        density_change (float | None | Unset): Free-space density observed around it in the second session, minus the
            first; null where one did not pass.
        last_as_before (ChangeVisit | None | Unset):
        first_as_after (ChangeVisit | None | Unset):
    """

    kind: ChangeKind
    component: int
    centre: Point
    low: Point
    high: Point
    area_m2: float
    confidence: float
    density_change: float | None | Unset = UNSET
    last_as_before: ChangeVisit | None | Unset = UNSET
    first_as_after: ChangeVisit | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.change_visit import ChangeVisit  # noqa: PLC0415

        kind = self.kind.value

        component = self.component

        centre = self.centre.to_dict()

        low = self.low.to_dict()

        high = self.high.to_dict()

        area_m2 = self.area_m2

        confidence = self.confidence

        density_change: float | None | Unset
        if isinstance(self.density_change, Unset):
            density_change = UNSET
        else:
            density_change = self.density_change

        last_as_before: dict[str, Any] | None | Unset
        if isinstance(self.last_as_before, Unset):
            last_as_before = UNSET
        elif isinstance(self.last_as_before, ChangeVisit):
            last_as_before = self.last_as_before.to_dict()
        else:
            last_as_before = self.last_as_before

        first_as_after: dict[str, Any] | None | Unset
        if isinstance(self.first_as_after, Unset):
            first_as_after = UNSET
        elif isinstance(self.first_as_after, ChangeVisit):
            first_as_after = self.first_as_after.to_dict()
        else:
            first_as_after = self.first_as_after

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "kind": kind,
                "component": component,
                "centre": centre,
                "low": low,
                "high": high,
                "area_m2": area_m2,
                "confidence": confidence,
            }
        )
        if density_change is not UNSET:
            field_dict["density_change"] = density_change
        if last_as_before is not UNSET:
            field_dict["last_as_before"] = last_as_before
        if first_as_after is not UNSET:
            field_dict["first_as_after"] = first_as_after

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.change_visit import ChangeVisit  # noqa: PLC0415
        from ..models.point import Point  # noqa: PLC0415

        d = dict(src_dict)
        kind = ChangeKind(d.pop("kind"))

        component = d.pop("component")

        centre = Point.from_dict(d.pop("centre"))

        low = Point.from_dict(d.pop("low"))

        high = Point.from_dict(d.pop("high"))

        area_m2 = d.pop("area_m2")

        confidence = d.pop("confidence")

        def _parse_density_change(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        density_change = _parse_density_change(d.pop("density_change", UNSET))

        def _parse_last_as_before(data: object) -> ChangeVisit | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                last_as_before_type_0 = ChangeVisit.from_dict(data)

                return last_as_before_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(ChangeVisit | None | Unset, data)

        last_as_before = _parse_last_as_before(d.pop("last_as_before", UNSET))

        def _parse_first_as_after(data: object) -> ChangeVisit | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                first_as_after_type_0 = ChangeVisit.from_dict(data)

                return first_as_after_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(ChangeVisit | None | Unset, data)

        first_as_after = _parse_first_as_after(d.pop("first_as_after", UNSET))

        change = cls(
            kind=kind,
            component=component,
            centre=centre,
            low=low,
            high=high,
            area_m2=area_m2,
            confidence=confidence,
            density_change=density_change,
            last_as_before=last_as_before,
            first_as_after=first_as_after,
        )

        change.additional_properties = d
        return change

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
