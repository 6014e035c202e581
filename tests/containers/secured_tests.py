"""Encryption and callers, in the server itself and behind HAProxy as deploy/compose has it."""

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
from engine import ROOT
from harness import FIRST_SCAN, ContainerTest, house, open_house, say, state_of


def setUpModule():
    open_house()


MOUNTED = "/run/vantage"
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
        self.haproxy = shutil.which("haproxy", path=os.environ["PATH"] + ":/usr/sbin")
        if not self.haproxy:
            self.skipTest("haproxy is not installed")
        (self.folder / "proxy").mkdir()
        (self.folder / "proxy" / "server.pem").write_bytes(
            self.authority.read("server.pem") + self.authority.read("server.key"))
        self.server = self.serve_secured("--http", "127.0.0.1:0")
        self.until_serving(self.server)
        self.proxy = self.start_proxy()
        self.credentials = self.authority.credentials()
        self.until_let_through()

    def start_proxy(self):
        """Answers the address; sockets are handed down, so that ports are free for certain."""
        sockets = []
        for _ in range(2):
            listener = socket.create_server(("127.0.0.1", 0), backlog=128)
            self.addCleanup(listener.close)
            sockets.append(listener)
        log = open(self.folder / "haproxy.log", "wb")
        self.addCleanup(log.close)
        proxy = subprocess.Popen(
            [self.haproxy, "-db", "-f", ROOT / "deploy" / "compose" / "haproxy.cfg"],
            pass_fds=[listener.fileno() for listener in sockets], stdin=subprocess.DEVNULL,
            stdout=log, stderr=log, env={
                "PATH": os.environ["PATH"], "VANTAGE_CERTS": str(self.folder / "proxy"),
                "VANTAGE_BIND": f"fd@{sockets[0].fileno()}",
                "HAPROXY_METRICS": f"fd@{sockets[1].fileno()}",
                "VANTAGE_SERVER": self.server.address(),
                "VANTAGE_HTTP_PORT": str(self.server.http_port())})

        def end():
            proxy.terminate()
            try:
                proxy.wait(timeout=10)
            except subprocess.TimeoutExpired:
                proxy.kill()
                proxy.wait()
        self.addCleanup(end)
        self.metrics = f"http://127.0.0.1:{sockets[1].getsockname()[1]}/metrics"
        return f"127.0.0.1:{sockets[0].getsockname()[1]}"

    def until_let_through(self, wanted=True):
        deadline = time.monotonic() + 30
        while jobs.healthy(self.proxy, self.credentials) != wanted:
            self.assertLess(time.monotonic(), deadline,
                            (self.folder / "haproxy.log").read_text()[:1500])
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
        # Only what is ours goes in.
        other = job.channel.unary_unary("/other.Service/Method", request_serializer=bytes,
                                        response_deserializer=bytes)
        self.assertRefused(grpc.StatusCode.UNIMPLEMENTED, lambda: other(b"", timeout=10))
        pages = urllib.request.urlopen(self.metrics, timeout=10).read().decode()
        self.assertRegex(pages, r'haproxy_server_status\{proxy="vantaged".*state="UP"\} 1')
        # Killed, it is not sent calls; back again, it is. (Its port is another now, so the proxy
        # is, too.)
        self.server.kill("KILL")
        self.server.wait()
        self.assertRefused(grpc.StatusCode.UNAVAILABLE, job.get)
        self.server.start()
        self.until_serving(self.server)
        self.proxy = self.start_proxy()
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
