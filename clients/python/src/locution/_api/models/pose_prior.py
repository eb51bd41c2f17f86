from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="PosePrior")


@_attrs_define
class PosePrior:
    """A rough pose that a person or another system declares. It is weighed, not believed.

    Attributes:
        map_from_robot (Pose): A pose in the plane, equally a rigid transform.
        covariance (list[list[float]]): Covariance of (x, y, θ), row by row.
        component (int | Unset): The component of the map whose frame the pose is in.
    """

    map_from_robot: Pose
    covariance: list[list[float]]
    component: int | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        map_from_robot = self.map_from_robot.to_dict()

        covariance = []
        for covariance_item_data in self.covariance:
            covariance_item = covariance_item_data

            covariance.append(covariance_item)

        component = self.component

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "map_from_robot": map_from_robot,
                "covariance": covariance,
            }
        )
        if component is not UNSET:
            field_dict["component"] = component

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        map_from_robot = Pose.from_dict(d.pop("map_from_robot"))

        covariance = []
        _covariance = d.pop("covariance")
        for covariance_item_data in _covariance:
            covariance_item = cast(list[float], covariance_item_data)

            covariance.append(covariance_item)

        component = d.pop("component", UNSET)

        pose_prior = cls(
            map_from_robot=map_from_robot,
            covariance=covariance,
            component=component,
        )

        return pose_prior
