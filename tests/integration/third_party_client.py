#!/usr/bin/env python3
"""The service as an independent client finds it: by reflection alone, without our protos or stubs.

Usage: third_party_client.py VANTAGED. Exit status 77: the modules it needs are not installed.
"""

import pathlib
import signal
import subprocess
import sys
import tempfile
import time

try:
    import grpc
    from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory
except ImportError as missing:
    print(f"skipped: {missing} (Debian: python3-grpcio, python3-protobuf)")
    sys.exit(77)


def reflection_pool():
    """The messages of grpc.reflection.v1alpha that are needed, built by hand."""
    field = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(
        name="reflection.proto", package="grpc.reflection.v1alpha", syntax="proto3")

    def message(name, *fields):
        made = file.message_type.add(name=name)
        for number, field_name, kind, label, type_name in fields:
            made.field.add(number=number, name=field_name, type=kind, label=label,
                           type_name=type_name)

    one, many = field.LABEL_OPTIONAL, field.LABEL_REPEATED
    message("ServerReflectionRequest", (4, "file_containing_symbol", field.TYPE_STRING, one, None),
            (7, "list_services", field.TYPE_STRING, one, None))
    message("FileDescriptorResponse", (1, "file_descriptor_proto", field.TYPE_BYTES, many, None))
    message("ServiceResponse", (1, "name", field.TYPE_STRING, one, None))
    message("ListServiceResponse", (1, "service", field.TYPE_MESSAGE, many,
                                    ".grpc.reflection.v1alpha.ServiceResponse"))
    message("ServerReflectionResponse",
            (4, "file_descriptor_response", field.TYPE_MESSAGE, one,
             ".grpc.reflection.v1alpha.FileDescriptorResponse"),
            (6, "list_services_response", field.TYPE_MESSAGE, one,
             ".grpc.reflection.v1alpha.ListServiceResponse"))
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return pool


def message_class(pool, name):
    return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))


class Reflected:
    """A channel whose methods are known from the server's own description."""

    def __init__(self, channel):
        self.channel = channel
        pool = reflection_pool()
        self.request = message_class(pool, "grpc.reflection.v1alpha.ServerReflectionRequest")
        response = message_class(pool, "grpc.reflection.v1alpha.ServerReflectionResponse")
        self.ask_stream = channel.stream_stream(
            "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
            request_serializer=self.request.SerializeToString,
            response_deserializer=response.FromString)
        self.pool = descriptor_pool.DescriptorPool()
        self.files = {}

    def ask(self, **what):
        return next(iter(self.ask_stream(iter([self.request(**what)]))))

    def services(self):
        listed = self.ask(list_services="*").list_services_response.service
        return sorted(service.name for service in listed)

    def describe(self, symbol):
        raw = self.ask(file_containing_symbol=symbol).file_descriptor_response.file_descriptor_proto
        assert raw, f"{symbol} cannot be described"
        for data in raw:
            file = descriptor_pb2.FileDescriptorProto.FromString(data)
            self.files.setdefault(file.name, file)
        added = set()

        def add(name):
            if name in added:
                return
            added.add(name)
            for dependency in self.files[name].dependency:
                add(dependency)
            try:
                self.pool.FindFileByName(name)
            except KeyError:
                self.pool.Add(self.files[name])

        for name in list(self.files):
            add(name)
        return self.pool.FindServiceByName(symbol)

    def call(self, service, method, body, timeout=30):
        described = self.pool.FindServiceByName(service).FindMethodByName(method)
        request = message_class(self.pool, described.input_type.full_name)
        response = message_class(self.pool, described.output_type.full_name)
        unary = self.channel.unary_unary(
            f"/{service}/{method}", request_serializer=request.SerializeToString,
            response_deserializer=response.FromString)
        return unary(json_format.ParseDict(body, request()), timeout=timeout)


def error_of(call):
    try:
        call()
    except grpc.RpcError as error:
        details = dict((key, value) for key, value in error.trailing_metadata() or ())
        return error.code(), error.details(), details
    raise AssertionError("the call succeeded")


def check(address):
    server = Reflected(grpc.insecure_channel(address))
    services = server.services()
    print("services:", ", ".join(services))
    for wanted in ("SessionService", "ScanService", "PlanService", "ModelService", "FleetService"):
        assert f"vantage.v1.{wanted}" in services, wanted
    assert "grpc.health.v1.Health" in services
    for service in services:
        if service.startswith("vantage.") or service.startswith("grpc.health."):
            methods = [method.name for method in server.describe(service).methods]
            print(f"{service}: {', '.join(methods)}")

    health = server.call("grpc.health.v1.Health", "Check", {"service": "vantage.v1.PlanService"})
    assert health.status == 1, health

    sessions = "vantage.v1.SessionService"
    created = server.call(sessions, "CreateSession",
                          {"sessionId": "other", "requestId": "r1",
                           "session": {"planningConfig": {"requiredDensity": 400}}})
    assert created.session.name == "sessions/other"
    assert created.session.planning_config.required_density == 400
    again = server.call(sessions, "CreateSession",
                        {"sessionId": "other", "requestId": "r1",
                         "session": {"planningConfig": {"requiredDensity": 400}}})
    assert again.session.name == "sessions/other", "the same request is harmless"

    code, text, metadata = error_of(lambda: server.call(sessions, "GetSession",
                                                        {"name": "sessions/nowhere"}))
    assert code == grpc.StatusCode.NOT_FOUND, code
    assert "nowhere" in text and "grpc-status-details-bin" in metadata, (text, metadata)
    code, text, metadata = error_of(lambda: server.call(
        sessions, "CreateSession",
        {"session": {"planningConfig": {"requiredDensity": -1, "minHeight": -1}}}))
    assert code == grpc.StatusCode.INVALID_ARGUMENT, code
    assert b"required_density" in metadata["grpc-status-details-bin"]
    assert b"min_height" in metadata["grpc-status-details-bin"], "all violations, not the first"
    code, _, metadata = error_of(lambda: server.call(
        "vantage.v1.FleetService", "ListScanners", {"parent": "sessions/other"}))
    assert code == grpc.StatusCode.UNIMPLEMENTED and "grpc-status-details-bin" in metadata, code
    code, _, _ = error_of(lambda: server.call("vantage.v1.PlanService", "CreatePlan",
                                              {"parent": "sessions/other"}))
    assert code == grpc.StatusCode.FAILED_PRECONDITION, code


def main():
    with tempfile.TemporaryDirectory() as folder:
        port_file = pathlib.Path(folder, "port")
        with subprocess.Popen([sys.argv[1], "--listen", "127.0.0.1:0", "--port-file",
                               str(port_file), "--data", str(pathlib.Path(folder, "data"))]) as server:
            try:
                deadline = time.monotonic() + 60
                while not (port_file.exists() and port_file.read_text().strip()):
                    assert server.poll() is None, "the server ended"
                    assert time.monotonic() < deadline, "the server did not start"
                    time.sleep(0.05)
                check(f"127.0.0.1:{port_file.read_text().strip()}")
                server.send_signal(signal.SIGTERM)
                assert server.wait(timeout=60) == 0, server.returncode
            finally:
                server.kill()
    print("ok")


if __name__ == "__main__":
    main()
