# SPDX-License-Identifier: BSD-3-Clause
"""Bins of parts as a depth camera sees them, with the pose and the visible share of every part. numpy only."""

import numpy as np


def rotation(rng):
    q = rng.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def lying(triangles, rng):
    """A rotation about which the part lies on one of its large flat sides, or any."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normal, axis=1)
    for _ in range(30):
        n = normal[rng.choice(len(area), p=area / area.sum())]
        n = n / np.linalg.norm(n)
        height = triangles.reshape(-1, 3) @ n
        flat = (triangles @ n > height.max() - 0.03 * np.ptp(height)).all(1)
        if area[flat].sum() > 0.05 * area.sum():
            break
    else:
        return rotation(rng)
    z = -n  # down
    x = np.cross(z, rng.normal(size=3))
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def raster(points, size, depth_low=None, perspective=True):
    """Depth image of triangles in pixels: points (n, 3, 3) of x, y in pixels and depth. inf: nothing."""
    w, h = size
    image = np.full(w * h, np.inf)
    p = points[(points[..., 2] > 0).all(1)] if perspective else points
    low = np.ceil(p[..., :2].min(1)).astype(int)
    high = np.floor(p[..., :2].max(1)).astype(int)
    low = np.maximum(low, 0)
    high = np.minimum(high, [w - 1, h - 1])
    span = high - low + 1
    keep = (span > 0).all(1)
    p, low, span = p[keep], low[keep], span[keep]
    count = span[:, 0] * span[:, 1]
    begin = 0
    while begin < len(p):
        end = max(begin + 1, int(np.searchsorted(np.cumsum(count[begin:]), 4_000_000)) + begin)
        c = count[begin:end]
        which = np.repeat(np.arange(begin, end), c)
        inner = np.arange(c.sum()) - np.repeat(np.cumsum(c) - c, c)
        x = low[which, 0] + inner % span[which, 0]
        y = low[which, 1] + inner // span[which, 0]
        t = p[which]
        e1, e2 = t[:, 1, :2] - t[:, 0, :2], t[:, 2, :2] - t[:, 0, :2]
        dx, dy = x - t[:, 0, 0], y - t[:, 0, 1]
        det = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            a = (dx * e2[:, 1] - dy * e2[:, 0]) / det
            b = (e1[:, 0] * dy - e1[:, 1] * dx) / det
            if perspective:
                z = 1 / ((1 - a - b) / t[:, 0, 2] + a / t[:, 1, 2] + b / t[:, 2, 2])
            else:
                z = (1 - a - b) * t[:, 0, 2] + a * t[:, 1, 2] + b * t[:, 2, 2]
            ok = (a >= 0) & (b >= 0) & (a + b <= 1) & np.isfinite(z)
        np.minimum.at(image, y[ok] * w + x[ok], z[ok])
        begin = end
    return image.reshape(h, w)


class Camera:
    def __init__(self, eye, at, size=(640, 480), focal=585.0):
        z = np.asarray(at, float) - eye
        z /= np.linalg.norm(z)
        x = np.cross(z, [0, 0, 1.0])
        x /= np.linalg.norm(x)
        self.r, self.eye = np.stack([x, np.cross(z, x), z]), np.asarray(eye, float)
        self.size, self.focal = size, focal
        u, v = np.meshgrid(np.arange(size[0]) - size[0] / 2, np.arange(size[1]) - size[1] / 2)
        self.rays = np.stack([u / focal, v / focal, np.ones_like(u)], -1)

    def depth(self, triangles):
        p = (triangles - self.eye) @ self.r.T
        q = p.copy()
        q[..., :2] = p[..., :2] / p[..., 2:] * self.focal + np.array(self.size) / 2
        return raster(q, self.size)

    def boxes(self, boxes):
        """Depth of axis-parallel boxes (low, high)."""
        d = self.rays.reshape(-1, 3) @ self.r
        out = np.full(len(d), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            for low, high in boxes:
                t1, t2 = (low - self.eye) / d, (high - self.eye) / d
                near, far = np.minimum(t1, t2).max(1), np.maximum(t1, t2).min(1)
                out = np.where((far >= near) & (near > 0) & (near < out), near, out)
        return out.reshape(self.size[::-1])


def heights(triangles, low, edge, count, top):
    p = triangles.copy()
    p[..., :2] = (p[..., :2] - low) / edge
    if top:
        p[..., 2] *= -1
    image = raster(p, count, perspective=False)
    return -image if top else image


def pile(meshes, half, rng, tries=6):
    """Drops meshes one after another into a bin. @return their poses world_from_part."""
    edge = half[0] / 110
    count = (np.ceil(2 * np.asarray(half) / edge)).astype(int)
    ground = np.zeros(count[::-1])
    out = []
    for triangles in meshes:
        best = None
        for _ in range(tries):
            r = lying(triangles, rng) if rng.random() < 0.5 else rotation(rng)
            moved = triangles @ r.T
            low, high = moved.min((0, 1)), moved.max((0, 1))
            room = np.asarray(half) - 1.05 * np.maximum(high[:2], -low[:2])
            if (room <= 0).any():
                continue
            x = rng.uniform(-room, room)
            bottom = heights(moved + [*x, 0], -np.asarray(half), edge, tuple(count), False)
            inside = np.isfinite(bottom)
            if not inside.any():
                continue
            z = (ground[inside] - bottom[inside]).max()
            if best is None or z + high[2] < best[0]:
                best = (z + high[2], r, np.array([*x, z]))
        if best is None:
            continue
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = best[1], best[2]
        tops = heights(triangles @ best[1].T + best[2], -np.asarray(half), edge, tuple(count), True)
        ground = np.maximum(ground, np.where(np.isfinite(tops), tops, 0))
        out.append(pose)
    return out


def bin_of(half, height):
    x, y = half
    t = 0.03 * x
    return [
        (np.array(a, float), np.array(b, float))
        for a, b in (
            ((-x, -y, -t), (x, y, 0)),
            ((-x, y, 0), (x, y + t, height)),
            ((-x, -y - t, 0), (x, -y, height)),
            ((x, -y, 0), (x + t, y, height)),
            ((-x - t, -y, 0), (-x, y, height)),
        )
    ]


def thin(points, edge):
    _, rows = np.unique(np.floor(points / edge).astype(np.int64), axis=0, return_index=True)
    return np.sort(rows)


def scene(part, others, instances, clutter, rng, diameter):
    """A bin with instances of part and clutter pieces of others.

    @return points in the camera's frame (sensor at the origin, z ahead), and a list of
    (scene_from_part, visible share) of the instances.
    """
    meshes = [(part, True)] * instances + [
        (others[rng.integers(len(others))], False) for _ in range(clutter)
    ]
    rng.shuffle(meshes)
    n = max(len(meshes), 2)
    side = diameter * np.clip(0.34 * np.sqrt(n), 0.9, 2)
    half = (side * 1.1, side * 0.9)
    poses = []
    kept = []
    for (triangles, mine), pose in zip(meshes, pile([m for m, _ in meshes], half, rng)):
        poses.append(pose)
        kept.append((triangles, mine))
    at = np.array([0, 0, 0.3 * diameter])
    distance = 1.25 * half[0] * 585 / 320 * rng.uniform(1, 1.25)
    tilt, turn = rng.uniform(0, 0.5), rng.uniform(0, 2 * np.pi)
    eye = at + distance * np.array(
        [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn) - 1e-3, np.cos(tilt)]
    )
    camera = Camera(eye, at)
    depth = [camera.depth(t @ p[:3, :3].T + p[:3, 3]) for (t, _), p in zip(kept, poses)]
    image = np.minimum.reduce(
        depth + [camera.boxes(bin_of(half, diameter * rng.uniform(0.4, 1.2)))]
    )
    truth = []
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3], camera_from_world[:3, 3] = camera.r, -camera.r @ eye
    for (_, mine), d, p in zip(kept, depth, poses):
        if mine:
            own = np.isfinite(d)
            share = (own & (d <= image + 1e-9)).sum() / max(own.sum(), 1)
            truth.append((camera_from_world @ p, share))
    noise = diameter * rng.uniform(0.003, 0.008)
    seen = np.isfinite(image) & (rng.random(image.shape) > 0.02)
    z = image[seen] + rng.normal(size=seen.sum()) * noise
    points = camera.rays[seen] * z[:, None]
    return points.astype(np.float32), truth
