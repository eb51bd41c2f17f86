from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.event_type_5_event import EventType5Event
from ..models.localization_state import LocalizationState

T = TypeVar("T", bound="EventType5")


@_attrs_define
class EventType5:
    """A robot that localises was found or lost.

    Attributes:
        id (str): Name of the localisation.
        state (LocalizationState): How sure an answer is.
        event (EventType5Event):
    """

    id: str
    state: LocalizationState
    event: EventType5Event
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        id = self.id

        state = self.state.value

        event = self.event.value

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "id": id,
                "state": state,
                "event": event,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        id = d.pop("id")

        state = LocalizationState(d.pop("state"))

        event = EventType5Event(d.pop("event"))

        event_type_5 = cls(
            id=id,
            state=state,
            event=event,
        )

        event_type_5.additional_properties = d
        return event_type_5

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
