"""What the server refuses, and what to do about it."""

from __future__ import annotations

import dataclasses
from typing import Dict, List, Optional

import grpc

from vantage.google.rpc import error_details_pb2, status_pb2
from vantage.v1 import error_pb2


@dataclasses.dataclass(frozen=True)
class FieldViolation:
    """One field of a request that is wrong."""

    field: str
    """Its path, such as `session.planning_config.required_density_per_m2`."""
    description: str
    """What is wrong with it, and what may stand there."""


class VantageError(Exception):
    """A call that failed. Its text has cause, violations and fix; its class follows the code."""

    code: grpc.StatusCode = grpc.StatusCode.UNKNOWN
    """The canonical code."""

    def __init__(self, cause: str, fix: str = "") -> None:
        super().__init__(cause)
        self.cause = cause
        self.violations: List[FieldViolation] = []
        """All fields that are wrong, not the first alone."""
        self.fix = fix
        """What to do about it; may be empty."""
        self.reason = ""
        """The server's stable reason, such as SCAN_LOST, for programs; empty from the network."""
        self.metadata: Dict[str, str] = {}
        """What belongs to the reason."""
        self.retry_seconds: Optional[float] = None
        """The server asks to wait so long, s, and then to call again."""
        self.claim_conflict: Optional[error_pb2.ClaimConflict] = None
        """Whose place it is, with reason CLAIMED."""
        self.expected_piece: Optional[error_pb2.ExpectedPiece] = None
        """Which piece an upload goes on with, with reason UPLOAD_GAP."""

    def __str__(self) -> str:
        wrong = "".join(f"\n  {v.field}: {v.description}" for v in self.violations)
        return f"{self.cause}{wrong}" + (f"\n  fix: {self.fix}" if self.fix else "")

    @property
    def transient(self) -> bool:
        """The same call may succeed after a wait."""
        return self.code is grpc.StatusCode.UNAVAILABLE or (
            self.code is grpc.StatusCode.RESOURCE_EXHAUSTED and self.retry_seconds is not None)


def _kind(code: grpc.StatusCode) -> type:
    name = "".join(part.title() for part in code.name.split("_"))
    return type(name, (VantageError,), {"code": code, "__module__": __name__,
                                        "__doc__": f"A VantageError with code {code.name}."})


_KINDS = {code: _kind(code) for code in grpc.StatusCode if code is not grpc.StatusCode.OK}
InvalidArgument = _KINDS[grpc.StatusCode.INVALID_ARGUMENT]
NotFound = _KINDS[grpc.StatusCode.NOT_FOUND]
AlreadyExists = _KINDS[grpc.StatusCode.ALREADY_EXISTS]
FailedPrecondition = _KINDS[grpc.StatusCode.FAILED_PRECONDITION]
OutOfRange = _KINDS[grpc.StatusCode.OUT_OF_RANGE]
Unavailable = _KINDS[grpc.StatusCode.UNAVAILABLE]
DeadlineExceeded = _KINDS[grpc.StatusCode.DEADLINE_EXCEEDED]
ResourceExhausted = _KINDS[grpc.StatusCode.RESOURCE_EXHAUSTED]
PermissionDenied = _KINDS[grpc.StatusCode.PERMISSION_DENIED]
Unauthenticated = _KINDS[grpc.StatusCode.UNAUTHENTICATED]
Unimplemented = _KINDS[grpc.StatusCode.UNIMPLEMENTED]
Aborted = _KINDS[grpc.StatusCode.ABORTED]
Cancelled = _KINDS[grpc.StatusCode.CANCELLED]
DataLoss = _KINDS[grpc.StatusCode.DATA_LOSS]
Internal = _KINDS[grpc.StatusCode.INTERNAL]

# Where neither the server nor the caller names one.
_FIXES = {
    grpc.StatusCode.UNAVAILABLE: "start the server with 'vantaged', or connect() to another address",
    grpc.StatusCode.DEADLINE_EXCEEDED: "try again, or connect() with a longer timeout",
    grpc.StatusCode.UNIMPLEMENTED: "a later release of the server brings it",
    grpc.StatusCode.ABORTED: "someone else changed it in the meantime: read it again, then repeat",
    grpc.StatusCode.UNAUTHENTICATED: "connect() with token_file=, or with tls_cert= and tls_key=",
    grpc.StatusCode.PERMISSION_DENIED: "ask the server's operator for the role",
    grpc.StatusCode.INTERNAL: "try again; if it happens again, the server's log says more",
    grpc.StatusCode.UNKNOWN: "try again; if it happens again, the server's log says more",
}


def from_rpc(error: grpc.RpcError, server: str) -> VantageError:
    """A failed call of gRPC's, at an address, with all that the server said."""
    code = error.code() or grpc.StatusCode.UNKNOWN
    made = _KINDS[code]((error.details() or code.name).rstrip("."))
    trailers = {key: value for key, value in error.trailing_metadata() or ()}
    for detail in status_pb2.Status.FromString(trailers.get("grpc-status-details-bin", b"")).details:
        _read(detail.type_url.rpartition("/")[2], detail.value, made)
    if not made.reason:  # from the network
        if code is grpc.StatusCode.UNAVAILABLE:
            made.cause = f"cannot reach the server at {server} ({made.cause})"
        elif code is grpc.StatusCode.DEADLINE_EXCEEDED:
            made.cause = f"the server at {server} did not answer in time"
    if made.violations:
        made.fix = "correct the fields named above"
    elif made.retry_seconds is not None and made.transient and made.reason:
        made.fix = f"try again in {made.retry_seconds:.1f} s"
    else:
        made.fix = made.fix or _FIXES.get(code, "")
    made.__cause__ = error
    return made


def _read(kind: str, value: bytes, into: VantageError) -> None:
    if kind == "google.rpc.BadRequest":
        into.violations += [FieldViolation(v.field, v.description) for v in
                            error_details_pb2.BadRequest.FromString(value).field_violations]
    elif kind == "google.rpc.ErrorInfo":
        info = error_details_pb2.ErrorInfo.FromString(value)
        into.reason, into.metadata = info.reason, dict(info.metadata)
    elif kind == "google.rpc.RetryInfo":
        delay = error_details_pb2.RetryInfo.FromString(value).retry_delay
        into.retry_seconds = delay.seconds + 1e-9 * delay.nanos
    elif kind == "vantage.v1.ClaimConflict":
        into.claim_conflict = error_pb2.ClaimConflict.FromString(value)
    elif kind == "vantage.v1.ExpectedPiece":
        into.expected_piece = error_pb2.ExpectedPiece.FromString(value)
