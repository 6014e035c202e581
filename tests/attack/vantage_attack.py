#!/usr/bin/env python3
"""What abuse gets from the server: ./dev attack.

Starts servers of its own on free ports of 127.0.0.1, alone and behind HAProxy, and attacks nothing
else. Every attack is bounded in count and time; each row says what it got, and 'held' when the
server kept its promise: it lives, says so over HTTP, answers a well-behaved caller, and gave
nothing away.
"""
import argparse
import fcntl
import functools
import gzip
import hashlib
import hmac
import json
import os
import shutil
import socket
import ssl
import struct
import subprocess
import sys
import threading
import time

try:
    import grpc
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
except ImportError as missing:
    print(f"skipped: {missing}", file=sys.stderr)
    sys.exit(77)

import floods
from deployed import HAPROXY, OPENSSL, DeployedServer
from http2 import (CONTINUATION, DATA, END_HEADERS, END_STREAM, GOAWAY, HEADERS, PING, RST_STREAM,
                   SETTINGS, call, frame, integer, literal, message)
from identity_provider import IdentityProvider, base64url
from range_image import room, send, sphere
from server import Server
from web import WebAttacks

# What a flood may cost as deployed: memory, the time of a bystander's calls (p99), processor time.
MOST_MB, MOST_MS, MOST_CPU_S = 200, 100, 1
KNOWN = ("more connections than files (CVE-2023-4785)",)
HEALTH = b"/grpc.health.v1.Health/Check"


def crc32c(data):
    """Castagnoli's, a bit at a time: for small pieces."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def range_image(columns=8, rows=4, metres=2):
    """A small scan, encoded as upload.proto says: every range the same."""
    step = 0.1
    image = struct.pack("<4sHHIIdd", b"VRIM", 1, 0, columns, rows, step, step)
    image += struct.pack(f"<{rows}d", *(step * row for row in range(rows)))
    codes = [2 + 2 * int(metres * 10_000)] + [2] * (rows - 1)
    for column in range(columns):
        image += struct.pack("<d", step * column)
        for plane in range(4):
            image += bytes(code >> 8 * plane & 255 for code in codes)
    return image


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


class Contract:
    """Messages by name, from the descriptor set that the build makes."""

    def __init__(self, path):
        with open(path, "rb") as file:
            files = descriptor_pb2.FileDescriptorSet.FromString(file.read())
        self.pool = descriptor_pool.DescriptorPool()
        for one in files.file:
            self.pool.Add(one)

    def new(self, message_name, /, **fields):
        found = self.pool.FindMessageTypeByName("vantage.v1." + message_name)
        get = getattr(message_factory, "GetMessageClass", None)
        kind = get(found) if get else message_factory.MessageFactory(self.pool).GetPrototype(found)
        return kind(**fields)


def ask(channel, service, method, request, token=None, response_class=None, timeout=20):
    """(code name, details) of a unary call."""
    serialize = ((lambda raw: raw) if isinstance(request, bytes) else
                 (lambda m: m.SerializeToString()))
    invoke = channel.unary_unary(f"/vantage.v1.{service}/{method}", request_serializer=serialize,
                                 response_deserializer=lambda raw: raw)
    metadata = [("authorization", "Bearer " + token)] if token else []
    try:
        answer = invoke(request, timeout=timeout, metadata=metadata)
        return "OK", answer
    except grpc.RpcError as error:
        return error.code().name, error.details()


class Attacks(WebAttacks):
    """`start`: makes a server, given its flags."""

    def __init__(self, start, contract):
        self.start = start
        self.contract = contract
        self.rows = []

    # ---- Bookkeeping ------------------------------------------------------------------------

    def record(self, name, got, held, known=False, **figures):
        # What is known of gRPC 1.51, and stands in server/README.md with what keeps it away.
        known = not held and (known or name in KNOWN)
        row = {"attack": name, "got": got, "held": bool(held), "known": known, **figures}
        self.rows.append(row)
        extra = "  ".join(f"{key} {value}" for key, value in figures.items())
        print(f"{'held ' if held else 'KNOWN' if known else 'BROKE'}  {name}: {got}" +
              (f"  ({extra})" if extra else ""), flush=True)

    def start_is_bare(self):
        """Whether servers are attacked without a proxy in front."""
        return self.start.func is Server

    def well(self, server):
        """Whether it lives, and serves somebody who behaves."""
        if not server.alive() or server.get("/readyz")[0] != 200:
            return False
        return server.serves_others()

    def secured(self, *flags):
        """A server with callers: a tenant's administrator and two who plan, another's administrator,
        and one past its time."""
        server_folder = os.path.join(self.folder, "callers")
        with open(server_folder, "w") as file:
            os.chmod(server_folder, 0o600)
            for name, tenant, roles, token, more in (
                    ("owner", "museum", "administer", "owner-token", ""),
                    ("tablet", "museum", "plan,read", "tablet-token", ""),
                    ("rival", "museum", "plan,read", "rival-token", ""),
                    ("stranger", "castle", "administer", "stranger-token", ""),
                    ("late", "museum", "administer", "late-token", "2020-01-01T00:00:00Z")):
                file.write(f"{name} {tenant} {roles} token:{sha256(token)} {more}\n")
        return self.start("--callers", server_folder, *flags)

    # ---- With valid HTTP/2 and gRPC ---------------------------------------------------------

    def names_and_tokens(self):
        new = self.contract.new
        with self.secured() as server, server.channel() as channel:
            code, _ = ask(channel, "SessionService", "CreateSession",
                          new("CreateSessionRequest", session_id="job"), token="owner-token")
            get = new("GetSessionRequest", name="sessions/job")
            got = {who: ask(channel, "SessionService", "GetSession", get, token=token)[0]
                   for who, token in (("owner", "owner-token"), ("stranger", "stranger-token"),
                                      ("forged", "owner-tokem"), ("expired", "late-token"),
                                      ("none", None))}
            want = {"owner": "OK", "stranger": "NOT_FOUND", "forged": "UNAUTHENTICATED",
                    "expired": "UNAUTHENTICATED", "none": "UNAUTHENTICATED"}
            self.record("another tenant's names, forged and expired tokens",
                        ", ".join(f"{k}: {v}" for k, v in got.items()),
                        code == "OK" and got == want)
            delete = new("DeleteSessionRequest", name="sessions/job")
            got = ask(channel, "SessionService", "DeleteSession", delete, token="stranger-token")[0]
            there = ask(channel, "SessionService", "GetSession", get, token="owner-token")[0]
            self.record("deleting another tenant's session", got,
                        got == "NOT_FOUND" and there == "OK")
            self.claims(channel)
            guesses = 500
            codes = {}
            begun, cpu = time.monotonic(), server.cpu_seconds()
            for i in range(guesses):
                code = ask(channel, "SessionService", "GetSession", get, token=f"guess-{i}")[0]
                codes[code] = codes.get(code, 0) + 1
            lines = server.log().count("call failed")
            self.record(f"{guesses} guessed tokens", str(codes), "OK" not in codes and lines < 100,
                        log_lines=lines, cpu_s=round(server.cpu_seconds() - cpu, 2),
                        seconds=round(time.monotonic() - begun, 1))

    def jwt(self):
        """Tokens of an identity provider, genuine and not, and what a thousand forged ones cost."""
        if not OPENSSL:
            print("openssl is not installed: no JWTs are tried")
            return
        provider = IdentityProvider(self.folder, OPENSSL, "provider")
        stranger = IdentityProvider(self.folder, OPENSSL, "stranger")
        keys = os.path.join(self.folder, "jwt-keys")
        with open(keys, "w") as file:
            os.chmod(keys, 0o600)
            file.write(provider.key_set())
        good, forged = provider.token(), stranger.token()
        unsigned = provider.text({"alg": "none", "kid": "k"}, provider.claims())
        confused = provider.text({"alg": "HS256", "kid": "k"}, provider.claims())
        mac = hmac.new(provider.public, confused.encode(), "sha256").digest()
        tokens = {"good": good, "forged": forged, "unsigned": unsigned + ".",
                  "its signature without alg": unsigned + "." + good.split(".")[2],
                  "public key as secret": confused + "." + base64url(mac),
                  "key of its own": stranger.token({"jku": "http://127.0.0.1/keys"}),
                  "other kid": provider.token({"kid": "other"}),
                  "critical": provider.token({"crit": ["exp"]}),
                  "expired": provider.token(exp=int(time.time()) - 1),
                  "not yet": provider.token(nbf=int(time.time()) + 600),
                  "other audience": provider.token(aud="wiki"),
                  "other issuer": provider.token(iss="https://evil.example"),
                  "proxy": provider.token(tenant="*")}
        request = self.contract.new("ListSessionsRequest")
        with self.start("--jwt-keys", keys, "--jwt-issuer", "https://login.example",
                        "--jwt-audience", "vantage") as server, server.channel() as channel:
            def list_with(token):
                return ask(channel, "SessionService", "ListSessions", request, token=token)[0]

            got = {what: list_with(token) for what, token in tokens.items()}
            let_in = [what for what, code in got.items() if code == "OK"]
            self.record(f"{len(tokens)} JWTs", f"let in: {', '.join(let_in)}",
                        let_in == ["good"] and set(got.values()) == {"OK", "UNAUTHENTICATED"})
            forgeries = [forged[:-8] + base64url(i.to_bytes(6, "big")) for i in range(1000)]
            codes, cpu, begun = {}, server.cpu_seconds(), time.monotonic()
            for token in forgeries:
                code = list_with(token)
                codes[code] = codes.get(code, 0) + 1
            cpu, took = server.cpu_seconds() - cpu, time.monotonic() - begun
            # The same calls with what is no JWT at all: what the checks of signatures add.
            without = server.cpu_seconds()
            for i in range(1000):
                list_with(f"guess-{i}")
            without = server.cpu_seconds() - without
            known = list_with(good)
            self.record("1000 forged JWTs", f"{codes}; who was known before: {known}",
                        "OK" not in codes and known == "OK" and good not in server.log(),
                        cpu_s=round(cpu, 2), guesses_cpu_s=round(without, 2),
                        seconds=round(took, 1))

    def claims(self, channel):
        """Within a tenant: a claim is whoever took it's, and its administrator's."""
        new = self.contract.new
        made = [ask(channel, "FleetService", "CreateScanner",
                    new("CreateScannerRequest", parent="sessions/job", scanner_id="one",
                        scanner=new("Scanner")), token="owner-token")[0]]
        claim = new("ClaimViewRequest", parent="sessions/job",
                    scanner="sessions/job/scanners/one", position=new("Vector3", z=1.5))
        made.append(ask(channel, "FleetService", "ClaimView", claim, token="tablet-token")[0])
        name = "sessions/job/claims/claim-1"
        got = [ask(channel, "FleetService", method, new(method + "Request", name=name),
                   token="rival-token")[0] for method in ("RenewClaim", "ReleaseClaim")]
        own = [ask(channel, "FleetService", "RenewClaim", new("RenewClaimRequest", name=name),
                   token=token)[0] for token in ("tablet-token", "owner-token")]
        self.record("another caller's claim renewed and released", ", ".join(got),
                    made == ["OK", "OK"] and got == ["PERMISSION_DENIED"] * 2
                    and own == ["OK", "OK"])

    def shares(self):
        """A tenant that takes all memory with models that it uses all the time."""
        new = self.contract.new
        greedy, quiet = "owner-token", "stranger-token"
        image, done = room(180, 75, 3.0), threading.Event()
        with self.secured("--memory-mib", "96") as server, server.channel() as channel:
            def open_job(name, token):
                ask(channel, "SessionService", "CreateSession",
                    new("CreateSessionRequest", session_id=name), token=token)
                return send(ask, channel, new, f"sessions/{name}", image, token=token)

            def merged(scan, token, seconds):
                until = time.monotonic() + seconds
                while time.monotonic() < until:
                    if self.scan_state(channel, scan, token)[0] == "SCAN_STATE_MERGED":
                        return True
                    time.sleep(0.1)
                return False

            jobs = []
            for number in range(12):
                code, scan = open_job(f"greedy-{number}", greedy)
                if code != "OK" or not merged(scan, greedy, 10):
                    break
                jobs.append(f"sessions/greedy-{number}")

            def use():
                while not done.is_set():
                    for job in jobs:
                        ask(channel, "SessionService", "GetCoverage",
                            new("GetCoverageRequest", name=job), token=greedy)

            user = threading.Thread(target=use)
            user.start()
            begun = time.monotonic()
            code, scan = open_job("quiet", quiet)
            there = code == "OK" and merged(scan, quiet, 60)
            took = time.monotonic() - begun
            done.set()
            user.join()
            self.record(f"all of 96 MiB held by {len(jobs)} models of one tenant, used all the time",
                        f"another tenant's scan is merged: {there}",
                        there and server.get("/readyz")[0] == 200,
                        seconds=round(took, 1))

    def uploads(self):
        """What an upload takes that it should not: after its end, and what is no scan at all."""
        new = self.contract.new
        with self.start() as server, server.channel() as channel:
            ask(channel, "SessionService", "CreateSession",
                new("CreateSessionRequest", session_id="job"))

            def begin(number, **upload):
                ask(channel, "ScanService", "CreateUpload", new(
                    "CreateUploadRequest", parent="sessions/job", upload=new("Upload", **upload)))
                return f"sessions/job/uploads/upload-{number}"

            def send(upload, data, sequence=0, offset=0, total=None):
                piece = new("Piece", sequence=sequence, offset=offset, data=data,
                            crc32c=crc32c(data))
                request = new("UploadPieceRequest", upload=upload, piece=piece)
                if total is not None:
                    request.total.CopyFrom(total)
                return ask(channel, "ScanService", "UploadPiece", request)[0]

            def total_of(image):
                return new("UploadTotal", encoded_size_bytes=len(image),
                           sha256=hashlib.sha256(image).digest())

            image, other = range_image(), range_image(metres=3)
            upload = begin(1, total=total_of(image))
            sent = [send(upload, image), send(upload, image)]
            got = [send(upload, other), send(upload, image, sequence=1),
                   send(upload, image, total=total_of(other))]
            self.record("another scan's pieces and total after the commit", ", ".join(got),
                        sent == ["OK", "OK"] and got == ["FAILED_PRECONDITION"] * 3
                        and self.well(server))
            junk, pieces, code = b"J" * 4096, 0, "OK"
            upload = begin(2)
            while code == "OK" and pieces < 64:
                code = send(upload, junk, pieces, pieces * len(junk))
                pieces += 1
            self.record("an upload that is no range image", f"{code} after {pieces} pieces",
                        code == "INVALID_ARGUMENT" and pieces == 1 and self.well(server))

    def failures(self):
        """Uploads that fail, with all that an upload can tell, leave nothing behind."""
        new, failed = self.contract.new, 4000
        targets = [new("TargetSighting", name=f"{number:0100}", in_scan=new("Vector3", x=number))
                   for number in range(100)]
        image = range_image()
        whole = new("Piece", data=image, crc32c=crc32c(image))
        another = new("UploadTotal", encoded_size_bytes=len(image), sha256=bytes(32))
        with self.start("--calls-per-second", "100000") as server, server.channel() as channel:
            ask(channel, "SessionService", "CreateSession",
                new("CreateSessionRequest", session_id="job"))
            memory, codes = server.memory_mb(), set()
            # No faster than HAProxy lets one address call (5000 in 10 s), or the row is of that.
            begun, calls_per_second = time.monotonic(), 400
            for number in range(failed):
                time.sleep(max(0, begun + 2 * number / calls_per_second - time.monotonic()))
                create = new("CreateUploadRequest", parent="sessions/job",
                             upload=new("Upload", targets=targets, total=another))
                codes.add(ask(channel, "ScanService", "CreateUpload", create)[0])
                piece = new("UploadPieceRequest", piece=whole,
                            upload=f"sessions/job/uploads/upload-{number + 1}")
                codes.add(ask(channel, "ScanService", "UploadPiece", piece)[0])
            time.sleep(2)
            left = [json.loads(line)["bytes"] for line in server.log().splitlines()
                    if "the log was compacted" in line]
            self.record(f"{failed} uploads that fail, {2 * failed * create.ByteSize() >> 20} MiB of log",
                        f"{', '.join(sorted(codes))}; {(left or [0])[-1] >> 20} MiB are left",
                        codes == {"OK", "DATA_LOSS"} and left and left[-1] < 30 << 20
                        and self.well(server),
                        memory_mb=round(server.memory_mb() - memory))

    def paths_and_counts(self):
        new = self.contract.new
        with self.start() as server:
            with server.channel() as channel:
                tricks = ["../../etc/passwd", "a/../b", "/etc/passwd", "a\x00b", "%2e%2e%2f", "..",
                          "CON", "a" * 100_000, "a\n{\"level\":\"audit\"}"]
                codes = {ask(channel, "SessionService", "CreateSession",
                             new("CreateSessionRequest", session_id=trick))[0] for trick in tricks}
                codes |= {ask(channel, "ScanService", "GetScan",
                              new("GetScanRequest", name=f"sessions/{trick}/scans/{trick}"))[0]
                          for trick in tricks}
                forged = any(line.startswith('{"level":"audit"}')
                             for line in server.log().splitlines())
                self.record("path tricks in ids", ", ".join(sorted(codes)),
                            codes == {"INVALID_ARGUMENT"} and not forged)
                memory = server.memory_mb()
                request = new("CreateSessionRequest")
                for _ in range(200_000):
                    request.session.scanner_models.add()
                codes = [ask(channel, "SessionService", "CreateSession", request)[0]]
                codes.append(ask(channel, "SessionService", "ListSessions",
                                 new("ListSessionsRequest", page_size=2**31 - 1))[0])
                codes.append(ask(channel, "SessionService", "ListSessions",
                                 new("ListSessionsRequest", page_size=-1))[0])
                # Groups within groups, a length that goes on beyond the end, a field of 2^29.
                codes.append(ask(channel, "SessionService", "CreateSession", b"\x0b" * 100_000)[0])
                codes.append(ask(channel, "SessionService", "CreateSession",
                                 b"\x12\xff\xff\xff\xff\x07x")[0])
                # A page that is too large is a page of the most there may be; all else is refused.
                self.record("huge counts and malformed messages", ", ".join(codes),
                            codes[1] == "OK" and codes.count("OK") == 1 and self.well(server),
                            memory_mb=round(server.memory_mb() - memory))
                codes = set()
                for size in (5 << 20, 64 << 20):
                    codes.add(ask(channel, "SessionService", "CreateSession",
                                  b"\x1a" + varint(size) + b"x" * size)[0])
                self.record("messages of 5 and 64 MiB", ", ".join(sorted(codes)),
                            codes <= {"RESOURCE_EXHAUSTED", "UNAVAILABLE"} and self.well(server),
                            memory_mb=round(server.memory_mb() - memory))

    def bombs(self):
        """256 MiB of zeros in 256 KiB, as gRPC's own compression brings it."""
        size = 256 << 20
        bomb = gzip.compress(b"\0" * size, 9)
        with self.start() as server:
            memory = server.memory_mb()
            link = server.link()
            link.send(frame(HEADERS, END_HEADERS, 1,
                            call(b"/vantage.v1.SessionService/CreateSession",
                                 literal(b"grpc-encoding", b"gzip"))))
            body = message(bomb, compressed=True)
            for at in range(0, len(body), 16384):
                last = at + 16384 >= len(body)
                link.send(frame(DATA, END_STREAM if last else 0, 1, body[at:at + 16384]))
            peak = memory
            until = time.monotonic() + 5
            while time.monotonic() < until:
                peak = max(peak, server.memory_mb())
                time.sleep(0.02)
            link.close()
            self.record("decompression bomb, 256 MiB in 256 KiB by gzip", "refused",
                        peak - memory < 64 and self.well(server), peak_mb=round(peak - memory))

    # ---- What is large for its bytes --------------------------------------------------------

    def scan_state(self, channel, scan, token=None):
        new = self.contract.new
        code, got = ask(channel, "ScanService", "GetScan", new("GetScanRequest", name=scan),
                        token=token)
        if code != "OK":
            return code, ""
        scan = type(new("GetScanResponse")).FromString(got).scan
        return scan.DESCRIPTOR.fields_by_name["state"].enum_type.values_by_number[
            scan.state].name, scan.state_message

    def large_scans(self):
        """A hall of 60 m radius seen in every direction: 8 kB once compressed, gigabytes merged."""
        new = self.contract.new
        with self.start("--memory-mib", "1024") as server, server.channel() as channel:
            session = new("Session")
            session.scanner_models.add().max_range_m = 100
            ask(channel, "SessionService", "CreateSession",
                new("CreateSessionRequest", session_id="job", session=session))
            memory = peak = server.memory_mb()
            code, scan = send(ask, channel, new, "sessions/job", sphere(720, 300, 60.0))
            until, state, why = time.monotonic() + 60, "", ""
            while code == "OK" and time.monotonic() < until:
                peak = max(peak, server.memory_mb())
                state, why = self.scan_state(channel, scan)
                if state not in ("SCAN_STATE_RECEIVED", "SCAN_STATE_REGISTERING",
                                 "SCAN_STATE_MERGING"):
                    break
                time.sleep(0.02)
            code, good = send(ask, channel, new, "sessions/job", sphere(180, 75, 4.0))
            while code == "OK" and time.monotonic() < until:
                if self.scan_state(channel, good)[0] == "SCAN_STATE_MERGED":
                    break
                time.sleep(0.05)
            merged = code == "OK" and self.scan_state(channel, good)[0] == "SCAN_STATE_MERGED"
            self.record("a scan of 8 kB that takes gigabytes, with 1 GiB", f"{state}: {why[:60]}",
                        state == "SCAN_STATE_FAILED" and merged and peak - memory < 1024
                        and self.well(server), peak_mb=round(peak - memory))

    # ---- What outlives what it was for ------------------------------------------------------

    def names_used_again(self):
        """A watch that is not read, while its session goes and another tenant takes the name."""
        new = self.contract.new
        with self.secured() as server, server.channel() as channel:
            create = new("CreateSessionRequest", session_id="job")
            ask(channel, "SessionService", "CreateSession", create, token="owner-token")
            link = server.link()
            # A window of 0: nothing can be sent until the client says so.
            link.send(frame(SETTINGS, 0, 0, b"\0\x04" + (0).to_bytes(4, "big")))
            request = message(new("WatchSessionRequest", name="sessions/job").SerializeToString())
            link.send(frame(HEADERS, END_HEADERS, 1,
                            call(b"/vantage.v1.SessionService/WatchSession",
                                 literal(b"authorization", b"Bearer owner-token")))
                      + frame(DATA, END_STREAM, 1, request))
            time.sleep(0.5)
            ask(channel, "SessionService", "DeleteSession",
                new("DeleteSessionRequest", name="sessions/job"), token="owner-token")
            secret = "seen-by-castle-alone"
            ask(channel, "SessionService", "CreateSession", create, token="stranger-token")
            reject = new("RejectViewRequest", parent="sessions/job", reason=secret)
            reject.position.x = 1
            code, _ = ask(channel, "PlanService", "RejectView", reject, token="stranger-token")
            link.send(frame(SETTINGS, 0, 0, b"\0\x04" + (1 << 20).to_bytes(4, "big")))
            read = b"".join(body for _, _, _, body in link.read_frames(GOAWAY, patience=3))
            link.close()
            self.record("a watch of a deleted session whose name another tenant took",
                        f"{len(read)} bytes, the other's among them: {secret.encode() in read}",
                        code == "OK" and secret.encode() not in read and server.alive())

    # ---- Shutting down ----------------------------------------------------------------------

    def shutdown(self):
        """SIGTERM while large scans are merged and streams are open that nobody reads."""
        new = self.contract.new
        drain = 2
        with self.start("--drain-seconds", str(drain)) as server, server.channel() as channel:
            session = new("Session")
            session.scanner_models.add().max_range_m = 100
            ask(channel, "SessionService", "CreateSession",
                new("CreateSessionRequest", session_id="job", session=session))
            sent = [send(ask, channel, new, "sessions/job", sphere(360, 150, 25.0))[0]
                    for _ in range(4)]
            link = server.link()
            link.send(frame(SETTINGS, 0, 0, b"\0\x04" + (0).to_bytes(4, "big")))
            watch = message(new("WatchSessionRequest", name="sessions/job").SerializeToString())
            for stream in range(1, 41, 2):
                link.send(frame(HEADERS, END_HEADERS, stream,
                                call(b"/vantage.v1.SessionService/WatchSession"))
                          + frame(DATA, END_STREAM, stream, watch))
            time.sleep(0.5)
            begun = time.monotonic()
            server.process.terminate()
            code = server.process.wait(60)
            seconds = time.monotonic() - begun
            link.close()
            self.record(f"SIGTERM at work, with {drain} s to drain",
                        f"ended with {code} after {seconds:.1f} s",
                        set(sent) == {"OK"} and code == 0 and seconds < drain + 2)

    def log_readers(self):
        """Whoever reads the log stalls, and then dies."""
        new = self.contract.new
        drain = 2
        read, write = os.pipe()
        fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, 4096)
        with self.start("--calls-per-second", "0", "--drain-seconds", str(drain),
                        stderr=write) as server, server.channel() as channel:
            os.close(write)

            def served(count):
                codes = [ask(channel, "SessionService", "DeleteSession",
                             new("DeleteSessionRequest", name=f"sessions/none-{number}"))[0]
                         for number in range(count)]
                return codes.count("NOT_FOUND")

            stalled = served(3000)
            lost = [line for line in server.get("/metrics")[1].splitlines()
                    if line.startswith("vantage_log_lines_lost_total ")]
            os.close(read)
            gone = served(300)
            begun = time.monotonic()
            server.process.terminate()
            code = server.process.wait(60)
            seconds = time.monotonic() - begun
            self.record("a log that nobody reads, then nobody can",
                        f"{stalled} of 3000 and {gone} of 300 calls answered; "
                        f"{' '.join(lost)}; SIGTERM ended it with {code} after {seconds:.1f} s",
                        stalled == 3000 and gone == 300 and lost and code == 0
                        and seconds < drain + 2)

    def renewals(self):
        """A new certificate is written, and its key only later: everybody still gets in."""
        if self.start.func is not Server or not OPENSSL:
            return  # HAProxy ends the encryption before the server
        def path(name):
            return os.path.join(self.folder, name)
        for name in ("old", "new"):
            subprocess.run([OPENSSL, "req", "-x509", "-newkey", "ec", "-pkeyopt",
                            "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj",
                            "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout",
                            path(name + ".key"), "-out", path(name + ".pem")], check=True,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for kind in ("pem", "key"):
            shutil.copy(path("old." + kind), path("server." + kind))
        with self.start("--tls-cert", path("server.pem"), "--tls-key",
                        path("server.key")) as server:
            def lets_in(name):
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
                context.load_verify_locations(path(name + ".pem"))
                context.set_alpn_protocols(["h2"])
                try:
                    with socket.create_connection(("127.0.0.1", server.port), 5) as link, \
                            context.wrap_socket(link, server_hostname="127.0.0.1"):
                        return True
                except OSError:
                    return False

            def tries(seconds, name):
                until, got = time.monotonic() + seconds, []
                while time.monotonic() < until:
                    got.append(lets_in(name))
                    time.sleep(0.1)
                return got
            shutil.copy(path("new.pem"), path("server.pem"))
            between = tries(12, "old")  # both look at the files every few seconds
            said = "is not the key" in server.get("/readyz")[1]
            shutil.copy(path("new.key"), path("server.key"))
            after = tries(12, "new")
            self.record("a certificate renewed without its key, then the key",
                        f"{sum(between)} of {len(between)} got in between, /readyz said so: {said}; "
                        f"then with the new one: {after[-1]}",
                        all(between) and said and after[-1])

    # ---- Connections ------------------------------------------------------------------------

    def connections(self):
        with self.start() as server:
            memory = server.memory_mb()
            def open_links(count, **how):
                for _ in range(count):
                    try:
                        yield server.link(**how)
                    except OSError:
                        pass  # refused
            silent = list(open_links(500, greet=False))
            greeted = list(open_links(500))
            well = self.well(server)
            held = round(server.memory_mb() - memory)
            until = time.monotonic() + 40
            left = silent + greeted
            while left and time.monotonic() < until:
                still = []
                for link in left:
                    link.socket.settimeout(0.001)
                    try:
                        data = link.socket.recv(65536)
                        if data:
                            still.append(link)
                    except TimeoutError:
                        still.append(link)
                    except OSError:
                        pass
                left = still
            self.record("a thousand connections that say nothing",
                        f"{len(silent) + len(greeted)} were let in, {1000 - len(left)} are gone "
                        "within 40 s", well and not left
                        and self.well(server), memory_mb=held)
            for link in silent + greeted:
                link.close()

    def few_files(self):
        """CVE-2023-4785: accept() that fails for want of files."""
        with self.start(files=128) as server:
            links = []
            for _ in range(400):
                try:
                    links.append(server.link(patience=1))
                except OSError:
                    break
            for link in links:
                link.close()
            until, well = time.monotonic() + 20, False
            while not well and time.monotonic() < until:
                try:
                    well = self.well(server)
                except OSError:
                    time.sleep(0.2)
            self.record("more connections than files (CVE-2023-4785)",
                        f"{len(links)} connections with 128 files; serves again once they are "
                        f"closed: {well}", well)

    def slow_readers(self):
        """A listing that fills megabytes, asked for 200 times and never read."""
        new = self.contract.new
        with self.start() as server:
            with server.channel() as channel:
                for i in range(100):
                    ask(channel, "SessionService", "CreateSession",
                        new("CreateSessionRequest", session_id=f"job-{i}"))
            memory = server.memory_mb()
            request = message(new("ListSessionsRequest", page_size=1000).SerializeToString())
            links = []
            for _ in range(10):
                link = server.link()
                for stream in range(1, 41, 2):
                    link.send(frame(HEADERS, END_HEADERS, stream,
                                    call(b"/vantage.v1.SessionService/ListSessions"))
                              + frame(DATA, END_STREAM, stream, request))
                links.append(link)
            time.sleep(3)
            held = round(server.memory_mb() - memory)
            well = self.well(server)
            time.sleep(12)
            after = round(server.memory_mb() - memory)
            self.record("200 answers that nobody reads", f"held {held} MB for them",
                        well and held < 200, after_15_s_mb=after)
            for link in links:
                link.close()

    # ---- Malformed HTTP/2 -------------------------------------------------------------------

    def flood(self, name, make, known=False, wait=4):
        """Sends what `make(link)` sends: what processor time it costs, and whether all is well.
        Behind HAProxy it costs the server next to nothing; what some cost a server alone is known
        of gRPC 1.51 (server/README.md)."""
        alone = self.start.func is Server
        with self.start() as server:
            cpu, begun = server.cpu_seconds(), time.monotonic()
            link = server.link()
            sent = make(link)
            link.read_frames(GOAWAY, patience=wait)
            slow = time.monotonic()
            well = self.well(server)
            answer = time.monotonic() - slow
            spent = server.cpu_seconds() - cpu if server.alive() else float("nan")
            got = sent + ("; connection closed" if link.closed else "; connection stays")
            self.record(name, got if server.alive() else "THE SERVER ENDED",
                        well and spent <= MOST_CPU_S, known=known and alone and well,
                        cpu_s=round(spent, 2),
                        answer_s=round(answer, 2), seconds=round(time.monotonic() - begun, 1))
            link.close()

    def malformed(self):
        def continuation(link, size=4 << 20):
            link.send(frame(HEADERS, 0, 1, call(HEALTH) + b"\x00" + integer(1, 7) + b"x" +
                            integer(size, 7)))
            for _ in range(size // 16384):
                if not link.send(frame(CONTINUATION, 0, 1, b"a" * 16384)):
                    break
            return "4 MiB in one header value"

        def zeros(link, count=250):
            link.send(frame(HEADERS, 0, 1, call(HEALTH) + b"\x00\x7f" + b"\x80" * 16000))
            for _ in range(count):
                if not link.send(frame(CONTINUATION, 0, 1, b"\x80" * 16384)):
                    break
            return "4 MiB of leading zeros of one integer"

        def resets(link, count=20_000):
            for i in range(count):
                if not link.send(frame(HEADERS, END_HEADERS, 2 * i + 1, call(HEALTH))
                                 + frame(RST_STREAM, 0, 2 * i + 1, b"\0\0\0\x08")):
                    return f"{i} calls, each reset at once"
            return f"{count} calls, each reset at once"

        def pings(link, count=50_000):
            for i in range(count):
                if not link.send(frame(PING, 0, 0, b"12345678")):
                    return f"{i} pings"
            return f"{count} pings"

        def settings(link, count=50_000):
            for i in range(count):
                if not link.send(frame(SETTINGS)):
                    return f"{i} settings"
            return f"{count} settings"

        def nonsense(link):
            link.send(bytes(i * 7 % 256 for i in range(1 << 20)))
            return "1 MiB of noise"

        def base64(link):
            link.send(frame(HEADERS, END_HEADERS, 1, call(HEALTH, literal(b"x-bin", b"!!!"))))
            return "a -bin header that is none"

        def aborts(link):
            long = b"".join(literal(b"x-%d" % i, b"a" * 3000, indexed=True) for i in range(6))
            for stream, block in enumerate([
                    call(HEALTH, te=b"x") + long, call(HEALTH, scheme=b"x") + long,
                    call(HEALTH) + literal(b"grpclb_client_stats", b"x") + long]):
                link.send(frame(HEADERS, END_HEADERS, 2 * stream + 1, block))
            return "te, :scheme and grpclb_client_stats before more than 8 KiB"

        self.flood("header flood (CVE-2023-33953)", continuation, known=True, wait=8)
        self.flood("padded HPACK integer (CVE-2023-33953)", zeros, known=True)
        self.flood("rapid reset (CVE-2023-44487)", resets, known=True)
        self.flood("ping flood", pings)
        self.flood("settings flood", settings)
        self.flood("noise", nonsense)
        self.flood("bad base64 (CVE-2023-32732)", base64)
        self.flood("invalid te and :scheme (CVE-2023-1428)", aborts)

    # ---- Floods beside a bystander ----------------------------------------------------------

    def floods(self):
        """Two connections for six seconds each, and what somebody at another address has of it."""
        alone = self.start.func is Server
        for kind, name in (("resets", "rapid resets (CVE-2023-44487)"),
                           ("continuations", "headers without end in CONTINUATION"),
                           ("unknown", "calls of a method that there is not"),
                           ("settings", "SETTINGS")):
            # As many calls as come, so that the limits are those in front.
            with self.start("--calls-per-second", "0") as server:
                port, ca = server.flood_target()
                got = floods.run(kind, port, server.processes(), ca)
                grown = {key: mb for key, mb in got.items() if key.endswith("_mb")}
                well = self.well(server)
                stopped = (f", ended after {got['stopped_after_s']} s" if got["stopped_after_s"]
                           else "")
                self.record(f"flood: {name}",
                            f"{got['sent']} frames{stopped}; of {got['calls']} calls of a "
                            f"bystander {got['failed']} failed",
                            well and got["failed"] == 0 and got["p99_ms"] < MOST_MS
                            and all(mb < MOST_MB for mb in grown.values()),
                            known=alone and server.alive(), p50_ms=got["p50_ms"],
                            p99_ms=got["p99_ms"], **grown)

    def run(self, only):
        import tempfile
        with tempfile.TemporaryDirectory(prefix="vantage-attack-") as self.folder:
            for part in (self.names_and_tokens, self.jwt, self.shares, self.uploads, self.failures, self.paths_and_counts, self.bombs,
                         self.large_scans, self.names_used_again, self.shutdown, self.log_readers, self.renewals,
                         self.connections, self.few_files, self.slow_readers, self.malformed,
                         self.floods, self.web_slow, self.web_idle, self.web_pipelined, self.web_streams,
                         self.web_answers, self.web_vanished, self.web_bodies, self.web_floods):
                if not only or part.__name__.startswith(only):
                    part()
        return self.rows


def varint(value):
    out = bytearray()
    while value >= 128:
        out.append(value % 128 + 128)
        value //= 128
    out.append(value)
    return bytes(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", required=True, help="the vantaged to start")
    parser.add_argument("--contract", required=True, help="its descriptor set, vantage.v1.binpb")
    parser.add_argument("--only", default="", help="names_and_tokens, jwt, shares, uploads, paths_and_counts, "
                        "bombs, large_scans, names_used_again, shutdown, log_readers, renewals, connections, "
                        "few_files, slow_readers, malformed, floods, web_slow, web_idle, web_pipelined, "
                        "web_streams, web_answers, web_vanished, web_bodies, web_floods, or what several begin with: web")
    parser.add_argument("--haproxy-cfg", help="attack it also as deployed: behind HAProxy with "
                        "this configuration")
    parser.add_argument("--minutes", type=float, default=0, help="again and again for so long")
    parser.add_argument("--out", help="write the rows here as JSON")
    arguments = parser.parse_args()
    contract = Contract(arguments.contract)
    starts = {"alone": functools.partial(Server, arguments.server)}
    if arguments.haproxy_cfg and HAPROXY and OPENSSL:
        starts["behind HAProxy"] = functools.partial(DeployedServer, arguments.haproxy_cfg,
                                                     arguments.server)
    elif arguments.haproxy_cfg:
        print("haproxy or openssl is not installed: the server is attacked alone")
    rows = []
    until = time.monotonic() + 60 * arguments.minutes
    while not rows or time.monotonic() < until:
        for against, start in starts.items():
            print(f"The server {against}:", flush=True)
            rows += [{"against": against, **row}
                     for row in Attacks(start, contract).run(arguments.only)]
    if arguments.out:
        with open(arguments.out, "w") as file:
            json.dump(rows, file, indent=1)
    broke = [(row["against"], row["attack"]) for row in rows
             if not row["held"] and not row["known"]]
    known = sum(row["known"] for row in rows)
    print(f"{sum(row['held'] for row in rows)} of {len(rows)} held" +
          (f", {known} known of gRPC 1.51" if known else ""))
    return 1 if broke else 0


if __name__ == "__main__":
    sys.exit(main())
