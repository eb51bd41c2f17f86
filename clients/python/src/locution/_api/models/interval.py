from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Interval")


@_attrs_define
class Interval:
    """A stretch of driving.

    Attributes:
        run (str): Name of the run.
        first (int): First observation, inclusive.
        last (int): Last observation, inclusive.
        first_timestamp_ns (int | None | Unset): Timestamp of the first, nanoseconds; null in map versions of earlier
            programs, as what follows.
        last_timestamp_ns (int | None | Unset): Timestamp of the last, nanoseconds.
        component (int | None | Unset): Component of the map.
        map_from_middle (None | Pose | Unset):
    """

    run: str
    first: int
    last: int
    first_timestamp_ns: int | None | Unset = UNSET
    last_timestamp_ns: int | None | Unset = UNSET
    component: int | None | Unset = UNSET
    map_from_middle: None | Pose | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.pose import Pose  # noqa: PLC0415

        run = self.run

        first = self.first

        last = self.last

        first_timestamp_ns: int | None | Unset
        if isinstance(self.first_timestamp_ns, Unset):
            first_timestamp_ns = UNSET
        else:
            first_timestamp_ns = self.first_timestamp_ns

        last_timestamp_ns: int | None | Unset
        if isinstance(self.last_timestamp_ns, Unset):
            last_timestamp_ns = UNSET
        else:
            last_timestamp_ns = self.last_timestamp_ns

        component: int | None | Unset
        if isinstance(self.component, Unset):
            component = UNSET
        else:
            component = self.component

        map_from_middle: dict[str, Any] | None | Unset
        if isinstance(self.map_from_middle, Unset):
            map_from_middle = UNSET
        elif isinstance(self.map_from_middle, Pose):
            map_from_middle = self.map_from_middle.to_dict()
        else:
            map_from_middle = self.map_from_middle

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "run": run,
                "first": first,
                "last": last,
            }
        )
        if first_timestamp_ns is not UNSET:
            field_dict["first_timestamp_ns"] = first_timestamp_ns
        if last_timestamp_ns is not UNSET:
            field_dict["last_timestamp_ns"] = last_timestamp_ns
        if component is not UNSET:
            field_dict["component"] = component
        if map_from_middle is not UNSET:
            field_dict["map_from_middle"] = map_from_middle

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        run = d.pop("run")

        first = d.pop("first")

        last = d.pop("last")

        def _parse_first_timestamp_ns(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        first_timestamp_ns = _parse_first_timestamp_ns(d.pop("first_timestamp_ns", UNSET))

        def _parse_last_timestamp_ns(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        last_timestamp_ns = _parse_last_timestamp_ns(d.pop("last_timestamp_ns", UNSET))

        def _parse_component(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        component = _parse_component(d.pop("component", UNSET))

        def _parse_map_from_middle(data: object) -> None | Pose | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                map_from_middle_type_0 = Pose.from_dict(data)

                return map_from_middle_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | Pose | Unset, data)

        map_from_middle = _parse_map_from_middle(d.pop("map_from_middle", UNSET))

        interval = cls(
            run=run,
            first=first,
            last=last,
            first_timestamp_ns=first_timestamp_ns,
            last_timestamp_ns=last_timestamp_ns,
            component=component,
            map_from_middle=map_from_middle,
        )

        interval.additional_properties = d
        return interval

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
