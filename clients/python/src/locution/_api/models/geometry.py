from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="Geometry")


@_attrs_define
class Geometry:
    """What all scans of a run share.

    Attributes:
        num_ranges (int): Readings per scan, at most the server's limit. Example: 180.
        angle_min_rad (float): Direction of the first beam in the laser's frame. Example: -1.5708.
        angle_increment_rad (float): From one beam to the next; negative when the sweep runs clockwise, as that of a
            laser mounted upside down. Example: 0.0174533.
        range_max_m (float): A reading at or above this means "no return". Example: 81.83.
        num_ranges_min (int | None | Unset): Fewest readings of a scan, of a laser whose number varies; those missing at
            the end say nothing. As many as
            `num_ranges` unless said. Example: 180.
        range_min_m (float | Unset): A reading below this, or −∞, means "too near to tell" and says nothing; 0 unless
            said. Example: 0.06.
        robot_from_laser (Pose | Unset): A pose in the plane, equally a rigid transform.
    """

    num_ranges: int
    angle_min_rad: float
    angle_increment_rad: float
    range_max_m: float
    num_ranges_min: int | None | Unset = UNSET
    range_min_m: float | Unset = UNSET
    robot_from_laser: Pose | Unset = UNSET

    def to_dict(self) -> dict[str, Any]:
        num_ranges = self.num_ranges

        angle_min_rad = self.angle_min_rad

        angle_increment_rad = self.angle_increment_rad

        range_max_m = self.range_max_m

        num_ranges_min: int | None | Unset
        if isinstance(self.num_ranges_min, Unset):
            num_ranges_min = UNSET
        else:
            num_ranges_min = self.num_ranges_min

        range_min_m = self.range_min_m

        robot_from_laser: dict[str, Any] | Unset = UNSET
        if not isinstance(self.robot_from_laser, Unset):
            robot_from_laser = self.robot_from_laser.to_dict()

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "num_ranges": num_ranges,
                "angle_min_rad": angle_min_rad,
                "angle_increment_rad": angle_increment_rad,
                "range_max_m": range_max_m,
            }
        )
        if num_ranges_min is not UNSET:
            field_dict["num_ranges_min"] = num_ranges_min
        if range_min_m is not UNSET:
            field_dict["range_min_m"] = range_min_m
        if robot_from_laser is not UNSET:
            field_dict["robot_from_laser"] = robot_from_laser

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        num_ranges = d.pop("num_ranges")

        angle_min_rad = d.pop("angle_min_rad")

        angle_increment_rad = d.pop("angle_increment_rad")

        range_max_m = d.pop("range_max_m")

        def _parse_num_ranges_min(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        num_ranges_min = _parse_num_ranges_min(d.pop("num_ranges_min", UNSET))

        range_min_m = d.pop("range_min_m", UNSET)

        _robot_from_laser = d.pop("robot_from_laser", UNSET)
        robot_from_laser: Pose | Unset
        if isinstance(_robot_from_laser, Unset):
            robot_from_laser = UNSET
        else:
            robot_from_laser = Pose.from_dict(_robot_from_laser)

        geometry = cls(
            num_ranges=num_ranges,
            angle_min_rad=angle_min_rad,
            angle_increment_rad=angle_increment_rad,
            range_max_m=range_max_m,
            num_ranges_min=num_ranges_min,
            range_min_m=range_min_m,
            robot_from_laser=robot_from_laser,
        )

        return geometry
