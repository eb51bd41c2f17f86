from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.channel import Channel

T = TypeVar("T", bound="ExampleEvidence")


@_attrs_define
class ExampleEvidence:
    """What speaks for and against a place, by the stage that found it.

    Attributes:
        channel (Channel): What found a place.
        profile_score (float): Standard deviations by which the density profiles differ less than over the whole site.
        resemblance (float): 1 when all densities are equal.
        outline (float): Share of the outline that the search laid onto surfaces.
        coverage (float): Share of the example's returns about which the map has an opinion.
        contradicted (float): Of these, the share that lie where the map saw free space.
        contradicts (float): Share of the map's surfaces there that the example saw through.
    """

    channel: Channel
    profile_score: float
    resemblance: float
    outline: float
    coverage: float
    contradicted: float
    contradicts: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        channel = self.channel.value

        profile_score = self.profile_score

        resemblance = self.resemblance

        outline = self.outline

        coverage = self.coverage

        contradicted = self.contradicted

        contradicts = self.contradicts

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "channel": channel,
                "profile_score": profile_score,
                "resemblance": resemblance,
                "outline": outline,
                "coverage": coverage,
                "contradicted": contradicted,
                "contradicts": contradicts,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        channel = Channel(d.pop("channel"))

        profile_score = d.pop("profile_score")

        resemblance = d.pop("resemblance")

        outline = d.pop("outline")

        coverage = d.pop("coverage")

        contradicted = d.pop("contradicted")

        contradicts = d.pop("contradicts")

        example_evidence = cls(
            channel=channel,
            profile_score=profile_score,
            resemblance=resemblance,
            outline=outline,
            coverage=coverage,
            contradicted=contradicted,
            contradicts=contradicts,
        )

        example_evidence.additional_properties = d
        return example_evidence

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
