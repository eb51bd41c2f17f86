from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Registration")


@_attrs_define
class Registration:
    """How one submap lies on the other.

    Attributes:
        earlier_keyframe (int): Number of the keyframe of the earlier run.
        later_keyframe (int): Number of the keyframe of the later run.
        earlier_from_later (Pose): A pose in the plane, equally a rigid transform.
        covariance (list[list[float]]): Covariance of (x, y, θ), row by row.
        agreement (float): Share of what both saw that agrees, from 0 to 1.
    """

    earlier_keyframe: int
    later_keyframe: int
    earlier_from_later: Pose
    covariance: list[list[float]]
    agreement: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        earlier_keyframe = self.earlier_keyframe

        later_keyframe = self.later_keyframe

        earlier_from_later = self.earlier_from_later.to_dict()

        covariance = []
        for covariance_item_data in self.covariance:
            covariance_item = covariance_item_data

            covariance.append(covariance_item)

        agreement = self.agreement

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "earlier_keyframe": earlier_keyframe,
                "later_keyframe": later_keyframe,
                "earlier_from_later": earlier_from_later,
                "covariance": covariance,
                "agreement": agreement,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        earlier_keyframe = d.pop("earlier_keyframe")

        later_keyframe = d.pop("later_keyframe")

        earlier_from_later = Pose.from_dict(d.pop("earlier_from_later"))

        covariance = []
        _covariance = d.pop("covariance")
        for covariance_item_data in _covariance:
            covariance_item = cast(list[float], covariance_item_data)

            covariance.append(covariance_item)

        agreement = d.pop("agreement")

        registration = cls(
            earlier_keyframe=earlier_keyframe,
            later_keyframe=later_keyframe,
            earlier_from_later=earlier_from_later,
            covariance=covariance,
            agreement=agreement,
        )

        registration.additional_properties = d
        return registration

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
