# SPDX-License-Identifier: BSD-3-Clause
"""The scheme of SC2-PCR (Chen et al., CVPR 2022) with its numbers for 3DMatch with FPFH, written on
numpy from the paper.

Matches are nearest neighbours in feature space from source to target. Two are compatible when their
distances differ by less than 0.1 m. Seeds: a fifth of the matches, those best supported by the
leading eigenvector of the compatibility, non-maxima suppressed. The second-order measure of a seed
and a match counts what is compatible with both. Its best 30, then of these the best 20 by the
measure among themselves, weighted by the leading eigenvector, give a pose; the pose that most
matches agree with (0.1 m) wins and is fitted again."""

import numpy as np

from methods import VOXEL


def leading(matrix, rounds=10):
    """Leading eigenvectors of a stack of symmetric non-negative matrices."""
    vector = np.ones(matrix.shape[:-1], matrix.dtype)
    for _ in range(rounds):
        vector = np.matmul(matrix, vector[..., None])[..., 0]
        vector /= np.linalg.norm(vector, axis=-1, keepdims=True) + 1e-6
    return vector


def fit(p, q, w):
    """Weighted rigid motions (n, 3, 3), (n, 3) of p onto q, both (n, k, 3)."""
    w = (w / (w.sum(1, keepdims=True) + 1e-9))[..., None]
    a, b = (w * p).sum(1, keepdims=True), (w * q).sum(1, keepdims=True)
    u, _, vt = np.linalg.svd(np.matmul((w * (p - a)).transpose(0, 2, 1), q - b))
    v, ut = vt.transpose(0, 2, 1), u.transpose(0, 2, 1)
    turn = np.tile(np.eye(3, dtype=p.dtype), (len(p), 1, 1))
    turn[:, 2, 2] = np.sign(np.linalg.det(np.matmul(v, ut)))
    rotation = np.matmul(np.matmul(v, turn), ut)
    return rotation, b[:, 0] - np.einsum("nij,nj->ni", rotation, a[:, 0])


def distances(p):
    square = (p * p).sum(1)
    return np.sqrt(np.maximum(square[:, None] + square[None] - 2 * p @ p.T, 0))


def best(values, count):
    count = min(count, values.shape[1])
    return np.argpartition(-values, count - 1, axis=1)[:, :count]


class SecondOrder:
    label = "SC2-PCR's scheme"
    parameters = f"FPFH, one match a point, {2 * VOXEL:g} m, seeds 20 %, 30 and 20 members; own runner on numpy"
    threshold = 0.05  # share of the matches that agree
    refines = False
    within, suppression, share, first, second = (
        np.float32(2 * VOXEL),
        np.float32(2 * VOXEL),
        0.2,
        30,
        20,
    )

    def __init__(self):
        import gpureg

        self.gpureg = gpureg

    def version(self):
        return "on numpy " + np.__version__

    def prepare(self, cloud):
        options = self.gpureg.RegistrationOptions(
            voxel_size=VOXEL,
            prepare=self.gpureg.PrepareOptions(
                downsample=False, wide_feature_radius=0.0, depth_maps=0
            ),
        )
        prepared = self.gpureg.prepare(
            cloud.points, cloud.normals, options=options, context=self.gpureg.Context.cpu()
        )
        features = np.ascontiguousarray(prepared.features, np.float32)
        points = np.asarray(prepared.points, np.float32)
        norms = np.linalg.norm(features, axis=1, keepdims=True)
        keep = np.isfinite(norms[:, 0]) & (norms[:, 0] > 0)
        return points[keep], features[keep] / norms[keep]

    def align(self, source, target, initial, seed):
        p, q = source[0], target[0][np.argmax(source[1] @ target[1].T, axis=1)]
        n = len(p)
        if n < 4 or len(target[0]) < 4:
            return {"pose": None, "score": 0.0}
        apart = distances(p)
        difference = np.abs(apart - distances(q))
        soft = np.maximum(1 - (difference / self.within) ** 2, 0)
        confidence = leading(soft)
        compatible = (difference < self.within).astype(np.float32)
        # A seed has no better match around it.
        local = np.where(apart < self.suppression, confidence[None], 0).max(1)
        order = np.argsort(-(confidence + (confidence >= local)), kind="stable")
        seeds = order[: max(1, int(self.share * n))]
        measure = (compatible[seeds] @ compatible) * compatible[seeds]
        members = best(measure, self.first)
        inside = compatible[members[:, :, None], members[:, None, :]]
        inside = np.matmul(inside, inside) * inside
        members = np.take_along_axis(
            members, best(inside[:, 0] + inside.sum(1) * 1e-3, self.second), 1
        )
        inside = soft[members[:, :, None], members[:, None, :]]
        rotation, translation = fit(p[members], q[members], leading(inside))
        counts = np.empty(len(seeds))
        for k in range(0, len(seeds), 64):
            moved = (
                np.einsum("sij,nj->sni", rotation[k : k + 64], p) + translation[k : k + 64, None]
            )
            counts[k : k + 64] = (((moved - q) ** 2).sum(-1) < self.within**2).sum(1)
        winner = int(np.argmax(counts))
        r, t = rotation[winner], translation[winner]
        for _ in range(20):
            error = np.linalg.norm(p @ r.T + t - q, axis=1)
            inlier = error < self.within
            if inlier.sum() < 4:
                break
            weight = 1 / (1 + (error[inlier] / self.within) ** 2)
            r, t = (x[0] for x in fit(p[None, inlier], q[None, inlier], weight[None]))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = r, t
        return {
            "pose": pose,
            "score": float((np.linalg.norm(p @ r.T + t - q, axis=1) < self.within).mean()),
        }
