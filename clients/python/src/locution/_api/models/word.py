from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.word_id import WordId


T = TypeVar("T", bound="Word")


@_attrs_define
class Word:
    """A word ⟨d, s, a⟩.

    Attributes:
        id (WordId): Names a word of a run.
        class_ (int): d: density class.
        size (int): s: number of observations.
        turn_rad (float): a: turn, radians.
        observations (list[int]): First and last observation, both inclusive.
        predecessors (list[WordId]): Words that may stand before it.
    """

    id: WordId
    class_: int
    size: int
    turn_rad: float
    observations: list[int]
    predecessors: list[WordId]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        id = self.id.to_dict()

        class_ = self.class_

        size = self.size

        turn_rad = self.turn_rad

        observations = self.observations

        predecessors = []
        for predecessors_item_data in self.predecessors:
            predecessors_item = predecessors_item_data.to_dict()
            predecessors.append(predecessors_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "id": id,
                "class": class_,
                "size": size,
                "turn_rad": turn_rad,
                "observations": observations,
                "predecessors": predecessors,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.word_id import WordId  # noqa: PLC0415

        d = dict(src_dict)
        id = WordId.from_dict(d.pop("id"))

        class_ = d.pop("class")

        size = d.pop("size")

        turn_rad = d.pop("turn_rad")

        observations = cast(list[int], d.pop("observations"))

        predecessors = []
        _predecessors = d.pop("predecessors")
        for predecessors_item_data in _predecessors:
            predecessors_item = WordId.from_dict(predecessors_item_data)

            predecessors.append(predecessors_item)

        word = cls(
            id=id,
            class_=class_,
            size=size,
            turn_rad=turn_rad,
            observations=observations,
            predecessors=predecessors,
        )

        word.additional_properties = d
        return word

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
