from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.event_type_4_event import EventType4Event

T = TypeVar("T", bound="EventType4")


@_attrs_define
class EventType4:
    """What matches the version has that serves now.

    Attributes:
        version (int): Its number.
        num_matches (int): Matches, whatever became of them.
        num_verified (int): Matches that hold the map together.
        event (EventType4Event):
    """

    version: int
    num_matches: int
    num_verified: int
    event: EventType4Event
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        version = self.version

        num_matches = self.num_matches

        num_verified = self.num_verified

        event = self.event.value

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "version": version,
                "num_matches": num_matches,
                "num_verified": num_verified,
                "event": event,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        version = d.pop("version")

        num_matches = d.pop("num_matches")

        num_verified = d.pop("num_verified")

        event = EventType4Event(d.pop("event"))

        event_type_4 = cls(
            version=version,
            num_matches=num_matches,
            num_verified=num_verified,
            event=event,
        )

        event_type_4.additional_properties = d
        return event_type_4

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
