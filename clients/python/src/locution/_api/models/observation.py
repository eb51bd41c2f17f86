from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Observation")


@_attrs_define
class Observation:
    """A density sample.

    Attributes:
        observation (int): Its number in the run.
        scan_seq (int): Sequence number of the scan taken at this place.
        timestamp_ns (int): Timestamp of that scan, nanoseconds.
        travel_m (float): Distance driven since the run began, metres.
        odom_from_robot (Pose): A pose in the plane, equally a rigid transform.
        run_from_robot (Pose): A pose in the plane, equally a rigid transform.
        densities (list[float]): Density of each kernel, in [0, 1].
        is_hard (bool): Whether no opening of unknown cells was met.
        num_frontiers (int): Groups of free cells on the border of the kernel.
    """

    observation: int
    scan_seq: int
    timestamp_ns: int
    travel_m: float
    odom_from_robot: Pose
    run_from_robot: Pose
    densities: list[float]
    is_hard: bool
    num_frontiers: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        observation = self.observation

        scan_seq = self.scan_seq

        timestamp_ns = self.timestamp_ns

        travel_m = self.travel_m

        odom_from_robot = self.odom_from_robot.to_dict()

        run_from_robot = self.run_from_robot.to_dict()

        densities = self.densities

        is_hard = self.is_hard

        num_frontiers = self.num_frontiers

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "observation": observation,
                "scan_seq": scan_seq,
                "timestamp_ns": timestamp_ns,
                "travel_m": travel_m,
                "odom_from_robot": odom_from_robot,
                "run_from_robot": run_from_robot,
                "densities": densities,
                "is_hard": is_hard,
                "num_frontiers": num_frontiers,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        observation = d.pop("observation")

        scan_seq = d.pop("scan_seq")

        timestamp_ns = d.pop("timestamp_ns")

        travel_m = d.pop("travel_m")

        odom_from_robot = Pose.from_dict(d.pop("odom_from_robot"))

        run_from_robot = Pose.from_dict(d.pop("run_from_robot"))

        densities = cast(list[float], d.pop("densities"))

        is_hard = d.pop("is_hard")

        num_frontiers = d.pop("num_frontiers")

        observation = cls(
            observation=observation,
            scan_seq=scan_seq,
            timestamp_ns=timestamp_ns,
            travel_m=travel_m,
            odom_from_robot=odom_from_robot,
            run_from_robot=run_from_robot,
            densities=densities,
            is_hard=is_hard,
            num_frontiers=num_frontiers,
        )

        observation.additional_properties = d
        return observation

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
