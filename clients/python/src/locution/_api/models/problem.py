from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

T = TypeVar("T", bound="Problem")


@_attrs_define
class Problem:
    """What went wrong (RFC 9457).

    Attributes:
        type_ (str): Stable name of the kind of problem. Example: https://locution.dev/problems/invalid-scan.
        title (str): The kind in words. Example: Invalid scan.
        status (int): The HTTP status. Example: 422.
        detail (str): This very problem in words.
        field (None | str | Unset): Path of the offending value in the request. Example: scans[3].ranges_m[17].
        expected_sequence (int | None | Unset): The sequence number that continues the run.
    """

    type_: str
    title: str
    status: int
    detail: str
    field: None | str | Unset = UNSET
    expected_sequence: int | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        type_ = self.type_

        title = self.title

        status = self.status

        detail = self.detail

        field: None | str | Unset
        if isinstance(self.field, Unset):
            field = UNSET
        else:
            field = self.field

        expected_sequence: int | None | Unset
        if isinstance(self.expected_sequence, Unset):
            expected_sequence = UNSET
        else:
            expected_sequence = self.expected_sequence

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "type": type_,
                "title": title,
                "status": status,
                "detail": detail,
            }
        )
        if field is not UNSET:
            field_dict["field"] = field
        if expected_sequence is not UNSET:
            field_dict["expected_sequence"] = expected_sequence

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        d = dict(src_dict)
        type_ = d.pop("type")

        title = d.pop("title")

        status = d.pop("status")

        detail = d.pop("detail")

        def _parse_field(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        field = _parse_field(d.pop("field", UNSET))

        def _parse_expected_sequence(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        expected_sequence = _parse_expected_sequence(d.pop("expected_sequence", UNSET))

        problem = cls(
            type_=type_,
            title=title,
            status=status,
            detail=detail,
            field=field,
            expected_sequence=expected_sequence,
        )

        problem.additional_properties = d
        return problem

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
