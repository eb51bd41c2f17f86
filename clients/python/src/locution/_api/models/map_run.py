from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.keyframe_pose import KeyframePose


T = TypeVar("T", bound="MapRun")


@_attrs_define
class MapRun:
    """A run in the map; one that was cut is several, piece after piece.

    Attributes:
        run (str): Its name.
        component (int): The component whose frame the poses are in.
        num_scans (int): Scans it had when the map was built.
        length_m (float): Metres driven.
        poses (list[KeyframePose]): Poses of its keyframes.
        first_scan (int | Unset): Sequence number of its first scan: 0 but for later pieces of a run that was cut.
    """

    run: str
    component: int
    num_scans: int
    length_m: float
    poses: list[KeyframePose]
    first_scan: int | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        run = self.run

        component = self.component

        num_scans = self.num_scans

        length_m = self.length_m

        poses = []
        for poses_item_data in self.poses:
            poses_item = poses_item_data.to_dict()
            poses.append(poses_item)

        first_scan = self.first_scan

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "run": run,
                "component": component,
                "num_scans": num_scans,
                "length_m": length_m,
                "poses": poses,
            }
        )
        if first_scan is not UNSET:
            field_dict["first_scan"] = first_scan

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.keyframe_pose import KeyframePose  # noqa: PLC0415

        d = dict(src_dict)
        run = d.pop("run")

        component = d.pop("component")

        num_scans = d.pop("num_scans")

        length_m = d.pop("length_m")

        poses = []
        _poses = d.pop("poses")
        for poses_item_data in _poses:
            poses_item = KeyframePose.from_dict(poses_item_data)

            poses.append(poses_item)

        first_scan = d.pop("first_scan", UNSET)

        map_run = cls(
            run=run,
            component=component,
            num_scans=num_scans,
            length_m=length_m,
            poses=poses,
            first_scan=first_scan,
        )

        map_run.additional_properties = d
        return map_run

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
