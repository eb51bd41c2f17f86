from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.feature_type import FeatureType

if TYPE_CHECKING:
    from ..models.feature_properties import FeatureProperties
    from ..models.shape_type_0 import ShapeType0
    from ..models.shape_type_1 import ShapeType1
    from ..models.shape_type_2 import ShapeType2


T = TypeVar("T", bound="Feature")


@_attrs_define
class Feature:
    """A thing on the map.

    Attributes:
        type_ (FeatureType): `Feature`, as GeoJSON calls it.
        geometry (ShapeType0 | ShapeType1 | ShapeType2): A shape in metres.
        properties (FeatureProperties): What is said of a feature; null is what does not apply to it.
    """

    type_: FeatureType
    geometry: ShapeType0 | ShapeType1 | ShapeType2
    properties: FeatureProperties
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415

        type_ = self.type_.value

        geometry: dict[str, Any]
        if isinstance(self.geometry, ShapeType0):
            geometry = self.geometry.to_dict()
        elif isinstance(self.geometry, ShapeType1):
            geometry = self.geometry.to_dict()
        else:
            geometry = self.geometry.to_dict()

        properties = self.properties.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "type": type_,
                "geometry": geometry,
                "properties": properties,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.feature_properties import FeatureProperties  # noqa: PLC0415
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415
        from ..models.shape_type_2 import ShapeType2  # noqa: PLC0415

        d = dict(src_dict)
        type_ = FeatureType(d.pop("type"))

        def _parse_geometry(data: object) -> ShapeType0 | ShapeType1 | ShapeType2:
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                componentsschemas_shape_type_0 = ShapeType0.from_dict(data)

                return componentsschemas_shape_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                componentsschemas_shape_type_1 = ShapeType1.from_dict(data)

                return componentsschemas_shape_type_1
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            if not isinstance(data, dict):
                raise TypeError()
            componentsschemas_shape_type_2 = ShapeType2.from_dict(data)

            return componentsschemas_shape_type_2

        geometry = _parse_geometry(d.pop("geometry"))

        properties = FeatureProperties.from_dict(d.pop("properties"))

        feature = cls(
            type_=type_,
            geometry=geometry,
            properties=properties,
        )

        feature.additional_properties = d
        return feature

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
