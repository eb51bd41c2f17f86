from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.direction import Direction

if TYPE_CHECKING:
    from ..models.example_evidence import ExampleEvidence
    from ..models.pose import Pose


T = TypeVar("T", bound="ExamplePlace")


@_attrs_define
class ExamplePlace:
    """A place where an example may end.

    Attributes:
        component (int): The component of the map whose frame the pose is in.
        map_from_robot (Pose): A pose in the plane, equally a rigid transform.
        covariance (list[list[float]]): Covariance of (x, y, θ), row by row; long along a plain corridor.
        probability (float): Probability, over all sites asked; what is missing to 1 is that of being elsewhere.
        run (str): The run whose stretch reads like the example.
        observations (list[int]): First and last observation of that stretch.
        direction (Direction): Which way a place was driven, compared with another pass through it.
        evidence (ExampleEvidence): What speaks for and against a place, by the stage that found it.
    """

    component: int
    map_from_robot: Pose
    covariance: list[list[float]]
    probability: float
    run: str
    observations: list[int]
    direction: Direction
    evidence: ExampleEvidence
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        component = self.component

        map_from_robot = self.map_from_robot.to_dict()

        covariance = []
        for covariance_item_data in self.covariance:
            covariance_item = covariance_item_data

            covariance.append(covariance_item)

        probability = self.probability

        run = self.run

        observations = self.observations

        direction = self.direction.value

        evidence = self.evidence.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "component": component,
                "map_from_robot": map_from_robot,
                "covariance": covariance,
                "probability": probability,
                "run": run,
                "observations": observations,
                "direction": direction,
                "evidence": evidence,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.example_evidence import ExampleEvidence  # noqa: PLC0415
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

        run = d.pop("run")

        observations = cast(list[int], d.pop("observations"))

        direction = Direction(d.pop("direction"))

        evidence = ExampleEvidence.from_dict(d.pop("evidence"))

        example_place = cls(
            component=component,
            map_from_robot=map_from_robot,
            covariance=covariance,
            probability=probability,
            run=run,
            observations=observations,
            direction=direction,
            evidence=evidence,
        )

        example_place.additional_properties = d
        return example_place

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
