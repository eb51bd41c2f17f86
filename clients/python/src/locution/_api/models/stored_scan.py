from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="StoredScan")


@_attrs_define
class StoredScan:
    """A stored scan.

    Attributes:
        scan_seq (int): Sequence number.
        timestamp_ns (int): As sent.
        odom_from_robot (Pose): A pose in the plane, equally a rigid transform.
        ranges_m (list[float | None]): Readings in metres; one without a return is null in JSON, null, NaN or ∞ in CBOR,
            and NaN here.

            CBOR may also carry them as a typed array of RFC 8746 (tags 81, 82, 85, 86), or as one byte string of 32-bit
            floats,
            little endian, which is the quickest to read. Example: [2.31, 2.29, None].
        angular_velocity_rad_per_s (float | None | Unset): As sent.
    """

    scan_seq: int
    timestamp_ns: int
    odom_from_robot: Pose
    ranges_m: list[float | None]
    angular_velocity_rad_per_s: float | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        scan_seq = self.scan_seq

        timestamp_ns = self.timestamp_ns

        odom_from_robot = self.odom_from_robot.to_dict()

        ranges_m = []
        for componentsschemas_ranges_item_data in self.ranges_m:
            componentsschemas_ranges_item: float | None
            componentsschemas_ranges_item = componentsschemas_ranges_item_data
            ranges_m.append(componentsschemas_ranges_item)

        angular_velocity_rad_per_s: float | None | Unset
        if isinstance(self.angular_velocity_rad_per_s, Unset):
            angular_velocity_rad_per_s = UNSET
        else:
            angular_velocity_rad_per_s = self.angular_velocity_rad_per_s

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "scan_seq": scan_seq,
                "timestamp_ns": timestamp_ns,
                "odom_from_robot": odom_from_robot,
                "ranges_m": ranges_m,
            }
        )
        if angular_velocity_rad_per_s is not UNSET:
            field_dict["angular_velocity_rad_per_s"] = angular_velocity_rad_per_s

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        scan_seq = d.pop("scan_seq")

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

        def _parse_angular_velocity_rad_per_s(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        angular_velocity_rad_per_s = _parse_angular_velocity_rad_per_s(d.pop("angular_velocity_rad_per_s", UNSET))

        stored_scan = cls(
            scan_seq=scan_seq,
            timestamp_ns=timestamp_ns,
            odom_from_robot=odom_from_robot,
            ranges_m=ranges_m,
            angular_velocity_rad_per_s=angular_velocity_rad_per_s,
        )

        stored_scan.additional_properties = d
        return stored_scan

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
