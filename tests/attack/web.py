#!/usr/bin/env python3
"""Abuse of the web's port: HTTP/1.1 and the Connect protocol, by hand.

As a program it is one side of a flood: web.py FLOOD|bystander PORT SECONDS [--ca FILE] [--source
ADDRESS] [--deaf]; what came of it goes to standard output as JSON.
"""
import argparse
import ctypes
import json
import os
import shutil
import signal
import socket
import ssl
import struct
import subprocess
import threading
import time
import zlib

from floods import run, watch

LISTING = "/vantage.v1.SessionService/ListSessions"
# What is promised of who is slow: 10 s for a head, 30 s for each 64 KiB of a body, 60 s between
# requests (server/web/connection.h); and what a busy machine may take longer.
HEAD_SECONDS, BODY_SECONDS, IDLE_SECONDS, LATE_SECONDS = 10, 30, 60, 8
# Within which a link that fell silent is noticed, by what was under way (server/README.md, 'By the
# web'); and what the kernel's timers may take longer.
VANISHED_SECONDS = {"silent": 15, "asked once": 15, "streams": 21, "unread answers": 15}
TIMER_SECONDS = 2


def request(path=LISTING, body=b"{}", kind="application/json", more=(), method="POST", length=None):
    lines = [f"{method} {path} HTTP/1.1", "host: localhost", f"content-type: {kind}",
             f"content-length: {len(body) if length is None else length}", *more, "", ""]
    return "\r\n".join(lines).encode() + body


def enveloped(body, flags=0, length=None):
    return bytes([flags]) + struct.pack(">I", len(body) if length is None else length) + body


class WebLink:
    """A connection to the web's port. `tls`: whom to believe, where it is encrypted."""

    def __init__(self, port, source=None, tls=None, patience=10, host="127.0.0.1", window=None):
        self.socket = socket.socket()
        self.socket.settimeout(patience)
        if window is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, window)
        if source is not None:
            self.socket.bind((source, 0))
        try:
            self.socket.connect((host, port))
            if tls is not None:
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
                context.load_verify_locations(tls)
                context.set_alpn_protocols(["http/1.1"])
                self.socket = context.wrap_socket(self.socket, server_hostname="localhost")
        except OSError:
            self.socket.close()
            raise
        self.rest = b""

    def send(self, data):
        """Whether it went."""
        try:
            self.socket.sendall(data)
            return True
        except OSError:
            return False

    def answer(self, patience=10):
        """(status, body) of the next answer; (0, b"") where none came."""
        self.socket.settimeout(patience)
        try:
            while b"\r\n\r\n" not in self.rest:
                self.more()
            head, self.rest = self.rest.split(b"\r\n\r\n", 1)
            fields = dict(line.lower().split(b": ", 1) for line in head.split(b"\r\n")[1:])
            length = int(fields.get(b"content-length", b"0"))
            while len(self.rest) < length:
                self.more()
            body, self.rest = self.rest[:length], self.rest[length:]
            return int(head.split()[1]), body
        except (OSError, ValueError):
            return 0, b""

    def more(self):
        came = self.socket.recv(1 << 16)
        if not came:
            raise OSError("ended")
        self.rest += came

    def ended(self):
        """Whether the other end has ended it, by now."""
        self.socket.setblocking(False)
        try:
            while self.socket.recv(1 << 16):
                pass
            return True
        except (BlockingIOError, ssl.SSLWantReadError):
            return False
        except OSError:
            return True
        finally:
            try:
                self.socket.settimeout(10)
            except OSError:
                pass

    def close(self):
        self.socket.close()


def open_sessions(link, count):
    """So that a listing is long."""
    for number in range(count):
        session = {"sessionId": f"job-{number}", "session": {"displayName": "x" * 100}}
        link.send(request("/vantage.v1.SessionService/CreateSession", json.dumps(session).encode()))
        link.answer()
    link.close()


def links_of(server, count, **how):
    """As many as are let in."""
    links = []
    for _ in range(count):
        try:
            links.append(server.web_link(**how))
        except OSError:
            pass
    return links


def own_address():
    """One of this machine's that is not a loopback address; None: there is none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        try:
            one.connect(("192.0.2.254", 9))  # nothing is sent
            address = one.getsockname()[0]
        except OSError:
            return None
    return None if address.startswith("127.") else address


class WebAttacks:
    """Rows over the web's port. What they are recorded with is in Attacks."""

    def web_well(self, server):
        """Whether somebody else is served, over gRPC and by the web."""
        if not self.well(server):
            return False
        try:
            link = server.web_link(source="127.0.0.9")
        except OSError:
            return False
        link.send(request())
        status, _ = link.answer(20)
        link.close()
        return status == 200

    def web_slow(self):
        """Heads and bodies that come a byte a second, and connections that say nothing."""
        with self.start() as server:
            memory = server.memory_mb()
            each = 200 if server.proxied is None else 15  # HAProxy lets one address have fifty
            silent = links_of(server, each)
            heads, bodies = links_of(server, each), links_of(server, each)
            for link in heads:
                link.send(f"POST {LISTING} HTTP/1.1\r\nhost: localhost\r\n".encode())
            for link in bodies:
                link.send(request(body=b"", length=1_000_000))
            held = round(server.memory_mb() - memory)
            well = self.web_well(server)
            groups = ((silent, None, IDLE_SECONDS, "that say nothing"),
                      (heads, b"x", HEAD_SECONDS, "whose head comes a byte a second"),
                      (bodies, b" ", BODY_SECONDS, "whose body comes a byte a second"))
            begun, last = time.monotonic(), [0.0] * len(groups)
            left = [list(links) for links, *_ in groups]
            while any(left) and time.monotonic() < begun + IDLE_SECONDS + LATE_SECONDS:
                for number, (_, byte, _, _) in enumerate(groups):
                    if byte:
                        for link in left[number]:
                            link.send(byte)
                    still = [link for link in left[number] if not link.ended()]
                    if len(still) < len(left[number]):
                        last[number] = time.monotonic() - begun
                    left[number] = still
                time.sleep(1)
            well = well and self.web_well(server)
            for number, (links, _, promised, what) in enumerate(groups):
                self.record(f"web: {len(links)} connections {what}",
                            f"{len(links) - len(left[number])} are gone after {last[number]:.0f} s",
                            well and not left[number] and last[number] < promised + LATE_SECONDS,
                            memory_mb=held)
            for link in silent + heads + bodies:
                link.close()

    def web_idle(self):
        """10,000 connections of one address, each of which has had an answer and keeps silent."""
        address = own_address()
        flags, how = (), {}
        if self.start_is_bare() and address is not None:
            # A server that strangers reach: of this machine's own connections it counts none.
            flags = ("--web", "0.0.0.0:0", "--allow-insecure-remote")
            how = {"host": address, "source": address}
        with self.start(*flags) as server:
            memory, begun, links, refused = server.memory_mb(), time.monotonic(), [], 0
            for number in range(10_000):
                # Further ones wait in the kernel's queue, or are refused; a good client's do not.
                if refused > 300:
                    break
                try:
                    link = server.web_link(patience=1, **how)
                except OSError:
                    refused += 1
                    continue
                links.append(link)
                if number < 300:
                    link.send(request())
                    link.answer(5)
            tried = len(links) + refused
            time.sleep(0.5)
            ended = sum(link.ended() for link in links)
            well = self.web_well(server)
            held = round(server.memory_mb() - memory)
            took = time.monotonic() - begun
            for link in links:
                link.close()
            time.sleep(1)
            again = self.web_well(server)
            self.record(f"web: {tried} connections of one address",
                        f"{len(links) - ended} are kept, {ended + refused} were ended or refused; "
                        f"somebody else is served: {well}",
                        well and again and len(links) - ended <= 4096 and held < 200,
                        memory_mb=held, seconds=round(took, 1))

    def web_pipelined(self):
        """Requests one behind the other, and no answer is read for a while."""
        with self.start("--calls-per-second", "0") as server:
            memory, link = server.memory_mb(), server.web_link(patience=2)
            block, sent = request() * 100, 0
            begun = time.monotonic()
            while time.monotonic() < begun + 5 and link.send(block):
                sent += 100
            held = round(server.memory_mb() - memory)
            well = self.web_well(server)
            link.close()
            # From elsewhere: what HAProxy lets an address ask for is spent.
            link = server.web_link(source="127.0.0.9")
            link.send(request() * 100)
            answers = sum(link.answer(20)[0] == 200 for _ in range(100))
            link.close()
            self.record(f"web: {sent} requests on one connection, no answer read",
                        f"then {answers} of 100 answered to one who reads",
                        well and answers == 100 and held < 64, memory_mb=held)

    def web_streams(self):
        """Streams that nobody reads, while the session that they follow goes on changing."""
        count = 500 if self.start_is_bare() else 40
        events = 2000
        with self.start("--calls-per-second", "0") as server:
            link = server.web_link()
            link.send(request("/vantage.v1.SessionService/CreateSession", b'{"sessionId": "site"}'))
            made, _ = link.answer()
            memory = server.memory_mb()
            watch = request("/vantage.v1.SessionService/WatchSession",
                            enveloped(b'{"name": "sessions/site"}'), "application/connect+json")
            # As little as the kernel lets a client take.
            links = links_of(server, count, window=1024)
            for one in links:
                one.send(watch)
            time.sleep(1)
            opened = open_connections(server) - 1  # without that of the good client
            begun, codes = time.monotonic(), {}
            for number in range(events):
                link.send(request("/vantage.v1.SessionService/UpdateSession", json.dumps({
                    "session": {"name": "sessions/site", "displayName": f"{number} " + "x" * 100},
                    "updateMask": "displayName"}).encode()))
                status, _ = link.answer(20)
                codes[status] = codes.get(status, 0) + 1
            took, held = time.monotonic() - begun, round(server.memory_mb() - memory)
            well = self.web_well(server)
            last, left = until_silent(links, server, BODY_SECONDS + 2 * LATE_SECONDS)
            self.record(f"web: {len(links)} streams that nobody reads, {events} events",
                        f"{codes.get(200, 0)} calls beside them answered; {opened} were open, "
                        f"{left} are left {took + last:.0f} s later",
                        made == 200 and well and codes == {200: events} and opened == len(links)
                        and left == 0 and held < 200,
                        memory_mb=held, call_ms=round(1e3 * took / events, 1))
            for one in links:
                one.close()

    def web_answers(self):
        """Large answers that nobody reads."""
        count = 200 if self.start_is_bare() else 40
        with self.start("--calls-per-second", "0") as server:
            open_sessions(server.web_link(), 300)
            memory = server.memory_mb()
            links = links_of(server, count, window=1024)
            for one in links:
                one.send(request(body=b'{"pageSize": 1000}') * 5)
            time.sleep(3)
            held = round(server.memory_mb() - memory)
            well = self.web_well(server)
            for one in links:
                one.close()
            time.sleep(2)
            self.record(f"web: {5 * len(links)} large answers that nobody reads",
                        f"held {held} MB for them", well and held < 300,
                        after_mb=round(server.memory_mb() - memory))

    def web_vanished(self):
        """Clients whose link is gone, so that the server hears neither an end nor a reset."""
        if not self.start_is_bare():
            return  # HAProxy has its own patience
        ends = LinkedNetwork.make()
        if ends is None:
            print("a network of one's own needs root and ip: nobody vanishes")
            return
        each, links = 20, {}
        with ends, self.start("--web", f"{ends.HERE}:0", "--allow-insecure-remote",
                              "--calls-per-second", "0") as server:
            open_sessions(WebLink(server.web_port(), host=ends.HERE), 300)
            watch = request("/vantage.v1.SessionService/WatchSession",
                            enveloped(b'{"name": "sessions/job-1"}'), "application/connect+json")
            for what, asked in (("silent", b""), ("asked once", request()), ("streams", watch),
                                ("unread answers", request(body=b'{"pageSize": 1000}') * 20)):
                window = 1024 if what == "unread answers" else None
                links[what] = [ends.there(lambda most=window: WebLink(
                    server.web_port(), host=ends.HERE, window=most)) for _ in range(each)]
                for link in links[what]:
                    link.send(asked)
            for link in links["asked once"]:
                link.answer()
            ports = {what: {link.socket.getsockname()[1] for link in group}
                     for what, group in links.items()}
            time.sleep(2)
            # Just after it was last heard that a stream's client is there, which takes longest.
            for link in links["streams"]:
                link.ended()
            links["streams"][-1].socket.recv(1 << 16)
            time.sleep(0.5)
            memory, before = server.memory_mb(), open_connections(server)
            ends.cut()
            begun, gone = time.monotonic(), {}
            while time.monotonic() < begun + IDLE_SECONDS and (
                    len(gone) < len(links) or open_connections(server) > 0):
                known = established(server.web_port())
                for what, group in ports.items():
                    if not group & known:
                        gone.setdefault(what, round(time.monotonic() - begun, 1))
                time.sleep(0.2)
            took, left = time.monotonic() - begun, open_connections(server)
            for group in links.values():
                for link in group:
                    link.close()
            self.record(f"web: {before} connections whose clients vanished",
                        f"gone after {', '.join(f'{s} s ({what})' for what, s in gone.items())}; "
                        f"{left} are left after {took:.0f} s",
                        before == 4 * each and left == 0 and len(gone) == len(links)
                        and all(took_it < VANISHED_SECONDS[what] + TIMER_SECONDS
                                for what, took_it in gone.items())
                        and self.well(server),
                        freed_mb=round(memory - server.memory_mb()))

    def web_bodies(self):
        """What a body may claim, and what it may hold."""
        bombs = {"gzip": bomb(31), "deflate": bomb(15)}
        call = "/vantage.v1.SessionService/CreateSession"
        stream = "application/connect+json"
        watch = "/vantage.v1.SessionService/WatchSession"
        chunked = ("transfer-encoding: chunked",)

        def headed(*fields, body=b"", path=call):
            return "\r\n".join([f"POST {path} HTTP/1.1", "host: localhost",
                                "content-type: application/json", *fields, "", ""]).encode() + body

        cases = {
            "a length of 2^63": request(call, b"{", length=1 << 63),
            "a length of 10 GB": request(call, b"{", length=10_000_000_000),
            "a length below 0": headed("content-length: -1", body=b"{}"),
            "two lengths": headed("content-length: 2", "content-length: 30", body=b"{}"),
            "length and chunks": headed("content-length: 2", *chunked, body=b"0\r\n\r\n"),
            "a chunk of 2^64": headed(*chunked, body=b"FFFFFFFFFFFFFFFF\r\n{}"),
            "chunks of a byte, 5 MB": headed(*chunked, body=b"1\r\n[\r\n" * 5_000_000 + b"0\r\n\r\n"),
            "a chunk's extension without end": headed(*chunked, body=b"2;" + b"x" * 1_000_000),
            "trailers without end": headed(*chunked, body=b"2\r\n{}\r\n0\r\n" + b"a: b\r\n" * 200_000),
            "256 MiB by gzip": request(call, bombs["gzip"], more=("content-encoding: gzip",)),
            "256 MiB by deflate": request(call, bombs["deflate"], more=("content-encoding: deflate",)),
            "256 MiB by gzip in a stream": request(
                watch, enveloped(bombs["gzip"], flags=1), stream, ("connect-content-encoding: gzip",)),
            "an envelope of 4 GiB": request(watch, enveloped(b"{}", length=(1 << 32) - 1), stream),
            "an envelope that is cut off": request(watch, b"\0\0\0", stream),
            "100,000 arrays in each other": request(call, b"[" * 100_000),
            "4 MB of objects in each other": request(call, b'{"session":' * 350_000),
            "words that are no UTF-8": request(call, b'{"sessionId": "\xff\xfe\xc0"}'),
            "half of a surrogate": request(call, b'{"sessionId": "\\ud800"}'),
            "a number of a million digits": request(
                LISTING, b'{"pageSize": ' + b"9" * 1_000_000 + b"}"),
            "not a number": request("/vantage.v1.PlanService/RejectView",
                                    b'{"parent": "sessions/job", "position": {"x": NaN}}'),
            "base64 that is none": request("/vantage.v1.ScanService/UploadPiece",
                                           b'{"upload": "sessions/a/uploads/b", "piece": {"data": "!"}}'),
            "a map of 500,000 keys": request(call, b"{" + b",".join(
                b'"k%d":1' % number for number in range(500_000)) + b"}"),
            "binary that is none": request(call, b"\x0b" * 100_000, "application/proto"),
            "a head of 1 MB": headed(*(f"x-{number}: {'y' * 1000}" for number in range(1000))),
            "a line of 1 MB": b"GET /" + b"a" * 1_000_000,
            "two requests in one head": headed("content-length: 4", "x: a\r\n b", body=b"{}GE"),
            "noise": bytes(number * 7 % 256 for number in range(1 << 20)),
            "HTTP/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\4\0\0\0\0\0",
        }
        with self.start("--calls-per-second", "0") as server:
            memory = peak = server.memory_mb()
            cpu, begun, got, wrong = server.cpu_seconds(), time.monotonic(), {}, []
            unanswered = []
            for name, data in cases.items():
                try:
                    link = server.web_link()
                except OSError:
                    wrong.append(f"{name}: not let in")
                    continue
                sender = threading.Thread(target=link.send, args=(data,))
                sender.start()
                # Answers of streams are 200 and say what is wrong in their last message; whoever
                # waits for more of a body is ended in time, and here by us.
                status, body = link.answer(2)
                got[status] = got.get(status, 0) + 1
                if status == 0:
                    unanswered.append(name)
                if status == 200 and path_of(data) != watch:
                    wrong.append(f"{name}: 200")
                if status >= 500 and status != 501 and status != 505:
                    wrong.append(f"{name}: {status} {body[:80]!r}")
                peak = max(peak, server.memory_mb())
                link.close()
                sender.join()
                if not server.alive():
                    wrong.append(f"{name}: THE SERVER ENDED")
                    break
            well = server.alive() and self.web_well(server)
            self.record(f"web: {len(cases)} bodies and heads that claim too much or are broken",
                        "; ".join(wrong) or ", ".join(
                            f"{count} x {status or 'no answer'}" for status, count in sorted(got.items()))
                        + f" ({', '.join(unanswered)})",
                        not wrong and well and peak - memory < 100, peak_mb=round(peak - memory),
                        cpu_s=round(server.cpu_seconds() - cpu, 2),
                        seconds=round(time.monotonic() - begun, 1))

    def web_floods(self):
        """Two connections for six seconds each, and what somebody at another address has of it."""
        for kind, name in (("calls", "calls, one behind the other"),
                           ("unknown", "requests for what there is not"),
                           ("heads", "heads that are refused"),
                           ("connects", "connections that end at once"),
                           ("json", "4 MB of JSON that is broken at its end")):
            with self.start("--calls-per-second", "0") as server:
                port, ca = server.web_target()
                got = run(kind, port, server.processes(), ca, script=__file__)
                grown = {key: mb for key, mb in got.items() if key.endswith("_mb")}
                self.record(f"web flood: {name}",
                            f"{got['sent']} sent; of {got['calls']} calls of a bystander "
                            f"{got['failed']} failed",
                            self.web_well(server) and got["failed"] == 0 and got["p99_ms"] < 100
                            and all(mb < 200 for mb in grown.values()), p50_ms=got["p50_ms"],
                            p99_ms=got["p99_ms"], **grown)


class LinkedNetwork:
    """A network namespace, and a link to it that can be cut as when a tablet leaves the Wi-Fi."""
    HERE, THERE = "198.18.0.1", "198.18.0.2"  # of RFC 2544's range, for tests

    @classmethod
    def make(cls):
        """None: the system does not let us."""
        if not shutil.which("ip", path=os.environ["PATH"] + ":/usr/sbin:/sbin"):
            return None
        made = cls()
        own, other = f"vh{os.getpid()}", f"vt{os.getpid()}"
        for command in (f"netns add {made.name}",
                        f"link add {own} type veth peer name {other} netns {made.name}",
                        f"addr add {cls.HERE}/30 dev {own}", f"link set {own} up",
                        f"-n {made.name} addr add {cls.THERE}/30 dev {other}",
                        f"-n {made.name} link set {other} up"):
            if not made.ip(command):
                made.__exit__()
                return None
        made.other = other
        return made

    def __init__(self):
        self.name, self.other = f"vantage-{os.getpid()}", ""

    def ip(self, command):
        return subprocess.run(["ip", *command.split()], check=False, stderr=subprocess.DEVNULL,
                              env={"PATH": "/usr/sbin:/sbin:/usr/bin:/bin"}).returncode == 0

    def there(self, make):
        """What `make` makes in the namespace: sockets belong to that of the thread."""
        made = []

        def enter():
            with open(f"/run/netns/{self.name}") as namespace:
                if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), 0x40000000) == 0:
                    made.append(make())
        thread = threading.Thread(target=enter)
        thread.start()
        thread.join()
        return made[0]

    def cut(self):
        self.ip(f"-n {self.name} link set {self.other} down")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        # The link first: what the namespace takes with it goes some time later.
        self.ip(f"link del vh{os.getpid()}")
        self.ip(f"netns del {self.name}")


def established(port):
    """The other ends' ports of TCP connections of a port here."""
    found = set()
    with open("/proc/net/tcp") as table:
        for line in list(table)[1:]:
            own, other, state = line.split()[1:4]
            if int(own.split(":")[1], 16) == port and state == "01":
                found.add(int(other.split(":")[1], 16))
    return found


def bomb(window):
    """256 MiB of zeros, compressed; `window` as zlib has it. Never whole in memory here."""
    packer, block = zlib.compressobj(9, zlib.DEFLATED, window), bytes(1 << 20)
    return b"".join(packer.compress(block) for _ in range(256)) + packer.flush()


def path_of(data):
    return data[:300].split(b" ", 2)[1].decode(errors="replace") if data.startswith(b"POST ") else ""


def open_connections(server):
    """Those to the web listener, as its metrics say."""
    for line in server.get("/metrics")[1].splitlines():
        if line.startswith("vantage_web_connections"):
            return int(float(line.split()[-1]))
    return -1


def until_silent(links, server, seconds):
    """Seconds until the server has let go of connections that are not read, and how many it has
    left; reading would keep them."""
    begun, left = time.monotonic(), open_connections(server)
    while time.monotonic() < begun + seconds:
        left = open_connections(server) - 1  # that of the good client
        if left <= 0:
            break
        time.sleep(0.5)
    return time.monotonic() - begun, max(0, left)


# ---- Floods, in processes of their own ------------------------------------------------------


def flood_of(kind):
    """Yields (how many, bytes) to send on one connection."""
    json_body = b"[" + b"0," * 2_000_000
    blocks = {"calls": (100, request() * 100),
              "unknown": (100, request("/none", method="GET", body=b"") * 100),
              "heads": (1, b"GET / HTTP/1.1\r\n" + b"x: " + b"y" * 20_000 + b"\r\n\r\n"),
              "connects": (1, b""),
              "json": (1, request(body=json_body))}
    while True:
        yield blocks[kind]


def flood(given):
    os.nice(10)  # an attacker's processor time is not this machine's
    until, sent = time.monotonic() + given.seconds, 0
    over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: over.set())
    while time.monotonic() < until and not over.is_set():
        try:
            link = WebLink(given.port, source=given.source, tls=given.ca, patience=1)
        except OSError:
            time.sleep(0.01)
            continue
        for count, data in flood_of(given.what):
            if time.monotonic() > until or over.is_set() or not link.send(data):
                break
            sent += count
            if given.what == "connects" or (not given.deaf and link.ended()):
                break
        link.close()
    return {"sent": sent}


def bystander(given):
    def call_well(link):
        link.send(request())
        return link.answer(5)[0] == 200
    return watch(given.seconds, lambda: WebLink(given.port, source=given.source, tls=given.ca, patience=5),
                 call_well)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["calls", "unknown", "heads", "connects", "json", "bystander"])
    parser.add_argument("port", type=int)
    parser.add_argument("seconds", type=float)
    parser.add_argument("--ca", help="speak TLS; whom to believe")
    parser.add_argument("--source", help="address to come from")
    parser.add_argument("--deaf", action="store_true", help="never read an answer")
    given = parser.parse_args()
    print(json.dumps(bystander(given) if given.what == "bystander" else flood(given)))


if __name__ == "__main__":
    main()
