from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.site_state import SiteState
from ..types import UNSET, Unset

T = TypeVar("T", bound="SiteSummary")


@_attrs_define
class SiteSummary:
    """What a site holds.

    Attributes:
        site (str): Its name. Example: hospital-floor-2.
        state (SiteState): Whether a site can be asked.
        num_runs (int): Runs.
        num_scans (int): Scans of all runs.
        num_observations (int): Observations of all runs.
        num_words (int): Words of all levels of all runs.
        bytes_on_disk (int): Bytes on disk.
        generation (int): The text generation that serves.
        reason (None | str | Unset): Why it is unreadable, and what can be done about it.
        map_version (int | None | Unset): The map version that serves; null before the first build.
    """

    site: str
    state: SiteState
    num_runs: int
    num_scans: int
    num_observations: int
    num_words: int
    bytes_on_disk: int
    generation: int
    reason: None | str | Unset = UNSET
    map_version: int | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        site = self.site

        state = self.state.value

        num_runs = self.num_runs

        num_scans = self.num_scans

        num_observations = self.num_observations

        num_words = self.num_words

        bytes_on_disk = self.bytes_on_disk

        generation = self.generation

        reason: None | str | Unset
        if isinstance(self.reason, Unset):
            reason = UNSET
        else:
            reason = self.reason

        map_version: int | None | Unset
        if isinstance(self.map_version, Unset):
            map_version = UNSET
        else:
            map_version = self.map_version

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "site": site,
                "state": state,
                "num_runs": num_runs,
                "num_scans": num_scans,
                "num_observations": num_observations,
                "num_words": num_words,
                "bytes_on_disk": bytes_on_disk,
                "generation": generation,
            }
        )
        if reason is not UNSET:
            field_dict["reason"] = reason
        if map_version is not UNSET:
            field_dict["map_version"] = map_version

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        site = d.pop("site")

        state = SiteState(d.pop("state"))

        num_runs = d.pop("num_runs")

        num_scans = d.pop("num_scans")

        num_observations = d.pop("num_observations")

        num_words = d.pop("num_words")

        bytes_on_disk = d.pop("bytes_on_disk")

        generation = d.pop("generation")

        def _parse_reason(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        reason = _parse_reason(d.pop("reason", UNSET))

        def _parse_map_version(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        map_version = _parse_map_version(d.pop("map_version", UNSET))

        site_summary = cls(
            site=site,
            state=state,
            num_runs=num_runs,
            num_scans=num_scans,
            num_observations=num_observations,
            num_words=num_words,
            bytes_on_disk=bytes_on_disk,
            generation=generation,
            reason=reason,
            map_version=map_version,
        )

        site_summary.additional_properties = d
        return site_summary

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
