# SPDX-License-Identifier: BSD-3-Clause
"""sphere2500 with false loops, as plain arrays: read from GTSAM's wheel, written as g2o."""

from __future__ import annotations

import dataclasses
import pathlib

import numpy as np

GROUP = (5, 9)  # edges of a consistent group, both ends included


@dataclasses.dataclass
class SphereGraph:
    """Edges measure node j in the frame of node i: ``poses[k]`` is i_from_j, (M, 4, 4)."""

    ends: np.ndarray
    poses: np.ndarray
    information: np.ndarray  # (6, 6), rotation first, one for all edges
    truth: np.ndarray  # world_from_node, (N, 4, 4)
    false: np.ndarray  # (M,) flags

    @property
    def odometry(self) -> np.ndarray:
        return np.abs(self.ends[:, 0] - self.ends[:, 1]) == 1

    def initial(self) -> np.ndarray:
        """Poses from odometry alone."""
        chain = {int(i): pose for (i, j), pose in zip(self.ends, self.poses) if j == i + 1}
        out = [np.eye(4)]
        for k in range(len(self.truth) - 1):
            out.append(out[-1] @ chain[k])
        return np.array(out)


def euler(v: np.ndarray) -> np.ndarray:
    """EDGE3's x y z roll pitch yaw as a transform."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(v[3:]), np.sin(v[3:])
    pose = np.eye(4)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = v[:3]
    return pose


def _edges(path: pathlib.Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rows = [line.split() for line in path.read_text().splitlines() if line.startswith("EDGE3")]
    ends = np.array([[int(r[1]), int(r[2])] for r in rows])
    poses = np.array([euler(np.array(r[3:9], float)) for r in rows])
    upper = np.array(rows[0][9:], float)
    information = np.zeros((6, 6))
    information[np.triu_indices(6)] = upper
    information += np.triu(information, 1).T
    order = [3, 4, 5, 0, 1, 2]
    return ends, poses, information[np.ix_(order, order)]


def load(folder: pathlib.Path, nodes: int = 2500) -> SphereGraph:
    """The graph, or its first rings of 50 nodes."""
    ends, poses, information = _edges(folder / "sphere2500.txt")
    _, true_poses, _ = _edges(folder / "sphere2500_groundtruth.txt")
    truth = np.tile(np.eye(4), (nodes, 1, 1))
    for (i, j), pose in zip(ends, true_poses):
        if j == i + 1 and j < nodes:
            truth[j] = truth[i] @ pose
    keep = (ends < nodes).all(1)
    ends, poses = ends[keep], poses[keep]
    return SphereGraph(ends, poses, information, truth, np.zeros(len(ends), bool))


def with_false_loops(graph: SphereGraph, percent: int, kind: str, seed: int) -> SphereGraph:
    """`percent` of the loops are false.

    random: two nodes and a relative pose, each uniform. consistent: groups of GROUP edges of
    consecutive nodes at two places, as if one place were the other; the edges of a group agree with
    each other and with odometry.
    """
    random = np.random.default_rng([seed, percent, kind == "random"])
    loops = ~graph.odometry
    n, count = len(graph.truth), round(loops.sum() * percent / (100 - percent))
    reach = 2 * np.median(np.linalg.norm(graph.poses[loops, :3, 3], axis=1))
    taken = {tuple(sorted(e)) for e in graph.ends.tolist()}
    sigma = 1 / np.sqrt(np.diag(graph.information))
    ends: list[tuple[int, int]] = []
    poses: list[np.ndarray] = []
    while len(ends) < count:
        size = 1 if kind == "random" else int(random.integers(GROUP[0], GROUP[1] + 1))
        size = min(size, count - len(ends)) if count - len(ends) >= GROUP[0] else size
        a, b = (int(x) for x in random.integers(0, n - size, 2))
        pairs = [(a + k, b + k) for k in range(size)]
        if abs(a - b) < 2 * GROUP[1] or any(tuple(sorted(p)) in taken for p in pairs):
            continue
        taken.update(tuple(sorted(p)) for p in pairs)
        displaced = graph.truth[a] @ _uniform(random, reach) @ np.linalg.inv(graph.truth[b])
        for i, j in pairs:
            pose = np.linalg.inv(graph.truth[i]) @ displaced @ graph.truth[j]
            poses.append(pose @ _noise(random, sigma))
            ends.append((i, j))
    if not ends:
        return graph
    return dataclasses.replace(
        graph,
        ends=np.concatenate([graph.ends, ends]),
        poses=np.concatenate([graph.poses, poses]),
        false=np.concatenate([graph.false, np.ones(len(ends), bool)]),
    )


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _uniform(random: np.random.Generator, reach: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = _rotation(random.normal(size=4))
    direction = random.normal(size=3)
    pose[:3, 3] = direction / np.linalg.norm(direction) * reach * random.random() ** (1 / 3)
    return pose


def _noise(random: np.random.Generator, sigma: np.ndarray) -> np.ndarray:
    w, v = random.normal(size=(2, 3)) * sigma.reshape(2, 3)
    angle = np.linalg.norm(w)
    pose = np.eye(4)
    pose[:3, :3] = _rotation(np.append(np.sin(angle / 2) * w / angle, np.cos(angle / 2)))
    pose[:3, 3] = v
    return pose


def quaternion(r: np.ndarray) -> np.ndarray:
    """x y z w of a rotation matrix (Shepperd 1978)."""
    trace = np.array([r[0, 0], r[1, 1], r[2, 2], np.trace(r)])
    k = int(np.argmax(trace))
    if k == 3:
        q = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + trace[3]])
    else:
        a, b, c = k, (k + 1) % 3, (k + 2) % 3
        q = np.zeros(4)
        q[a] = 1 + r[a, a] - r[b, b] - r[c, c]
        q[b], q[c], q[3] = r[a, b] + r[b, a], r[a, c] + r[c, a], r[c, b] - r[b, c]
    return q / np.linalg.norm(q)


def write_g2o(path: pathlib.Path, graph: SphereGraph) -> None:
    """Translation first, the rotation part in radians."""
    order = [3, 4, 5, 0, 1, 2]
    upper = graph.information[np.ix_(order, order)][np.triu_indices(6)]
    tail = " ".join(f"{x:g}" for x in upper)

    def text(pose: np.ndarray) -> str:
        return " ".join(f"{x:.17g}" for x in (*pose[:3, 3], *quaternion(pose[:3, :3])))

    with path.open("w") as file:
        for k, pose in enumerate(graph.initial()):
            file.write(f"VERTEX_SE3:QUAT {k} {text(pose)}\n")
        for (i, j), pose in zip(graph.ends, graph.poses):
            file.write(f"EDGE_SE3:QUAT {i} {j} {text(pose)} {tail}\n")


def ate(positions: np.ndarray, truth: np.ndarray) -> float:
    """RMSE of positions after rigid alignment (Horn 1987), metres."""
    a, b = positions - positions.mean(0), truth - truth.mean(0)
    u, _, vt = np.linalg.svd(b.T @ a)
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.sqrt(((a @ rotation.T - b) ** 2).sum(1).mean()))
