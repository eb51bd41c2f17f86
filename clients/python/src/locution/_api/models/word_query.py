from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.word_pattern import WordPattern


T = TypeVar("T", bound="WordQuery")


@_attrs_define
class WordQuery:
    """A sequence of words to look for, driven either way.

    Attributes:
        words (list[WordPattern]): In the order of driving.
        limit (int | None | Unset): Most places to answer; 20 unless said.
    """

    words: list[WordPattern]
    limit: int | None | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        words = []
        for words_item_data in self.words:
            words_item = words_item_data.to_dict()
            words.append(words_item)

        limit: int | None | Unset
        if isinstance(self.limit, Unset):
            limit = UNSET
        else:
            limit = self.limit

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "words": words,
            }
        )
        if limit is not UNSET:
            field_dict["limit"] = limit

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.word_pattern import WordPattern  # noqa: PLC0415

        d = dict(src_dict)
        words = []
        _words = d.pop("words")
        for words_item_data in _words:
            words_item = WordPattern.from_dict(words_item_data)

            words.append(words_item)

        def _parse_limit(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        limit = _parse_limit(d.pop("limit", UNSET))

        word_query = cls(
            words=words,
            limit=limit,
        )

        return word_query
