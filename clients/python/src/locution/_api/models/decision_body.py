from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define

from ..models.decision_kind import DecisionKind

T = TypeVar("T", bound="Decision")


@_attrs_define
class Decision:
    """Says of a match whether it is right.

    Attributes:
        decision (DecisionKind): What a person said of a pair of places.
    """

    decision: DecisionKind

    def to_dict(self) -> dict[str, Any]:
        decision = self.decision.value

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "decision": decision,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        decision = DecisionKind(d.pop("decision"))

        decision_body = cls(
            decision=decision,
        )

        return decision_body
