from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Region")


@_attrs_define
class Region:
    """A stretch of driving with one density class: a word, placed in the map.

    Attributes:
        component (int): Component.
        run (str): The run that drove it.
        word (int): Number of the word of level 0.
        class_ (int): Density class.
        length_m (float): Metres along it.
        turn_rad (float): Radians turned in it.
        map_from_middle (Pose): A pose in the plane, equally a rigid transform.
    """

    component: int
    run: str
    word: int
    class_: int
    length_m: float
    turn_rad: float
    map_from_middle: Pose
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        component = self.component

        run = self.run

        word = self.word

        class_ = self.class_

        length_m = self.length_m

        turn_rad = self.turn_rad

        map_from_middle = self.map_from_middle.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "component": component,
                "run": run,
                "word": word,
                "class": class_,
                "length_m": length_m,
                "turn_rad": turn_rad,
                "map_from_middle": map_from_middle,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        component = d.pop("component")

        run = d.pop("run")

        word = d.pop("word")

        class_ = d.pop("class")

        length_m = d.pop("length_m")

        turn_rad = d.pop("turn_rad")

        map_from_middle = Pose.from_dict(d.pop("map_from_middle"))

        region = cls(
            component=component,
            run=run,
            word=word,
            class_=class_,
            length_m=length_m,
            turn_rad=turn_rad,
            map_from_middle=map_from_middle,
        )

        region.additional_properties = d
        return region

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
