from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.stamped_pose import StampedPose


T = TypeVar("T", bound="Trajectory")


@_attrs_define
class Trajectory:
    """Poses of one run.

    Attributes:
        poses (list[StampedPose]): One for every scan that was asked for, in order; of a run that was cut, in the map
            frame, for those of the pieces
            that lie in the component.
        component (int | None | Unset): Component of the map that the poses belong to; null outside the map frame.
        next_cursor (None | str | Unset): Where the next ones begin, when fewer were wanted than there are; null at the
            end.
    """

    poses: list[StampedPose]
    component: int | None | Unset = UNSET
    next_cursor: None | str | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        poses = []
        for poses_item_data in self.poses:
            poses_item = poses_item_data.to_dict()
            poses.append(poses_item)

        component: int | None | Unset
        if isinstance(self.component, Unset):
            component = UNSET
        else:
            component = self.component

        next_cursor: None | str | Unset
        if isinstance(self.next_cursor, Unset):
            next_cursor = UNSET
        else:
            next_cursor = self.next_cursor

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "poses": poses,
            }
        )
        if component is not UNSET:
            field_dict["component"] = component
        if next_cursor is not UNSET:
            field_dict["next_cursor"] = next_cursor

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.stamped_pose import StampedPose  # noqa: PLC0415

        d = dict(src_dict)
        poses = []
        _poses = d.pop("poses")
        for poses_item_data in _poses:
            poses_item = StampedPose.from_dict(poses_item_data)

            poses.append(poses_item)

        def _parse_component(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        component = _parse_component(d.pop("component", UNSET))

        def _parse_next_cursor(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        next_cursor = _parse_next_cursor(d.pop("next_cursor", UNSET))

        trajectory = cls(
            poses=poses,
            component=component,
            next_cursor=next_cursor,
        )

        trajectory.additional_properties = d
        return trajectory

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
