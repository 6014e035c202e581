"""A server, from where a program calls it."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Iterator, Optional, Type

from vantage.connection import Connection, Options
from vantage.session import Session
from vantage.v1 import scanner_model_pb2, session_pb2, session_service_pb2


class Client:
    """Close it, or use it as a context manager. Thread safe. Methods may raise a VantageError."""

    def __init__(self, options: Options) -> None:
        self._connection = Connection(options)

    def close(self) -> None:
        self._connection.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()

    def create_session(self, session_id: str = "", *,
                       scanner: Optional[scanner_model_pb2.ScannerModel] = None,
                       density: Optional[float] = None, voxel_size: Optional[float] = None,
                       display_name: str = "",
                       session: Optional[session_pb2.Session] = None) -> Session:
        """Opens a job.

        session_id: 1 to 63 of [a-z0-9-], starting with a letter; empty: the server chooses.
        scanner: what measures, such as image.scanner(). density: required, samples / m^2.
        voxel_size: m, [0.01, 0.5]. session: all else that can be said of it. AlreadyExists: the id
        is taken. InvalidArgument: names every field that is wrong.
        """
        asked = session_pb2.Session()
        if session is not None:
            asked.CopyFrom(session)
        if scanner is not None:
            asked.scanner_models.add().CopyFrom(scanner)
        if density is not None:
            asked.planning_config.required_density_per_m2 = density
        if voxel_size is not None:
            asked.model_config.voxel_size_m = voxel_size
        if display_name:
            asked.display_name = display_name
        made = self.call(session_service_pb2.CreateSessionRequest(session_id=session_id,
                                                                  session=asked))
        return Session(self._connection, made.session.name)

    def session(self, identifier: str) -> Session:
        """By its id or name; nothing is asked of the server."""
        name = identifier if "/" in identifier else f"sessions/{identifier}"
        return Session(self._connection, name)

    def sessions(self, text: str = "") -> Iterator[session_pb2.Session]:
        """All, oldest first, or those whose id or display name contains the text."""
        return self._connection.pages(session_service_pb2.ListSessionsRequest(text=text), "sessions")

    def healthy(self) -> bool:
        """Whether the server says that it serves; False also where it cannot be reached."""
        return self._connection.healthy()

    def call(self, request: Any) -> Any:
        """Any unary call of vantage.v1, by its request: with retries while the server is
        unavailable, and an id that makes repeating it harmless."""
        return self._connection.call(request)


def connect(server: str = "127.0.0.1:7464", **options: Any) -> Client:
    """A client of the server at host:port (or unix:/a/path). options: as of vantage.Options, such
    as tls_ca= and token_file=. Nothing is sent yet. ValueError: they don't fit together."""
    return Client(Options(server=server, **options))
