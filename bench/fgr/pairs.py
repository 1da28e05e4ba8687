# SPDX-License-Identifier: BSD-3-Clause
"""The synthetic range pairs of the Fast Global Registration paper: files, motions, and the points
that belong together.
"""

import array
import math
import sys

WITHIN = 0.0125  # data units: distance of points that belong together, as in the paper
DIAMETER = 2.0  # data units
COLUMNS = ("x", "y", "z", "nx", "ny", "nz")  # floats of a point


def read_ply(path):
    """Rows of six floats, x y z nx ny nz, of a binary little-endian PLY."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode().split("\n")
    count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
    if "format binary_little_endian 1.0" not in header or sum(
        line.startswith("property float") for line in header
    ) != len(COLUMNS):
        sys.exit(f"error: {path}: expected binary x y z nx ny nz")
    size = array.array("f").itemsize * len(COLUMNS)
    values = array.array("f", data[end : end + size * count])
    if sys.byteorder == "big":
        values.byteswap()
    return [values[k : k + len(COLUMNS)] for k in range(0, len(values), len(COLUMNS))]


def write_ply(path, rows):
    values = array.array("f", (value for row in rows for value in row))
    if sys.byteorder == "big":
        values.byteswap()
    properties = "".join(f"property float {name}\n" for name in COLUMNS)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    path.write_bytes(header.encode() + values.tobytes())


def rotate(pose, p):
    return [sum(pose[r][c] * p[c] for c in range(3)) for r in range(3)]


def apply(pose, p):
    return [value + pose[r][3] for r, value in enumerate(rotate(pose, p))]


def random_pose(generator):
    """Any rotation, uniformly; a translation of about a diameter."""
    q = [generator.gauss(0, 1) for _ in range(4)]
    w, x, y, z = (value / math.hypot(*q) for value in q)
    t = [generator.gauss(0, DIAMETER) for _ in range(3)]
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t[0]],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t[1]],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t[2]],
    ]


def together(source, target, truth):
    """Pairs of a source point and its nearest target point within WITHIN under the truth."""
    cells = {}
    for q in target:
        cells.setdefault(tuple(math.floor(v / WITHIN) for v in q[:3]), []).append(q[:3])
    pairs = []
    for p in source:
        moved = apply(truth, p)
        i, j, k = (math.floor(v / WITHIN) for v in moved)
        near = [
            (math.dist(moved, q), q)
            for a in (i - 1, i, i + 1)
            for b in (j - 1, j, j + 1)
            for c in (k - 1, k, k + 1)
            for q in cells.get((a, b, c), ())
        ]
        distance, nearest = min(near, key=lambda entry: entry[0], default=(math.inf, None))
        if distance <= WITHIN:
            pairs.append((p[:3], nearest))
    return pairs
