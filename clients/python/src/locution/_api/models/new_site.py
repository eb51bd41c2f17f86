from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.new_site_config_type_0 import NewSiteConfigType0


T = TypeVar("T", bound="NewSite")


@_attrs_define
class NewSite:
    """Makes a site.

    Attributes:
        config (NewSiteConfigType0 | None | Unset): The engine's configuration; what is left out keeps its default.
    """

    config: NewSiteConfigType0 | None | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        from ..models.new_site_config_type_0 import NewSiteConfigType0  # noqa: PLC0415

        config: dict[str, Any] | None | Unset
        if isinstance(self.config, Unset):
            config = UNSET
        elif isinstance(self.config, NewSiteConfigType0):
            config = self.config.to_dict()
        else:
            config = self.config

        field_dict: dict[str, Any] = {}

        field_dict.update({})
        if config is not UNSET:
            field_dict["config"] = config

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.new_site_config_type_0 import NewSiteConfigType0  # noqa: PLC0415

        d = dict(src_dict)

        def _parse_config(data: object) -> NewSiteConfigType0 | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                config_type_0 = NewSiteConfigType0.from_dict(data)

                return config_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(NewSiteConfigType0 | None | Unset, data)

        config = _parse_config(d.pop("config", UNSET))

        new_site = cls(
            config=config,
        )

        return new_site
