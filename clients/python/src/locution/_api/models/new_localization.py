from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.geometry import Geometry
    from ..models.pose_prior import PosePrior


T = TypeVar("T", bound="NewLocalization")


@_attrs_define
class NewLocalization:
    """Opens a localisation; the body of a run, and what is known of where the robot is.

    Attributes:
        geometry (Geometry): What all scans of a run share.
        robot (None | str | Unset): The robot, for the log.
        prior (None | PosePrior | Unset):
        area (None | str | Unset): The area it is said to be in: only components with a run of this area are looked at.
            Example: second floor.
    """

    geometry: Geometry
    robot: None | str | Unset = UNSET
    prior: None | PosePrior | Unset = UNSET
    area: None | str | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        from ..models.pose_prior import PosePrior  # noqa: PLC0415

        geometry = self.geometry.to_dict()

        robot: None | str | Unset
        if isinstance(self.robot, Unset):
            robot = UNSET
        else:
            robot = self.robot

        prior: dict[str, Any] | None | Unset
        if isinstance(self.prior, Unset):
            prior = UNSET
        elif isinstance(self.prior, PosePrior):
            prior = self.prior.to_dict()
        else:
            prior = self.prior

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
        if prior is not UNSET:
            field_dict["prior"] = prior
        if area is not UNSET:
            field_dict["area"] = area

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.geometry import Geometry  # noqa: PLC0415
        from ..models.pose_prior import PosePrior  # noqa: PLC0415

        d = dict(src_dict)
        geometry = Geometry.from_dict(d.pop("geometry"))

        def _parse_robot(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        robot = _parse_robot(d.pop("robot", UNSET))

        def _parse_prior(data: object) -> None | PosePrior | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                prior_type_0 = PosePrior.from_dict(data)

                return prior_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | PosePrior | Unset, data)

        prior = _parse_prior(d.pop("prior", UNSET))

        def _parse_area(data: object) -> None | str | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(None | str | Unset, data)

        area = _parse_area(d.pop("area", UNSET))

        new_localization = cls(
            geometry=geometry,
            robot=robot,
            prior=prior,
            area=area,
        )

        return new_localization
