from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.event_type_1_event import EventType1Event

T = TypeVar("T", bound="EventType1")


@_attrs_define
class EventType1:
    """Scans were stored and became text.

    Attributes:
        run (str): The run.
        next_sequence (int): The sequence number that it expects next.
        num_observations (int): Observations of the run.
        num_words (int): Words of all levels of the run.
        event (EventType1Event):
    """

    run: str
    next_sequence: int
    num_observations: int
    num_words: int
    event: EventType1Event
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        run = self.run

        next_sequence = self.next_sequence

        num_observations = self.num_observations

        num_words = self.num_words

        event = self.event.value

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "run": run,
                "next_sequence": next_sequence,
                "num_observations": num_observations,
                "num_words": num_words,
                "event": event,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        run = d.pop("run")

        next_sequence = d.pop("next_sequence")

        num_observations = d.pop("num_observations")

        num_words = d.pop("num_words")

        event = EventType1Event(d.pop("event"))

        event_type_1 = cls(
            run=run,
            next_sequence=next_sequence,
            num_observations=num_observations,
            num_words=num_words,
            event=event,
        )

        event_type_1.additional_properties = d
        return event_type_1

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
