"""The grid of rays that an organised cloud was measured with."""

from __future__ import annotations

import dataclasses

import numpy as np

from vantage.arrays import Array


@dataclasses.dataclass
class Grid:
    azimuth: Array  # (columns,), rad, rising
    elevation: Array  # (rows,), rad, rising
    ranges: Array  # (rows, columns), m; 0: nothing came back
    lines: Array  # (rows,), which line of the cloud each row is
    shots: Array  # (columns,), which shot of a line each column is


def grid_of(points: Array) -> Grid:
    """points: (lines, shots, 3), m, scanner's frame; NaN or 0, 0, 0 where nothing came back.

    ValueError: they form no grid.
    """
    if points.ndim != 3 or points.shape[2] != 3 or min(points.shape[:2]) < 2:
        raise ValueError(f"points: {points.shape}, but an organised cloud is (lines, shots, 3); one "
                         "with height 1 has lost its grid")
    points = np.nan_to_num(points.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    ranges = np.linalg.norm(points, axis=2)
    measured = ranges > 0
    if not measured.any():
        raise ValueError("points: nothing came back anywhere")
    unit = points / np.where(measured, ranges, 1)[..., None]
    # A shot's azimuth is that of all of it: overhead a single ray has none to speak of.
    across, along = unit[..., 1].sum(axis=0), unit[..., 0].sum(axis=0)
    azimuth = _filled("azimuth", np.arctan2(across, along), np.hypot(across, along) > 1e-6, turn=True)
    rising = np.where(measured, np.arcsin(np.clip(unit[..., 2], -1, 1)), np.nan)
    some = measured.any(axis=1)
    middle = np.zeros(len(rising))
    middle[some] = np.nanmedian(rising[some], axis=1)
    elevation = _filled("elevation", middle, some, turn=False)
    shots, lines = np.argsort(azimuth, kind="stable"), np.argsort(elevation, kind="stable")
    _check(unit, measured, azimuth, elevation)
    return Grid(azimuth[shots], elevation[lines], ranges[lines][:, shots].astype(np.float32), lines,
                shots)


def _filled(name: str, angles: Array, known: Array, turn: bool) -> Array:
    """The angles of all lines: those of lines without a return lie between their neighbours'."""
    at = np.flatnonzero(known)
    if len(at) < 2:
        raise ValueError(f"{name}: fewer than two lines have returns")
    seen = np.unwrap(angles[at]) if turn else angles[at]
    step = np.median(np.diff(seen) / np.diff(at))
    every = np.arange(len(angles))
    filled = np.interp(every, at, seen)
    filled[every < at[0]] = seen[0] + step * (every[every < at[0]] - at[0])
    filled[every > at[-1]] = seen[-1] + step * (every[every > at[-1]] - at[-1])
    if turn and np.ptp(filled) >= 2 * np.pi:
        raise ValueError("azimuth: the shots span more than a turn; cut the cloud to one")
    if len(np.unique(filled)) < len(filled):
        raise ValueError(f"{name}: two lines have the same; the cloud is no grid, or has one line twice")
    if not turn:
        filled = np.clip(filled, -np.pi / 2, np.pi / 2)
    elif filled.min() < -np.pi or filled.max() > np.pi:
        # A turn begins anywhere; what it spans is less than one.
        filled -= 2 * np.pi * np.round(0.5 * (filled.min() + filled.max()) / (2 * np.pi))
    return filled


def _check(unit: Array, measured: Array, azimuth: Array, elevation: Array) -> None:
    """Whether rays go where the grid says: within half a step, of 99 in 100."""
    flat = np.cos(elevation)
    grid = np.stack([flat[:, None] * np.cos(azimuth), flat[:, None] * np.sin(azimuth),
                     np.broadcast_to(np.sin(elevation)[:, None], measured.shape)], axis=-1)
    off = np.linalg.norm(unit - grid, axis=2)[measured]
    step = max(np.median(np.abs(np.diff(np.sort(azimuth)))), np.median(np.abs(np.diff(np.sort(elevation)))))
    worst = float(np.quantile(off, 0.99))
    if worst > 0.5 * step:
        raise ValueError(
            f"points: one ray in a hundred is {np.degrees(worst):.2f} degrees or more off the grid, whose "
            f"lines are {np.degrees(step):.2f} degrees apart. Take the cloud in the scanner's own frame, "
            "with the lines' offsets taken out ('destaggered') and before motion is compensated")
