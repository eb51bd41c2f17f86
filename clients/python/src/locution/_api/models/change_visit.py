from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="ChangeVisit")


@_attrs_define
class ChangeVisit:
    """A visit that saw a changed area.

    Attributes:
        run (str): The run.
        timestamp_ns (int): When the visit ended, if it saw the area as it was; when it began, if it saw it as it is.
    """

    run: str
    timestamp_ns: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        run = self.run

        timestamp_ns = self.timestamp_ns

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "run": run,
                "timestamp_ns": timestamp_ns,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        run = d.pop("run")

        timestamp_ns = d.pop("timestamp_ns")

        change_visit = cls(
            run=run,
            timestamp_ns=timestamp_ns,
        )

        change_visit.additional_properties = d
        return change_visit

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
