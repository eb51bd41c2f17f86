from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.room_label import RoomLabel
from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.door import Door
    from ..models.point import Point
    from ..models.shape_type_0 import ShapeType0
    from ..models.shape_type_1 import ShapeType1
    from ..models.shape_type_2 import ShapeType2


T = TypeVar("T", bound="Room")


@_attrs_define
class Room:
    """A part of the floor with walls and doors around it.

    Attributes:
        id (int): Its id, the same in every version that holds the room.
        label (RoomLabel): What a room is by its shape.
        component (int): Component of the map in whose frame the positions are.
        area_m2 (float): Free floor in it, square metres.
        centre (Point): A position.
        geometry (ShapeType0 | ShapeType1 | ShapeType2): A shape in metres.
        neighbours (list[int]): Ids of the rooms that a door joins it to.
        doors (list[Door]): Its doors.
        name (None | str | Unset): What people call it: the name of the annotation of kind `room` that lies in it.
    """

    id: int
    label: RoomLabel
    component: int
    area_m2: float
    centre: Point
    geometry: ShapeType0 | ShapeType1 | ShapeType2
    neighbours: list[int]
    doors: list[Door]
    name: None | str | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415

        id = self.id

        label = self.label.value

        component = self.component

        area_m2 = self.area_m2

        centre = self.centre.to_dict()

        geometry: dict[str, Any]
        if isinstance(self.geometry, ShapeType0):
            geometry = self.geometry.to_dict()
        elif isinstance(self.geometry, ShapeType1):
            geometry = self.geometry.to_dict()
        else:
            geometry = self.geometry.to_dict()

        neighbours = self.neighbours

        doors = []
        for doors_item_data in self.doors:
            doors_item = doors_item_data.to_dict()
            doors.append(doors_item)

        name: None | str | Unset
        if isinstance(self.name, Unset):
            name = UNSET
        else:
            name = self.name

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "id": id,
                "label": label,
                "component": component,
                "area_m2": area_m2,
                "centre": centre,
                "geometry": geometry,
                "neighbours": neighbours,
                "doors": doors,
            }
        )
        if name is not UNSET:
            field_dict["name"] = name

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.door import Door  # noqa: PLC0415
        from ..models.point import Point  # noqa: PLC0415
        from ..models.shape_type_0 import ShapeType0  # noqa: PLC0415
        from ..models.shape_type_1 import ShapeType1  # noqa: PLC0415
        from ..models.shape_type_2 import ShapeType2  # noqa: PLC0415

        d = dict(src_dict)
        id = d.pop("id")

        label = RoomLabel(d.pop("label"))

        component = d.pop("component")

        area_m2 = d.pop("area_m2")

        centre = Point.from_dict(d.pop("centre"))

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

        neighbours = cast(list[int], d.pop("neighbours"))

        doors = []
        _doors = d.pop("doors")
        for doors_item_data in _doors:
            doors_item = Door.from_dict(doors_item_data)

            doors.append(doors_item)

        def _parse_name(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        name = _parse_name(d.pop("name", UNSET))

        room = cls(
            id=id,
            label=label,
            component=component,
            area_m2=area_m2,
            centre=centre,
            geometry=geometry,
            neighbours=neighbours,
            doors=doors,
            name=name,
        )

        room.additional_properties = d
        return room

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
