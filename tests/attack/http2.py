"""HTTP/2 as an attacker writes it: frames by hand, over a plain socket to this machine."""
import socket
import struct

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RST_STREAM, SETTINGS, PING, GOAWAY, CONTINUATION = 0, 1, 3, 4, 6, 7, 9
END_STREAM, END_HEADERS = 0x1, 0x4


def frame(kind, flags=0, stream=0, payload=b""):
    return (struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) +
            struct.pack(">I", stream) + payload)


def integer(value, prefix):
    """An integer of HPACK with a prefix of so many bits, all of them free."""
    most = (1 << prefix) - 1
    if value < most:
        return bytes([value])
    out = bytearray([most])
    value -= most
    while value >= 128:
        out.append(value % 128 + 128)
        value //= 128
    out.append(value)
    return bytes(out)


def literal(name, value, indexed=False):
    """A header field with a literal name, for the dynamic table where `indexed`."""
    return ((b"\x40" if indexed else b"\x00") + integer(len(name), 7) + name +
            integer(len(value), 7) + value)


def call(path, *more, scheme=b"http", te=b"trailers"):
    """The header block of a gRPC call."""
    return b"".join([literal(b":method", b"POST"), literal(b":scheme", scheme),
                     literal(b":path", path), literal(b":authority", b"localhost"),
                     literal(b"te", te), literal(b"content-type", b"application/grpc"), *more])


def message(payload, compressed=False):
    return bytes([1 if compressed else 0]) + struct.pack(">I", len(payload)) + payload


class Link:
    """A connection that does what it is told; `closed` when the other end had enough."""

    def __init__(self, port, greet=True, patience=10, source=None, tls=None):
        """`source`: an address to come from; `tls`: a context, for encryption."""
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=patience,
                                               source_address=(source, 0) if source else None)
        self.closed = False
        if tls is not None:
            try:
                self.socket = tls.wrap_socket(self.socket, server_hostname="localhost")
            except OSError:
                self.socket.close()
                raise
        if greet:
            self.send(PREFACE + frame(SETTINGS))

    def send(self, data):
        try:
            self.socket.sendall(data)
        except OSError:
            self.closed = True
        return not self.closed

    def read_frames(self, until, patience=10):
        """Frames (kind, flags, stream, payload) until one of that kind, the end, or a time-out."""
        self.socket.settimeout(patience)
        frames, rest = [], b""
        try:
            while not any(f[0] == until for f in frames):
                data = self.socket.recv(65536)
                if not data:
                    self.closed = True
                    break
                rest += data
                while len(rest) >= 9:
                    size = int.from_bytes(rest[:3], "big")
                    if len(rest) < 9 + size:
                        break
                    frames.append((rest[3], rest[4], int.from_bytes(rest[5:9], "big") & 0x7FFFFFFF,
                                   rest[9:9 + size]))
                    rest = rest[9 + size:]
        except socket.timeout:
            pass
        except OSError:
            self.closed = True
        return frames

    def close(self):
        self.socket.close()
