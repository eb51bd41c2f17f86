from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.shape_type_0 import ShapeType0
    from ..models.shape_type_1 import ShapeType1
    from ..models.shape_type_2 import ShapeType2


T = TypeVar("T", bound="NewAnnotation")


@_attrs_define
class NewAnnotation:
    """What to draw.

    Attributes:
        kind (str): What sort of thing it is, in words of your own; `room` names the room in which it lies. Example:
            dock.
        name (str): What people call it. Example: Charging station.
        geometry (ShapeType0 | ShapeType1 | ShapeType2): A shape in metres.
        component (int | Unset): Component of the map in whose frame the geometry is; the first unless said.
    """

    kind: str
    name: str
    geometry: ShapeType0 | ShapeType1 | ShapeType2
    component: int | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415

        kind = self.kind

        name = self.name

        geometry: dict[str, Any]
        if isinstance(self.geometry, ShapeType0):
            geometry = self.geometry.to_dict()
        elif isinstance(self.geometry, ShapeType1):
            geometry = self.geometry.to_dict()
        else:
            geometry = self.geometry.to_dict()

        component = self.component

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "kind": kind,
                "name": name,
                "geometry": geometry,
            }
        )
        if component is not UNSET:
            field_dict["component"] = component

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415
        from ..models.shape_type_2 import ShapeType2  # noqa: PLC0415

        d = dict(src_dict)
        kind = d.pop("kind")

        name = d.pop("name")

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

        component = d.pop("component", UNSET)

        new_annotation = cls(
            kind=kind,
            name=name,
            geometry=geometry,
            component=component,
        )

        return new_annotation
