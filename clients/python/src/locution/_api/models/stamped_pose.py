from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="StampedPose")


@_attrs_define
class StampedPose:
    """A pose at the time of a scan.

    Attributes:
        scan_seq (int): Sequence number of the scan.
        timestamp_ns (int): Its timestamp, nanoseconds.
        x (float): Metres.
        y (float): Metres.
        theta (float): Radians.
    """

    scan_seq: int
    timestamp_ns: int
    x: float
    y: float
    theta: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        scan_seq = self.scan_seq

        timestamp_ns = self.timestamp_ns

        x = self.x

        y = self.y

        theta = self.theta

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "scan_seq": scan_seq,
                "timestamp_ns": timestamp_ns,
                "x": x,
                "y": y,
                "theta": theta,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        scan_seq = d.pop("scan_seq")

        timestamp_ns = d.pop("timestamp_ns")

        x = d.pop("x")

        y = d.pop("y")

        theta = d.pop("theta")

        stamped_pose = cls(
            scan_seq=scan_seq,
            timestamp_ns=timestamp_ns,
            x=x,
            y=y,
            theta=theta,
        )

        stamped_pose.additional_properties = d
        return stamped_pose

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
