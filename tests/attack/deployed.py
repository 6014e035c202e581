"""The server as deploy/compose has it: behind HAProxy, with its configuration, over TLS."""
import os
import shutil
import socket
import ssl
import subprocess
import time

import grpc

from http2 import DATA, END_HEADERS, END_STREAM, HEADERS, Link, call, frame, message
from server import LISTING, START_SECONDS, Server

HAPROXY = shutil.which("haproxy", path=os.environ["PATH"] + ":/usr/sbin")
OPENSSL = shutil.which("openssl")
HEALTH = b"/grpc.health.v1.Health/Check"


class DeployedServer(Server):
    """`haproxy_cfg`: of deploy/compose."""

    def __init__(self, haproxy_cfg, binary, *flags, **how):
        super().__init__(binary, *flags, **how)
        subprocess.run([OPENSSL, "req", "-x509", "-newkey", "ec", "-pkeyopt",
                        "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj",
                        "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1",
                        "-keyout", self.path("key.pem"), "-out", self.path("ca.pem")],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(self.path("server.pem"), "w") as both:
            for name in ("ca.pem", "key.pem"):
                with open(self.path(name)) as one:
                    both.write(one.read())
        # Handed down, so that the ports are free for certain.
        listeners = [socket.create_server(("127.0.0.1", 0), backlog=1024) for _ in range(2)]
        with open(self.path("haproxy.log"), "wb") as log:
            self.proxy = subprocess.Popen(
                [HAPROXY, "-db", "-f", haproxy_cfg], pass_fds=[one.fileno() for one in listeners],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                env={"PATH": os.environ["PATH"], "VANTAGE_CERTS": self.folder,
                     "VANTAGE_BIND": f"fd@{listeners[0].fileno()}",
                     "HAPROXY_METRICS": f"fd@{listeners[1].fileno()}",
                     "VANTAGE_SERVER": f"127.0.0.1:{self.port}",
                     "VANTAGE_HTTP_PORT": str(self.http)})
        self.front = listeners[0].getsockname()[1]
        for one in listeners:
            one.close()
        until = time.monotonic() + START_SECONDS
        while not self.serves_others(HEALTH):
            if time.monotonic() > until:
                with open(self.path("haproxy.log")) as log:
                    raise RuntimeError("nobody gets through HAProxy:\n" + log.read()[:2000])
            time.sleep(0.05)

    def link(self, source=None, **how):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.load_verify_locations(self.path("ca.pem"))
        context.set_alpn_protocols(["h2"])
        return Link(self.front, source=source, tls=context if how.get("greet", True) else None,
                    **how)

    def channel(self):
        with open(self.path("ca.pem"), "rb") as ca:
            credentials = grpc.ssl_channel_credentials(ca.read())
        return grpc.secure_channel(f"localhost:{self.front}", credentials)

    def serves_others(self, method=LISTING):
        """Whether somebody at another address is served, whatever the attacker's may still do."""
        link = None
        try:
            link = self.link(source="127.0.0.9")
            link.send(frame(HEADERS, END_HEADERS, 1,
                            call(method, scheme=b"https"))
                      + frame(DATA, END_STREAM, 1, message(b"")))
            # A refusal has headers alone.
            return any(kind == DATA for kind, _, _, _ in link.read_frames(DATA, patience=10))
        except OSError:
            return False
        finally:
            if link is not None:
                link.close()

    def stop(self):
        self.proxy.terminate()
        try:
            self.proxy.wait(10)
        except subprocess.TimeoutExpired:
            self.proxy.kill()
            self.proxy.wait()
        return super().stop()
