"""The server as it is deployed: on a socket behind HAProxy, with its configuration, over TLS."""
import os
import pathlib
import shutil
import socket
import ssl
import subprocess
import time

import grpc

from http2 import DATA, END_HEADERS, END_STREAM, HEADERS, Link, call, frame, message
from server import LISTING, START_SECONDS, Server
from web import WebLink

HAPROXY = shutil.which("haproxy", path=os.environ["PATH"] + ":/usr/sbin")
OPENSSL = shutil.which("openssl")
HEALTH = b"/grpc.health.v1.Health/Check"
# What haproxy.cfg sends, and the server believes of whoever comes by the socket.
PROXIED = ("--certificate-metadata", "x-client-certificate",
           "--address-metadata", "x-forwarded-for")
# An unprivileged user may send from any of these.
SOMEBODY_ELSE = "127.0.0.9"


def openssl(folder, *arguments):
    subprocess.run([OPENSSL, *arguments], cwd=folder, check=True, stdin=subprocess.DEVNULL,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def new_key(name):
    return ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", name)


class Authority:
    """Signs certificates of clients: NAME.crt and NAME.key in its folder."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        openssl(folder, "req", "-x509", *new_key("authority.key"), "-out", "authority.pem",
                "-days", "2", "-subj", "/CN=authority of clients")

    def certify(self, name, alternative=None):
        """`alternative`: subject alternative names, as OpenSSL has them."""
        openssl(self.folder, "req", "-new", *new_key(f"{name}.key"), "-out", f"{name}.csr",
                "-subj", f"/CN={name}")
        more = []
        if alternative:
            (self.folder / f"{name}.ext").write_text(f"subjectAltName={alternative}\n")
            more = ["-extfile", f"{name}.ext"]
        openssl(self.folder, "x509", "-req", "-in", f"{name}.csr", "-CA", "authority.pem",
                "-CAkey", "authority.key", "-CAcreateserial", "-days", "2", "-out",
                f"{name}.crt", *more)

    def shown(self, name):
        return [(self.folder / f"{name}.{kind}").read_bytes() for kind in ("key", "crt")]


class DeployedServer(Server):
    """`haproxy_cfg`: that of deploy. `authorities`: PEM files of what signs clients' certificates."""

    WEB = ("--web", "unix:FOLDER/web.sock")
    proxied = "haproxy"

    def __init__(self, haproxy_cfg, binary, *flags, authorities=(), **how):
        if "--callers" in flags:
            flags += PROXIED
        super().__init__(binary, "--listen", "unix:FOLDER/vantaged.sock", *flags, **how)
        openssl(self.folder, "req", "-x509", *new_key("tls.key"), "-days", "2", "-subj",
                "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-out",
                "tls.crt")
        os.mkdir(self.path("clients"))
        for number, authority in enumerate(authorities):
            shutil.copy(authority, self.path(f"clients/{number}.pem"))
        # Handed down, so that the ports are free for certain.
        listeners = [socket.create_server(("127.0.0.1", 0), backlog=1024) for _ in range(2)]
        with open(self.path("haproxy.log"), "wb") as log:
            self.proxy = subprocess.Popen(
                [HAPROXY, "-db", "-f", haproxy_cfg], pass_fds=[one.fileno() for one in listeners],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                env={"PATH": os.environ["PATH"], "VANTAGE_CERTS": self.folder,
                     "VANTAGE_CLIENTS": self.path("clients"),
                     "VANTAGE_BIND": f"fd@{listeners[0].fileno()}",
                     "HAPROXY_METRICS": f"fd@{listeners[1].fileno()}",
                     "VANTAGE_SERVER": "unix@" + self.path("vantaged.sock"),
                     "VANTAGE_WEB": "unix@" + self.path("web.sock"),
                     "VANTAGE_HTTP": f"127.0.0.1:{self.http}"})
        self.front = listeners[0].getsockname()[1]
        for one in listeners:
            one.close()
        until = time.monotonic() + START_SECONDS
        while not self.serves_others(HEALTH):
            if time.monotonic() > until:
                with open(self.path("haproxy.log")) as log:
                    raise RuntimeError("nobody gets through HAProxy:\n" + log.read()[:2000])
            time.sleep(0.05)
        # Or every row would hold for the wrong reason.
        with self.channel() as channel:
            grpc.channel_ready_future(channel).result(timeout=START_SECONDS)

    def link(self, source=None, **how):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.load_verify_locations(self.path("tls.crt"))
        context.set_alpn_protocols(["h2"])
        return Link(self.front, source=source, tls=context if how.get("greet", True) else None,
                    **how)

    def web_link(self, **how):
        return WebLink(self.front, tls=self.path("tls.crt"), **how)

    def web_target(self):
        return self.flood_target()

    def channel(self, shown=(), **options):
        """`shown`: key and certificate of a client, PEM. `options`: of the channel."""
        with open(self.path("tls.crt"), "rb") as own:
            credentials = grpc.ssl_channel_credentials(own.read(), *shown)
        # A connection of its own: channels that look alike share one else.
        options["grpc.use_local_subchannel_pool"] = 1
        # By number: not every machine knows its own name.
        return grpc.secure_channel(f"127.0.0.1:{self.front}", credentials, list(options.items()))

    def serves_others(self, method=LISTING):
        """Whether somebody at another address is served, whatever the attacker's may still do."""
        link = None
        try:
            link = self.link(source=SOMEBODY_ELSE)
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

    def processes(self):
        return {"server": self.process, "haproxy": self.proxy}

    def flood_target(self):
        return self.front, self.path("tls.crt")

    def stop(self):
        self.proxy.terminate()
        try:
            self.proxy.wait(10)
        except subprocess.TimeoutExpired:
            self.proxy.kill()
            self.proxy.wait()
        return super().stop()
