"""Streams of the server that outlive their links."""

from __future__ import annotations

from typing import Any, Callable, Iterator, Union

import grpc

from vantage.connection import Connection
from vantage.crc32c import crc32c
from vantage.errors import DataLoss, Unavailable, VantageError
from vantage.resumption import LoadingWait, Resumption
from vantage.v1 import event_pb2, model_service_pb2, plan_pb2, plan_service_pb2, session_service_pb2

ENDED = (plan_pb2.PLAN_STATE_SUCCEEDED, plan_pb2.PLAN_STATE_CANCELLED, plan_pb2.PLAN_STATE_FAILED)


def _answers(connection: Connection, method: Any, request: Any) -> Iterator[Any]:
    """Of one stream; closing the iterator ends it. VantageError."""
    stream = method(request, metadata=connection.metadata())
    try:
        yield from stream
    except grpc.RpcError as error:
        raise connection.failure(error) from error
    finally:
        stream.cancel()


def _loaded(connection: Connection, method: Any, request: Any) -> Iterator[Any]:
    """The same; begun again while the server loads the model, before which nothing comes."""
    loading = LoadingWait(connection.options.loading_patience)
    while True:
        try:
            yield from _answers(connection, method, request)
            return
        except VantageError as failure:
            if not loading.after(failure):
                raise


def _resumed(connection: Connection, method: Any, request: Callable[[], Any],
             ended: Callable[[], bool] = lambda: False) -> Iterator[Any]:
    """One stream after the other, until `ended`; heartbeats count as progress and are left out."""
    resumption = Resumption(connection.options.give_up_after, connection.wait)
    while True:
        failure: VantageError = Unavailable("the server closed the watch")
        try:
            for answer in _answers(connection, method, request()):
                yield answer
                # Whoever asked may have worked on it for long.
                resumption.progress()
        except VantageError as why:
            failure = why
        if ended():
            return
        resumption.after_break(failure)


def session_events(connection: Connection, name: str, after: int) -> Iterator[event_pb2.SessionEvent]:
    last = after
    for answer in _resumed(connection, connection.stubs["Session"].WatchSession,
                           lambda: session_service_pb2.WatchSessionRequest(name=name,
                                                                           after_sequence=last)):
        if answer.HasField("event") and answer.event.sequence > last:
            last = answer.event.sequence
            yield answer.event


def plan_revisions(connection: Connection, name: str) -> Iterator[plan_pb2.Plan]:
    latest = plan_pb2.Plan()
    for answer in _resumed(connection, connection.stubs["Plan"].WatchPlan,
                           lambda: plan_service_pb2.WatchPlanRequest(
                               name=name, after_revision=latest.revision),
                           lambda: latest.state in ENDED):
        if answer.HasField("plan"):
            latest = answer.plan
            yield latest


def exported(connection: Connection,
             request: Union[model_service_pb2.ExportModelRequest, model_service_pb2.ExportReportRequest]
             ) -> Iterator[bytes]:
    """Each piece is checked against its checksum and place. DataLoss otherwise."""
    stub = connection.stubs["Model"]
    of_model = isinstance(request, model_service_pb2.ExportModelRequest)
    method = stub.ExportModel if of_model else stub.ExportReport
    received = announced = 0
    for answer in _loaded(connection, method, request):
        if answer.HasField("heartbeat"):
            continue
        if answer.offset != received or crc32c(answer.data) != answer.crc32c:
            raise DataLoss(f"the export was damaged on its way, after {received} bytes")
        received += len(answer.data)
        announced = answer.total_size_bytes or announced
        yield answer.data
    if announced and announced != received:
        raise DataLoss(f"the export ended after {received} of {announced} bytes")
