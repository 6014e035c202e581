"""Scans to send: range images as proto/vantage/v1/upload.proto has them, and how they are sent."""
import hashlib
import math
import struct

CRC_TABLE = []
for index in range(256):
    value = index
    for _ in range(8):
        value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    CRC_TABLE.append(value)


def crc32c(data):
    value = 0xFFFFFFFF
    for byte in data:
        value = CRC_TABLE[(value ^ byte) & 255] ^ value >> 8
    return value ^ 0xFFFFFFFF


def encoded(columns, rows, metres):
    """`metres`: how far it is, of an azimuth and an elevation."""
    first, rise = -math.pi / 3, 5 * math.pi / 6 / rows
    turn = 2 * math.pi / columns
    elevations = [first + (row + 0.5) * rise for row in range(rows)]
    image = b"VRIM" + struct.pack("<HHIIdd", 1, 1, columns, rows, turn, rise)
    image += struct.pack(f"<{rows}d", *elevations)
    for column in range(columns):
        azimuth = -math.pi + (column + 0.5) * turn
        image += struct.pack("<d", azimuth)
        codes, before = [], 0
        for elevation in elevations:
            ticks = round(metres(azimuth, elevation) * 1e4)
            change = ticks - before  # folded: 2, 4, ... up, 3, 5, ... down
            codes.append(2 + (2 * change if change >= 0 else -2 * change - 1))
            before = ticks
        image += b"".join(bytes(code >> shift & 255 for code in codes)
                          for shift in (0, 8, 16, 24))
    return image


def sphere(columns, rows, metres):
    """As far away in every direction: few bytes once compressed, whatever the size."""
    return encoded(columns, rows, lambda azimuth, elevation: metres)


def room(columns, rows, half, height=2.8, over_floor=1.5):
    """From the middle of a square room."""
    def metres(azimuth, elevation):
        level = math.cos(elevation) * max(abs(math.cos(azimuth)), abs(math.sin(azimuth)))
        rise = math.sin(elevation)
        to_flat = (height - over_floor) / rise if rise > 0 else -over_floor / min(rise, -1e-9)
        return min(half / max(level, 1e-9), to_flat)
    return encoded(columns, rows, metres)


def send(ask, channel, new, session, image, token=None):
    """The code of the first call that failed, or 'OK', and the scan's name. `ask` as the attacks
    have it."""
    def call(method, request, answer):
        code, got = ask(channel, "ScanService", method, request, token=token, timeout=60)
        if code != "OK":
            return code, None
        return code, type(new(answer)).FromString(got)

    create = new("CreateUploadRequest", parent=session)
    create.upload.total.encoded_size_bytes = len(image)
    create.upload.total.sha256 = hashlib.sha256(image).digest()
    code, answer = call("CreateUpload", create, "CreateUploadResponse")
    sequence, offset = 0, 0
    while code == "OK" and offset < len(image):
        data = image[offset:offset + (1 << 20)]
        piece = new("UploadPieceRequest", upload=answer.upload.name)
        piece.piece.sequence = sequence
        piece.piece.offset = offset
        piece.piece.data = data
        piece.piece.crc32c = crc32c(data)
        code, answer = call("UploadPiece", piece, "UploadPieceResponse")
        sequence, offset = sequence + 1, offset + len(data)
    return code, answer.upload.scan if code == "OK" else ""
