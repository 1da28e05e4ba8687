# SPDX-License-Identifier: BSD-3-Clause
"""Small clouds with enough shape to be registered, and what tests ask about them."""

import gpureg
import numpy as np


def planar(x, y, degrees):
    """A pose in the plane."""
    pose = np.eye(4)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    pose[:2, :2] = [[c, -s], [s, c]]
    pose[:2, 3] = x, y
    return pose


def room(seed: int = 1, points: int = 6000) -> np.ndarray:
    """(points, 3) float64: floor, two walls and six boxes of a 2 m corner, sampled at random."""
    rng = np.random.default_rng(seed)
    parts = []
    for axis in range(3):
        side = rng.random((points // 6, 3)) * 2
        side[:, axis] = 0
        parts.append(side)
    for _ in range(6):
        low, size = rng.random(3) * 1.4, 0.15 + rng.random(3) * 0.4
        box = rng.random((points // 12, 3))
        faces = rng.integers(0, 6, len(box))
        box[np.arange(len(box)), faces % 3] = faces // 3
        parts.append(low + box * size)
    return np.concatenate(parts)


def pose(seed: int = 3) -> np.ndarray:
    """(4, 4) rotation by up to half a turn, translation within a metre."""
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = q, rng.normal(size=3)
    return out


def moved(points: np.ndarray, transform: np.ndarray) -> np.ndarray:
    return points @ transform[:3, :3].T + transform[:3, 3]


def error_of(result: gpureg.RegistrationResult, truth: np.ndarray) -> float:
    """Largest entry of the difference of two poses."""
    return float(np.abs(result.target_from_source - truth).max())


def few(count: int = 20000, voxel_size: float = 0.05) -> gpureg.RegistrationOptions:
    """The paper's sampling with few quadruples, refined: fast."""
    options = gpureg.RegistrationOptions.loopsmart(voxel_size)
    options.quadruples = count
    options.refine_iterations = 20
    return options
