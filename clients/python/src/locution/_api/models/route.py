from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.point import Point
    from ..models.route_step import RouteStep


T = TypeVar("T", bound="Route")


@_attrs_define
class Route:
    """A way from one position to another.

    Attributes:
        length_m (float): Metres.
        description (str): The way in one sentence.
        steps (list[RouteStep]): Places on the way.
        points (list[Point]): Positions on the way.
    """

    length_m: float
    description: str
    steps: list[RouteStep]
    points: list[Point]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        length_m = self.length_m

        description = self.description

        steps = []
        for steps_item_data in self.steps:
            steps_item = steps_item_data.to_dict()
            steps.append(steps_item)

        points = []
        for points_item_data in self.points:
            points_item = points_item_data.to_dict()
            points.append(points_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "length_m": length_m,
                "description": description,
                "steps": steps,
                "points": points,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.point import Point  # noqa: PLC0415
        from ..models.route_step import RouteStep  # noqa: PLC0415

        d = dict(src_dict)
        length_m = d.pop("length_m")

        description = d.pop("description")

        steps = []
        _steps = d.pop("steps")
        for steps_item_data in _steps:
            steps_item = RouteStep.from_dict(steps_item_data)

            steps.append(steps_item)

        points = []
        _points = d.pop("points")
        for points_item_data in _points:
            points_item = Point.from_dict(points_item_data)

            points.append(points_item)

        route = cls(
            length_m=length_m,
            description=description,
            steps=steps,
            points=points,
        )

        route.additional_properties = d
        return route

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
