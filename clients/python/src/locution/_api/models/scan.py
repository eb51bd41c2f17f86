from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Scan")


@_attrs_define
class Scan:
    """One sweep with the odometry at its time.

    Attributes:
        timestamp_ns (int): As the robot's clock said, nanoseconds; stored and served, never used to sort. Example:
            1763800000000000000.
        odom_from_robot (Pose): A pose in the plane, equally a rigid transform.
        ranges_m (list[float | None]): Readings in metres; one without a return is null in JSON, null, NaN or ∞ in CBOR,
            and NaN here.

            CBOR may also carry them as a typed array of RFC 8746 (tags 81, 82, 85, 86), or as one byte string of 32-bit
            floats,
            little endian, which is the quickest to read. Example: [2.31, 2.29, None].
    """

    timestamp_ns: int
    odom_from_robot: Pose
    ranges_m: list[float | None]

    def to_dict(self) -> dict[str, Any]:
        timestamp_ns = self.timestamp_ns

        odom_from_robot = self.odom_from_robot.to_dict()

        ranges_m = []
        for componentsschemas_ranges_item_data in self.ranges_m:
            componentsschemas_ranges_item: float | None
            componentsschemas_ranges_item = componentsschemas_ranges_item_data
            ranges_m.append(componentsschemas_ranges_item)

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "timestamp_ns": timestamp_ns,
                "odom_from_robot": odom_from_robot,
                "ranges_m": ranges_m,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        timestamp_ns = d.pop("timestamp_ns")

        odom_from_robot = Pose.from_dict(d.pop("odom_from_robot"))

        ranges_m = []
        _ranges_m = d.pop("ranges_m")
        for componentsschemas_ranges_item_data in _ranges_m:

            def _parse_componentsschemas_ranges_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            componentsschemas_ranges_item = _parse_componentsschemas_ranges_item(componentsschemas_ranges_item_data)

            ranges_m.append(componentsschemas_ranges_item)

        scan = cls(
            timestamp_ns=timestamp_ns,
            odom_from_robot=odom_from_robot,
            ranges_m=ranges_m,
        )

        return scan
