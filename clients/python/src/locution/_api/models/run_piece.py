from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.cut_reason import CutReason
from ..types import UNSET, Unset

T = TypeVar("T", bound="RunPiece")


@_attrs_define
class RunPiece:
    """A piece of a run: nothing tells how it lies to the piece before but the map, if that joined them.

    Attributes:
        from_scan (int): Sequence number of its first scan.
        to_scan (int): Sequence number of its last scan.
        reason (CutReason | None | Unset):
        component (int | None | Unset): The component of the map that it lies in; pieces of one component share a frame.
            Null when it is in no map.
        length_m (float | None | Unset): Metres driven in the map; null when it is in no map.
    """

    from_scan: int
    to_scan: int
    reason: CutReason | None | Unset = UNSET
    component: int | None | Unset = UNSET
    length_m: float | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from_scan = self.from_scan

        to_scan = self.to_scan

        reason: None | str | Unset
        if isinstance(self.reason, Unset):
            reason = UNSET
        elif isinstance(self.reason, CutReason):
            reason = self.reason.value
        else:
            reason = self.reason

        component: int | None | Unset
        if isinstance(self.component, Unset):
            component = UNSET
        else:
            component = self.component

        length_m: float | None | Unset
        if isinstance(self.length_m, Unset):
            length_m = UNSET
        else:
            length_m = self.length_m

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "from_scan": from_scan,
                "to_scan": to_scan,
            }
        )
        if reason is not UNSET:
            field_dict["reason"] = reason
        if component is not UNSET:
            field_dict["component"] = component
        if length_m is not UNSET:
            field_dict["length_m"] = length_m

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        from_scan = d.pop("from_scan")

        to_scan = d.pop("to_scan")

        def _parse_reason(data: object) -> CutReason | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, str):
                    raise TypeError()
                reason_type_0 = CutReason(data)

                return reason_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(CutReason | None | Unset, data)

        reason = _parse_reason(d.pop("reason", UNSET))

        def _parse_component(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        component = _parse_component(d.pop("component", UNSET))

        def _parse_length_m(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        length_m = _parse_length_m(d.pop("length_m", UNSET))

        run_piece = cls(
            from_scan=from_scan,
            to_scan=to_scan,
            reason=reason,
            component=component,
            length_m=length_m,
        )

        run_piece.additional_properties = d
        return run_piece

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
