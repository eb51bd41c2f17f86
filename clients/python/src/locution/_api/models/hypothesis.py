from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Hypothesis")


@_attrs_define
class Hypothesis:
    """A place where the robot may be.

    Attributes:
        component (int): The component of the map whose frame the pose is in.
        map_from_robot (Pose): A pose in the plane, equally a rigid transform.
        covariance (list[list[float]]): Covariance of (x, y, θ), row by row.
        probability (float): Probability; what is missing to 1 is that of being elsewhere.
    """

    component: int
    map_from_robot: Pose
    covariance: list[list[float]]
    probability: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        component = self.component

        map_from_robot = self.map_from_robot.to_dict()

        covariance = []
        for covariance_item_data in self.covariance:
            covariance_item = covariance_item_data

            covariance.append(covariance_item)

        probability = self.probability

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "component": component,
                "map_from_robot": map_from_robot,
                "covariance": covariance,
                "probability": probability,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        component = d.pop("component")

        map_from_robot = Pose.from_dict(d.pop("map_from_robot"))

        covariance = []
        _covariance = d.pop("covariance")
        for covariance_item_data in _covariance:
            covariance_item = cast(list[float], covariance_item_data)

            covariance.append(covariance_item)

        probability = d.pop("probability")

        hypothesis = cls(
            component=component,
            map_from_robot=map_from_robot,
            covariance=covariance,
            probability=probability,
        )

        hypothesis.additional_properties = d
        return hypothesis

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
