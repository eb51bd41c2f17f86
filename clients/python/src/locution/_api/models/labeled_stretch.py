from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.place_label import PlaceLabel

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Label")


@_attrs_define
class Label:
    """A stretch of driving through places of one label.

    Attributes:
        run (str): The run that drove it.
        component (int): Component of the map.
        label (PlaceLabel): What kind of place it is.
        first (int): First observation, inclusive.
        last (int): Last observation, inclusive.
        first_timestamp_ns (int): Timestamp of the first, nanoseconds.
        last_timestamp_ns (int): Timestamp of the last, nanoseconds.
        length_m (float): Metres along it.
        turn_rad (float): Radians turned in it, left positive.
        confidence (float): Share of what was seen that agrees with the label, from 0 to 1.
        map_from_middle (Pose): A pose in the plane, equally a rigid transform.
    """

    run: str
    component: int
    label: PlaceLabel
    first: int
    last: int
    first_timestamp_ns: int
    last_timestamp_ns: int
    length_m: float
    turn_rad: float
    confidence: float
    map_from_middle: Pose
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        run = self.run

        component = self.component

        label = self.label.value

        first = self.first

        last = self.last

        first_timestamp_ns = self.first_timestamp_ns

        last_timestamp_ns = self.last_timestamp_ns

        length_m = self.length_m

        turn_rad = self.turn_rad

        confidence = self.confidence

        map_from_middle = self.map_from_middle.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "run": run,
                "component": component,
                "label": label,
                "first": first,
                "last": last,
                "first_timestamp_ns": first_timestamp_ns,
                "last_timestamp_ns": last_timestamp_ns,
                "length_m": length_m,
                "turn_rad": turn_rad,
                "confidence": confidence,
                "map_from_middle": map_from_middle,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        run = d.pop("run")

        component = d.pop("component")

        label = PlaceLabel(d.pop("label"))

        first = d.pop("first")

        last = d.pop("last")

        first_timestamp_ns = d.pop("first_timestamp_ns")

        last_timestamp_ns = d.pop("last_timestamp_ns")

        length_m = d.pop("length_m")

        turn_rad = d.pop("turn_rad")

        confidence = d.pop("confidence")

        map_from_middle = Pose.from_dict(d.pop("map_from_middle"))

        labeled_stretch = cls(
            run=run,
            component=component,
            label=label,
            first=first,
            last=last,
            first_timestamp_ns=first_timestamp_ns,
            last_timestamp_ns=last_timestamp_ns,
            length_m=length_m,
            turn_rad=turn_rad,
            confidence=confidence,
            map_from_middle=map_from_middle,
        )

        labeled_stretch.additional_properties = d
        return labeled_stretch

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
