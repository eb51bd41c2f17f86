from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define

from ..models.place_label import PlaceLabel
from ..models.turn import Turn
from ..types import UNSET, Unset

T = TypeVar("T", bound="LabelPattern")


@_attrs_define
class LabelPattern:
    """One part of a question.

    Attributes:
        label (PlaceLabel): What kind of place it is.
        length_min_m (float | Unset): Metres along it, at least. Example: 10.0.
        length_max_m (float | None | Unset): Metres along it, at most.
        turn (None | Turn | Unset):
    """

    label: PlaceLabel
    length_min_m: float | Unset = UNSET
    length_max_m: float | None | Unset = UNSET
    turn: None | Turn | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        label = self.label.value

        length_min_m = self.length_min_m

        length_max_m: float | None | Unset
        if isinstance(self.length_max_m, Unset):
            length_max_m = UNSET
        else:
            length_max_m = self.length_max_m

        turn: None | str | Unset
        if isinstance(self.turn, Unset):
            turn = UNSET
        elif isinstance(self.turn, Turn):
            turn = self.turn.value
        else:
            turn = self.turn

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "label": label,
            }
        )
        if length_min_m is not UNSET:
            field_dict["length_min_m"] = length_min_m
        if length_max_m is not UNSET:
            field_dict["length_max_m"] = length_max_m
        if turn is not UNSET:
            field_dict["turn"] = turn

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        label = PlaceLabel(d.pop("label"))

        length_min_m = d.pop("length_min_m", UNSET)

        def _parse_length_max_m(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        length_max_m = _parse_length_max_m(d.pop("length_max_m", UNSET))

        def _parse_turn(data: object) -> None | Turn | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, str):
                    raise TypeError()
                turn_type_0 = Turn(data)

                return turn_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | Turn | Unset, data)

        turn = _parse_turn(d.pop("turn", UNSET))

        label_pattern = cls(
            label=label,
            length_min_m=length_min_m,
            length_max_m=length_max_m,
            turn=turn,
        )

        return label_pattern
