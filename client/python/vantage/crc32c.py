"""CRC32C (Castagnoli), which every piece is sent with; quick enough in NumPy alone."""

from __future__ import annotations

from typing import List

import numpy as np

from vantage.arrays import Array

_POLYNOMIAL = 0x82F63B78
_LANES = 512


def _table() -> Array:
    values = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        values = (values >> 1) ^ np.where(values & 1, np.uint32(_POLYNOMIAL), np.uint32(0))
    return values


_TABLE = _table()
_BYTES = _TABLE.tolist()


def _serial(crc: int, data: bytes) -> int:
    for byte in data:
        crc = crc >> 8 ^ _BYTES[(crc ^ byte) & 255]
    return crc


def _times(columns: Array, vectors: Array) -> Array:
    """A matrix over GF(2), as its 32 columns, times vectors of 32 bits."""
    result = np.zeros_like(vectors)
    for bit in range(32):
        result ^= np.where(vectors >> np.uint32(bit) & 1, columns[bit], np.uint32(0))
    return result


def _zeros(length: int) -> Array:
    """The matrix that appends so many bytes of zero to what a checksum is of."""
    one = np.uint32(1) << np.arange(32, dtype=np.uint32)
    step = (one >> 8) ^ _TABLE[one & 255]
    result = one
    while length:
        if length & 1:
            result = _times(step, result)
        step = _times(step, step)
        length >>= 1
    return result


_cache: "dict[int, List[Array]]" = {}


def crc32c(data: bytes) -> int:
    """The checksum of the bytes, as an unsigned number of 32 bits."""
    length = len(data) // _LANES
    crc = 0xFFFFFFFF
    if length >= 16:
        # As many stretches side by side, then joined two by two: a checksum is linear.
        lanes = np.frombuffer(data, np.uint8, length * _LANES).reshape(_LANES, length)
        sums = np.zeros(_LANES, np.uint32)
        sums[0] = crc
        for column in np.ascontiguousarray(lanes.T):
            sums = (sums >> 8) ^ _TABLE[(sums ^ column) & 255]
        if length not in _cache:
            if len(_cache) > 8:
                _cache.clear()
            _cache[length] = [_zeros(length << level) for level in range(9)]
        for matrix in _cache[length]:
            sums = _times(matrix, sums[0::2]) ^ sums[1::2]
        crc, data = int(sums[0]), data[length * _LANES:]
    return _serial(crc, data) ^ 0xFFFFFFFF
