from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.shape_type_0 import ShapeType0
    from ..models.shape_type_1 import ShapeType1
    from ..models.shape_type_2 import ShapeType2


T = TypeVar("T", bound="Annotation")


@_attrs_define
class Annotation:
    """Something that a person drew, where it lies in a version of the map.

    Attributes:
        id (str): Its id, the same in every version. Example: 7.
        kind (str): What sort of thing it is.
        name (str): What people call it.
        component (int | None | Unset): Component of the map in whose frame the geometry is; null in a version without
            the runs that drove there.
        geometry (None | ShapeType0 | ShapeType1 | ShapeType2 | Unset):
    """

    id: str
    kind: str
    name: str
    component: int | None | Unset = UNSET
    geometry: None | ShapeType0 | ShapeType1 | ShapeType2 | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415
        from ..models.shape_type_2 import ShapeType2  # noqa: PLC0415

        id = self.id

        kind = self.kind

        name = self.name

        component: int | None | Unset
        if isinstance(self.component, Unset):
            component = UNSET
        else:
            component = self.component

        geometry: dict[str, Any] | None | Unset
        if isinstance(self.geometry, Unset):
            geometry = UNSET
        elif isinstance(self.geometry, ShapeType0):
            geometry = self.geometry.to_dict()
        elif isinstance(self.geometry, ShapeType1):
            geometry = self.geometry.to_dict()
        elif isinstance(self.geometry, ShapeType2):
            geometry = self.geometry.to_dict()
        else:
            geometry = self.geometry

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "id": id,
                "kind": kind,
                "name": name,
            }
        )
        if component is not UNSET:
            field_dict["component"] = component
        if geometry is not UNSET:
            field_dict["geometry"] = geometry

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415
        from ..models.shape_type_2 import ShapeType2  # noqa: PLC0415

        d = dict(src_dict)
        id = d.pop("id")

        kind = d.pop("kind")

        name = d.pop("name")

        def _parse_component(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        component = _parse_component(d.pop("component", UNSET))

        def _parse_geometry(data: object) -> None | ShapeType0 | ShapeType1 | ShapeType2 | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
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
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                componentsschemas_shape_type_2 = ShapeType2.from_dict(data)

                return componentsschemas_shape_type_2
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | ShapeType0 | ShapeType1 | ShapeType2 | Unset, data)

        geometry = _parse_geometry(d.pop("geometry", UNSET))

        annotation = cls(
            id=id,
            kind=kind,
            name=name,
            component=component,
            geometry=geometry,
        )

        annotation.additional_properties = d
        return annotation

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
