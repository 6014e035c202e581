"""A scan of a job."""

from __future__ import annotations

from typing import List, Optional, Union

from vantage import watch
from vantage.arrays import Array
from vantage.connection import Connection
from vantage.geometry import prior as prior_of
from vantage.v1 import (geometry_pb2, pose_comparison_pb2, scan_pb2, scan_service_pb2,
                        session_service_pb2)

DECIDED = (scan_pb2.SCAN_STATE_MERGED, scan_pb2.SCAN_STATE_DOUBTFUL, scan_pb2.SCAN_STATE_FAILED,
           scan_pb2.SCAN_STATE_WITHDRAWN)


class Scan:
    """One that the server has. Every method may raise a VantageError."""

    def __init__(self, connection: Connection, name: str) -> None:
        self._connection = connection
        self.name = name
        """sessions/{session}/scans/{scan}."""

    def get(self) -> scan_pb2.Scan:
        """As it is now: state, pose, registration, what merging it did."""
        return self._connection.call(scan_service_pb2.GetScanRequest(name=self.name)).scan

    def wait(self) -> scan_pb2.Scan:
        """Until it is merged, doubtful, failed or withdrawn: changes no further unless a person
        acts. Resumes after breaks."""
        session = "/".join(self.name.split("/")[:2])
        # The session is read first: later changes of the scan arrive as events.
        after = self._connection.call(
            session_service_pb2.GetSessionRequest(name=session)).session.last_sequence
        latest = self.get()
        if latest.state in DECIDED:
            return latest
        for event in watch.session_events(self._connection, session, after):
            what = getattr(event, event.WhichOneof("event") or "session_created")
            if "scan" not in what.DESCRIPTOR.fields_by_name or isinstance(what.scan, str):
                continue
            if what.scan.name == self.name:
                latest = what.scan
                if latest.state in DECIDED:
                    break
        return latest

    def accept(self, rival_pose: int = 0) -> scan_pb2.Scan:
        """Merges a doubtful one where its alignment put it, or at the n-th of its
        `registration.rival_poses`. FailedPrecondition in any other state."""
        return self._connection.call(scan_service_pb2.AcceptScanRequest(
            name=self.name, rival_pose=rival_pose)).scan

    def set_pose(self, prior: Union[geometry_pb2.PosePrior, geometry_pb2.Pose, Array],
                 as_is: bool = False) -> scan_pb2.Scan:
        """Aligns it anew from there; as_is: merges it at exactly this pose."""
        given = prior if isinstance(prior, geometry_pb2.PosePrior) else prior_of(prior)
        return self._connection.call(scan_service_pb2.SetScanPoseRequest(
            name=self.name, prior=given, use=scan_service_pb2.POSE_USE_AS_IS if as_is else
            scan_service_pb2.POSE_USE_ALIGN)).scan

    def withdraw(self) -> List[str]:
        """Takes it out of the model, which is then as if it had never been made. The names of the
        scans that had been aligned to it, which keep their poses."""
        return list(self._connection.call(
            scan_service_pb2.WithdrawScanRequest(name=self.name)).dependent_scans)

    def compare(self, max_samples: Optional[int] = None) -> pose_comparison_pb2.PoseComparison:
        """What fits the model and what contradicts it, at each pose at which it may have been
        made."""
        return self._connection.call(scan_service_pb2.CompareScanPosesRequest(
            name=self.name, max_sample_count=max_samples or 0)).comparison
