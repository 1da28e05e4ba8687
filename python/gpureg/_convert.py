# SPDX-License-Identifier: BSD-3-Clause
"""Writes a scan, ``sys.argv``'s file and part, to standard output as a binary PLY.

The command gpureg has an interpreter run it for formats that libraries of Python read. The last
line on standard error says what is wrong.
"""

from __future__ import annotations

import sys

import numpy as np
import numpy.typing as npt

from ._formats import read_foreign

_PIECE = 1 << 20  # points that are converted at a time


def main() -> int:
    path, part = sys.argv[1], int(sys.argv[2])
    try:
        scan = read_foreign(path, part)
        if scan is None:
            raise OSError(f"{path}: neither LAS nor E57")
        write(*scan)
    except (ImportError, OSError, MemoryError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        print(reason if path in reason else f"{path}: {reason}", file=sys.stderr)
        return 1
    return 0


def write(points: npt.NDArray[np.float64], viewpoint: npt.NDArray[np.float64] | None) -> None:
    header = ["ply", "format binary_little_endian 1.0"]
    if viewpoint is not None:
        header.append("comment viewpoint {:g} {:g} {:g}".format(*viewpoint[0]))
    header.append(f"element vertex {len(points)}")
    header += [f"property double {axis}" for axis in "xyz"]
    out = sys.stdout.buffer
    out.write("\n".join([*header, "end_header\n"]).encode())
    for at in range(0, len(points), _PIECE):
        out.write(np.ascontiguousarray(points[at : at + _PIECE], "<f8").tobytes())
    out.flush()
