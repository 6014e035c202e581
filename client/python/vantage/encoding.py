"""Range images as bytes, as proto/vantage/v1/upload.proto describes them."""

from __future__ import annotations

import struct
from typing import Any, Dict, Optional

import numpy as np

from vantage.arrays import Array

HEADER = struct.Struct("<4sHHIIdd")
MAGIC, VERSION = b"VRIM", 1
FULL_TURN, INTENSITY, COLOUR = 1, 2, 4
UNIT = 1e-4
"""m, of a range."""
MOST_UNITS = 10_000_000
MOST_LINES = 1 << 18


def encode(azimuth: Array, elevation: Array, ranges: Array,
           intensity: Optional[Array], colour: Optional[Array], full_turn: bool,
           azimuth_step: float, elevation_step: float) -> bytes:
    """Arrays as of RangeImage, which has checked them."""
    rows, columns = ranges.shape
    flags = full_turn * FULL_TURN | (intensity is not None) * INTENSITY | (colour is not None) * COLOUR
    head = HEADER.pack(MAGIC, VERSION, flags, columns, rows, azimuth_step, elevation_step)
    by_column = np.ascontiguousarray(ranges.T, np.float64)
    # Half away from zero, as C++'s std::round.
    units = np.floor(by_column / UNIT + 0.5).astype(np.int64)
    units = np.where(by_column > 0, np.maximum(units, 1), 0)
    units[units > MOST_UNITS] = 0
    measured = units > 0
    # Each range is told as its difference from the last one before it in its column.
    before = np.zeros_like(units)
    row = np.where(measured, np.arange(rows), -1)
    last = np.maximum.accumulate(row, axis=1)
    previous = np.concatenate([np.full((columns, 1), -1), last[:, :-1]], axis=1)
    known = previous >= 0
    before[known] = np.take_along_axis(units, np.maximum(previous, 0), axis=1)[known]
    d = units - before
    codes = np.where(measured, 2 + np.where(d >= 0, 2 * d, -2 * d - 1),
                     np.where(by_column < 0, 1, 0)).astype("<u4")
    planes = codes.view(np.uint8).reshape(columns, rows, 4).transpose(0, 2, 1).reshape(columns, -1)
    parts = [np.ascontiguousarray(azimuth, "<f8").view(np.uint8).reshape(columns, 8), planes]
    if intensity is not None:
        looks = np.ascontiguousarray(np.where(measured, intensity.T, 0), "<u2")
        parts.append(looks.view(np.uint8).reshape(columns, rows, 2).transpose(0, 2, 1)
                     .reshape(columns, -1))
    if colour is not None:
        looks = np.where(measured[..., None], colour.transpose(1, 0, 2), 0)
        parts.append(looks.transpose(0, 2, 1).reshape(columns, -1))
    return head + np.ascontiguousarray(elevation, "<f8").tobytes() + np.hstack(parts).tobytes()


def decode(data: bytes) -> Dict[str, Any]:
    """What a RangeImage is made of. ValueError: another format or version, cut off, or too long."""
    if len(data) < HEADER.size or data[:4] != MAGIC:
        raise ValueError("range image: does not begin with a header (magic VRIM)")
    _, version, flags, columns, rows, azimuth_step, elevation_step = HEADER.unpack_from(data)
    if version != VERSION or flags & ~(FULL_TURN | INTENSITY | COLOUR):
        raise ValueError(f"range image: version {version} with flags {flags} is newer than this client")
    if not (2 <= columns <= MOST_LINES and 2 <= rows <= MOST_LINES):
        raise ValueError(f"range image: {columns} columns x {rows} rows are no image")
    planes = 4 + 2 * bool(flags & INTENSITY) + 3 * bool(flags & COLOUR)
    size = HEADER.size + 8 * rows + columns * (8 + planes * rows)
    if len(data) != size:
        raise ValueError(f"range image: {len(data)} bytes, but {columns} columns x {rows} rows take "
                         f"{size}; it was cut off or padded")
    elevation = np.frombuffer(data, "<f8", rows, HEADER.size).astype(np.float64)
    body = np.frombuffer(data, np.uint8, offset=HEADER.size + 8 * rows).reshape(columns, -1)
    azimuth = np.ascontiguousarray(body[:, :8]).view("<f8")[:, 0].astype(np.float64)
    planes_of = body[:, 8:].reshape(columns, planes, rows)
    codes = np.ascontiguousarray(planes_of[:, :4].transpose(0, 2, 1)).view("<u4")[..., 0].astype(np.int64)
    z = codes - 2
    d = np.where(codes < 2, 0, np.where(z % 2 == 0, z // 2, -(z // 2) - 1))
    units = np.cumsum(d, axis=1)
    measured = codes >= 2
    if (units[measured] < 1).any() or (units[measured] > MOST_UNITS).any():
        raise ValueError("range image: a range is not within 0.1 mm and 1 km")
    ranges = np.where(measured, units * UNIT, np.where(codes == 1, -1.0, 0.0)).astype(np.float32)
    image: Dict[str, Any] = {
        "azimuth": azimuth, "elevation": elevation, "ranges": ranges.T,
        "full_turn": bool(flags & FULL_TURN), "native_azimuth_step": azimuth_step,
        "native_elevation_step": elevation_step}
    plane = 4
    if flags & INTENSITY:
        pairs = np.ascontiguousarray(planes_of[:, 4:6].transpose(0, 2, 1))
        image["intensity"] = pairs.view("<u2")[..., 0].T.astype(np.uint16)
        plane = 6
    if flags & COLOUR:
        image["colour"] = planes_of[:, plane:plane + 3].transpose(2, 0, 1).copy()
    return image
