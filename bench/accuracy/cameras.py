# SPDX-License-Identifier: BSD-3-Clause
"""Where the cameras of a scene's fragments stood."""


def cameras(path):
    """Positions in each fragment's frame, in the order of the frames, by fragment; path: a scene's
    cameras.txt, which need not exist.
    """
    out = {}
    for values in map(str.split, path.read_text().splitlines() if path.exists() else []):
        if values:
            out.setdefault(int(values[0]), []).append([float(v) for v in values[2:5]])
    return out
