"""A map of a site: its parts, grids and trajectories, in numpy and in the forms of others."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import routes
from .models import Grid, Map, Pose
from .models import Trajectory as WireTrajectory
from .recording import Floats
from .transport import Transport


@dataclass(frozen=True)
class OccupancyGrid:
    """What is free and what is not, as `nav_msgs/OccupancyGrid` has it."""

    cells: npt.NDArray[np.int8]
    """(height, width): 0 free to 100 occupied, -1 unknown; row 0 is the lowest y."""
    resolution_m: float
    """Side of a cell."""
    map_from_grid: Pose
    """Where the lower left corner of the first cell lies."""

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top in metres, for `pyplot.imshow(cells, origin="lower", extent=…)`."""
        height, width = self.cells.shape
        x, y = self.map_from_grid.x, self.map_from_grid.y
        return x, x + width * self.resolution_m, y, y + height * self.resolution_m


@dataclass(frozen=True)
class Trajectory:
    """Where one run was, a pose for every scan."""

    run: str
    component: int | None
    """The part of the map in whose frame the poses are; None in frames of the run itself."""
    scan_seqs: npt.NDArray[np.int64]
    timestamps_ns: npt.NDArray[np.int64]
    poses: Floats
    """(n, 3): x, y, theta."""

    @classmethod
    def of(cls, run: str, wire: WireTrajectory) -> Trajectory:
        """The arrays of an answer."""
        numbers = [(pose.scan_seq, pose.timestamp_ns) for pose in wire.poses]
        whole = np.array(numbers, dtype=np.int64).reshape(-1, 2)
        poses = np.array([(pose.x, pose.y, pose.theta) for pose in wire.poses], dtype=np.float64).reshape(-1, 3)
        component = wire.component if isinstance(wire.component, int) else None
        return cls(run, component, whole[:, 0], whole[:, 1], poses)


class SiteMap:
    """One version of a site's map. Every question goes to this version, also when another is served meanwhile."""

    def __init__(self, transport: Transport, site: str, version: int | None = None) -> None:
        self._transport, self._site = transport, site
        self.summary = transport.get(Map, routes.GET_MAP, site, query={"version": version})

    @property
    def version(self) -> int:
        """Number of the version."""
        return self.summary.version

    @property
    def components(self) -> list[int]:
        """Parts of the map that no match joins, each with a frame of its own."""
        return [part.component for part in self.summary.components]

    def runs(self, component: int | None = None) -> list[str]:
        """Runs of the map, or of one of its parts."""
        return [run.run for run in self.summary.runs if component in (None, run.component)]

    def _form(self, route: routes.Route, component: int | None, accept: str) -> bytes:
        query = {"version": self.version, "component": component}
        return self._transport.send(route, self._site, query=query, accept=accept).content

    def grid(self, component: int = 0) -> OccupancyGrid:
        """The occupancy grid of a part of the map."""
        query = {"version": self.version, "component": component}
        grid = self._transport.get(Grid, routes.GET_GRID, self._site, query=query)
        cells = np.array(grid.data, dtype=np.int8).reshape(grid.info.height, grid.info.width)
        corner = grid.info.origin
        theta = 2.0 * math.atan2(corner.orientation.z, corner.orientation.w)
        return OccupancyGrid(cells, grid.info.resolution, Pose(corner.position.x, corner.position.y, theta))

    def to_nav2(self, path: str | Path, component: int = 0) -> Path:
        """Writes a map that `nav2_map_server` loads; answers the name of its YAML file.

        Args:
            path: The map's name, with or without `.yaml`; folders are made. The picture gets the same name.
            component: Which part of the map.
        """
        path = Path(path)
        page = path if path.suffix in (".yaml", ".yml") else path.with_name(path.name + ".yaml")
        picture = page.with_suffix(".pgm")
        text = self._form(routes.GET_GRID_YAML, component, "application/yaml").decode()
        lines = [f"image: {picture.name}" if line.startswith("image:") else line for line in text.splitlines()]
        page.parent.mkdir(parents=True, exist_ok=True)
        picture.write_bytes(self._form(routes.GET_GRID_PGM, component, "image/x-portable-graymap"))
        page.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return page

    def grid_png(self, component: int = 0) -> bytes:
        """The occupancy grid as PNG."""
        return self._form(routes.GET_GRID_PNG, component, "image/png")

    def picture_png(self, component: int | None = None) -> bytes:
        """The map with runs and matches drawn, as PNG."""
        return self._form(routes.GET_PICTURE_PNG, component, "image/png")

    def picture_svg(self, component: int | None = None) -> str:
        """The map with runs and matches drawn, as SVG."""
        return self._form(routes.GET_PICTURE_SVG, component, "image/svg+xml").decode()

    def graph_g2o(self, component: int = 0) -> str:
        """The pose graph of a part of the map in g2o's format."""
        return self._form(routes.GET_GRAPH_G2O, component, "text/plain").decode()

    def trajectory_tum(self, component: int = 0) -> str:
        """All trajectories of a part of the map in TUM's format."""
        return self._form(routes.GET_MAP_TUM, component, "text/plain").decode()

    def mcap(self, component: int = 0) -> bytes:
        """Grid and trajectories of a part of the map as MCAP, for Foxglove."""
        return self._form(routes.GET_MAP_MCAP, component, "application/octet-stream")

    def trajectory(self, run: str) -> Trajectory:
        """Where a run was in this map."""
        query: dict[str, Any] = {"frame": "map", "version": self.version}
        wire = self._transport.get(WireTrajectory, routes.GET_TRAJECTORY, self._site, run, query=query)
        return Trajectory.of(run, wire)

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        return self.picture_png()
