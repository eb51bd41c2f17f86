from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define

from ..models.scope import Scope
from ..types import UNSET, Unset

T = TypeVar("T", bound="NewKey")


@_attrs_define
class NewKey:
    """Makes a key.

    Attributes:
        name (str): 1 to 64 of `A–Z a–z 0–9 . _ -`; stands in the log. Example: robot-7.
        scope (Scope): What a key may do; each scope includes those before it.
        sites (list[str]): Sites it may do it in; `*` means all. Example: ['office'].
        expires_in_s (int | None | Unset): How long it is valid, seconds; for good unless said.
        requests_per_s_max (float | None | Unset): Most requests in a second, on average.
        num_localisations_max (int | None | Unset): Most localisations at once.
    """

    name: str
    scope: Scope
    sites: list[str]
    expires_in_s: int | None | Unset = UNSET
    requests_per_s_max: float | None | Unset = UNSET
    num_localisations_max: int | None | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        name = self.name

        scope = self.scope.value

        sites = self.sites

        expires_in_s: int | None | Unset
        if isinstance(self.expires_in_s, Unset):
            expires_in_s = UNSET
        else:
            expires_in_s = self.expires_in_s

        requests_per_s_max: float | None | Unset
        if isinstance(self.requests_per_s_max, Unset):
            requests_per_s_max = UNSET
        else:
            requests_per_s_max = self.requests_per_s_max

        num_localisations_max: int | None | Unset
        if isinstance(self.num_localisations_max, Unset):
            num_localisations_max = UNSET
        else:
            num_localisations_max = self.num_localisations_max

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "name": name,
                "scope": scope,
                "sites": sites,
            }
        )
        if expires_in_s is not UNSET:
            field_dict["expires_in_s"] = expires_in_s
        if requests_per_s_max is not UNSET:
            field_dict["requests_per_s_max"] = requests_per_s_max
        if num_localisations_max is not UNSET:
            field_dict["num_localisations_max"] = num_localisations_max

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        name = d.pop("name")

        scope = Scope(d.pop("scope"))

        sites = cast(list[str], d.pop("sites"))

        def _parse_expires_in_s(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        expires_in_s = _parse_expires_in_s(d.pop("expires_in_s", UNSET))

        def _parse_requests_per_s_max(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        requests_per_s_max = _parse_requests_per_s_max(d.pop("requests_per_s_max", UNSET))

        def _parse_num_localisations_max(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        num_localisations_max = _parse_num_localisations_max(d.pop("num_localisations_max", UNSET))

        new_key = cls(
            name=name,
            scope=scope,
            sites=sites,
            expires_in_s=expires_in_s,
            requests_per_s_max=requests_per_s_max,
            num_localisations_max=num_localisations_max,
        )

        return new_key
