from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.scope import Scope
from ..types import UNSET, Unset

T = TypeVar("T", bound="Key")


@_attrs_define
class Key:
    """A key, without its secret.

    Attributes:
        name (str): Its name.
        scope (Scope): What a key may do; each scope includes those before it.
        sites (list[str]): Where.
        is_configured (bool): Whether it stands in the server's configuration, where the API cannot change it.
        created_at_s (int | None | Unset): When it was made, seconds since 1970; null for keys of the configuration.
        expires_at_s (int | None | Unset): When it stops being valid, seconds since 1970.
        previous_valid_until_s (int | None | Unset): Until when the secret before the last rotation is valid, seconds
            since 1970.
        requests_per_s_max (float | None | Unset): Most requests in a second.
        num_localisations_max (int | None | Unset): Most localisations at once.
    """

    name: str
    scope: Scope
    sites: list[str]
    is_configured: bool
    created_at_s: int | None | Unset = UNSET
    expires_at_s: int | None | Unset = UNSET
    previous_valid_until_s: int | None | Unset = UNSET
    requests_per_s_max: float | None | Unset = UNSET
    num_localisations_max: int | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        name = self.name

        scope = self.scope.value

        sites = self.sites

        is_configured = self.is_configured

        created_at_s: int | None | Unset
        if isinstance(self.created_at_s, Unset):
            created_at_s = UNSET
        else:
            created_at_s = self.created_at_s

        expires_at_s: int | None | Unset
        if isinstance(self.expires_at_s, Unset):
            expires_at_s = UNSET
        else:
            expires_at_s = self.expires_at_s

        previous_valid_until_s: int | None | Unset
        if isinstance(self.previous_valid_until_s, Unset):
            previous_valid_until_s = UNSET
        else:
            previous_valid_until_s = self.previous_valid_until_s

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
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "name": name,
                "scope": scope,
                "sites": sites,
                "is_configured": is_configured,
            }
        )
        if created_at_s is not UNSET:
            field_dict["created_at_s"] = created_at_s
        if expires_at_s is not UNSET:
            field_dict["expires_at_s"] = expires_at_s
        if previous_valid_until_s is not UNSET:
            field_dict["previous_valid_until_s"] = previous_valid_until_s
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

        is_configured = d.pop("is_configured")

        def _parse_created_at_s(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        created_at_s = _parse_created_at_s(d.pop("created_at_s", UNSET))

        def _parse_expires_at_s(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        expires_at_s = _parse_expires_at_s(d.pop("expires_at_s", UNSET))

        def _parse_previous_valid_until_s(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        previous_valid_until_s = _parse_previous_valid_until_s(d.pop("previous_valid_until_s", UNSET))

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

        key = cls(
            name=name,
            scope=scope,
            sites=sites,
            is_configured=is_configured,
            created_at_s=created_at_s,
            expires_at_s=expires_at_s,
            previous_valid_until_s=previous_valid_until_s,
            requests_per_s_max=requests_per_s_max,
            num_localisations_max=num_localisations_max,
        )

        key.additional_properties = d
        return key

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
