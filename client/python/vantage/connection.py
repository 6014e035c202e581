"""The link to a server: channel, credentials, calls with retries."""

from __future__ import annotations

import dataclasses
import ipaddress
import pathlib
import time
import uuid
from typing import Any, Dict, Iterator, Optional, Tuple, Union

import grpc

from vantage.errors import VantageError, from_rpc
from vantage.resumption import Backoff, LoadingWait
from vantage.v1 import (fleet_service_pb2, fleet_service_pb2_grpc, model_service_pb2,
                        model_service_pb2_grpc, plan_service_pb2, plan_service_pb2_grpc,
                        scan_service_pb2, scan_service_pb2_grpc, session_service_pb2,
                        session_service_pb2_grpc)

Path = Union[str, "pathlib.PurePath"]

_SERVICES = ((session_service_pb2, session_service_pb2_grpc, "Session"),
             (scan_service_pb2, scan_service_pb2_grpc, "Scan"),
             (plan_service_pb2, plan_service_pb2_grpc, "Plan"),
             (model_service_pb2, model_service_pb2_grpc, "Model"),
             (fleet_service_pb2, fleet_service_pb2_grpc, "Fleet"))
# As the C++ client: a link that goes silent is found dead within 9 s. It retries by itself, since
# that has to know request ids, RetryInfo and resuming. min_reconnect_backoff is what an attempt to
# connect may take: TCP, TLS and HTTP/2 greet in four round trips, of a second each over a satellite.
_CHANNEL = (("grpc.keepalive_time_ms", 5000), ("grpc.keepalive_timeout_ms", 4000),
            ("grpc.http2.max_pings_without_data", 0), ("grpc.min_reconnect_backoff_ms", 10_000),
            ("grpc.initial_reconnect_backoff_ms", 100), ("grpc.max_reconnect_backoff_ms", 2000),
            ("grpc.enable_retries", 0), ("grpc.max_receive_message_length", 64 << 20))


@dataclasses.dataclass
class Options:
    """How a server is reached."""

    server: str = "127.0.0.1:7464"
    """host:port, or unix:/a/path."""
    tls_ca: Optional[Path] = None
    """PEM file of what signed the server's certificate; without it the link is not encrypted."""
    tls_cert: Optional[Path] = None
    """PEM file of the client's own certificate, where the server asks for one."""
    tls_key: Optional[Path] = None
    """PEM file of its key."""
    token_file: Optional[Path] = None
    """File with a bearer token, read again for every call; it is only sent over an encrypted link
    or within this machine. ValueError otherwise."""
    timeout: float = 30.0
    """s, of a unary call, all its attempts together."""
    attempts: int = 4
    """Of a unary call while the server is unavailable."""
    give_up_after: float = 120.0
    """s without any progress, of uploads and watches."""
    loading_patience: float = 900.0
    """s that a server may take to load the model of a job, as after a restart, beside the others."""

    def __post_init__(self) -> None:
        if self.attempts < 1:
            raise ValueError(f"attempts: at least 1, not {self.attempts}")


class Connection:
    """Shared by a client and all that it gives out. Thread safe."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self._channel = _channel(options)
        self._methods: Dict[str, Any] = {}
        self.stubs: Dict[str, Any] = {}
        for messages, stubs, name in _SERVICES:
            stub = getattr(stubs, f"{name}ServiceStub")(self._channel)
            self.stubs[name] = stub
            for method in messages.DESCRIPTOR.services_by_name[f"{name}Service"].methods:
                if not method.client_streaming and not method.server_streaming:
                    self._methods[method.input_type.full_name] = getattr(stub, method.name)

    def close(self) -> None:
        self._channel.close()

    def metadata(self) -> Tuple[Tuple[str, str], ...]:
        """What goes with every call."""
        if self.options.token_file is None:
            return ()
        token = pathlib.Path(self.options.token_file).read_text().strip()
        if not token.isascii() or not token.isprintable() or " " in token:
            raise ValueError(f"{self.options.token_file} holds more than one token")
        return (("authorization", f"Bearer {token}"),)

    def failure(self, error: grpc.RpcError) -> VantageError:
        return from_rpc(error, self.options.server)

    def call(self, request: Any) -> Any:
        """The unary call that takes this message. VantageError."""
        method = self._methods.get(request.DESCRIPTOR.full_name)
        if method is None:
            raise TypeError(f"{request.DESCRIPTOR.full_name} is no request of a unary call")
        if "request_id" in request.DESCRIPTOR.fields_by_name and not request.request_id:
            # Repeating it after a break is harmless then.
            copy = type(request)()
            copy.CopyFrom(request)
            request = copy
            request.request_id = uuid.uuid4().hex
        loading = LoadingWait(self.options.loading_patience)
        deadline = time.monotonic() + self.options.timeout
        backoff = Backoff()
        attempt = 1
        while True:
            try:
                return method(request, timeout=max(0.0, deadline - time.monotonic()),
                              metadata=self.metadata())
            except grpc.RpcError as error:
                failure = self.failure(error)
            if loading.after(failure):
                deadline = time.monotonic() + self.options.timeout
                continue
            if not failure.transient or attempt == self.options.attempts:
                break
            attempt += 1
            wait = backoff.next(failure.retry_seconds)
            if time.monotonic() + wait > deadline:
                break
            self.wait(wait)
        raise failure

    def wait(self, seconds: float) -> None:
        """Before another attempt, and gets a lost link back meanwhile: gRPC goes on with a connection
        while somebody waits for it, and otherwise looks after it every 5 s only."""
        until = time.monotonic() + seconds
        ready = grpc.channel_ready_future(self._channel)
        try:
            ready.result(timeout=seconds)
        except grpc.FutureTimeoutError:
            pass
        finally:
            ready.cancel()
        time.sleep(max(0.0, until - time.monotonic()))

    def pages(self, request: Any, field: str) -> Iterator[Any]:
        """The entries of a list, page after page."""
        while True:
            page = self.call(request)
            yield from getattr(page, field)
            if not page.next_page_token:
                return
            request.page_token = page.next_page_token

    def healthy(self) -> bool:
        """Whether the server says SERVING. False also where it cannot be reached."""
        check = self._channel.unary_unary("/grpc.health.v1.Health/Check",
                                          request_serializer=lambda _: b"",
                                          response_deserializer=bytes)
        try:
            answer: bytes = check(None, timeout=self.options.timeout, metadata=self.metadata())
        except grpc.RpcError:
            return False
        return answer == b"\x08\x01"


def _stays_here(server: str) -> bool:
    if server.startswith(("localhost:", "[::1]:", "unix:")):
        return True
    try:  # a name may begin with 127., too
        return ipaddress.IPv4Address(server.rpartition(":")[0]).is_loopback
    except ValueError:
        return False


def _channel(options: Options) -> grpc.Channel:
    if (options.tls_cert is None) != (options.tls_key is None):
        raise ValueError("tls_cert and tls_key need one another")
    if options.tls_ca is None:
        if options.tls_cert is not None:
            raise ValueError("tls_cert needs tls_ca, to know the server by")
        if options.token_file is not None and not _stays_here(options.server):
            raise ValueError(f"token_file: the token would travel to {options.server} for everyone to "
                             "read; name the server's tls_ca")
        return grpc.insecure_channel(options.server, options=_CHANNEL)
    read = [None if path is None else pathlib.Path(path).read_bytes()
            for path in (options.tls_ca, options.tls_key, options.tls_cert)]
    return grpc.secure_channel(options.server, grpc.ssl_channel_credentials(*read), options=_CHANNEL)

