from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.event_type_3_event import EventType3Event

T = TypeVar("T", bound="EventType3")


@_attrs_define
class EventType3:
    """Another version of the map serves.

    Attributes:
        version (int): Its number.
        num_components (int): Parts that nothing connects.
        event (EventType3Event):
    """

    version: int
    num_components: int
    event: EventType3Event
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        version = self.version

        num_components = self.num_components

        event = self.event.value

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "version": version,
                "num_components": num_components,
                "event": event,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        version = d.pop("version")

        num_components = d.pop("num_components")

        event = EventType3Event(d.pop("event"))

        event_type_3 = cls(
            version=version,
            num_components=num_components,
            event=event,
        )

        event_type_3.additional_properties = d
        return event_type_3

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
