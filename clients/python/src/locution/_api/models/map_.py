from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

if TYPE_CHECKING:
    from ..models.component import Component
    from ..models.connection import Connection
    from ..models.map_run import MapRun
    from ..models.map_statistics import MapStatistics
    from ..models.region import Region


T = TypeVar("T", bound="Map")


@_attrs_define
class Map:
    """A map version.

    Attributes:
        version (int): Its number.
        versions (list[int]): Versions that can be asked for, oldest first.
        components (list[Component]): Parts that nothing connects, each with a frame of its own.
        runs (list[MapRun]): Runs with the poses of their keyframes.
        regions (list[Region]): Regions of equal density along the runs.
        connections (list[Connection]): Which regions are beside which, by position in `regions`.
        statistics (MapStatistics): Figures of a map.
    """

    version: int
    versions: list[int]
    components: list[Component]
    runs: list[MapRun]
    regions: list[Region]
    connections: list[Connection]
    statistics: MapStatistics
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    def to_dict(self) -> dict[str, Any]:
        version = self.version

        versions = self.versions

        components = []
        for components_item_data in self.components:
            components_item = components_item_data.to_dict()
            components.append(components_item)

        runs = []
        for runs_item_data in self.runs:
            runs_item = runs_item_data.to_dict()
            runs.append(runs_item)

        regions = []
        for regions_item_data in self.regions:
            regions_item = regions_item_data.to_dict()
            regions.append(regions_item)

        connections = []
        for connections_item_data in self.connections:
            connections_item = connections_item_data.to_dict()
            connections.append(connections_item)

        statistics = self.statistics.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "version": version,
                "versions": versions,
                "components": components,
                "runs": runs,
                "regions": regions,
                "connections": connections,
                "statistics": statistics,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls: type[T], src_dict: Mapping[str, Any]) -> T:
        from ..models.component import Component  # noqa: PLC0415
        from ..models.connection import Connection  # noqa: PLC0415
        from ..models.map_run import MapRun  # noqa: PLC0415
        from ..models.map_statistics import MapStatistics  # noqa: PLC0415
        from ..models.region import Region  # noqa: PLC0415

        d = dict(src_dict)
        version = d.pop("version")

        versions = cast(list[int], d.pop("versions"))

        components = []
        _components = d.pop("components")
        for components_item_data in _components:
            components_item = Component.from_dict(components_item_data)

            components.append(components_item)

        runs = []
        _runs = d.pop("runs")
        for runs_item_data in _runs:
            runs_item = MapRun.from_dict(runs_item_data)

            runs.append(runs_item)

        regions = []
        _regions = d.pop("regions")
        for regions_item_data in _regions:
            regions_item = Region.from_dict(regions_item_data)

            regions.append(regions_item)

        connections = []
        _connections = d.pop("connections")
        for connections_item_data in _connections:
            connections_item = Connection.from_dict(connections_item_data)

            connections.append(connections_item)

        statistics = MapStatistics.from_dict(d.pop("statistics"))

        map_ = cls(
            version=version,
            versions=versions,
            components=components,
            runs=runs,
            regions=regions,
            connections=connections,
            statistics=statistics,
        )

        map_.additional_properties = d
        return map_

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
