from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.registration import Registration


T = TypeVar("T", bound="Evidence")


@_attrs_define
class Evidence:
    """What speaks for and against a match.

    Attributes:
        bits (float | None | Unset): Surprise of the most surprising chain of words through both stretches; null when
            none was weighed.
        expected_chance_matches (float | None | Unset): Number of chains this surprising that chance would bring in this
            site; null when too many to count.
        shape_residual_m (float | None | Unset): RMS distance of the two driven shapes after rigid alignment, metres.
        density_correlation (float | None | Unset): Correlation of the aligned density profiles, from -1 to 1.
        ambiguity (float | None | Unset): Evidence of the best candidate at a different place, relative to this one's: 1
            is fully ambiguous.
        registration (None | Registration | Unset):
    """

    bits: float | None | Unset = UNSET
    expected_chance_matches: float | None | Unset = UNSET
    shape_residual_m: float | None | Unset = UNSET
    density_correlation: float | None | Unset = UNSET
    ambiguity: float | None | Unset = UNSET
    registration: None | Registration | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.registration import Registration  # noqa: PLC0415

        bits: float | None | Unset
        if isinstance(self.bits, Unset):
            bits = UNSET
        else:
            bits = self.bits

        expected_chance_matches: float | None | Unset
        if isinstance(self.expected_chance_matches, Unset):
            expected_chance_matches = UNSET
        else:
            expected_chance_matches = self.expected_chance_matches

        shape_residual_m: float | None | Unset
        if isinstance(self.shape_residual_m, Unset):
            shape_residual_m = UNSET
        else:
            shape_residual_m = self.shape_residual_m

        density_correlation: float | None | Unset
        if isinstance(self.density_correlation, Unset):
            density_correlation = UNSET
        else:
            density_correlation = self.density_correlation

        ambiguity: float | None | Unset
        if isinstance(self.ambiguity, Unset):
            ambiguity = UNSET
        else:
            ambiguity = self.ambiguity

        registration: dict[str, Any] | None | Unset
        if isinstance(self.registration, Unset):
            registration = UNSET
        elif isinstance(self.registration, Registration):
            registration = self.registration.to_dict()
        else:
            registration = self.registration

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update({})
        if bits is not UNSET:
            field_dict["bits"] = bits
        if expected_chance_matches is not UNSET:
            field_dict["expected_chance_matches"] = expected_chance_matches
        if shape_residual_m is not UNSET:
            field_dict["shape_residual_m"] = shape_residual_m
        if density_correlation is not UNSET:
            field_dict["density_correlation"] = density_correlation
        if ambiguity is not UNSET:
            field_dict["ambiguity"] = ambiguity
        if registration is not UNSET:
            field_dict["registration"] = registration

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.registration import Registration  # noqa: PLC0415

        d = dict(src_dict)

        def _parse_bits(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        bits = _parse_bits(d.pop("bits", UNSET))

        def _parse_expected_chance_matches(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        expected_chance_matches = _parse_expected_chance_matches(d.pop("expected_chance_matches", UNSET))

        def _parse_shape_residual_m(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        shape_residual_m = _parse_shape_residual_m(d.pop("shape_residual_m", UNSET))

        def _parse_density_correlation(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        density_correlation = _parse_density_correlation(d.pop("density_correlation", UNSET))

        def _parse_ambiguity(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        ambiguity = _parse_ambiguity(d.pop("ambiguity", UNSET))

        def _parse_registration(data: object) -> None | Registration | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                registration_type_0 = Registration.from_dict(data)

                return registration_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | Registration | Unset, data)

        registration = _parse_registration(d.pop("registration", UNSET))

        evidence = cls(
            bits=bits,
            expected_chance_matches=expected_chance_matches,
            shape_residual_m=shape_residual_m,
            density_correlation=density_correlation,
            ambiguity=ambiguity,
            registration=registration,
        )

        evidence.additional_properties = d
        return evidence

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
