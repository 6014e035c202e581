#!/usr/bin/python3
"""record_clouds.py TO: messages as two kinds of driver publish them, of the examples' room: what
ros2_test.py replays. Written once; the test reads the file, not this."""

import base64
import gzip
import json
import sys

import numpy as np

import room

KINDS = {"f4": 7, "u4": 6, "u2": 4, "u1": 2}


def message(points, layout, point_step, is_dense, stamp, extra):
    """layout: (name, kind, offset)."""
    height, width = points.shape[:2]
    kind = np.dtype({"names": [name for name, _, _ in layout], "formats": [f"<{k}" for _, k, _ in layout],
                     "offsets": [offset for _, _, offset in layout], "itemsize": point_step})
    cloud = np.zeros((height, width), kind)
    for axis, name in enumerate("xyz"):
        cloud[name] = points[..., axis]
    for name, values in extra.items():
        cloud[name] = values
    return {"header": {"frame_id": "lidar", "stamp": stamp}, "height": height, "width": width,
            "fields": [{"name": name, "offset": offset, "datatype": KINDS[k], "count": 1}
                       for name, k, offset in layout],
            "is_bigendian": False, "point_step": point_step, "row_step": point_step * width,
            "is_dense": is_dense, "data": base64.b64encode(cloud.tobytes()).decode()}


def main():
    clouds = []
    for number, (place, heading) in enumerate((((1.8, 1.9, 1.5), 0), ((2.6, 2.4, 1.5), 20))):
        image = room.scan(place, heading, step=2.5, seed=number)
        rng = np.random.default_rng(number)
        lost = rng.random(image.ranges.shape) < 0.02
        points = image.directions() * image.ranges[..., None]
        intensity = np.round(255 * np.exp(-image.ranges / 8))
        if number == 0:
            # Rings from the top down, turning clockwise; no return is 0, 0, 0; 48 bytes a point.
            points = np.where(lost[..., None], 0, points)[::-1, ::-1]
            clouds.append(message(
                points, (("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8), ("intensity", "f4", 16),
                         ("t", "u4", 20), ("reflectivity", "u2", 24), ("ring", "u1", 26),
                         ("range", "u4", 32)), 48, True, number,
                {"intensity": intensity[::-1, ::-1], "ring": np.arange(len(points))[:, None],
                 "range": (1000 * np.linalg.norm(points, axis=2)).astype(np.uint32)}))
        else:
            # Rings from the bottom up, beginning somewhere in the turn; no return is NaN.
            points = np.roll(np.where(lost[..., None], np.nan, points), 41, axis=1)
            clouds.append(message(
                points, (("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8), ("intensity", "f4", 16)), 32,
                False, number, {"intensity": np.roll(intensity, 41, axis=1)}))
    with gzip.GzipFile(sys.argv[1], "wb", mtime=0) as file:
        file.write(json.dumps(clouds).encode())


if __name__ == "__main__":
    main()
