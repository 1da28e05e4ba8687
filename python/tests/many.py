# SPDX-License-Identifier: BSD-3-Clause
"""A run of more than a thousand pairs, for tests that kill it. As a script: one process of that
run.
"""

import sys

import gpureg
from scenes import few, moved, pose, room

FRAGMENTS = 46  # 1,035 pairs


def fragments():
    rooms = [room(seed, 1200) for seed in range(4)]
    return [moved(rooms[k % 4], pose(k)) for k in range(FRAGMENTS)]


def options():
    return few(6000, voxel_size=0.08)


def run(folder, progress=False, **keywords):
    return gpureg.register_all(
        fragments(),
        output=folder,
        options=options(),
        progress=progress,
        **keywords,
    )


if __name__ == "__main__":
    print("started", flush=True)
    run(
        sys.argv[1],
        progress=lambda done, total: print(done, flush=True),
        contexts=[gpureg.Context.cpu(1)],
    )
