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


def sphere(columns, rows, metres):
    """As far away in every direction: few bytes once compressed, whatever the size."""
    first, rise = -math.pi / 3, 5 * math.pi / 6 / rows
    turn = 2 * math.pi / columns
    head = b"VRIM" + struct.pack("<HHIIdd", 1, 1, columns, rows, turn, rise)
    elevations = struct.pack(f"<{rows}d", *(first + (row + 0.5) * rise for row in range(rows)))
    codes = [2 + 2 * round(metres * 1e4)] + [2] * (rows - 1)
    planes = b"".join(bytes(code >> shift & 255 for code in codes) for shift in (0, 8, 16, 24))
    return head + elevations + b"".join(
        struct.pack("<d", -math.pi + (column + 0.5) * turn) + planes for column in range(columns))


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
