# SPDX-License-Identifier: BSD-3-Clause
"""The clouds that every method gets: raw, and downsampled by gpureg to 5 cm with normals turned to
the cameras.
"""

import dataclasses
import pathlib

import numpy as np
from methods import VOXEL


@dataclasses.dataclass
class Cloud:
    points: np.ndarray  # (n, 3) float64
    normals: np.ndarray  # (n, 3) float64
    raw: np.ndarray  # (m, 3) float32
    raw_normals: np.ndarray | None
    viewpoints: np.ndarray | None


def write_one(output, number, points, normals, viewpoints, voxel=VOXEL):
    """One fragment from arrays into a folder; normals, viewpoints: perhaps None."""
    import gpureg

    options = gpureg.RegistrationOptions(voxel_size=voxel)
    options.prepare.wide_feature_radius, options.prepare.depth_maps = 0.0, 0
    prepared = gpureg.prepare(
        points, normals, viewpoints=viewpoints, options=options, context=gpureg.Context.cpu()
    )
    arrays = {
        "points": np.asarray(prepared.points, np.float64),
        "normals": np.asarray(prepared.normals, np.float64),
        "raw": np.asarray(points, np.float32),
    }
    if normals is not None:
        arrays["raw_normals"] = np.asarray(normals, np.float32)
    if viewpoints is not None:
        arrays["viewpoints"] = np.asarray(viewpoints, np.float32)
    np.savez(pathlib.Path(output) / f"{number}.npz", **arrays)


def write(folder, output):
    """One .npz per fragment into a folder; the numbers of the fragments."""
    import gpureg
    from gpureg import _core

    folder, output = pathlib.Path(folder), pathlib.Path(output)
    cameras = folder / "cameras.txt"
    viewpoints = _core.read_cameras(str(cameras), [], []) if cameras.exists() else {}
    numbers = []
    for number, path, _ in _core.list_scans(str(folder), False)[0]:
        cloud = gpureg.read_point_cloud(path)
        normals = cloud.normals if cloud.normals is not None and len(cloud.normals) else None
        write_one(output, number, cloud.points, normals, viewpoints.get(number))
        numbers.append(number)
    return numbers


def read(folder, number):
    with np.load(pathlib.Path(folder) / f"{number}.npz") as file:
        return Cloud(
            file["points"],
            file["normals"],
            file["raw"],
            file.get("raw_normals"),
            file.get("viewpoints"),
        )
