from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.run_state import RunState
from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.geometry import Geometry


T = TypeVar("T", bound="Run")


@_attrs_define
class Run:
    """A run and how far it has come.

    Attributes:
        run (str): Its name. Example: porter-3-monday.
        geometry (Geometry): What all scans of a run share.
        state (RunState): Whether a run takes more scans.
        next_sequence (int): The sequence number to send next.
        num_scans (int): Scans stored.
        num_observations (int): Observations so far.
        num_words (int): Words of all levels so far.
        robot (None | str | Unset): The robot.
        area (None | str | Unset): Where it belongs, when the client said.
    """

    run: str
    geometry: Geometry
    state: RunState
    next_sequence: int
    num_scans: int
    num_observations: int
    num_words: int
    robot: None | str | Unset = UNSET
    area: None | str | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        run = self.run

        geometry = self.geometry.to_dict()

        state = self.state.value

        next_sequence = self.next_sequence

        num_scans = self.num_scans

        num_observations = self.num_observations

        num_words = self.num_words

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
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "run": run,
                "geometry": geometry,
                "state": state,
                "next_sequence": next_sequence,
                "num_scans": num_scans,
                "num_observations": num_observations,
                "num_words": num_words,
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
        run = d.pop("run")

        geometry = Geometry.from_dict(d.pop("geometry"))

        state = RunState(d.pop("state"))

        next_sequence = d.pop("next_sequence")

        num_scans = d.pop("num_scans")

        num_observations = d.pop("num_observations")

        num_words = d.pop("num_words")

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

        run = cls(
            run=run,
            geometry=geometry,
            state=state,
            next_sequence=next_sequence,
            num_scans=num_scans,
            num_observations=num_observations,
            num_words=num_words,
            robot=robot,
            area=area,
        )

        run.additional_properties = d
        return run

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
