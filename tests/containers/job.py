"""A scanning job as another's client would run it: by reflection, one call after the other."""

import base64
import hashlib
import math
import pathlib
import sys
import time

import grpc

import room_scan

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "integration"))
from reflected_client import Reflected, error_of  # noqa: E402,F401

SESSIONS, SCANS, PLANS, MODELS = (f"vantage.v1.{name}Service"
                                  for name in ("Session", "Scan", "Plan", "Model"))
UNDER_WAY = 1, 2, 3  # SCAN_STATE_RECEIVED, _REGISTERING, _MERGING
SCANNER = {"azimuthStepRad": math.radians(1.5), "elevationStepRad": math.radians(1.5),
           "rangeNoiseM": 0.002}


def healthy(address, credentials=None, timeout=1.0):
    """Whether a server says SERVING there."""
    with channel_to(address, credentials) as channel:
        check = channel.unary_unary("/grpc.health.v1.Health/Check",
                                    request_serializer=lambda _: b"",
                                    response_deserializer=bytes)
        try:
            return check(None, timeout=timeout) == b"\x08\x01"
        except grpc.RpcError:
            return False


def channel_to(address, credentials=None):
    options = (("grpc.enable_http_proxy", 0), ("grpc.max_reconnect_backoff_ms", 200))
    if credentials is None:
        return grpc.insecure_channel(address, options=options)
    return grpc.secure_channel(address, credentials, options=options)


class Job:
    """One session on the server at `address`."""

    def __init__(self, address, session="job", credentials=None, metadata=()):
        self.channel = channel_to(address, credentials)
        self.client = Reflected(self.channel, metadata)
        self.name = f"sessions/{session}"

    def close(self):
        self.channel.close()

    def create(self, density=100, voxel=0.05):
        return self.client.call(SESSIONS, "CreateSession", {
            "sessionId": self.name.split("/")[1],
            "session": {"scannerModels": [SCANNER], "modelConfig": {"voxelSizeM": voxel},
                        "planningConfig": {"requiredDensityPerM2": density}}}).session

    def get(self):
        return self.client.call(SESSIONS, "GetSession", {"name": self.name}).session

    def scans(self):
        return self.client.call(SCANS, "ListScans", {"parent": self.name}).scans

    def open_upload(self, image, prior=None):
        upload = {"total": {"encodedSizeBytes": len(image),
                            "sha256": base64.b64encode(hashlib.sha256(image).digest()).decode()}}
        if prior:
            upload["prior"] = prior
        return self.client.call(SCANS, "CreateUpload",
                                {"parent": self.name, "upload": upload}).upload

    def send(self, upload, image, pieces=None):
        """Sends what is missing, or the next `pieces` of it; answers the upload."""
        sent = 0
        size = min(upload.max_piece_size_bytes, 16 * 1024)
        while upload.next_offset < len(image) and (pieces is None or sent < pieces):
            data = image[upload.next_offset:upload.next_offset + size]
            upload = self.client.call(SCANS, "UploadPiece", {
                "upload": upload.name,
                "piece": {"sequence": upload.next_sequence, "offset": upload.next_offset,
                          "data": base64.b64encode(data).decode(),
                          "crc32c": room_scan.crc32c(data)}}).upload
            sent += 1
        return upload

    def push(self, image, prior=None):
        """Sends a scan and waits until the model has it; answers what became of it."""
        upload = self.send(self.open_upload(image, prior), image)
        assert upload.scan, upload
        return self.decided(upload.scan)

    def decided(self, scan):
        """Waits for the scan's end by following the session's events from the first."""
        merged = "scan_merged", "scan_refused"
        for response in self.client.watch(SESSIONS, "WatchSession", {"name": self.name}):
            kind = response.event.WhichOneof("event")
            if kind in merged and getattr(response.event, kind).scan.name == scan:
                break
        return self.client.call(SCANS, "GetScan", {"name": scan}).scan

    def decided_or_waiting(self, scan):
        """As soon as a scan is decided, or says what it waits for."""
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            got = self.client.call(SCANS, "GetScan", {"name": scan}).scan
            if got.state not in UNDER_WAY or got.state_message:
                return got
            time.sleep(0.02)
        raise AssertionError(f"{scan} neither decided nor said what it waits for")

    def plan(self, **how):
        """Makes a plan and follows it to its end; by default one that can be repeated."""
        made = self.start_plan(**(how or {"workLimitRays": 3000000, "seed": 7}))
        for response in self.client.watch(PLANS, "WatchPlan", {"name": made.name}):
            last = response
        assert last.last, last
        return self.client.call(PLANS, "GetPlan", {"name": made.name}).plan

    def start_plan(self, **how):
        return self.client.call(PLANS, "CreatePlan", {"parent": self.name, "plan": how}).plan

    def coverage(self):
        return self.client.call(MODELS, "GetCoverage", {"name": self.name}).coverage


def what_was_planned(plan):
    """All of a plan that must be the same when it is made again."""
    views = plan.result.views
    return [view.SerializeToString(deterministic=True) for view in views]
