from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.event_type_0_event import EventType0Event
from ..models.run_change import RunChange

T = TypeVar("T", bound="EventType0")


@_attrs_define
class EventType0:
    """A run was made, finished or deleted.

    Attributes:
        run (str): Its name.
        change (RunChange): What became of a run.
        event (EventType0Event):
    """

    run: str
    change: RunChange
    event: EventType0Event
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        run = self.run

        change = self.change.value

        event = self.event.value

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "run": run,
                "change": change,
                "event": event,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        run = d.pop("run")

        change = RunChange(d.pop("change"))

        event = EventType0Event(d.pop("event"))

        event_type_0 = cls(
            run=run,
            change=change,
            event=event,
        )

        event_type_0.additional_properties = d
        return event_type_0

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
