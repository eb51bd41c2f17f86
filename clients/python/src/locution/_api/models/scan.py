from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Scan")


@_attrs_define
class Scan:
    """One sweep with the odometry at its time.

    Attributes:
        timestamp_ns (int): As the robot's clock said, nanoseconds; stored and served, never used to sort. Example:
            1763800000000000000.
        ranges_m (list[float | None]): Readings in metres; one without a return is null in JSON, null, NaN or ∞ in CBOR,
            and NaN here.

            CBOR may also carry them as a typed array of RFC 8746 (tags 81, 82, 85, 86), or as one byte string of 32-bit
            floats,
            little endian, which is the quickest to read. Example: [2.31, 2.29, None].
        odom_from_robot (None | Pose | Unset):
        angular_velocity_rad_per_s (float | None | Unset): How fast the robot turned then by a gyroscope, counter-
            clockwise; it helps where odometry and laser are in doubt. Example: 0.35.
    """

    timestamp_ns: int
    ranges_m: list[float | None]
    odom_from_robot: None | Pose | Unset = UNSET
    angular_velocity_rad_per_s: float | None | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        from ..models.pose import Pose  # noqa: PLC0415

        timestamp_ns = self.timestamp_ns

        ranges_m = []
        for componentsschemas_ranges_item_data in self.ranges_m:
            componentsschemas_ranges_item: float | None
            componentsschemas_ranges_item = componentsschemas_ranges_item_data
            ranges_m.append(componentsschemas_ranges_item)

        odom_from_robot: dict[str, Any] | None | Unset
        if isinstance(self.odom_from_robot, Unset):
            odom_from_robot = UNSET
        elif isinstance(self.odom_from_robot, Pose):
            odom_from_robot = self.odom_from_robot.to_dict()
        else:
            odom_from_robot = self.odom_from_robot

        angular_velocity_rad_per_s: float | None | Unset
        if isinstance(self.angular_velocity_rad_per_s, Unset):
            angular_velocity_rad_per_s = UNSET
        else:
            angular_velocity_rad_per_s = self.angular_velocity_rad_per_s

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "timestamp_ns": timestamp_ns,
                "ranges_m": ranges_m,
            }
        )
        if odom_from_robot is not UNSET:
            field_dict["odom_from_robot"] = odom_from_robot
        if angular_velocity_rad_per_s is not UNSET:
            field_dict["angular_velocity_rad_per_s"] = angular_velocity_rad_per_s

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        timestamp_ns = d.pop("timestamp_ns")

        ranges_m = []
        _ranges_m = d.pop("ranges_m")
        for componentsschemas_ranges_item_data in _ranges_m:

            def _parse_componentsschemas_ranges_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            componentsschemas_ranges_item = _parse_componentsschemas_ranges_item(componentsschemas_ranges_item_data)

            ranges_m.append(componentsschemas_ranges_item)

        def _parse_odom_from_robot(data: object) -> None | Pose | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                odom_from_robot_type_0 = Pose.from_dict(data)

                return odom_from_robot_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | Pose | Unset, data)

        odom_from_robot = _parse_odom_from_robot(d.pop("odom_from_robot", UNSET))

        def _parse_angular_velocity_rad_per_s(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        angular_velocity_rad_per_s = _parse_angular_velocity_rad_per_s(d.pop("angular_velocity_rad_per_s", UNSET))

        scan = cls(
            timestamp_ns=timestamp_ns,
            ranges_m=ranges_m,
            odom_from_robot=odom_from_robot,
            angular_velocity_rad_per_s=angular_velocity_rad_per_s,
        )

        return scan
