from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.site_config import SiteConfig


T = TypeVar("T", bound="Site")


@_attrs_define
class Site:
    """A site, how it is configured and what it holds.

    Attributes:
        site (str): Its name. Example: hospital-floor-2.
        config (SiteConfig): The engine's configuration in it, complete.
        num_runs (int): Runs.
        num_scans (int): Scans of all runs.
        num_observations (int): Observations of all runs.
        num_words (int): Words of all levels of all runs.
        bytes_on_disk (int): Bytes on disk.
        generation (int): The text generation that serves.
        map_version (int | None | Unset): The map version that serves; null before the first build.
    """

    site: str
    config: SiteConfig
    num_runs: int
    num_scans: int
    num_observations: int
    num_words: int
    bytes_on_disk: int
    generation: int
    map_version: int | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        site = self.site

        config = self.config.to_dict()

        num_runs = self.num_runs

        num_scans = self.num_scans

        num_observations = self.num_observations

        num_words = self.num_words

        bytes_on_disk = self.bytes_on_disk

        generation = self.generation

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
                "config": config,
                "num_runs": num_runs,
                "num_scans": num_scans,
                "num_observations": num_observations,
                "num_words": num_words,
                "bytes_on_disk": bytes_on_disk,
                "generation": generation,
            }
        )
        if map_version is not UNSET:
            field_dict["map_version"] = map_version

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.site_config import SiteConfig  # noqa: PLC0415

        d = dict(src_dict)
        site = d.pop("site")

        config = SiteConfig.from_dict(d.pop("config"))

        num_runs = d.pop("num_runs")

        num_scans = d.pop("num_scans")

        num_observations = d.pop("num_observations")

        num_words = d.pop("num_words")

        bytes_on_disk = d.pop("bytes_on_disk")

        generation = d.pop("generation")

        def _parse_map_version(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        map_version = _parse_map_version(d.pop("map_version", UNSET))

        site = cls(
            site=site,
            config=config,
            num_runs=num_runs,
            num_scans=num_scans,
            num_observations=num_observations,
            num_words=num_words,
            bytes_on_disk=bytes_on_disk,
            generation=generation,
            map_version=map_version,
        )

        site.additional_properties = d
        return site

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
