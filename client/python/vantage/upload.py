"""Sending a scan: pieces under the server's credit, resumed after every break."""

from __future__ import annotations

import dataclasses
import hashlib
import threading
import time
from typing import Any, Callable, Iterator, Optional, Tuple

import grpc

from vantage.connection import Connection
from vantage.crc32c import crc32c
from vantage.errors import (Cancelled, DataLoss, FailedPrecondition, Internal, OutOfRange,
                            ResourceExhausted, Unavailable, VantageError)
from vantage.resumption import Resumption
from vantage.v1 import scan_pb2, scan_service_pb2, upload_pb2

try:
    import zstandard
except ImportError:  # pieces go as they are
    zstandard = None

PIECE_BYTES = 256 << 10
"""Large enough to compress well, small enough to lose little when a link breaks."""
SILENCE = 9.0
"""s. The server speaks at least every 5 s: a link silent for longer than this is dead."""
_OPEN = upload_pb2.UPLOAD_STATE_OPEN
_READING = upload_pb2.UPLOAD_STATE_READING
_COMMITTED = upload_pb2.UPLOAD_STATE_COMMITTED


@dataclasses.dataclass
class UploadProgress:
    """How far a scan is on its way to the server."""

    acknowledged_bytes: int = 0
    """Stored by the server."""
    total_bytes: int = 0
    sent_bytes: int = 0
    """On the wire, compressed, repetitions included."""
    reconnects: int = 0
    committed: bool = False


Report = Callable[[UploadProgress], None]


def make_piece(data: bytes, sequence: int, offset: int) -> upload_pb2.Piece:
    """The piece that holds `data` (not empty) at this place of the whole."""
    piece = upload_pb2.Piece(sequence=sequence, offset=offset, uncompressed_size_bytes=len(data),
                             crc32c=crc32c(data), data=data,
                             compression=upload_pb2.COMPRESSION_NONE)
    if zstandard is not None:
        compressed = zstandard.ZstdCompressor().compress(data)
        if len(compressed) < len(data):
            piece.data, piece.compression = compressed, upload_pb2.COMPRESSION_ZSTD
    return piece


@dataclasses.dataclass
class _Heard:
    """What the server said so far over one stream."""

    stored: int  # every byte before this offset
    credit: int  # bytes may be sent up to here
    state: int = _OPEN
    ended: bool = False  # the stream
    silent: bool = False  # nothing was heard for too long

    @property
    def over(self) -> bool:
        return self.ended or self.silent or self.state != _OPEN


class _Stream:
    """Sends over one stream what the server lacks."""

    def __init__(self, connection: Connection, upload: upload_pb2.Upload, data: bytes,
                 progress: UploadProgress) -> None:
        self._upload, self._data, self._progress = upload, data, progress
        self._piece_bytes = min(PIECE_BYTES, upload.max_piece_size_bytes or PIECE_BYTES)
        self._changed = threading.Condition()
        self._heard = _Heard(upload.next_offset, upload.credit_offset)
        self._heard_at = time.monotonic()
        self._failure: Optional[grpc.RpcError] = None
        self._calls = connection.stubs["Scan"].UploadScan(self._requests(),
                                                          metadata=connection.metadata())

    def run(self, report: Report) -> Tuple[_Heard, Optional[grpc.RpcError]]:
        reader = threading.Thread(target=self._read, name="vantage-upload", daemon=True)
        reader.start()
        try:
            while True:
                reported = self._progress.acknowledged_bytes
                now = self._wait(lambda heard: heard.stored > reported)
                if now.stored > reported:
                    self._progress.acknowledged_bytes = now.stored
                    report(self._progress)
                if now.over:
                    break
            # The server ends the stream after its last word.
            self._wait(lambda heard: heard.ended, whatever_state=True)
        finally:
            self._calls.cancel()
            reader.join()
        return self._heard, self._failure

    def _wait(self, ready: Callable[[_Heard], bool], whatever_state: bool = False) -> _Heard:
        """Until the server's answers suit, the stream has ended, or it is silent."""
        with self._changed:
            while not (self._heard.ended or self._heard.silent or ready(self._heard) or
                       (self._heard.over and not whatever_state)):
                left = self._heard_at + SILENCE - time.monotonic()
                if left <= 0:
                    self._heard.silent = True
                    self._changed.notify_all()
                else:
                    self._changed.wait(left)
            return dataclasses.replace(self._heard)

    def _read(self) -> None:
        try:
            for answer in self._calls:
                with self._changed:
                    heard = self._heard
                    heard.stored = max(heard.stored, answer.next_offset)
                    heard.credit = max(heard.credit, answer.credit_offset)
                    heard.state = answer.state or heard.state
                    self._heard_at = time.monotonic()
                    self._changed.notify_all()
        except grpc.RpcError as error:
            self._failure = error
        with self._changed:
            self._heard.ended = True
            self._changed.notify_all()

    def _requests(self) -> Iterator[scan_service_pb2.UploadScanRequest]:
        """Runs in a thread of gRPC's."""
        sequence, offset = self._upload.next_sequence, self._upload.next_offset
        first = True
        while first or offset < len(self._data):
            wanted = min(self._piece_bytes, len(self._data) - offset)
            # A short piece is sent only when no acknowledgement is on its way that would bring more
            # credit.
            now = self._wait(lambda heard: heard.credit - offset >= wanted or
                             (heard.credit > offset and heard.stored >= offset))
            if now.over:
                return
            size = min(wanted, now.credit - offset)
            request = scan_service_pb2.UploadScanRequest(upload=self._upload.name if first else "")
            first = False
            if size > 0:
                request.piece.CopyFrom(make_piece(self._data[offset:offset + size], sequence, offset))
                self._progress.sent_bytes += len(request.piece.data)
                sequence, offset = sequence + 1, offset + size
            yield request
        # The final answer comes after the last piece: committed, or not what was announced.
        self._wait(lambda heard: False)


def _may_come_again(connection: Connection, upload: upload_pb2.Upload) -> bool:
    """The scan has to be sent once more, since the upload or the scan that it became is gone."""
    if upload.state in (_OPEN, _READING):
        return False
    if upload.state != _COMMITTED:
        return True
    scans = list(upload.scans) or [upload.scan]
    return all(connection.call(scan_service_pb2.GetScanRequest(name=name)).scan.state ==
               scan_pb2.SCAN_STATE_WITHDRAWN for name in scans)


def _begin_or_find(connection: Connection,
                   create: scan_service_pb2.CreateUploadRequest) -> upload_pb2.Upload:
    """The upload is named by its content. So the same scan for the same session is the same upload,
    however often its sender starts anew: it goes on where it was, and arrives once."""
    content = hashlib.sha256(create.SerializeToString(deterministic=True)).hexdigest()[:32]
    most = 1000
    for times in range(most):
        create.request_id = f"scan-{content}-{times}"
        upload: upload_pb2.Upload = connection.call(create).upload
        if not _may_come_again(connection, upload):
            return upload
    raise ResourceExhausted(f"this scan was sent and withdrawn {most} times")


def send(connection: Connection, session: str, upload: upload_pb2.Upload, data: bytes,
         report: Report) -> upload_pb2.Upload:
    """All of the bytes; the upload as it is then. VantageError."""
    upload.total.encoded_size_bytes = len(data)
    upload.total.sha256 = hashlib.sha256(data).digest()
    create = scan_service_pb2.CreateUploadRequest(parent=session, upload=upload)
    progress = UploadProgress(total_bytes=len(data))
    resumption = Resumption(connection.options.give_up_after, connection.wait)

    def resumed(call: Callable[[], Any]) -> Any:
        while True:
            try:
                return call()
            except VantageError as failure:
                if failure.transient:
                    progress.reconnects += 1
                    report(progress)
                resumption.after_break(failure)

    state = resumed(lambda: _begin_or_find(connection, _without_id(create)))
    while True:
        if state.state in (_COMMITTED, _READING):
            progress.acknowledged_bytes, progress.committed = len(data), True
            report(progress)
            return state
        if upload.HasField("file") and state.state == upload_pb2.UPLOAD_STATE_FAILED:
            return state
        if state.state != _OPEN:
            raise FailedPrecondition(
                f"the server refused the scan: {state.state_message}",
                "send the scan again; if it is refused again, what it was made of is at fault")
        before = state.next_offset
        heard, failure = _Stream(connection, state, data, progress).run(report)
        if heard.stored > before:
            resumption.progress()
        if heard.state == _OPEN:
            progress.reconnects += 1
            report(progress)
            resumption.after_break(_of_the_stream(connection, failure))
        name = state.name
        state = resumed(lambda: connection.call(scan_service_pb2.GetUploadRequest(name=name)).upload)


def _without_id(create: scan_service_pb2.CreateUploadRequest) -> scan_service_pb2.CreateUploadRequest:
    fresh = scan_service_pb2.CreateUploadRequest()
    fresh.CopyFrom(create)
    return fresh


def _of_the_stream(connection: Connection, failure: Optional[grpc.RpcError]) -> VantageError:
    """Why a stream ended; faults that leave the upload as it is may be tried again."""
    if failure is None:
        return Unavailable("the server closed the stream")
    why = connection.failure(failure)
    if isinstance(why, (OutOfRange, DataLoss, Cancelled, Internal)):
        return Unavailable(why.cause)
    return why
