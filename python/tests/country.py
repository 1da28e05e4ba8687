# SPDX-License-Identifier: BSD-3-Clause
"""Many small fragments of a generated hilly country, and the pairs of them that overlap."""

import numpy as np
import numpy.typing as npt

WIDTH = 3.0  # metres that a fragment sees
SPACING = 0.1  # metres between its points
CELL = 0.05  # metres between the heights of the country


def country(extent: float, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """Heights on a grid: hills, mounds and holes of all widths from 0.3 to 2 m, two on every square
    metre.
    """
    cells = int(extent / CELL) + 2
    heights = np.zeros((cells, cells))
    for _ in range(int(2 * extent**2)):
        width, place = 0.3 + 1.7 * rng.random() ** 3, rng.integers(0, cells, 2)
        reach = int(width / CELL)
        (low_x, low_y), (high_x, high_y) = (
            np.maximum(place - reach, 0),
            np.minimum(place + reach + 1, cells),
        )
        x, y = (
            np.arange(low_x, high_x)[:, None] - place[0],
            np.arange(low_y, high_y)[None] - place[1],
        )
        r = np.minimum(np.hypot(x, y) / reach, 1)
        heights[low_x:high_x, low_y:high_y] += rng.normal(0, 0.5 * width) * (1 - r**2) ** 2
    return heights


def make_fragments(
    count: int, seed: int
) -> tuple[list[npt.NDArray[np.float32]], list[tuple[int, int]]]:
    """Fragments in frames of their own, and the pairs that overlap by a third of their area or
    more.
    """
    rng = np.random.default_rng(seed)
    extent = WIDTH * np.sqrt(count / 6)  # every place is seen by six, about
    heights = country(extent + WIDTH, rng)
    corners = rng.random((count, 2)) * extent
    fragments = []
    for corner in corners:
        ground = (
            rng.random((int((WIDTH / SPACING) ** 2), 2)) * WIDTH
        )  # each sees other points of the same surface
        cell, part = np.divmod((ground + corner) / CELL, 1)
        (x, y), (u, v) = cell.astype(int).T, part.T
        up = (1 - u) * ((1 - v) * heights[x, y] + v * heights[x, y + 1]) + u * (
            (1 - v) * heights[x + 1, y] + v * heights[x + 1, y + 1]
        )
        turn = rng.random() * 2 * np.pi
        c, s = np.cos(turn), np.sin(turn)
        local = np.column_stack([ground - WIDTH / 2, up - 3.0]) @ np.array(
            [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
        )
        fragments.append(np.asarray(local + rng.normal(0, 0.004, local.shape), np.float32))
    shared = np.maximum(0, WIDTH - np.abs(corners[:, None] - corners[None])).prod(axis=2) / WIDTH**2
    i, j = np.nonzero(np.triu(shared >= 1 / 3, 1))
    return fragments, list(zip(i.tolist(), j.tolist()))
