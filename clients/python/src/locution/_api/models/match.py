from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.channel import Channel
from ..models.decision_kind import DecisionKind
from ..models.direction import Direction
from ..models.match_state import MatchState
from ..models.rejection_reason import RejectionReason
from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.evidence import Evidence
    from ..models.interval import Interval


T = TypeVar("T", bound="Match")


@_attrs_define
class Match:
    """The claim that two stretches of driving went through the same place.

    Attributes:
        id (str): Its name in this version of the map.
        earlier (Interval): A stretch of driving.
        later (Interval): A stretch of driving.
        direction (Direction): Which way a place was driven, compared with another pass through it.
        channel (Channel): What found a place.
        evidence (Evidence): What speaks for and against a match.
        probability (float): Probability that it is right, from 0 to 1.
        state (MatchState): What became of a match.
        reason (None | RejectionReason | Unset):
        decision (DecisionKind | None | Unset):
    """

    id: str
    earlier: Interval
    later: Interval
    direction: Direction
    channel: Channel
    evidence: Evidence
    probability: float
    state: MatchState
    reason: None | RejectionReason | Unset = UNSET
    decision: DecisionKind | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        id = self.id

        earlier = self.earlier.to_dict()

        later = self.later.to_dict()

        direction = self.direction.value

        channel = self.channel.value

        evidence = self.evidence.to_dict()

        probability = self.probability

        state = self.state.value

        reason: None | str | Unset
        if isinstance(self.reason, Unset):
            reason = UNSET
        elif isinstance(self.reason, RejectionReason):
            reason = self.reason.value
        else:
            reason = self.reason

        decision: None | str | Unset
        if isinstance(self.decision, Unset):
            decision = UNSET
        elif isinstance(self.decision, DecisionKind):
            decision = self.decision.value
        else:
            decision = self.decision

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "id": id,
                "earlier": earlier,
                "later": later,
                "direction": direction,
                "channel": channel,
                "evidence": evidence,
                "probability": probability,
                "state": state,
            }
        )
        if reason is not UNSET:
            field_dict["reason"] = reason
        if decision is not UNSET:
            field_dict["decision"] = decision

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.evidence import Evidence  # noqa: PLC0415
        from ..models.interval import Interval  # noqa: PLC0415

        d = dict(src_dict)
        id = d.pop("id")

        earlier = Interval.from_dict(d.pop("earlier"))

        later = Interval.from_dict(d.pop("later"))

        direction = Direction(d.pop("direction"))

        channel = Channel(d.pop("channel"))

        evidence = Evidence.from_dict(d.pop("evidence"))

        probability = d.pop("probability")

        state = MatchState(d.pop("state"))

        def _parse_reason(data: object) -> None | RejectionReason | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, str):
                    raise TypeError()
                reason_type_0 = RejectionReason(data)

                return reason_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | RejectionReason | Unset, data)

        reason = _parse_reason(d.pop("reason", UNSET))

        def _parse_decision(data: object) -> DecisionKind | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, str):
                    raise TypeError()
                decision_type_0 = DecisionKind(data)

                return decision_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(DecisionKind | None | Unset, data)

        decision = _parse_decision(d.pop("decision", UNSET))

        match = cls(
            id=id,
            earlier=earlier,
            later=later,
            direction=direction,
            channel=channel,
            evidence=evidence,
            probability=probability,
            state=state,
            reason=reason,
            decision=decision,
        )

        match.additional_properties = d
        return match

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
