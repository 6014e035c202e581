"""A room of boxes, and a scanner in it: what the examples scan."""

import math

import numpy as np

import vantage

ROOM = (6.2, 5.1, 2.7)  # m, from the origin
BOXES = np.array([  # smallest and largest corners, m
    [(0.0, 3.4, 0.0), (0.6, 5.1, 2.2)],  # wardrobe
    [(3.7, 2.7, 0.0), (3.85, 5.1, 2.7)],  # partition
    [(2.9, 0.9, 0.0), (4.3, 1.7, 0.75)],  # table
    [(5.2, 0.0, 0.0), (6.2, 0.5, 1.1)]])  # chest


def scan(position, heading=0.0, step=1.5, noise=0.002, seed=1):
    """A panoramic scan from `position`, m, in the room's frame; heading and step in degrees."""
    azimuth = np.radians(np.arange(-180, 180, step))
    elevation = np.radians(np.arange(-60, 88, step))
    turned = azimuth + math.radians(heading)
    flat = np.cos(elevation)[:, None]
    rays = np.stack([flat * np.cos(turned), flat * np.sin(turned),
                     np.broadcast_to(np.sin(elevation)[:, None], (elevation.size, azimuth.size))],
                    axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        walls = (np.where(rays > 0, ROOM, 0.0) - position) / rays
        nearest = np.nanmin(np.where(rays != 0, walls, np.inf), axis=-1)
        for low, high in BOXES:
            a, b = (low - position) / rays, (high - position) / rays
            enter = np.nanmax(np.minimum(a, b), axis=-1)
            leave = np.nanmin(np.maximum(a, b), axis=-1)
            nearest = np.where((enter > 0) & (enter <= leave), np.minimum(nearest, enter), nearest)
    ranges = nearest + np.random.default_rng(seed).normal(0, noise, nearest.shape)
    return vantage.RangeImage(azimuth, elevation, ranges)
