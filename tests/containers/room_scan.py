"""Scans of a furnished room in closed form, encoded as core/sensor/encoding.h says."""

import math
import random
import struct

ROOM = (6.2, 5.1, 2.7)  # m, from the origin
BOXES = (  # smallest and largest corners, m
    ((0.0, 3.4, 0.0), (0.6, 5.1, 2.2)),    # wardrobe
    # Partition: the place behind it can't be seen from the first scan.
    ((3.7, 2.7, 0.0), (3.85, 5.1, 2.7)),
    ((2.9, 0.9, 0.0), (4.3, 1.7, 0.75)),   # table
    ((5.2, 0.0, 0.0), (6.2, 0.5, 1.1)))    # chest
FIRST = (1.8, 1.9, 1.5)  # where the first scan is made: the origin of the world


def range_along(position, ray):
    """Distance to the nearest surface, m."""
    nearest = math.inf
    for at, along, size in zip(position, ray, ROOM):
        if along:
            nearest = min(nearest, ((size if along > 0 else 0.0) - at) / along)
    for low, high in BOXES:
        enter, leave = 0.0, math.inf
        for axis in range(3):
            if not ray[axis]:
                if not low[axis] <= position[axis] <= high[axis]:
                    leave = -1.0
                continue
            a = (low[axis] - position[axis]) / ray[axis]
            b = (high[axis] - position[axis]) / ray[axis]
            enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
        if enter <= leave:
            nearest = min(nearest, enter)
    return nearest


def encoded(position, heading=0.0, step=1.5, noise=0.002, seed=1):
    """A scan at `position`, m, in the room's frame; `heading` and `step` are in degrees."""
    rng = random.Random(seed)
    columns = round(360 / step)
    azimuths = [math.radians(-180 + column * step) for column in range(columns)]
    elevations = [math.radians(-60 + row * step) for row in range(int(148 / step))]
    out = [struct.pack("<4sHHIIdd", b"VRIM", 1, 1, columns, len(elevations), math.radians(step),
                       math.radians(step)), struct.pack(f"<{len(elevations)}d", *elevations)]
    for azimuth in azimuths:
        east, north = (math.cos(azimuth + math.radians(heading)),
                       math.sin(azimuth + math.radians(heading)))
        codes, before = [], 0
        for elevation in elevations:
            flat = math.cos(elevation)
            true = range_along(position, (flat * east, flat * north, math.sin(elevation)))
            units = max(1, round((true + rng.gauss(0, noise)) * 1e4))
            difference = units - before
            codes.append(2 + (2 * difference if difference >= 0 else -2 * difference - 1))
            before = units
        out.append(struct.pack("<d", azimuth))
        for plane in range(4):
            out.append(bytes(code >> 8 * plane & 255 for code in codes))
    return b"".join(out)


def ptx(position, step=1.5):
    """The same without noise, as a PTX file: columns from bottom to top, rays that saw nothing as 0 0 0."""
    columns, rows = round(360 / step), int(148 / step)
    lines = [f"{columns}\n{rows}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1"]
    for column in range(columns):
        azimuth = math.radians(-180 + column * step)
        for row in range(rows):
            elevation = math.radians(-60 + row * step)
            ray = (math.cos(elevation) * math.cos(azimuth),
                   math.cos(elevation) * math.sin(azimuth), math.sin(elevation))
            distance = range_along(position, ray)
            lines.append(" ".join(f"{distance * part:.4f}" for part in ray) + " 0.5")
    return "\n".join(lines) + "\n"


def crc32c(data, _table=[]):
    """Castagnoli's, reflected."""
    if not _table:
        for byte in range(256):
            for _ in range(8):
                byte = byte >> 1 ^ (0x82F63B78 if byte & 1 else 0)
            _table.append(byte)
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ _table[(crc ^ byte) & 255]
    return crc ^ 0xFFFFFFFF


assert crc32c(b"123456789") == 0xE3069283
