# SPDX-License-Identifier: BSD-3-Clause
"""Parts of a dozen kinds as triangle meshes, from signed distances. numpy only."""

import itertools

import numpy as np

# The six tetrahedra of a cube around its diagonal, corners by bits x + 2 y + 4 z.
_TETRAHEDRA = [(0, 7, *pair) for pair in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))]
_CORNERS = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)])


def mesh_of(distance, low, high, cells=44):
    """Marching tetrahedra: triangles (n, 3, 3) of the surface where distance(points) is 0."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    edge = (high - low).max() / cells
    count = np.ceil((high - low) / edge).astype(int) + 1
    axes = [low[k] + edge * np.arange(count[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    values = distance(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    # No value of exactly 0: a surface through a corner would have triangles without area.
    values = np.where(np.abs(values) < 1e-9 * edge, 1e-9 * edge, values)
    base = np.stack(np.meshgrid(*[np.arange(c - 1) for c in count], indexing="ij"), -1)
    base = base.reshape(-1, 3)
    corner = base[:, None] + _CORNERS[None]
    at = values[corner[..., 0], corner[..., 1], corner[..., 2]]
    mixed = (at.min(1) < 0) & (at.max(1) > 0)
    corner, at = corner[mixed], at[mixed]
    place = grid[corner[..., 0], corner[..., 1], corner[..., 2]]
    out = []
    for tetrahedron in _TETRAHEDRA:
        p, v = place[:, tetrahedron], at[:, tetrahedron]
        inside = v < 0
        for mask in range(1, 15):
            bits = np.array([mask >> k & 1 for k in range(4)], bool)
            rows = (inside == bits).all(1)
            if not rows.any():
                continue
            q, w = p[rows], v[rows]
            ins, outs = np.flatnonzero(bits), np.flatnonzero(~bits)

            def cut(a, b, q=q, w=w):
                t = (w[:, a] / (w[:, a] - w[:, b]))[:, None]
                return q[:, a] + t * (q[:, b] - q[:, a])

            cuts = [cut(a, b) for a, b in itertools.product(ins, outs)]
            if len(cuts) == 3:
                faces = [cuts]
            else:  # 2 + 2: a quad, a0b0 a0b1 a1b1 a1b0
                faces = [[cuts[0], cuts[1], cuts[3]], [cuts[0], cuts[3], cuts[2]]]
            outward = q[:, outs].mean(1) - q[:, ins].mean(1)
            for face in faces:
                t = np.stack(face, 1)
                normal = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
                turned = (normal * outward).sum(1) < 0
                t[turned] = t[turned][:, ::-1]
                out.append(t[np.linalg.norm(normal, axis=1) > 1e-12 * edge * edge])
    return np.concatenate(out)


def box(centre, size, rounding=0.0):
    c, h = np.asarray(centre, float), np.asarray(size, float) / 2 - rounding

    def f(p):
        q = np.abs(p - c) - h
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0) - rounding

    return f


def cylinder(centre, radius, height, axis=2):
    c = np.asarray(centre, float)
    others = [k for k in range(3) if k != axis]

    def f(p):
        d = p - c
        q = np.stack(
            [np.linalg.norm(d[:, others], axis=1) - radius, np.abs(d[:, axis]) - height / 2], 1
        )
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)

    return f


def capsule(a, b, radius):
    a, b = np.asarray(a, float), np.asarray(b, float)

    def f(p):
        t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        return np.linalg.norm(p - a - t[:, None] * (b - a), axis=1) - radius

    return f


def union(*parts):
    return lambda p: np.min([f(p) for f in parts], axis=0)


def smooth_union(width, *parts):
    return lambda p: -width * np.log(np.exp(-np.array([f(p) for f in parts]) / width).sum(0))


def minus(a, *holes):
    return lambda p: np.max([a(p)] + [-h(p) for h in holes], axis=0)


def _bracket(r):
    w, a, b, t = r.uniform(0.3, 0.6), r.uniform(0.7, 1), r.uniform(0.5, 0.9), r.uniform(0.07, 0.14)
    holes = [
        cylinder((x * a, r.uniform(-0.2, 0.2) * w, 0), r.uniform(0.05, 0.1), 1, 2)
        for x in (0.4, 0.75)
    ]
    holes.append(cylinder((0, r.uniform(-0.1, 0.1) * w, 0.6 * b), r.uniform(0.06, 0.12), 1, 0))
    solid = union(box((a / 2, 0, t / 2), (a, w, t)), box((t / 2, 0, b / 2), (t, w, b)))
    if r.random() < 0.5:
        solid = union(
            solid,
            box((0.3 * a, r.choice([-0.4, 0, 0.4]) * w, 0.2 * b), (0.5 * a, t * 0.8, 0.35 * b)),
        )
    return minus(solid, *holes)


def _elbow(r):
    a, b, c = r.uniform(0.5, 0.9), r.uniform(0.4, 0.9), r.uniform(0.09, 0.15)
    solid = union(
        capsule((0, 0, 0), (a, 0, 0), c),
        capsule((0, 0, 0), (0, b, 0), c),
        cylinder((a, 0, 0), 1.6 * c, 0.08, 0),
        cylinder((0, b, 0), 1.5 * c, 0.08, 1),
    )
    return minus(solid, cylinder((a, 0, 0), 0.7 * c, 0.5, 0), cylinder((0, b, 0), 0.7 * c, 0.5, 1))


def _tee(r):
    a, b, c = r.uniform(0.8, 1.1), r.uniform(0.4, 0.6), r.uniform(0.1, 0.16)
    x = r.uniform(-0.2, 0.2)
    solid = union(
        cylinder((0, 0, 0), c, a, 0),
        cylinder((x, b / 2, 0), 0.85 * c, b, 1),
        cylinder((x, b, 0), 1.4 * c, 0.07, 1),
    )
    return minus(
        solid, cylinder((0, 0, 0), 0.75 * c, 2, 0), cylinder((x, b, 0), 0.6 * c, 2 * b - 0.2, 1)
    )


def _gear(r):
    teeth, radius, depth = r.integers(8, 15), r.uniform(0.4, 0.5), r.uniform(0.05, 0.09)
    hub, t = r.uniform(0.12, 0.2), r.uniform(0.1, 0.2)

    def toothed(p):
        angle = np.arctan2(p[:, 1], p[:, 0])
        rim = radius + depth * np.tanh(3 * np.cos(teeth * angle))
        return np.maximum(np.linalg.norm(p[:, :2], axis=1) - rim, np.abs(p[:, 2]) - t / 2)

    solid = union(toothed, cylinder((0, 0, t / 2), hub, t * r.uniform(1, 2.5)))
    return minus(
        solid, cylinder((0, 0, 0), 0.5 * hub, 2), box((0.5 * hub, 0, 0), (0.3 * hub, 0.3 * hub, 2))
    )


def _box_with_holes(r):
    s = r.uniform([0.6, 0.4, 0.25], [1, 0.7, 0.45])
    x, y = r.uniform(-0.25, 0.25) * s[0], r.uniform(-0.2, 0.2) * s[1]
    return minus(
        box((0, 0, 0), s),
        cylinder((x, y, s[2] / 2), r.uniform(0.1, 0.18), s[2]),
        box((-s[0] / 2, -s[1] / 2, s[2] / 2), s * r.uniform(0.4, 0.8, 3)),
        cylinder((0.25 * s[0], 0, 0), 0.22 * s[2], 2, 1),
    )


def _housing(r):
    s, t = r.uniform([0.7, 0.5, 0.3], [1, 0.7, 0.5]), r.uniform(0.05, 0.08)
    solid = minus(box((0, 0, 0), s), box((0, 0, t), s - [2 * t, 2 * t, 0]))
    posts = [
        cylinder((x * (s[0] / 2 - 0.14), y * (s[1] / 2 - 0.14), -0.1 * s[2]), 0.07, 0.7 * s[2])
        for x, y in ((1, 1), (-1, 1), (1, -1))
    ]
    ear = box((s[0] / 2 + 0.08, r.uniform(-0.2, 0.2) * s[1], -s[2] / 2 + t / 2), (0.25, 0.2, t))
    return union(solid, ear, *posts)


def _organic(r):
    k = r.integers(5, 9)
    balls = []
    at = np.zeros(3)
    for _ in range(k):
        at = at + r.normal(size=3) * 0.16
        radius = r.uniform(0.08, 0.2)
        balls.append(capsule(at, at + 1e-9, radius))
    return smooth_union(0.05, *balls)


def _figure(r):
    body = [capsule((0, 0, 0), (0, 0, 0.4), 0.14), capsule((0, 0, 0.58), (0.05, 0, 0.62), 0.11)]
    for side in (-1, 1):
        hand = np.array([r.uniform(-0.2, 0.25), side * r.uniform(0.25, 0.4), r.uniform(0.1, 0.6)])
        foot = np.array([r.uniform(-0.15, 0.2), side * r.uniform(0.08, 0.2), -0.4])
        body += [
            capsule((0, side * 0.12, 0.38), hand, 0.055),
            capsule((0, side * 0.08, 0), foot, 0.07),
        ]
    return smooth_union(0.02, *body)


def _bolt(r):
    length, a, b = r.uniform(0.6, 0.8), r.uniform(0.08, 0.13), r.uniform(0.18, 0.26)

    def hexagon(p):
        q = np.abs(p[:, :2])
        flat = np.maximum(q[:, 0] * 0.8660254 + q[:, 1] * 0.5, q[:, 1]) - b
        return np.maximum(flat, np.abs(p[:, 2]) - 0.09)

    return union(
        hexagon, cylinder((0, 0, length / 2), a, length), cylinder((0, 0, 0.1), 1.25 * b, 0.05)
    )


def _lever(r):
    a, t = r.uniform(0.7, 1), r.uniform(0.08, 0.13)
    big, small = r.uniform(0.16, 0.24), r.uniform(0.09, 0.14)
    solid = union(
        cylinder((0, 0, 0.05), big, t + 0.12),
        cylinder((a, 0, r.uniform(-0.05, 0.1)), small, t + 0.05),
        box((a / 2, 0, 0), (a, 1.1 * small, t)),
    )
    return minus(solid, cylinder((0, 0, 0), 0.55 * big, 2), cylinder((a, 0, 0), 0.5 * small, 2))


def _clip(r):
    radius, t, w = r.uniform(0.28, 0.4), r.uniform(0.07, 0.1), r.uniform(0.2, 0.4)
    ring = minus(cylinder((0, 0, 0), radius, w), cylinder((0, 0, 0), radius - t, 2))
    ring = minus(ring, box((radius, 0.05, 0), (radius, r.uniform(0.2, 0.35), 2)))
    foot = box((-radius - 0.12, r.uniform(-0.08, 0.08), 0), (0.35, r.uniform(0.3, 0.5), 0.8 * w))
    return minus(union(ring, foot), cylinder((-radius - 0.15, 0.1, 0), 0.06, 1, 0))


def _step_block(r):
    """Like the part of the generated bin: a base, a wall, a knob."""
    s = r.uniform([0.8, 0.45, 0.18], [1, 0.7, 0.28])
    wall = box((-0.5 * s[0] + 0.12, 0, 0.3), (0.22, s[1], 0.6))
    knob = cylinder((r.uniform(0.1, 0.3), r.uniform(-0.1, 0.12), 0.25), r.uniform(0.1, 0.15), 0.45)
    return union(box((0, 0, s[2] / 2), s), wall, knob)


KINDS = {
    "bracket": _bracket,
    "elbow": _elbow,
    "tee": _tee,
    "gear": _gear,
    "box_with_holes": _box_with_holes,
    "housing": _housing,
    "organic": _organic,
    "figure": _figure,
    "bolt": _bolt,
    "lever": _lever,
    "clip": _clip,
    "step_block": _step_block,
}


def make(kind, seed, diameter):
    """Triangles (n, 3, 3) around the origin; diameter: of the box, corner to corner."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    f = KINDS[kind](rng)
    coarse = np.stack(np.meshgrid(*[np.linspace(-2, 2, 90)] * 3, indexing="ij"), -1).reshape(-1, 3)
    within = coarse[f(coarse) < 0.03]
    mesh = mesh_of(f, within.min(0) - 0.06, within.max(0) + 0.06)
    low, high = mesh.min((0, 1)), mesh.max((0, 1))
    return (mesh - (low + high) / 2) * (diameter / np.linalg.norm(high - low))


def area_of(triangles):
    return (
        np.linalg.norm(
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
        )
        / 2
    )


def sample(triangles, count, rng):
    """Points and normals, uniform by area."""
    area = area_of(triangles)
    t = triangles[rng.choice(len(area), count, p=area / area.sum())]
    a, b = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    normal = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return t[:, 0] * (1 - a) + t[:, 1] * a * (1 - b) + t[:, 2] * a * b, normal
