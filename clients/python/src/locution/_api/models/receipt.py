from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

T = TypeVar("T", bound="Receipt")


@_attrs_define
class Receipt:
    """The answer to an accepted batch, also when it is repeated.

    Attributes:
        next_sequence (int): The sequence number to send next.
        num_observations (int): Observations of the run after this batch.
        num_words (int): Words of all levels of the run after this batch.
    """

    next_sequence: int
    num_observations: int
    num_words: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        next_sequence = self.next_sequence

        num_observations = self.num_observations

        num_words = self.num_words

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "next_sequence": next_sequence,
                "num_observations": num_observations,
                "num_words": num_words,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        next_sequence = d.pop("next_sequence")

        num_observations = d.pop("num_observations")

        num_words = d.pop("num_words")

        receipt = cls(
            next_sequence=next_sequence,
            num_observations=num_observations,
            num_words=num_words,
        )

        receipt.additional_properties = d
        return receipt

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
