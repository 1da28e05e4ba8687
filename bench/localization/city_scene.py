# SPDX-License-Identifier: BSD-3-Clause
"""Generated cities for bench/localization/city.py: a grid of streets with a building on each plot.

Everything is a box: walls with windows and doors, inner walls, furniture, kerbs, fences, cars, trees,
lamps. A row of a box: centre, half sizes, yaw, height of the floor that it stands on. City.piece()
makes a plot with its streets, sample() the points that are seen of it, cast() the ranges of rays.
"""

from __future__ import annotations

import functools
import typing
from typing import Any

import numpy as np

SLAB = 0.25  # metres
HALF, YAW, FLOOR = slice(3, 6), 6, 7  # columns of a box, after its centre
UNSEEN = -100  # as height of the floor: the top is too high to be seen


def box(x: Any, y: Any, z: Any, floor: float, yaw: float = 0) -> list[float]:
    ends = np.array([x, y, z])
    return [*ends.mean(1), *np.diff(ends)[:, 0] / 2, yaw, floor]


def wall(axis: int, across: Any, along: Any, z: Any, holes: Any, floor: float) -> list[Any]:
    """Along axis 0 or 1. holes: intervals along it, and of heights above the floor."""
    out, at = [], along[0]
    for a, b, low, high in [*holes, (along[1], along[1], 0, 0)]:
        for u, v in (((at, a), z), ((a, b), (z[0], floor + low)), ((a, b), (floor + high, z[1]))):
            if u[1] - u[0] > 1e-3 and v[1] - v[0] > 1e-3:
                out.append(box(*((u, across) if axis == 0 else (across, u)), v, floor))
        at = b
    return out


def furniture(room: Any, random: Any) -> list[Any]:
    low, high = np.array(room).T
    out = []
    for _ in range(random.integers(3, 5 + int(np.prod((high - low)[:2]) / 4))):
        size = random.uniform(0.3, [2.2, 0.9, 2.1])
        size[:2] = np.minimum(random.permutation(size[:2]), (high - low)[:2] - 0.1)
        corner = random.uniform(low, np.maximum(high - size, low))
        side = random.integers(6)
        if side < 4:  # at a wall
            corner[side % 2] = [*low[:2], *(high - size)[:2]][side]
        corner[2] = low[2] + random.choice([0, 0, 0, 0, 0.6, 1.4])
        ends = np.stack([corner, np.minimum(corner + size, high)], 1)
        if corner[2] == low[2] + 0.6:  # a table
            ends[2] = low[2] + [0.68, 0.74]
            leg = ends[:2].mean(1)[:, None] + [-0.05, 0.05]
            out.append(box(*leg, (low[2], low[2] + 0.68), low[2]))
        out.append(box(*ends, low[2]))
    return out


def divided(room: Any, random: Any) -> tuple[list[Any], list[Any]]:
    """Rooms, and the walls between them."""
    sizes = [b - a for a, b in room]
    axis = int(sizes[1] > sizes[0])
    if sizes[axis] < random.uniform(3.5, 7):
        return [room], []
    (a, b), (c, d), thick = room[axis], room[1 - axis], random.uniform(0.08, 0.2)
    at = random.uniform(0.65 * a + 0.35 * b, 0.35 * a + 0.65 * b)
    door = random.uniform(c + 0.1, d - 1.05)
    walls = wall(
        1 - axis, (at, at + thick), (c, d), room[2], [(door, door + 0.95, 0, 2.05)], room[2][0]
    )
    rooms = []
    for part in ((a, at), (at + thick, b)):
        half = [*room[:axis], part, *room[axis + 1 :]]
        found, more = divided(half, random)
        rooms, walls = rooms + found, walls + more
    return rooms, walls


@functools.lru_cache(64)
def building(key: tuple[int, ...]) -> tuple[np.ndarray, list[Any]]:
    """Boxes and rooms; the origin is in the middle of the ground floor."""
    random = np.random.default_rng(key)
    (w, d), t, height = (
        random.uniform(3.5, 6, 2),
        random.uniform(0.2, 0.4),
        random.uniform(2.6, 3.3),
    )
    storeys = random.integers(1, 4)
    parts = [((-w, w), (-d, d), storeys, 0)]
    if random.random() < 0.6:  # a wing, open to the main part
        y = random.uniform(-d, d - 3.2)
        side = (w, w + random.uniform(3, 6)), (y, random.uniform(y + 3.2, d))
        parts.append((*side, random.integers(1, storeys + 1), 1))
    boxes, rooms = [], []
    for x, y, storeys, wing in parts:
        for z0 in np.arange(storeys) * height:
            inner = [
                (x[0] + t * (not wing), x[1] - t),
                (y[0] + t, y[1] - t),
                (z0, z0 + height - SLAB),
            ]
            boxes.append(box(x, y, (z0 - SLAB, z0), z0))
            sides = [
                (0, (y[0], y[0] + t), x),
                (0, (y[1] - t, y[1]), x),
                (1, (x[1] - t, x[1]), inner[1]),
            ]
            sides += [] if wing else [(1, (x[0], x[0] + t), inner[1])]
            for axis, across, along in sides:
                holes, at = [], along[0] + random.uniform(0.5, 1.5)
                while at + 2.2 < along[1]:
                    width, low = random.uniform(0.7, 1.9), random.uniform(0.3, 1.2)
                    door = z0 == 0 and axis == 0 and not holes
                    holes.append((at, at + width, 0 if door else low, random.uniform(2, 2.35)))
                    at += width + random.uniform(0.5, 2.5)
                boxes += wall(axis, across, along, inner[2], holes, z0)
            found, walls = divided(inner, random)
            boxes += walls
            rooms += found
            for room in found:
                boxes += furniture(room, random)
        eaves, top = random.uniform(0, 0.6), storeys * height
        over = (x[0] - eaves * (not wing), x[1] + eaves), (y[0] - eaves, y[1] + eaves)
        boxes.append(box(*over, (top - SLAB, top), UNSEEN))
        for _ in range(random.integers(2, 7)):  # bins, balconies, air conditioners at the facade
            at, size = random.uniform(x[0], x[1] - 1), random.uniform(0.3, [2.5, 1.2, 1.3])
            low = random.choice([-SLAB, height - SLAB, 1.2, 2.4])
            deep = random.choice([(y[0] - size[1], y[0]), (y[1], y[1] + size[1])])
            boxes.append(box((at, at + size[0]), deep, (low, low + size[2]), UNSEEN * (low > 1)))
    return np.array(boxes), rooms


class Piece(typing.NamedTuple):
    """A plot with the streets at its left and below."""

    boxes: np.ndarray
    outer: np.ndarray  # corners: two rows
    plot: np.ndarray
    frame: np.ndarray  # of the building: x, y, z, yaw
    key: tuple[int, ...]  # of the building: copies have the same


def moved(points: np.ndarray, frame: np.ndarray, back: bool = False) -> np.ndarray:
    c, s = np.cos(frame[3]), np.sin(frame[3])
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return (points - frame[:3]) @ turn if back else points @ turn.T + frame[:3]


class City:
    def __init__(self, buildings: int, seed: int, copied: float) -> None:
        self.buildings, self.seed = buildings, seed
        random = np.random.default_rng([seed, 0])
        self.columns = int(np.ceil(np.sqrt(buildings)))
        self.lines = []
        for pitch, low in ((3, 18), (2, 20)):  # a street every so many plots
            size = random.uniform(low, low + 12, self.columns)
            gap = random.uniform(8, 16, self.columns) * (np.arange(self.columns) % pitch == 0)
            self.lines.append(np.stack([gap, np.cumsum(size + gap) - size, size], 1))
        copies = random.permutation(buildings)[: 3 * round(buildings * copied / 3)]
        self.copy_of = {int(k): n // 3 for n, k in enumerate(copies)}
        self.pieces: dict[int, Piece] = {}

    def rectangle(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        gap, at, size = np.array(
            [self.lines[0][k % self.columns], self.lines[1][k // self.columns]]
        ).T
        return np.array([at - gap, at + size]), np.array([at, at + size])

    def key(self, k: int) -> tuple[int, ...]:
        """Of the building: copies have the same."""
        copy = self.copy_of.get(k)
        return (self.seed, 3, k) if copy is None else (self.seed, 2, copy)

    def make(self, k: int) -> Piece:
        random = np.random.default_rng([self.seed, 1, k])
        outer, plot = self.rectangle(k)
        raised = random.uniform(0.1, 0.4)
        key = self.key(k)
        yaw = random.integers(4) * np.pi / 2 + random.normal(0, 0.12)
        house, _ = building(key)
        frame = np.array([0, 0, raised + SLAB, yaw])
        shape = moved(house[:, :3], frame)[:, :2]
        middle, spare = shape.min(0) + np.ptp(shape, 0) / 2, np.ptp(plot, 0) - np.ptp(shape, 0) - 2
        frame[:2] = plot.mean(0) - middle + random.uniform(-0.5, 0.5, 2) * np.maximum(spare, 0)
        house = np.concatenate([moved(house[:, :3], frame), house[:, 3:]], 1)
        house[:, YAW:] += frame[[3, 2]]
        (x0, y0), (x1, y1) = plot
        boxes = [box((x0, x1), (y0, y1), (-0.5, raised), 0)]

        def put(low: Any, high: Any, yaw: float, *shapes: Any) -> None:
            """Boxes of (size, height of the foot) at a random place."""
            at = random.uniform(low, high)
            if ((np.abs(house[:, :2] - at) < house[:, 3:5].max(1)[:, None] + 0.5).all(1)).any():
                return
            for size, foot in shapes:
                ends = np.stack([-np.array(size) / 2, np.array(size) / 2])[:, :2].T + at[:, None]
                boxes.append(box(*ends, (foot, foot + size[2]), 0, yaw))

        def tree(low: Any, high: Any, ground: float) -> None:
            tall = random.uniform(1.2, 3.5)
            crown = [
                (random.uniform(0.5, 2.5, 3), ground + tall + random.uniform(-0.5, 2))
                for _ in range(random.integers(2, 6))
            ]
            put(low, high, random.uniform(0, 3), ((0.3, 0.3, tall), ground), *crown)

        for axis in (0, 1):  # fences and hedges
            for line in plot[:, axis] + [0.2, -0.2]:
                a, b = np.sort(random.uniform(*plot[:, 1 - axis], 2))
                u, v, tall = (a, b), (line - 0.15, line + 0.15), random.uniform(0.5, 1.8)
                boxes.append(box(*((v, u) if axis == 0 else (u, v)), (raised, raised + tall), 0))
        for _ in range(random.integers(3, 9)):
            tree(plot[0] + 1, plot[1] - 1, raised)
        for _ in range(random.integers(2, 8)):  # sheds, benches, bushes
            size = random.uniform(0.3, [4, 3, 2.4]) * random.uniform(0.3, 1)
            put(plot[0] + 2, plot[1] - 2, random.uniform(0, 3), (size, raised))
        boxes.append(box((outer[0, 0], x1), (outer[0, 1], y0), (-0.5, 0), 0))
        boxes.append(box((outer[0, 0], x0), (y0, y1), (-0.5, 0), 0))
        for axis in (0, 1):  # a street along the axis, beside the plot
            begin, end = plot[:, axis]
            low, high = outer[0, 1 - axis], plot[0, 1 - axis]
            if high == low:
                continue
            path = random.uniform(1.3, 2.6, 2)
            for v, kerb in (((low, low + path[0]), 0.12), ((high - path[1], high), 0.14)):
                u = (begin, end)
                boxes.append(box(*((u, v) if axis == 0 else (v, u)), (-0.4, kerb), 0))

            def beside(
                v: float, n: int, make: Any, axis: int = axis, u: Any = (begin, end)
            ) -> None:
                for _ in range(random.poisson(n)):
                    ends = np.array([[u[0] + 1, v], [u[1] - 1, v]])
                    make(*(ends if axis == 0 else ends[:, ::-1]))

            def car(low: Any, high: Any, axis: int = axis) -> None:
                size = random.uniform([3.4, 1.5, 0.6], [5, 1.9, 1])
                cabin = size * random.uniform([0.4, 0.8, 0.6], [0.9, 0.95, 1.5])
                yaw = axis * np.pi / 2 + random.normal(0, 0.03)
                put(low, high, yaw, (size, 0.25), (cabin, 0.25 + size[2]))

            def post(
                low: Any, high: Any, axis: int = axis
            ) -> None:  # a lamp, a sign, a bin, a shelter
                size = random.uniform(0.08, [0.3, 0.3, 0.3]) + [0, 0, random.choice([1, 2.5, 6])]
                put(low, high, random.uniform(0, 3), (size, 0.12))
                if random.random() < 0.3:
                    put(low, high, axis * np.pi / 2, (random.uniform(0.3, [3, 1, 2.5]), 0.12))

            for side, v in ((1, low + path[0]), (-1, high - path[1])):
                beside(v + side * 1.1, 1.5, car)
                beside(v - side * 0.5, 1.5, post)
                beside(v - side * 0.6, 0.7, functools.partial(tree, ground=0.12))
        return Piece(np.concatenate([boxes, house]), outer, plot, frame, key)

    def piece(self, k: int) -> Piece:
        if k not in self.pieces:
            self.pieces[k] = self.make(k)
        return self.pieces[k]

    def near(self, place: np.ndarray, reach: float) -> np.ndarray:
        """Boxes within reach, the nearest first."""
        found = []
        for k in range(self.buildings):
            outer, _ = self.rectangle(k)
            if ((outer[0] - 4 < place[:2] + reach) & (outer[1] + 4 > place[:2] - reach)).all():
                found.append(self.piece(k).boxes)
        boxes = np.concatenate(found)
        gap = np.linalg.norm(boxes[:, :3] - place, axis=1) - np.linalg.norm(boxes[:, HALF], axis=1)
        order = np.argsort(gap)
        return boxes[order[gap[order] < reach]]


def contains(b: np.ndarray, points: np.ndarray, slack: float) -> np.ndarray:
    turned = moved(points, np.array([*b[:3], b[YAW]]), back=True)
    return (np.abs(turned) < b[HALF] + slack).all(1)


def is_free(boxes: np.ndarray, place: np.ndarray, slack: float) -> bool:
    d, c, s = place - boxes[:, :3], np.cos(boxes[:, YAW]), np.sin(boxes[:, YAW])
    turned = np.stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0], d[:, 2]], 1)
    return not (np.abs(turned) < boxes[:, HALF] + slack).all(1).any()


def sample(boxes: np.ndarray, spacing: float, random: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of the surfaces that are not hidden in other boxes."""
    parts = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1, 1):
            side = 2 * boxes[:, [3 + u, 3 + v]]
            level = boxes[:, 2] + sign * boxes[:, 5] - boxes[:, FLOOR]
            hidden = (level > 2.2) if sign > 0 else (level < 0.3)
            grid = np.ceil(side / spacing).astype(int)
            grid[hidden & (axis == 2)] = 0
            count = grid.prod(1)
            of = np.repeat(np.arange(len(boxes)), count)
            k = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
            kept = random.random(len(of)) * spacing**2 * count[of] < side.prod(1)[of]
            of, k = of[kept], k[kept]
            cell = np.stack([k // grid[of, 1], k % grid[of, 1]], 1) + random.random((len(k), 2))
            local = np.zeros((len(of), 3))
            local[:, axis] = sign
            normals = local.copy()
            local[:, [u, v]] = 2 * cell / grid[of] - 1
            parts.append((local * boxes[of, HALF], normals, of))
    local, normals, of = (np.concatenate(part) for part in zip(*parts))
    c, s = np.cos(boxes[of, YAW]), np.sin(boxes[of, YAW])
    points, normals = (
        np.stack([c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1], p[:, 2]], 1)
        for p in (local, normals)
    )
    points += boxes[of, :3]
    seen = points[:, 2] > -0.01
    overlap = ~np.eye(len(boxes), dtype=bool)
    for yaw in (0, boxes[-1, YAW]):  # of the streets, and of the building
        middle = moved(boxes[:, :3], np.array([0, 0, 0, yaw]), back=True)
        c, s = np.abs(np.cos(boxes[:, YAW] - yaw)), np.abs(np.sin(boxes[:, YAW] - yaw))
        hx, hy, hz = boxes[:, HALF].T
        half = np.stack([c * hx + s * hy, s * hx + c * hy, hz], 1) + 1e-3
        for axis in range(3):
            m, h = middle[:, axis], half[:, axis]
            overlap &= np.abs(m[:, None] - m) < h[:, None] + h
    for k in np.flatnonzero(overlap.any(1)):
        index = np.flatnonzero(overlap[k][of] & seen)
        seen[index] = ~contains(boxes[k], points[index], 1e-3)
    return points[seen], normals[seen]


def cast(boxes: np.ndarray, place: np.ndarray, turn: Any, up: Any, reach: float) -> np.ndarray:
    """Ranges, up x turn, of the first box along each ray; inf: none. Boxes are the nearest first."""
    ranges = np.full((len(up), len(turn)), np.inf)  # horizontal until the end
    tangent = np.tan(up) + 1e-9
    for b in boxes:
        o = moved(place[None], np.array([*b[:3], b[YAW]]), back=True)[0]
        radius, away = np.hypot(b[3], b[4]), np.hypot(o[0], o[1])
        columns = np.arange(len(turn))
        if away > radius:
            towards = np.arctan2(b[1] - place[1], b[0] - place[0])
            off = np.abs((turn - towards + np.pi) % (2 * np.pi) - np.pi)
            columns = np.flatnonzero(off <= np.arcsin(radius / away))
        with np.errstate(divide="ignore"):
            low, high = np.sort([(s * b[5] - o[2]) / tangent for s in (-1, 1)], axis=0)
            spans = [
                np.sort(
                    [(s * b[3 + k] - o[k]) / f(turn[columns] - b[YAW]) for s in (-1, 1)], axis=0
                )
                for k, f in enumerate((np.cos, np.sin))
            ]
        near, far = np.maximum(spans[0][0], spans[1][0]), np.minimum(spans[0][1], spans[1][1])
        hit = (near <= far) & (far > 0)
        columns, near, far = columns[hit], near[hit], far[hit]
        first = np.maximum(near, low[:, None])
        first[(first > np.minimum(far, high[:, None])) | (first < 0.05)] = np.inf
        ranges[:, columns] = np.minimum(ranges[:, columns], first)
    ranges /= np.cos(up)[:, None]
    ranges[ranges > reach] = np.inf
    return ranges
