from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.geometry import Geometry


T = TypeVar("T", bound="NewRun")


@_attrs_define
class NewRun:
    """Makes a run.

    Attributes:
        geometry (Geometry): What all scans of a run share.
        robot (None | str | Unset): The robot, when there is more to say than the run's name. Example: porter-3.
        area (None | str | Unset): Where the run belongs, for instance a floor: it is never joined to runs of another
            area. Floors that look alike
            cannot be told apart by a laser. Example: second floor.
    """

    geometry: Geometry
    robot: None | str | Unset = UNSET
    area: None | str | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        geometry = self.geometry.to_dict()

        robot: None | str | Unset
        if isinstance(self.robot, Unset):
            robot = UNSET
        else:
            robot = self.robot

        area: None | str | Unset
        if isinstance(self.area, Unset):
            area = UNSET
        else:
            area = self.area

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "geometry": geometry,
            }
        )
        if robot is not UNSET:
            field_dict["robot"] = robot
        if area is not UNSET:
            field_dict["area"] = area

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.geometry import Geometry  # noqa: PLC0415

        d = dict(src_dict)
        geometry = Geometry.from_dict(d.pop("geometry"))

        def _parse_robot(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        robot = _parse_robot(d.pop("robot", UNSET))

        def _parse_area(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        area = _parse_area(d.pop("area", UNSET))

        new_run = cls(
            geometry=geometry,
            robot=robot,
            area=area,
        )

        return new_run
