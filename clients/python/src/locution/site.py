"""One building: its runs, its map, and questions about places."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar

from tqdm.auto import tqdm

from . import models, routes
from .errors import JobFailed, RecordingError, Refused
from .localization import LocalizationSession, as_recording, batch_body, example_body
from .maps import SiteMap, Trajectory
from .readers import RosOptions
from .recording import Recording, Scan
from .transport import Transport

_LOOK_EVERY_S = 0.2
"""Pause between two looks at a job."""
T = TypeVar("T")


class Site:
    """One building of a server; made by the first thing that is stored in it."""

    def __init__(self, transport: Transport, name: str) -> None:
        self._transport, self.name = transport, name

    def __repr__(self) -> str:
        return f"Site({self.name!r} on {self._transport.url})"

    # the site itself

    def create(self, config: Mapping[str, Any] | None = None) -> models.SiteSummary:
        """Makes the site, or finds it as it stands; `Refused` (409) if it stands with another configuration."""
        body = {} if config is None else {"config": dict(config)}
        return self._transport.get(models.SiteSummary, routes.MAKE_SITE, self.name, json=body)

    def status(self) -> models.Site:
        """What the site holds, and its configuration."""
        return self._transport.get(models.Site, routes.GET_SITE, self.name)

    def exists(self) -> bool:
        """Whether the server has the site."""
        try:
            self.status()
        except Refused as refused:
            if refused.status == 404:
                return False
            raise
        return True

    def change(self, change: models.SiteChange) -> models.ChangedSite:
        """Changes what of the site's configuration can be changed."""
        return self._transport.get(models.ChangedSite, routes.CHANGE_SITE, self.name, json=change.to_dict())

    def delete(self) -> None:
        """Deletes the site and all that it holds."""
        self._transport.send(routes.DELETE_SITE, self.name)

    def backup(self) -> bytes:
        """The whole site as one stream."""
        return self._transport.send(routes.BACKUP_SITE, self.name, accept="*/*").content

    def restore(self, backup: bytes) -> models.SiteSummary:
        """Makes the site from a backup; it must not stand yet."""
        answer = self._transport.send(routes.RESTORE_SITE, self.name, content=backup)
        return models.SiteSummary.from_dict(answer.json())

    # runs

    def runs(self) -> Iterator[models.Run]:
        """All runs, in the order in which they were made."""
        return self._transport.all(models.Run, routes.LIST_RUNS, self.name)

    def run(self, run: str) -> models.Run:
        """A run as it stands."""
        return self._transport.get(models.Run, routes.GET_RUN, self.name, run)

    def make_run(self, run: str, geometry: models.Geometry, robot: str | None = None) -> models.Run:
        """Makes a run, or finds it as it stands."""
        body = {"geometry": geometry.to_dict(), "robot": robot}
        return self._transport.get(models.Run, routes.MAKE_RUN, self.name, run, json=body)

    def append(self, run: str, first_sequence: int, scans: Sequence[Scan]) -> models.Receipt:
        """Appends scans; when this returns they are on the server's disk. A repetition changes nothing."""
        body = batch_body(first_sequence, scans)
        return self._transport.get(models.Receipt, routes.APPEND_BATCH, self.name, run, cbor=body)

    def finish(self, run: str) -> models.Run:
        """Ends a run; later scans are refused."""
        return self._transport.get(models.Run, routes.FINISH_RUN, self.name, run)

    def replay(
        self,
        recording: Recording | str | Path,
        *,
        run: str | None = None,
        robot: str | None = None,
        options: RosOptions | None = None,
        batch_size: int = 100,
        finish: bool = True,
        progress: bool = True,
    ) -> models.Run:
        """Sends a recording as its robot would have, from wherever the server's copy of it ends.

        Args:
            recording: A recording, or a file: CARMEN log, ROS 1 or ROS 2 bag, MCAP.
            run: Name of the run; that of the file unless said.
            robot: Name of the robot.
            options: Topics and frames of a bag; found unless said.
            batch_size: Scans per request.
            finish: Whether the run ends with the recording.
            progress: Whether a bar is shown.

        Raises:
            RecordingError: a file that cannot be read, or another than the one that was begun.
            Refused: the server said no.
        """
        recording = as_recording(recording, options)
        run = run or recording.name
        if not self.exists():
            self.create()
        begun = self.make_run(run, recording.geometry, robot)
        if begun.state == models.RunState.FINISHED:
            return begun
        sequence = begun.next_sequence
        with tqdm(total=recording.num_scans, initial=sequence, desc=run, unit="scan", disable=not progress) as bar:
            for batch in recording.batches(batch_size, first=sequence):
                receipt = self.append(run, sequence, batch)
                bar.update(receipt.next_sequence - sequence)
                sequence = receipt.next_sequence
            bar.total = sequence
        if sequence == 0:
            raise RecordingError(f"{run}: no scan has odometry near its time")
        return self.finish(run) if finish else self.run(run)

    def delete_run(self, run: str) -> models.Job | None:
        """Deletes a run; where the map must follow, the job that sees to it."""
        answer = self._transport.send(routes.DELETE_RUN, self.name, run)
        return models.Job.from_dict(answer.json()) if answer.status_code == 202 else None

    def pieces(self, run: str, version: int | None = None) -> Iterator[models.RunPiece]:
        """Parts into which a run falls where its robot could not be followed, and why; one of most runs."""
        return self._transport.all(models.RunPiece, routes.LIST_PIECES, self.name, run, query={"version": version})

    def scans(self, run: str, limit: int | None = None) -> Iterator[models.StoredScan]:
        """Scans as they are stored; `limit` is that of a page."""
        query = {"limit": limit}
        return self._transport.all(models.StoredScan, routes.LIST_SCANS, self.name, run, query=query)

    def observations(self, run: str) -> Iterator[models.Observation]:
        """What was seen every 0.1 m."""
        return self._transport.all(models.Observation, routes.LIST_OBSERVATIONS, self.name, run)

    def words(self, run: str, level: int = 0) -> Iterator[models.Word]:
        """The text of a run."""
        return self._transport.all(models.Word, routes.LIST_WORDS, self.name, run, query={"level": level})

    def trajectory(self, run: str, frame: Literal["map", "run", "odom"] = "map") -> Trajectory:
        """Where a run was: in the map, by its own scans, or by odometry alone."""
        query = {"frame": frame}
        wire = self._transport.get(models.Trajectory, routes.GET_TRAJECTORY, self.name, run, query=query)
        return Trajectory.of(run, wire)

    def trajectory_tum(self, run: str, frame: Literal["map", "run", "odom"] = "map") -> str:
        """The same in TUM's format."""
        query = {"frame": frame}
        return self._transport.send(routes.GET_TRAJECTORY_TUM, self.name, run, query=query, accept="*/*").text

    # the map

    def build(self, progress: bool = True) -> SiteMap:
        """Builds the map of everything stored, waits for it and answers it.

        Raises:
            JobFailed: the build ended in failure.
        """
        self.wait(self.start_build(), progress)
        return self.map()

    def start_build(self) -> models.Job:
        """Begins to build the map."""
        return self._transport.get(models.Job, routes.BUILD_MAP, self.name)

    def wait(self, job: models.Job, progress: bool = True) -> models.Job:
        """Waits until a job is done; raises as `build`."""
        with tqdm(total=100, desc=job.kind.value, unit="%", leave=False, disable=not progress) as bar:
            while job.state in (models.JobState.QUEUED, models.JobState.RUNNING):
                time.sleep(_LOOK_EVERY_S)
                job = self.job(job.id)
                bar.update(round(100.0 * job.progress) - bar.n)
        if job.state == models.JobState.FAILED:
            raise JobFailed(job)
        return job

    def job(self, job: str) -> models.Job:
        """A job as it stands."""
        return self._transport.get(models.Job, routes.GET_JOB, self.name, job)

    def cancel(self, job: str) -> models.Job:
        """Cancels a job."""
        return self._transport.get(models.Job, routes.CANCEL_JOB, self.name, job)

    def jobs(self) -> Iterator[models.Job]:
        """All jobs that are remembered, the newest first."""
        return self._transport.all(models.Job, routes.LIST_JOBS, self.name)

    def map(self, version: int | None = None) -> SiteMap:
        """The map that is served, or another version that is kept; `Refused` (409) before the first build."""
        return SiteMap(self._transport, self.name, version)

    def places(self, component: int | None = None, version: int | None = None) -> Iterator[models.Place]:
        """What kind of place each region is, by all passes."""
        query = {"component": component, "version": version}
        return self._transport.all(models.Place, routes.LIST_PLACES, self.name, query=query)

    def rooms(self, component: int | None = None, version: int | None = None) -> Iterator[models.Room]:
        """Rooms, corridors and halls with the doors between them; ids survive rebuilds."""
        query = {"component": component, "version": version}
        return self._transport.all(models.Room, routes.LIST_ROOMS, self.name, query=query)

    def labels(self, version: int | None = None) -> Iterator[models.Label]:
        """What kind of place each stretch of driving is."""
        return self._transport.all(models.Label, routes.LIST_LABELS, self.name, query={"version": version})

    def changes(
        self, before: Sequence[str] = (), after: Sequence[str] = (), version: int | None = None
    ) -> Iterator[models.Change]:
        """What came and went between two sets of runs; the latest run against all others unless said."""
        query = {"before": ",".join(before) or None, "after": ",".join(after) or None, "version": version}
        return self._transport.all(models.Change, routes.LIST_CHANGES, self.name, query=query)

    def route(
        self, start: tuple[float, float], goal: tuple[float, float], component: int | None = None
    ) -> models.Route:
        """The shortest way over ground that was driven, in metres and in words."""
        (from_x, from_y), (to_x, to_y) = start, goal
        query = {"from_x": from_x, "from_y": from_y, "to_x": to_x, "to_y": to_y, "component": component}
        return self._transport.get(models.Route, routes.GET_ROUTE, self.name, query=query)

    # annotations

    def annotations(
        self, kind: str | None = None, component: int | None = None, version: int | None = None
    ) -> Iterator[models.Annotation]:
        """What people drew, where it lies in a map."""
        query = {"kind": kind, "component": component, "version": version}
        return self._transport.all(models.Annotation, routes.LIST_ANNOTATIONS, self.name, query=query)

    def annotation(self, annotation: str) -> models.Annotation:
        """One annotation where it lies in the served map."""
        return self._transport.get(models.Annotation, routes.GET_ANNOTATION, self.name, annotation)

    def annotate(self, kind: str, name: str, geometry: dict[str, object], component: int = 0) -> models.Annotation:
        """Draws a GeoJSON shape, in metres; it moves with the places around it. Kind `room` names a room."""
        body = {"kind": kind, "name": name, "component": component, "geometry": geometry}
        return self._transport.get(models.Annotation, routes.MAKE_ANNOTATION, self.name, json=body)

    def change_annotation(
        self, annotation: str, kind: str, name: str, geometry: dict[str, object], component: int = 0
    ) -> models.Annotation:
        """Draws something else in the place of an annotation."""
        body = {"kind": kind, "name": name, "component": component, "geometry": geometry}
        return self._transport.get(models.Annotation, routes.CHANGE_ANNOTATION, self.name, annotation, json=body)

    def delete_annotation(self, annotation: str) -> None:
        """Forgets an annotation."""
        self._transport.send(routes.DELETE_ANNOTATION, self.name, annotation)

    # channels

    def channels(self) -> Iterator[models.MapChannel]:
        """Names that stand for versions of the map, which robots follow."""
        return self._transport.all(models.MapChannel, routes.LIST_CHANNELS, self.name)

    def channel(self, channel: str) -> models.MapChannel:
        """One channel: `map(site.channel("stable").map_version)` is what its robots drive by."""
        return self._transport.get(models.MapChannel, routes.GET_CHANNEL, self.name, channel)

    def move_channel(self, channel: str, version: int | None = None) -> models.MapChannel:
        """Points a channel to a version, the served one unless said; makes it when there is none of this name."""
        body = {"map_version": version}
        return self._transport.get(models.MapChannel, routes.MOVE_CHANNEL, self.name, channel, json=body)

    def roll_back_channel(self, channel: str) -> models.MapChannel:
        """Takes the last move of a channel back."""
        return self._transport.get(models.MapChannel, routes.ROLL_BACK_CHANNEL, self.name, channel)

    def delete_channel(self, channel: str) -> None:
        """Forgets a channel."""
        self._transport.send(routes.DELETE_CHANNEL, self.name, channel)

    def channel_robots(self, channel: str) -> Iterator[models.ChannelRobot]:
        """Robots that follow a channel, and which version each has."""
        return self._transport.all(models.ChannelRobot, routes.LIST_CHANNEL_ROBOTS, self.name, channel)

    def report_channel_robot(self, channel: str, robot: str, version: int) -> None:
        """Says which version of the map a robot has loaded."""
        names = (self.name, channel, robot)
        self._transport.send(routes.REPORT_CHANNEL_ROBOT, *names, json={"map_version": version})

    # matches

    def matches(
        self,
        *,
        state: Literal["candidate", "verified", "rejected"] | None = None,
        channel: str | None = None,
        direction: Literal["same", "opposite"] | None = None,
        run: str | None = None,
        version: int | None = None,
    ) -> Iterator[models.Match]:
        """What the map claims to be the same place, or has refused to; `to_frame` makes a table of it."""
        query = {"state": state, "channel": channel, "direction": direction, "run": run, "version": version}
        return self._transport.all(models.Match, routes.LIST_MATCHES, self.name, query=query)

    def match(self, match: str) -> models.Match:
        """A match of the served map."""
        return self._transport.get(models.Match, routes.GET_MATCH, self.name, match)

    def veto(self, match: models.Match | str) -> models.Match:
        """A person says that the two places differ; counts from the next build on."""
        return self._decide(match, "veto")

    def confirm(self, match: models.Match | str) -> models.Match:
        """A person says that the two places are the same; counts from the next build on."""
        return self._decide(match, "confirm")

    def _decide(self, match: models.Match | str, decision: str) -> models.Match:
        names = (self.name, _id(match))
        return self._transport.get(models.Match, routes.DECIDE_MATCH, *names, json={"decision": decision})

    def undecide(self, match: models.Match | str) -> None:
        """Takes back what a person said."""
        self._transport.send(routes.UNDECIDE_MATCH, self.name, _id(match))

    # questions

    def localization(self, geometry: models.Geometry, robot: str | None = None) -> LocalizationSession:
        """Opens a session for a robot that asks where it is while it drives."""
        return LocalizationSession(self._transport, self.name, geometry, robot)

    def localizations(self) -> Iterator[models.Localization]:
        """The sessions that are open."""
        return self._transport.all(models.Localization, routes.LIST_LOCALIZATIONS, self.name)

    def localize(
        self,
        recording: Recording | str | Path,
        *,
        options: RosOptions | None = None,
        batch_size: int = 20,
        progress: bool = True,
    ) -> models.Localization:
        """Where is the robot that records this? Drives through the recording until one place is left.

        The answer holds after as many scans as it took (`next_sequence`), or at the end of the recording.
        """
        recording = as_recording(recording, options)
        with (
            self.localization(recording.geometry) as session,
            tqdm(total=recording.num_scans, desc="localize", unit="scan", disable=not progress) as bar,
        ):
            for batch in recording.batches(batch_size):
                session.append(batch)
                bar.update(len(batch))
                if session.is_converged:
                    break
            return session.answer

    def ask_example(self, recording: Recording | str | Path, options: RosOptions | None = None) -> models.ExampleAnswer:
        """Where does this recording end? The last 25 m count; nothing is stored."""
        body = example_body(recording, options)
        return self._transport.get(models.ExampleAnswer, routes.QUERY_EXAMPLE, self.name, cbor=body)

    def query_words(self, words: Sequence[models.WordPattern], limit: int | None = None) -> list[models.WordAnswer]:
        """Where these words are driven one after the other, either way round; best fit first."""
        body = models.WordQuery(words=list(words), limit=limit).to_dict()
        return self._answers(models.WordAnswer.from_dict, routes.QUERY_WORDS, body)

    def query_labels(self, labels: Sequence[models.LabelPattern], limit: int | None = None) -> list[models.LabelAnswer]:
        """Where these kinds of places are driven one after the other, either way round."""
        body = models.LabelQuery(labels=list(labels), limit=limit).to_dict()
        return self._answers(models.LabelAnswer.from_dict, routes.QUERY_LABELS, body)

    def _answers(self, read: Callable[[Mapping[str, Any]], T], route: routes.Route, body: Mapping[str, Any]) -> list[T]:
        return [read(answer) for answer in self._transport.send(route, self.name, json=body).json()]


def _id(match: models.Match | str) -> str:
    return match if isinstance(match, str) else match.id
