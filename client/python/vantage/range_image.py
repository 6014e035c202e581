"""A scan as the scanner made it: a grid of rays from one centre of projection."""

from __future__ import annotations

import dataclasses
import math
from typing import Optional, Tuple

import numpy as np

from vantage import encoding, organised
from vantage.arrays import Array
from vantage.v1 import scanner_model_pb2

NO_RETURN = np.float32(0)
"""What a cell holds instead of a range: the ray went out and nothing came back."""
NO_INFORMATION = np.float32(-1)
"""What a cell holds instead of a range: it was not measured (the scanner's body, masked)."""


@dataclasses.dataclass(eq=False)
class RangeImage:
    """Ranges along a grid of rays, in the scanner's own frame: right-handed, z up.

    Columns share an azimuth and rows an elevation; neither need be evenly spaced. What it is made
    of is checked and copied; ValueError says what is wrong and what to do about it.
    """

    azimuth: Array
    """(columns,) float64, rad, counter-clockwise from +x, strictly rising, spanning less than 2 pi."""
    elevation: Array
    """(rows,) float64, rad, from the horizon up, strictly rising, within [-pi/2, pi/2]."""
    ranges: Array
    """(rows, columns) float32, m, row 0 is the lowest; NO_RETURN or NO_INFORMATION without one.
    Whole 0.1 mm are sent, and beyond 1 km NO_RETURN."""
    intensity: Optional[Array] = None
    """(rows, columns) uint16, 65,535 is the most, or None. Planning does not use it."""
    colour: Optional[Array] = None
    """(rows, columns, 3) uint8, red, green, blue, or None. Planning does not use it."""
    full_turn: Optional[bool] = None
    """The last column is followed by the first. None: it is, where a step closes the gap."""
    native_azimuth_step: Optional[float] = None
    """rad, of the instrument; smaller than the grid's where the scan was thinned. None: the
    grid's."""
    native_elevation_step: Optional[float] = None
    """rad, likewise."""

    def __post_init__(self) -> None:
        self.azimuth = np.array(self.azimuth, np.float64)
        self.elevation = np.array(self.elevation, np.float64)
        self.ranges = np.array(self.ranges, np.float32)
        for name, axis in (("azimuth", self.azimuth), ("elevation", self.elevation)):
            if axis.ndim != 1 or axis.size < 2:
                raise ValueError(f"{name}: {axis.shape}, but it has one angle for each line, two at least")
            if not np.isfinite(axis).all() or not (np.diff(axis) > 0).all():
                raise ValueError(f"{name}: the angles must be finite and rise strictly; sort the "
                                 "grid's lines by them")
        if self.azimuth[-1] - self.azimuth[0] >= 2 * math.pi:
            raise ValueError("azimuth: spans a full turn or more; leave out the column that is there twice")
        if abs(self.elevation).max() > math.pi / 2:
            raise ValueError("elevation: not within [-pi/2, pi/2]; it is in radians from the horizon")
        shape = self.elevation.size, self.azimuth.size
        if self.ranges.shape != shape:
            raise ValueError(f"ranges: {self.ranges.shape}, but elevation and azimuth make (rows, "
                             f"columns) {shape}")
        if not np.isfinite(self.ranges).all():
            raise ValueError("ranges: not finite; where nothing came back, put NO_RETURN")
        if (self.ranges[self.ranges < 0] != NO_INFORMATION).any():
            raise ValueError("ranges: negative; where a cell was not measured, put NO_INFORMATION")
        if not (self.ranges > 0).any():
            raise ValueError("ranges: no cell holds a range")
        if self.intensity is not None:
            self.intensity = self._appearance("intensity", self.intensity, shape, np.uint16)
        if self.colour is not None:
            self.colour = self._appearance("colour", self.colour, (*shape, 3), np.uint8)
        if self.native_azimuth_step is None:
            self.native_azimuth_step = float(np.median(np.diff(self.azimuth)))
        if self.native_elevation_step is None:
            self.native_elevation_step = float(np.median(np.diff(self.elevation)))
        for name in ("native_azimuth_step", "native_elevation_step"):
            if not 0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name}: {getattr(self, name)}, but an angle between rays is more than 0")
        if self.full_turn is None:
            steps = np.diff(self.azimuth)
            gap = 2 * math.pi - (self.azimuth[-1] - self.azimuth[0])
            self.full_turn = bool(gap < 1.5 * steps.max())

    @staticmethod
    def _appearance(name: str, given: Array, shape: Tuple[int, ...], kind: type) -> Array:
        given = np.asarray(given)
        if given.shape != shape or given.dtype != kind:
            raise ValueError(f"{name}: {given.dtype} {given.shape}, but it is {np.dtype(kind)} {shape}")
        return given.copy()

    @classmethod
    def from_points(cls, points: Array, intensity: Optional[Array] = None) -> "RangeImage":
        """Of an organised cloud, in the scanner's frame.

        points: (lines, shots, 3), m; NaN or 0, 0, 0 where nothing came back. Lines share an
        elevation and shots an azimuth, in whatever order. intensity: (lines, shots) uint16.
        ValueError: the directions form no such grid; the message says by how much.
        """
        grid = organised.grid_of(np.asarray(points))
        looks = None if intensity is None else np.asarray(intensity)[grid.lines][:, grid.shots]
        if looks is not None:
            looks = np.where(grid.ranges > 0, looks, 0).astype(np.asarray(intensity).dtype)
        return cls(grid.azimuth, grid.elevation, grid.ranges, intensity=looks)

    def to_bytes(self) -> bytes:
        """As it is sent and stored (proto/vantage/v1/upload.proto); every image has one encoding."""
        return encoding.encode(self.azimuth, self.elevation, self.ranges, self.intensity, self.colour,
                               bool(self.full_turn), float(self.native_azimuth_step or 0),
                               float(self.native_elevation_step or 0))

    @classmethod
    def from_bytes(cls, data: bytes) -> "RangeImage":
        """The image of an encoding. ValueError: it is none, or cut off."""
        return cls(**encoding.decode(data))

    def directions(self) -> Array:
        """(rows, columns, 3) float64, unit vectors of the rays, scanner's frame."""
        flat, up = np.cos(self.elevation), np.sin(self.elevation)
        return np.stack([flat[:, None] * np.cos(self.azimuth), flat[:, None] * np.sin(self.azimuth),
                         np.broadcast_to(up[:, None], self.ranges.shape)], axis=-1)

    def points(self) -> Array:
        """(samples, 3) float64, m, scanner's frame: the cells that hold a range, row by row."""
        measured = self.ranges > 0
        return self.directions()[measured] * self.ranges[measured][:, None].astype(np.float64)

    def scanner(self, **figures: float) -> scanner_model_pb2.ScannerModel:
        """The model of a scanner that makes such images: spans, elevations and native steps; the
        rest by default, or by `figures` (max_range_m=40; as in vantage.v1.ScannerModel)."""
        span = 2 * math.pi if self.full_turn else min(
            2 * math.pi, self.azimuth[-1] - self.azimuth[0] + self.native_azimuth_step)
        useful = np.flatnonzero((self.ranges != NO_INFORMATION).any(axis=1))
        half = 0.5 * float(self.native_elevation_step or 0)
        model = scanner_model_pb2.ScannerModel(
            azimuth_span_rad=span, azimuth_step_rad=self.native_azimuth_step,
            elevation_step_rad=self.native_elevation_step,
            min_elevation_rad=max(-math.pi / 2, self.elevation[useful[0]] - half),
            max_elevation_rad=min(math.pi / 2, self.elevation[-1] + half))
        for name, value in figures.items():
            setattr(model, name, value)
        return model
