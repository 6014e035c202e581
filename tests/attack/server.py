"""A vantaged of one's own to attack: started on free ports of this machine, watched, ended."""
import os
import resource
import shutil
import subprocess
import tempfile
import time
import urllib.error
import urllib.request

import grpc

from http2 import Link
from web import WebLink

START_SECONDS = 60
LISTING = b"/vantage.v1.SessionService/ListSessions"


class Server:
    """`files`: how many it may have open. `stderr`: a descriptor to log to, instead of a file."""

    # Where it listens to browsers, unless its flags say so.
    WEB = ("--web", "127.0.0.1:0", "--web-port-file", "FOLDER/web")
    proxied = None  # by whose address it is reached

    def __init__(self, binary, *flags, files=None, stderr=None):
        self.folder = tempfile.mkdtemp(prefix="vantage-attack-")
        self.log_path = self.path("log")
        limit = None if files is None else (
            lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (files, files)))
        flags = (*(self.WEB[2:] if "--web" in flags else self.WEB), *flags)
        with open(self.log_path, "wb") as log:
            self.process = subprocess.Popen(
                [binary, "--listen", "127.0.0.1:0", "--port-file", self.path("port"),
                 "--http", "127.0.0.1:0", "--http-port-file", self.path("http"), "--in-memory",
                 *(flag.replace("FOLDER", self.folder) for flag in flags)],
                stdout=log, stderr=log if stderr is None else stderr, preexec_fn=limit)
        self.port = self._port("port")
        self.http = self._port("http")

    def link(self, **how):
        return Link(self.port, **how)

    def web_port(self):
        return self._port("web")

    def web_link(self, **how):
        return WebLink(self.web_port(), **how)

    def web_target(self):
        """As flood_target, of the web's port."""
        return self.web_port(), None

    def channel(self):
        return grpc.insecure_channel(f"127.0.0.1:{self.port}")

    def serves_others(self):
        """Whether somebody else is served."""
        with grpc.insecure_channel(f"127.0.0.1:{self.port}") as channel:
            invoke = channel.unary_unary(LISTING.decode(), request_serializer=bytes,
                                         response_deserializer=bytes)
            try:
                invoke(b"", timeout=20)
                return True
            except grpc.RpcError:
                return False

    def path(self, name):
        return os.path.join(self.folder, name)

    def _port(self, name):
        until = time.monotonic() + START_SECONDS
        while time.monotonic() < until:
            if self.process.poll() is not None:
                break
            try:
                with open(self.path(name)) as file:
                    return int(file.read())
            except (FileNotFoundError, ValueError):
                time.sleep(0.02)
        raise RuntimeError("the server did not start:\n" + self.log())

    def log(self):
        with open(self.log_path, errors="replace") as file:
            return file.read()

    def processes(self):
        """Those whose memory a flood might fill, by name."""
        return {"server": self.process}

    def flood_target(self):
        """The port that strangers reach, and whose TLS it speaks."""
        return self.port, None

    def alive(self):
        return self.process.poll() is None

    def cpu_seconds(self):
        with open(f"/proc/{self.process.pid}/stat") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory_mb(self):
        with open(f"/proc/{self.process.pid}/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6

    def get(self, path):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.http}{path}",
                                        timeout=10) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def stop(self):
        if self.alive():
            self.process.terminate()
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.process.kill()
        code = self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)
        return code

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
