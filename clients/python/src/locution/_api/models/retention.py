from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

T = TypeVar("T", bound="Retention")


@_attrs_define
class Retention:
    """How much of a site is kept; what is left out is kept whole.

    Attributes:
        num_versions (int | None | Unset): Map versions, the serving one included; as the server is configured unless
            said.
        num_runs (int | None | Unset): Runs: finished ones beyond are deleted, the oldest first, when a map is built.
        num_scans (int | None | Unset): Scans of all runs together: finished runs are deleted, the oldest first, when a
            map is built. The latest run stays.
    """

    num_versions: int | None | Unset = UNSET
    num_runs: int | None | Unset = UNSET
    num_scans: int | None | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        num_versions: int | None | Unset
        if isinstance(self.num_versions, Unset):
            num_versions = UNSET
        else:
            num_versions = self.num_versions

        num_runs: int | None | Unset
        if isinstance(self.num_runs, Unset):
            num_runs = UNSET
        else:
            num_runs = self.num_runs

        num_scans: int | None | Unset
        if isinstance(self.num_scans, Unset):
            num_scans = UNSET
        else:
            num_scans = self.num_scans

        field_dict: dict[str, Any] = {}

        field_dict.update({})
        if num_versions is not UNSET:
            field_dict["num_versions"] = num_versions
        if num_runs is not UNSET:
            field_dict["num_runs"] = num_runs
        if num_scans is not UNSET:
            field_dict["num_scans"] = num_scans

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)

        def _parse_num_versions(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        num_versions = _parse_num_versions(d.pop("num_versions", UNSET))

        def _parse_num_runs(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        num_runs = _parse_num_runs(d.pop("num_runs", UNSET))

        def _parse_num_scans(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        num_scans = _parse_num_scans(d.pop("num_scans", UNSET))

        retention = cls(
            num_versions=num_versions,
            num_runs=num_runs,
            num_scans=num_scans,
        )

        return retention
