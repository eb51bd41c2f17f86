from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

T = TypeVar("T", bound="WordPattern")


@_attrs_define
class WordPattern:
    """One word of a question; what is left out may be anything.

    Attributes:
        class_ (int | None | Unset): d: density class. Example: 3.
        size (int | None | Unset): s: number of observations. Example: 24.
        size_tolerance (float | None | Unset): How far the size may be off, as a share of the larger; 0.25 unless said.
        turn_rad (float | None | Unset): a: turn, radians. Example: 1.57.
        turn_tolerance_rad (float | None | Unset): How far the turn may be off, radians; 30 degrees unless said.
    """

    class_: int | None | Unset = UNSET
    size: int | None | Unset = UNSET
    size_tolerance: float | None | Unset = UNSET
    turn_rad: float | None | Unset = UNSET
    turn_tolerance_rad: float | None | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        class_: int | None | Unset
        if isinstance(self.class_, Unset):
            class_ = UNSET
        else:
            class_ = self.class_

        size: int | None | Unset
        if isinstance(self.size, Unset):
            size = UNSET
        else:
            size = self.size

        size_tolerance: float | None | Unset
        if isinstance(self.size_tolerance, Unset):
            size_tolerance = UNSET
        else:
            size_tolerance = self.size_tolerance

        turn_rad: float | None | Unset
        if isinstance(self.turn_rad, Unset):
            turn_rad = UNSET
        else:
            turn_rad = self.turn_rad

        turn_tolerance_rad: float | None | Unset
        if isinstance(self.turn_tolerance_rad, Unset):
            turn_tolerance_rad = UNSET
        else:
            turn_tolerance_rad = self.turn_tolerance_rad

        field_dict: dict[str, Any] = {}

        field_dict.update({})
        if class_ is not UNSET:
            field_dict["class"] = class_
        if size is not UNSET:
            field_dict["size"] = size
        if size_tolerance is not UNSET:
            field_dict["size_tolerance"] = size_tolerance
        if turn_rad is not UNSET:
            field_dict["turn_rad"] = turn_rad
        if turn_tolerance_rad is not UNSET:
            field_dict["turn_tolerance_rad"] = turn_tolerance_rad

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)

        def _parse_class_(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        class_ = _parse_class_(d.pop("class", UNSET))

        def _parse_size(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        size = _parse_size(d.pop("size", UNSET))

        def _parse_size_tolerance(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        size_tolerance = _parse_size_tolerance(d.pop("size_tolerance", UNSET))

        def _parse_turn_rad(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        turn_rad = _parse_turn_rad(d.pop("turn_rad", UNSET))

        def _parse_turn_tolerance_rad(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        turn_tolerance_rad = _parse_turn_tolerance_rad(d.pop("turn_tolerance_rad", UNSET))

        word_pattern = cls(
            class_=class_,
            size=size,
            size_tolerance=size_tolerance,
            turn_rad=turn_rad,
            turn_tolerance_rad=turn_tolerance_rad,
        )

        return word_pattern
