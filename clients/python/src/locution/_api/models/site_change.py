from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.retention import Retention
    from ..models.site_change_config_type_0 import SiteChangeConfigType0


T = TypeVar("T", bound="SiteChange")


@_attrs_define
class SiteChange:
    """Changes a site; what is left out stays.

    Attributes:
        config (None | SiteChangeConfigType0 | Unset): Members of the engine's configuration that change, as a JSON
            merge patch (RFC 7396): null sets a member to its
            default. Everything but `translator` can be changed.
        retention (None | Retention | Unset):
    """

    config: None | SiteChangeConfigType0 | Unset = UNSET
    retention: None | Retention | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        from ..models.retention import Retention  # noqa: PLC0415
        from ..models.site_change_config_type_0 import SiteChangeConfigType0  # noqa: PLC0415

        config: dict[str, Any] | None | Unset
        if isinstance(self.config, Unset):
            config = UNSET
        elif isinstance(self.config, SiteChangeConfigType0):
            config = self.config.to_dict()
        else:
            config = self.config

        retention: dict[str, Any] | None | Unset
        if isinstance(self.retention, Unset):
            retention = UNSET
        elif isinstance(self.retention, Retention):
            retention = self.retention.to_dict()
        else:
            retention = self.retention

        field_dict: dict[str, Any] = {}

        field_dict.update({})
        if config is not UNSET:
            field_dict["config"] = config
        if retention is not UNSET:
            field_dict["retention"] = retention

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.retention import Retention  # noqa: PLC0415
        from ..models.site_change_config_type_0 import SiteChangeConfigType0  # noqa: PLC0415

        d = dict(src_dict)

        def _parse_config(data: object) -> None | SiteChangeConfigType0 | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                config_type_0 = SiteChangeConfigType0.from_dict(data)

                return config_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | SiteChangeConfigType0 | Unset, data)

        config = _parse_config(d.pop("config", UNSET))

        def _parse_retention(data: object) -> None | Retention | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                retention_type_0 = Retention.from_dict(data)

                return retention_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | Retention | Unset, data)

        retention = _parse_retention(d.pop("retention", UNSET))

        site_change = cls(
            config=config,
            retention=retention,
        )

        return site_change
