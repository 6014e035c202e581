#!/usr/bin/env python3
"""Who calls is known behind HAProxy, and nobody is for another: proxied_test.py.

Environment: VANTAGED, the server; VANTAGE_HAPROXY_CFG. Ends with 77 where haproxy, openssl or
grpcio is not installed.
"""
import base64
import hashlib
import http.client
import json
import os
import pathlib
import ssl
import sys
import tempfile
import time
import unittest

try:
    import grpc

    from deployed import HAPROXY, OPENSSL, Authority, DeployedServer, openssl
    from http2 import DATA, END_HEADERS, END_STREAM, HEADERS, call, frame, literal, message
    from server import LISTING
except ImportError as missing:
    print(f"skipped: {missing}", file=sys.stderr)
    sys.exit(77)

SERVER = os.environ["VANTAGED"]
HAPROXY_CFG = os.environ["VANTAGE_HAPROXY_CFG"]
DELETING = b"/vantage.v1.SessionService/DeleteSession"
OTHER_ADDRESS = "127.0.0.77"


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


class ProxiedTest(unittest.TestCase):
    """One server and one proxy for all tests: each begins with the same callers."""

    READ_AGAIN = "the callers file was read again"
    LINES = {"office": "office museum administer certificate:office.example",
             "guard": "guard museum read certificate:guard",
             "tablet": "tablet museum read token:" + sha256("tablet-token")}

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="vantage-proxied-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.authority = Authority(cls.folder)
        cls.authority.certify("whoever", "DNS:x.example,DNS:office.example")
        cls.authority.certify("guard")
        cls.authority.certify("unknown")
        (cls.folder / "other").mkdir()
        cls.stranger = Authority(cls.folder / "other")
        cls.stranger.certify("guard")
        cls.write_callers(cls.LINES)
        cls.server = DeployedServer(HAPROXY_CFG, SERVER, "--callers", str(cls.folder / "callers"),
                                    authorities=[cls.folder / "authority.pem"])
        cls.addClassCleanup(cls.server.stop)

    @classmethod
    def write_callers(cls, lines):
        new = cls.folder / "callers.new"
        new.write_text("".join(line + "\n" for line in lines.values()))
        new.chmod(0o600)
        new.rename(cls.folder / "callers")

    def say(self, lines):
        """Until the server has read them."""
        read = self.server.log().count(self.READ_AGAIN)
        self.write_callers(lines)
        until = time.monotonic() + 20
        while self.server.log().count(self.READ_AGAIN) == read and time.monotonic() < until:
            time.sleep(0.05)

    def call(self, channel, method=LISTING, metadata=(), request=b""):
        """(code, reason); reason is '' where all is well."""
        invoke = channel.unary_unary(method.decode(), request_serializer=bytes,
                                     response_deserializer=bytes)
        try:
            invoke(request, metadata=metadata, timeout=20)
            return "OK", ""
        except grpc.RpcError as error:
            details = dict(error.trailing_metadata() or ()).get("grpc-status-details-bin", b"")
            reasons = [word for word in ("CREDENTIALS_MISSING", "CERTIFICATE_UNKNOWN",
                                         "CERTIFICATE_INVALID", "ROLE_MISSING", "RATE_LIMITED",
                                         "TOKEN_UNKNOWN") if word.encode() in details]
            return error.code().name, "".join(reasons)

    def as_who(self, name, **how):
        return self.server.channel(self.authority.shown(name), **how)

    def der(self, name):
        openssl(self.folder, "x509", "-in", f"{name}.crt", "-outform", "DER", "-out", "der")
        return base64.b64encode((self.folder / "der").read_bytes()).decode()

    def test_certificates_have_their_roles(self):
        # A request for a session's name without one: whoever may ask is told that it lacks.
        with self.as_who("whoever") as office, self.as_who("guard") as guard:
            self.assertEqual(self.call(office), ("OK", ""))
            self.assertEqual(self.call(office, DELETING)[0], "INVALID_ARGUMENT")
            self.assertEqual(self.call(guard), ("OK", ""))
            self.assertEqual(self.call(guard, DELETING), ("PERMISSION_DENIED", "ROLE_MISSING"))
        with self.as_who("unknown") as unknown:
            self.assertEqual(self.call(unknown), ("UNAUTHENTICATED", "CERTIFICATE_UNKNOWN"))
        with self.server.channel() as nobody:
            self.assertEqual(self.call(nobody), ("UNAUTHENTICATED", "CREDENTIALS_MISSING"))
            self.assertEqual(self.call(nobody, metadata=(("authorization", "Bearer tablet-token"),)),
                             ("OK", ""))

    def test_another_authority_gets_no_further_than_the_handshake(self):
        with self.server.channel(self.stranger.shown("guard")) as channel:
            self.assertEqual(self.call(channel), ("UNAVAILABLE", ""))

    def test_a_line_taken_out_ends_it_on_the_open_connection(self):
        self.addCleanup(self.write_callers, self.LINES)
        with self.as_who("guard") as guard, self.as_who("whoever") as office:
            self.assertEqual(self.call(guard), ("OK", ""))
            self.say({name: line for name, line in self.LINES.items() if name != "guard"})
            self.assertEqual(self.call(guard), ("UNAUTHENTICATED", "CERTIFICATE_UNKNOWN"))
            self.assertEqual(self.call(office), ("OK", ""))
            self.say(self.LINES)
            self.assertEqual(self.call(guard), ("OK", ""))

    def test_a_forged_certificate_counts_for_nothing(self):
        forged = (("x-client-certificate", self.der("whoever")),)
        with self.server.channel() as nobody:
            self.assertEqual(self.call(nobody, metadata=forged),
                             ("UNAUTHENTICATED", "CREDENTIALS_MISSING"))
            self.assertEqual(self.call(nobody, metadata=forged + forged),
                             ("UNAUTHENTICATED", "CREDENTIALS_MISSING"))
        # Beside one's own.
        with self.as_who("guard") as guard:
            self.assertEqual(self.call(guard, DELETING, forged),
                             ("PERMISSION_DENIED", "ROLE_MISSING"))
        # In whatever case it is written, and as a trailer of the headers' own.
        for name in (b"X-Client-Certificate", b"x-client-certificate ", b"x_client_certificate"):
            link = self.server.link()
            link.send(frame(HEADERS, END_HEADERS, 1,
                            call(LISTING, literal(name, forged[0][1].encode()), scheme=b"https"))
                      + frame(DATA, END_STREAM, 1, message(b"")))
            kinds = [kind for kind, _, _, _ in link.read_frames(DATA, patience=1)]
            self.assertNotIn(DATA, kinds, name)
            link.close()
        # To the server itself, past the proxy.
        with grpc.insecure_channel(f"127.0.0.1:{self.server.port}") as direct:
            self.assertEqual(self.call(direct, metadata=forged),
                             ("UNAUTHENTICATED", "CREDENTIALS_MISSING"))

    def test_whoever_fails_locks_nobody_else_out(self):
        guess = literal(b"authorization", b"Bearer guess")
        address = literal(b"x-forwarded-for", b"127.0.0.1")  # nobody's own choice
        link = self.server.link(source=OTHER_ADDRESS)
        for stream in range(1, 101, 2):
            link.send(frame(HEADERS, END_HEADERS, stream,
                            call(LISTING, guess, address, scheme=b"https"))
                      + frame(DATA, END_STREAM, stream, message(b"")))
            link.read_frames(HEADERS)
        link.close()
        # What nobody may do is told apart by address: here, nothing has failed yet.
        with self.server.channel() as nobody:
            self.assertEqual(self.call(nobody, metadata=(("authorization", "Bearer guess"),)),
                             ("UNAUTHENTICATED", "TOKEN_UNKNOWN"))
        lines = [json.loads(line) for line in self.server.log().splitlines()
                 if line.startswith("{")]
        self.assertIn(f"ipv4:{OTHER_ADDRESS}", {line.get("peer") for line in lines})

    def by_web(self, path, who=None, fields=None, body="{}"):
        """As a browser does, by HTTP/1.1: (status, answer)."""
        context = ssl.create_default_context(cafile=self.server.path("tls.crt"))
        context.set_alpn_protocols(["http/1.1"])
        if who:
            context.load_cert_chain(self.folder / f"{who}.crt", self.folder / f"{who}.key")
        link = http.client.HTTPSConnection("localhost", self.server.front, context=context,
                                           timeout=20)
        try:
            link.request("POST" if body else "GET", path, body,
                         {"content-type": "application/json"} | (fields or {}))
            answer = link.getresponse()
            return answer.status, answer.read().decode()
        finally:
            link.close()

    def test_browsers_are_known_by_the_same_means(self):
        listing, deleting = LISTING.decode(), DELETING.decode()
        self.assertEqual(self.by_web(listing, "whoever"), (200, "{}"))
        self.assertEqual(self.by_web(deleting, "whoever")[0], 400)
        status, answer = self.by_web(deleting, "guard")
        self.assertEqual((status, json.loads(answer)["code"]), (403, "permission_denied"))
        self.assertIn("ROLE_MISSING", answer)
        self.assertIn("CREDENTIALS_MISSING", self.by_web(listing)[1])
        self.assertEqual(self.by_web(listing, None, {"authorization": "Bearer tablet-token"}),
                         (200, "{}"))
        forged = {"x-client-certificate": self.der("whoever"), "x-forwarded-for": "10.9.8.7",
                  "vantage-web-peer": "unix:"}
        self.assertIn("CREDENTIALS_MISSING", self.by_web(listing, None, forged)[1])
        self.assertEqual(self.by_web(deleting, "guard", forged)[0], 403)
        self.assertNotIn("10.9.8.7", self.server.log())
        # The page's files need nobody's credentials; here there are none.
        self.assertEqual(self.by_web("/nothing.js", body=None)[0], 404)
        # gRPC needs HTTP/2, and other paths than its own lead nowhere.
        self.assertEqual(self.by_web(listing, "whoever", {"content-type": "application/grpc"})[0],
                         400)
        self.assertEqual(self.by_web("/grpc.channelz.v1.Channelz/GetServers", "whoever",
                                     {"content-type": "application/grpc"})[0], 404)

    def test_the_socket_is_for_owner_and_group(self):
        for name in ("vantaged.sock", "web.sock"):
            self.assertEqual(os.stat(self.server.path(name)).st_mode & 0o7777, 0o660)

    def test_a_large_certificate_is_let_through_and_a_huge_one_refused(self):
        for name, count, wanted in (("large", 120, ("OK", "")), ("huge", 300, None)):
            self.authority.certify(name, ",".join(
                ["DNS:office.example"] + [f"DNS:host-{i:04}.museum.example" for i in range(count)]))
            with self.as_who(name) as channel:
                large = (("x-own", "a" * 5000),)
                got = self.call(channel, metadata=large)
                if wanted:
                    self.assertEqual(got, wanted)
                else:
                    self.assertNotEqual(got[0], "OK")


if __name__ == "__main__":
    if not (HAPROXY and OPENSSL):
        print("skipped: haproxy or openssl is not installed", file=sys.stderr)
        sys.exit(77)
    unittest.main()
