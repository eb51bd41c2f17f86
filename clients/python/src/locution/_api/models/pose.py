from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define

T = TypeVar("T", bound="Pose")


@_attrs_define
class Pose:
    """A pose in the plane, equally a rigid transform.

    Attributes:
        x (float): Metres. Example: 1.25.
        y (float): Metres. Example: -0.4.
        theta (float): Heading in radians, counter-clockwise. Example: 1.5708.
    """

    x: float
    y: float
    theta: float

    def to_dict(self) -> dict[str, Any]:
        x = self.x

        y = self.y

        theta = self.theta

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "x": x,
                "y": y,
                "theta": theta,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        x = d.pop("x")

        y = d.pop("y")

        theta = d.pop("theta")

        pose = cls(
            x=x,
            y=y,
            theta=theta,
        )

        return pose
