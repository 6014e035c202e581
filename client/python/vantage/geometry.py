"""Poses, priors and plans as arrays."""

from __future__ import annotations

import math
from typing import Dict, Optional, Union

import numpy as np

from vantage.arrays import Array
from vantage.v1 import geometry_pb2, plan_pb2


def pose(x: float, y: float, z: float, heading: float = 0.0) -> geometry_pb2.Pose:
    """An upright scanner at x, y, z, m, world; heading: degrees from the world's +x to its own,
    counter-clockwise."""
    half = math.radians(heading) / 2
    return geometry_pb2.Pose(rotation=geometry_pb2.Quaternion(w=math.cos(half), z=math.sin(half)),
                             translation=geometry_pb2.Vector3(x=x, y=y, z=z))


def pose_of(T_world_scan: Array) -> geometry_pb2.Pose:
    """(4, 4), rigid, scanner to world, m. ValueError: not rigid."""
    T = np.asarray(T_world_scan, np.float64)
    if T.shape != (4, 4) or not np.allclose(T[3], (0, 0, 0, 1)):
        raise ValueError(f"T_world_scan: {T.shape}, but a rigid transform is (4, 4) with a last row 0, 0, 0, 1")
    R = T[:3, :3]
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0:
        raise ValueError("T_world_scan: not rigid; its rotation has scale, shear or a mirror in it")
    # The largest of the four is found first, so that nothing is divided by little.
    squares = 1 + np.array([R.trace(), *(2 * np.diag(R) - R.trace())])
    at = int(np.argmax(squares))
    i, j, k = ((0, 1, 2), (0, 1, 2), (1, 2, 0), (2, 0, 1))[at]
    q = np.zeros(4)
    q[at] = 0.5 * math.sqrt(squares[at])
    scale = 0.25 / q[at]
    if at == 0:
        q[1:] = scale * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        q[0] = scale * (R[k, j] - R[j, k])
        q[1 + j], q[1 + k] = scale * (R[j, i] + R[i, j]), scale * (R[k, i] + R[i, k])
    return geometry_pb2.Pose(rotation=geometry_pb2.Quaternion(w=q[0], x=q[1], y=q[2], z=q[3]),
                             translation=geometry_pb2.Vector3(x=T[0, 3], y=T[1, 3], z=T[2, 3]))


def matrix(pose: geometry_pb2.Pose) -> Array:
    """(4, 4) float64, scanner to world, m."""
    q = np.array([pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z])
    w, x, y, z = q / np.linalg.norm(q)
    T = np.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                 [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                 [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = pose.translation.x, pose.translation.y, pose.translation.z
    return T


def prior(where: Union[geometry_pb2.Pose, Array], covariance: Optional[Array] = None,
          levelled_sigma: Optional[float] = None, trusted: bool = False) -> geometry_pb2.PosePrior:
    """What is known of where a scan was made. Without a covariance it is a guess: the place is
    sought up to 1.5 m and 15 degrees from it.

    where: a pose, or (4, 4) scanner to world, m. covariance: (6, 6) of the error [rotation about
    the world's axes, rad; translation, m]. levelled_sigma: an inclinometer fixed roll and pitch to
    this angle, rad, one sigma. trusted: it is a registration, checked and not replaced, and needs a
    covariance. ValueError: a shape is another.
    """
    made = geometry_pb2.PosePrior(
        pose=where if isinstance(where, geometry_pb2.Pose) else pose_of(where), trusted=trusted,
        levelled_sigma_rad=levelled_sigma)
    if covariance is not None:
        if np.shape(covariance) != (6, 6):
            raise ValueError(f"covariance: {np.shape(covariance)}, but rotation and translation make (6, 6)")
        made.covariance.extend(np.asarray(covariance, np.float64).ravel())
    return made


def positions(plan: plan_pb2.Plan) -> Array:
    """(views, 3) float64, m, world: where the scanner's centre goes, the best view first."""
    return np.array([(view.position.x, view.position.y, view.position.z)
                     for view in plan.result.views]).reshape(-1, 3)


def score_map(plan: plan_pb2.Plan) -> Dict[str, Array]:
    """Of a full plan (PlanRun.full): `centre` (cells, 3) float64, m, world; `score`, `score_lower`
    and `score_upper` (cells,) float32, weighted samples."""
    cells = plan.result.score_map
    origin = np.array([cells.origin.x, cells.origin.y, cells.origin.z])
    return {"centre": origin + np.stack([np.array(cells.x, np.float64), np.array(cells.y, np.float64),
                                         np.array(cells.z, np.float64)], axis=-1).reshape(-1, 3),
            **{name: np.array(getattr(cells, name), np.float32)
               for name in ("score", "score_lower", "score_upper")}}
