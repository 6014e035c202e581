"""A job: its scans, its model and its plans."""

from __future__ import annotations

import os
import pathlib
import time
from typing import Iterator, List, Optional, Sequence, Union

from google.protobuf import duration_pb2

from vantage import watch
from vantage.arrays import Array
from vantage.connection import Connection, Path
from vantage.errors import FailedPrecondition, VantageError
from vantage.geometry import prior as prior_of
from vantage.plan_run import PlanRun
from vantage.range_image import RangeImage
from vantage.resumption import Resumption
from vantage.scan import Scan
from vantage.upload import Report, send
from vantage.v1 import (event_pb2, geometry_pb2, model_service_pb2, plan_pb2, plan_service_pb2,
                        planning_config_pb2, pose_graph_pb2, scan_pb2, scan_service_pb2,
                        scanner_model_pb2, session_pb2, session_service_pb2, upload_pb2)

Prior = Union[geometry_pb2.PosePrior, geometry_pb2.Pose, Array]


def _duration(seconds: float) -> duration_pb2.Duration:
    made = duration_pb2.Duration()
    made.FromNanoseconds(round(1e9 * seconds))
    return made


class Session:
    """A job on the server. Every method may raise a VantageError."""

    def __init__(self, connection: Connection, name: str) -> None:
        self._connection = connection
        self.name = name
        """sessions/{session}."""

    def get(self) -> session_pb2.Session:
        """As it is now, every field filled in."""
        return self._connection.call(session_service_pb2.GetSessionRequest(name=self.name)).session

    def delete(self) -> None:
        """With its scans, plans and uploads."""
        self._connection.call(session_service_pb2.DeleteSessionRequest(name=self.name))

    def upload(self, image: RangeImage, *, display_name: str = "", prior: Optional[Prior] = None,
               scanner: Optional[scanner_model_pb2.ScannerModel] = None, scanner_name: str = "",
               preview: bool = False, replaces: str = "",
               progress: Optional[Report] = None) -> Scan:
        """Sends a scan; returns when the server has stored it.

        After a break it goes on where the server says, with growing pauses, until nothing came
        through for `give_up_after` seconds. The same scan sent again, also by a program that was
        started anew, goes on where it was and arrives once: who keeps the image until this returns
        loses nothing.

        prior: what is known of its pose (vantage.prior); the first scan needs none. scanner: what
        made it, where that is not the job's first; scanner_name: which of the fleet, by resource
        name. preview, replaces: as in vantage.v1.Upload. progress: called from this thread.
        FailedPrecondition: the server refused it, and says why.
        """
        upload = upload_pb2.Upload(display_name=display_name, scanner=scanner_name, preview=preview,
                                   replaces=replaces, scanner_model=scanner, prior=_prior(prior))
        sent = send(self._connection, self.name, upload, image.to_bytes(), progress or _silent)
        return Scan(self._connection, sent.scan)

    def upload_file(self, path: Path, *, display_name: str = "", prior: Optional[Prior] = None,
                    station: Optional[Sequence[float]] = None, unit: float = 0.0,
                    intensity: bool = False, colour: bool = False, ignore_poses: bool = False,
                    progress: Optional[Report] = None) -> List[Scan]:
        """Sends a file (E57, PTX, PCD, LAS, PLY or text), which the server reads: a scan for each
        set-up in it, in its order. Resumes as upload().

        station: x, y, z where the scanner stood, in the file's frame and unit, of LAS, PLY and text.
        unit: m, of the file's coordinates. FailedPrecondition: no scan came of it, and why.
        """
        path = pathlib.Path(path)
        upload = upload_pb2.Upload(
            display_name=display_name, prior=_prior(prior),
            file=upload_pb2.ScanFile(name=os.path.basename(path), unit_m=unit, intensity=intensity,
                                     colour=colour, ignore_poses=ignore_poses))
        if station is not None:
            x, y, z = station
            upload.file.station.CopyFrom(geometry_pb2.Vector3(x=x, y=y, z=z))
        state = send(self._connection, self.name, upload, path.read_bytes(), progress or _silent)
        resumption = Resumption(self._connection.options.give_up_after, self._connection.wait)
        while state.state == upload_pb2.UPLOAD_STATE_READING:
            time.sleep(0.2)
            try:
                state = self._connection.call(scan_service_pb2.GetUploadRequest(name=state.name)).upload
                resumption.progress()
            except VantageError as failure:
                resumption.after_break(failure)
        if state.state != upload_pb2.UPLOAD_STATE_COMMITTED:
            raise FailedPrecondition(state.state_message or "the server took no scan from the file")
        return [Scan(self._connection, name) for name in state.scans]

    def scan(self, identifier: str) -> Scan:
        """By its id or name; nothing is asked of the server."""
        name = identifier if "/" in identifier else f"{self.name}/scans/{identifier}"
        return Scan(self._connection, name)

    def scans(self) -> Iterator[scan_pb2.Scan]:
        """All, oldest first."""
        return self._connection.pages(scan_service_pb2.ListScansRequest(parent=self.name), "scans")

    def plan(self, seconds: Optional[float] = None, *, work_limit_rays: Optional[int] = None,
             seed: Optional[int] = None, scanners: Sequence[str] = (),
             config: Optional[planning_config_pb2.PlanningConfig] = None) -> PlanRun:
        """Starts a plan and returns at once; iterate over it for rankings that improve.

        seconds: how long it may take, [0.01, 3600]; or work_limit_rays, with which the same model,
        configuration and seed give the same plan anywhere. Without either 1 s. scanners: of the
        fleet, by resource name. config: what differs from the job's. FailedPrecondition while no
        scan is in the model.
        """
        if seconds is not None and work_limit_rays is not None:
            raise ValueError("seconds and work_limit_rays: a plan has one budget")
        plan = plan_pb2.Plan(seed=seed, scanners=scanners, config_overrides=config)
        if seconds is not None:
            plan.time_budget.CopyFrom(_duration(seconds))
        elif work_limit_rays is not None:
            plan.work_limit_rays = work_limit_rays
        return PlanRun(self._connection, self._connection.call(
            plan_service_pb2.CreatePlanRequest(parent=self.name, plan=plan)).plan)

    def plans(self) -> Iterator[plan_pb2.Plan]:
        """All, oldest first, without patches and maps."""
        return self._connection.pages(plan_service_pb2.ListPlansRequest(parent=self.name), "plans")

    def evaluate(self, x: float, y: float, z: float,
                 heading: Optional[float] = None) -> plan_service_pb2.EvaluateViewResponse:
        """What a scan from a place of one's own would bring: m, world; heading in rad."""
        return self._connection.call(plan_service_pb2.EvaluateViewRequest(
            parent=self.name, position=geometry_pb2.Vector3(x=x, y=y, z=z), heading_rad=heading))

    def reject(self, x: float, y: float, z: float, radius: float = 0.5, reason: str = "",
               seconds: Optional[float] = None) -> session_pb2.Rejection:
        """'I can't stand there': later plans avoid it. m, world; seconds: how long, else for
        good."""
        return self._connection.call(plan_service_pb2.RejectViewRequest(
            parent=self.name, position=geometry_pb2.Vector3(x=x, y=y, z=z), radius_m=radius,
            reason=reason, ttl=None if seconds is None else _duration(seconds))).rejection

    def coverage(self) -> model_service_pb2.GetCoverageResponse:
        """How complete the model is, m^2 by density, and what is still missing."""
        return self._connection.call(model_service_pb2.GetCoverageRequest(name=self.name))

    def links(self) -> pose_graph_pb2.PoseGraph:
        """What ties the scans to each other, how well it holds them, and what would hold them
        better."""
        return self._connection.call(model_service_pb2.GetPoseGraphRequest(name=self.name)).graph

    def watch(self, after: int = 0) -> Iterator[event_pb2.SessionEvent]:
        """Every event after a sequence number: first those of the past, then as they happen, for as
        long as one iterates. After a break it goes on behind the last one: none is missed, and none
        comes twice. OutOfRange: there is no such number yet."""
        return watch.session_events(self._connection, self.name, after)

    def export(self, kind: "model_service_pb2.ExportFormat", path: Path, scans: Sequence[str] = ()) -> int:
        """Writes the model to a file (vantage.v1.model_service_pb2.EXPORT_FORMAT_...); how many
        bytes. The file is there when it is whole. DataLoss: damaged on its way."""
        return _save(path, watch.exported(self._connection, model_service_pb2.ExportModelRequest(
            name=self.name, format=kind, scans=scans)))

    def report(self, path: Path, *, language: str = "en", utc_offset: float = 0,
               required_coverage: Optional[float] = None) -> int:
        """Writes the job's report, one HTML file that needs nothing else; how many bytes. `language`:
        "en" or "de"; `utc_offset`: s, whole minutes, added to the times in it; `required_coverage`:
        the share of a region's attainable surface that has to be at density for it to count as met,
        (0, 1], 0.95 if absent. The file is there when it is whole. DataLoss: damaged on its way."""
        return _save(path, watch.exported(self._connection, model_service_pb2.ExportReportRequest(
            name=self.name, language=language, utc_offset=_duration(utc_offset),
            required_coverage=required_coverage)))


def _save(path: Path, pieces: Iterator[bytes]) -> int:
    path = pathlib.Path(path)
    begun = path.with_name(path.name + ".part")
    try:
        with begun.open("wb") as file:
            size = sum(file.write(piece) for piece in pieces)
        begun.replace(path)
    except BaseException:
        begun.unlink(missing_ok=True)
        raise
    return size


def _prior(given: Optional[Prior]) -> Optional[geometry_pb2.PosePrior]:
    if given is None or isinstance(given, geometry_pb2.PosePrior):
        return given
    return prior_of(given)


def _silent(_: object) -> None:
    pass
