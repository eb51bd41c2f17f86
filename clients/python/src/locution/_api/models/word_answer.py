from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.direction import Direction
from ..types import UNSET, Unset

if TYPE_CHECKING:
    from ..models.pose import Pose


T = TypeVar("T", bound="WordAnswer")


@_attrs_define
class WordAnswer:
    """Where a question fits.

    Attributes:
        site (str): The site.
        run (str): The run.
        direction (Direction): Which way a place was driven, compared with another pass through it.
        words (list[int]): First and last word of level 0; alternative words make them more than the question has.
        observations (list[int]): First and last observation.
        fit (float): Mean fit of the words, from 0 (just within the tolerances) to 1 (exact).
        component (int | None | Unset): Component of the map; null when the run is not in it.
        map_from_middle (None | Pose | Unset):
    """

    site: str
    run: str
    direction: Direction
    words: list[int]
    observations: list[int]
    fit: float
    component: int | None | Unset = UNSET
    map_from_middle: None | Pose | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        from ..models.pose import Pose  # noqa: PLC0415

        site = self.site

        run = self.run

        direction = self.direction.value

        words = self.words

        observations = self.observations

        fit = self.fit

        component: int | None | Unset
        if isinstance(self.component, Unset):
            component = UNSET
        else:
            component = self.component

        map_from_middle: dict[str, Any] | None | Unset
        if isinstance(self.map_from_middle, Unset):
            map_from_middle = UNSET
        elif isinstance(self.map_from_middle, Pose):
            map_from_middle = self.map_from_middle.to_dict()
        else:
            map_from_middle = self.map_from_middle

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "site": site,
                "run": run,
                "direction": direction,
                "words": words,
                "observations": observations,
                "fit": fit,
            }
        )
        if component is not UNSET:
            field_dict["component"] = component
        if map_from_middle is not UNSET:
            field_dict["map_from_middle"] = map_from_middle

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.pose import Pose  # noqa: PLC0415

        d = dict(src_dict)
        site = d.pop("site")

        run = d.pop("run")

        direction = Direction(d.pop("direction"))

        words = cast(list[int], d.pop("words"))

        observations = cast(list[int], d.pop("observations"))

        fit = d.pop("fit")

        def _parse_component(data: object) -> int | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(int | None | Unset, data)

        component = _parse_component(d.pop("component", UNSET))

        def _parse_map_from_middle(data: object) -> None | Pose | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            try:
                if not isinstance(data, dict):
                    raise TypeError()
                map_from_middle_type_0 = Pose.from_dict(data)

                return map_from_middle_type_0
            except (TypeError, ValueError, AttributeError, KeyError):
                pass
            return cast(None | Pose | Unset, data)

        map_from_middle = _parse_map_from_middle(d.pop("map_from_middle", UNSET))

        word_answer = cls(
            site=site,
            run=run,
            direction=direction,
            words=words,
            observations=observations,
            fit=fit,
            component=component,
            map_from_middle=map_from_middle,
        )

        word_answer.additional_properties = d
        return word_answer

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
