"""Encryption and callers, in the server itself and on a socket behind HAProxy as deployed."""

import contextlib
import hashlib
import os
import pathlib
import re
import secrets
import shutil
import socket
import ssl
import subprocess
import time
import urllib.request

import grpc

import job as jobs
from harness import FIRST_SCAN, ContainerTest, house, open_house, say, state_of
from proxy import HAPROXY, Proxy, socket_folder


def setUpModule():
    open_house()


MOUNTED = "/run/vantage"
# What haproxy.cfg sends.
PROXIED = ("--certificate-metadata", "x-client-certificate",
           "--address-metadata", "x-forwarded-for")
UNAUTHENTICATED = grpc.StatusCode.UNAUTHENTICATED


class Authority:
    """A certificate authority in a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.openssl("req", "-x509", *self.key("ca"), "-out", "ca.pem", "-days", "2",
                     "-subj", "/CN=Test authority")

    def openssl(self, *arguments):
        subprocess.run(["openssl", *arguments], cwd=self.folder, check=True,
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)

    @staticmethod
    def key(name):
        return ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout",
                f"{name}.key")

    def certify(self, name):
        """NAME.pem and NAME.key, for this machine's loopback."""
        (self.folder / "extensions").write_text("subjectAltName=DNS:localhost,IP:127.0.0.1\n")
        self.openssl("req", "-new", *self.key(name), "-out", "request", "-subj", f"/CN={name}")
        self.openssl("x509", "-req", "-in", "request", "-CA", "ca.pem", "-CAkey", "ca.key",
                     "-CAcreateserial", "-days", "2", "-extfile", "extensions", "-out",
                     f"{name}.pem")
        # Read by the user of the container; the folder is this test's alone.
        (self.folder / f"{name}.key").chmod(0o644)

    def read(self, name):
        return (self.folder / name).read_bytes()

    def credentials(self, client=None):
        if client is None:
            return grpc.ssl_channel_credentials(self.read("ca.pem"))
        return grpc.ssl_channel_credentials(self.read("ca.pem"), self.read(f"{client}.key"),
                                            self.read(f"{client}.pem"))


class Callers:
    """A file of callers with tokens."""

    def __init__(self, path):
        self.path, self.lines, self.tokens = path, {}, {}

    def add(self, name, tenant, roles):
        self.tokens[name] = f"vantage_{secrets.token_urlsafe(32)}"
        digest = hashlib.sha256(self.tokens[name].encode()).hexdigest()
        self.lines[name] = f"{name} {tenant} {roles} token:{digest}\n"
        self.write()

    def remove(self, name):
        del self.lines[name]
        self.write()

    def write(self):
        new = self.path.with_suffix(".new")
        new.write_text("".join(self.lines.values()))
        new.chmod(0o644)
        new.rename(self.path)

    def shown_by(self, name):
        return (("authorization", f"Bearer {self.tokens[name]}"),)


class SecuredContainerTest(ContainerTest):
    def setUp(self):
        super().setUp()
        if not shutil.which("openssl"):
            self.skipTest("openssl is not installed")
        self.folder = pathlib.Path(house.engine.scratch())
        self.folder.chmod(0o755)
        self.authority = Authority(self.folder)
        self.authority.certify("server")
        self.callers = Callers(self.folder / "callers")
        self.callers.add("tablet", "museum", "submit,plan,read")
        self.callers.add("visitor", "museum", "read")
        self.callers.add("stranger", "bank", "administer")

    def serve_secured(self, *flags):
        server = self.serve(house.engine.new_volume(), "--callers", f"{MOUNTED}/callers", *flags,
                            options=("-v", f"{self.folder}:{MOUNTED}:ro"))
        return server

    def job_of(self, caller, address, credentials, session="job"):
        job = jobs.Job(address, session, credentials,
                       self.callers.shown_by(caller) if caller else ())
        self.opened.append(job)
        return job

    def assertRefused(self, code, call):
        got, text, _ = jobs.error_of(call)
        self.assertEqual(got, code, text)


TLS = ("--tls-cert", f"{MOUNTED}/server.pem", "--tls-key", f"{MOUNTED}/server.key")


class TlsTest(SecuredContainerTest):
    def test_encryption_and_tokens(self):
        server = self.serve_secured(*TLS)
        credentials = self.authority.credentials()
        self.until_serving(server, credentials=credentials)
        address = server.address()
        self.assertFalse(jobs.healthy(address), "without encryption nobody is answered")

        tablet = self.job_of("tablet", address, credentials)
        tablet.create()
        self.assertEqual(state_of(tablet.push(FIRST_SCAN)), "SCAN_STATE_MERGED")
        self.assertEqual(state_of(tablet.plan()), "PLAN_STATE_SUCCEEDED")

        nobody = self.job_of(None, address, credentials)
        self.assertRefused(UNAUTHENTICATED, nobody.get)
        wrong = jobs.Job(address, "job", credentials,
                         (("authorization", "Bearer vantage_" + "x" * 43),))
        self.opened.append(wrong)
        self.assertRefused(UNAUTHENTICATED, wrong.get)
        visitor = self.job_of("visitor", address, credentials)
        self.assertEqual(visitor.get().name, "sessions/job")
        self.assertRefused(grpc.StatusCode.PERMISSION_DENIED, lambda: visitor.push(FIRST_SCAN))
        stranger = self.job_of("stranger", address, credentials)
        self.assertRefused(grpc.StatusCode.NOT_FOUND, stranger.get)

        # Taken back while the server runs.
        self.callers.remove("tablet")
        deadline = time.monotonic() + 30
        while True:
            try:
                tablet.get()
            except grpc.RpcError as error:
                self.assertEqual(error.code(), UNAUTHENTICATED)
                break
            self.assertLess(time.monotonic(), deadline, "the token is still taken")
            time.sleep(0.1)
        self.assertEqual(visitor.get().name, "sessions/job")
        for token in self.callers.tokens.values():
            self.assertNotIn(token, server.logs())

    def test_mutual(self):
        self.authority.certify("office")
        self.callers.lines["office"] = "office museum administer certificate:office\n"
        self.callers.write()
        server = self.serve_secured(*TLS, "--tls-client-ca", f"{MOUNTED}/ca.pem")
        known = self.authority.credentials("office")
        self.until_serving(server, credentials=known)
        address = server.address()
        self.assertFalse(jobs.healthy(address, self.authority.credentials()),
                         "no certificate, no answer")
        self.job_of(None, address, known).create()


class ProxyTest(SecuredContainerTest):
    """HAProxy runs on this machine with the delivered configuration; the server in a container."""

    def setUp(self):
        super().setUp()
        if not HAPROXY:
            self.skipTest("haproxy is not installed")
        if os.geteuid() != 0:
            self.skipTest("only root can give the container's user a folder for its socket")
        self.sockets = socket_folder(self.folder / "sockets")
        self.authority.certify("office")
        self.callers.lines["office"] = "office museum administer certificate:office\n"
        self.callers.write()
        self.server = self.serve(
            house.engine.new_volume(), "--callers", f"{MOUNTED}/callers",
            "--listen", "unix:/run/vantage-sockets/vantaged.sock", *PROXIED,
            "--http", "127.0.0.1:0",
            options=("-v", f"{self.folder}:{MOUNTED}:ro",
                     "-v", f"{self.sockets}:/run/vantage-sockets:rw"))
        self.until_serving(self.server)
        self.start_proxy()
        self.credentials = self.authority.credentials()
        self.until_let_through()

    def start_proxy(self):
        started = Proxy(self.folder / f"proxy-{self.server.starts}",
                        [self.authority.read("server.pem"), self.authority.read("server.key")],
                        [self.authority.read("ca.pem")], self.sockets / "vantaged.sock",
                        f"127.0.0.1:{self.server.http_port()}")
        self.addCleanup(started.end)
        self.started, self.proxy = started, started.address

    def until_let_through(self, wanted=True):
        deadline = time.monotonic() + 30
        while jobs.healthy(self.proxy, self.credentials) != wanted:
            self.assertLess(time.monotonic(), deadline,
                            self.started.log())
            time.sleep(0.05)

    def tls(self):
        context = ssl.create_default_context(cafile=self.folder / "ca.pem")
        context.set_alpn_protocols(["h2"])
        host, port = self.proxy.split(":")
        raw = socket.create_connection((host, int(port)), timeout=10)
        try:
            return context.wrap_socket(raw, server_hostname="localhost")
        except OSError:
            raw.close()
            raise

    def test_job_and_failing_server(self):
        job = self.job_of("tablet", self.proxy, self.credentials)
        job.create()
        self.assertEqual(state_of(job.push(FIRST_SCAN)), "SCAN_STATE_MERGED")
        self.assertEqual(state_of(job.plan()), "PLAN_STATE_SUCCEEDED")
        self.assertRefused(UNAUTHENTICATED, self.job_of(None, self.proxy, self.credentials).get)
        # By a certificate, until its line is taken out.
        office = self.job_of(None, self.proxy, self.authority.credentials("office"))
        self.assertEqual(office.get().name, "sessions/job")
        self.callers.remove("office")
        deadline = time.monotonic() + 30
        with self.assertRaises(grpc.RpcError) as refused:
            while time.monotonic() < deadline:
                office.get()
                time.sleep(0.1)
        self.assertEqual(refused.exception.code(), UNAUTHENTICATED)
        # Only what is ours goes in.
        other = job.channel.unary_unary("/other.Service/Method", request_serializer=bytes,
                                        response_deserializer=bytes)
        self.assertRefused(grpc.StatusCode.UNIMPLEMENTED, lambda: other(b"", timeout=10))
        pages = urllib.request.urlopen(f"http://{self.started.metrics}/metrics",
                                       timeout=10).read().decode()
        self.assertRegex(pages, r'haproxy_server_status\{proxy="vantaged".*state="UP"\} 1')
        # Killed, it is not sent calls; back again, it is, by the same socket. (Its HTTP port is
        # another now, so the proxy is, too.)
        self.server.kill("KILL")
        self.server.wait()
        self.assertRefused(grpc.StatusCode.UNAVAILABLE, job.get)
        self.server.start()
        self.until_serving(self.server)
        self.start_proxy()
        self.until_let_through()
        self.assertEqual(len(self.job_of("tablet", self.proxy, self.credentials).scans()), 1)

    def test_headers_have_a_limit(self):
        job = self.job_of("tablet", self.proxy, self.credentials)
        job.create()
        for size, let_in in ((4_000, True), (7_000, False), (40_000, False)):
            large = jobs.Job(self.proxy, "job", self.credentials,
                             self.callers.shown_by("tablet") + (("x-large", "x" * size),))
            self.opened.append(large)
            if let_in:
                self.assertEqual(large.get().name, "sessions/job")
                continue
            with self.assertRaises(grpc.RpcError):
                large.get()

        def frame(kind, flags, stream, payload):
            return (len(payload).to_bytes(3, "big") + bytes((kind, flags))
                    + stream.to_bytes(4, "big") + payload)
        # A header that never ends, in CONTINUATION frames: gRPC 1.51 would take all of it.
        sent = 0
        with contextlib.suppress(OSError), self.tls() as link:
            link.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, b"")
                         + frame(1, 0, 1, b"\x00\x01a\x7f\x81\xff\xff\x7f"))
            for _ in range(1280):
                link.sendall(frame(9, 0, 1, b"x" * 16_000))
                sent += 16_000
        say(f"HAProxy ended an endless header after {sent / 1e6:.1f} MB")
        self.assertLess(sent, 10e6)
        self.assertEqual(job.get().name, "sessions/job")

    def test_connections_have_a_limit(self):
        links = []
        try:
            for _ in range(80):
                try:
                    links.append(self.tls())
                except OSError:
                    break
            say(f"HAProxy lets one address have {len(links)} connections more")
            self.assertGreater(len(links), 20)
            self.assertLess(len(links), 51)
        finally:
            for link in links:
                link.close()
        self.until_let_through()
