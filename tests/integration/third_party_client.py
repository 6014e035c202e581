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
    from reflected_client import Reflected, error_of
except ImportError as missing:
    print(f"skipped: {missing} (Debian: python3-grpcio, python3-protobuf)")
    sys.exit(77)


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
                           "session": {"planningConfig": {"requiredDensityPerM2": 400}}})
    assert created.session.name == "sessions/other"
    assert created.session.planning_config.required_density_per_m2 == 400
    again = server.call(sessions, "CreateSession",
                        {"sessionId": "other", "requestId": "r1",
                         "session": {"planningConfig": {"requiredDensityPerM2": 400}}})
    assert again.session.name == "sessions/other", "the same request is harmless"

    code, text, metadata = error_of(lambda: server.call(sessions, "GetSession",
                                                        {"name": "sessions/nowhere"}))
    assert code == grpc.StatusCode.NOT_FOUND, code
    assert "nowhere" in text and "grpc-status-details-bin" in metadata, (text, metadata)
    code, text, metadata = error_of(lambda: server.call(
        sessions, "CreateSession",
        {"session": {"planningConfig": {"requiredDensityPerM2": -1, "minViewpointHeightM": -1}}}))
    assert code == grpc.StatusCode.INVALID_ARGUMENT, code
    details = metadata["grpc-status-details-bin"]
    assert b"required_density_per_m2" in details
    assert b"min_viewpoint_height_m" in details, "all violations, not the first"
    code, _, metadata = error_of(lambda: server.call(
        "vantage.v1.FleetService", "ListScanners", {"parent": "sessions/nowhere"}))
    assert code == grpc.StatusCode.NOT_FOUND and "grpc-status-details-bin" in metadata, code
    code, _, _ = error_of(lambda: server.call("vantage.v1.PlanService", "CreatePlan",
                                              {"parent": "sessions/other"}))
    assert code == grpc.StatusCode.FAILED_PRECONDITION, code


def main():
    with tempfile.TemporaryDirectory() as folder:
        port_file = pathlib.Path(folder, "port")
        with subprocess.Popen([sys.argv[1], "--listen", "127.0.0.1:0",
                               "--port-file", str(port_file),
                               "--data", str(pathlib.Path(folder, "data"))]) as server:
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
