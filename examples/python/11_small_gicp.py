# SPDX-License-Identifier: BSD-3-Clause
"""Global registration with gpureg, then local refinement with small_gicp.

    pip install small_gicp
    python 11_small_gicp.py source.ply target.ply [--voxel-size 0.05]

gpureg finds the pose without an initial guess; small_gicp refines it on all points; gpureg says how
probable the refined pose is. Exit status: 0 aligned, 1 not aligned.
"""

import argparse

import gpureg
import numpy as np
import small_gicp


def main() -> int:
    parser = argparse.ArgumentParser(description="gpureg, then small_gicp.")
    parser.add_argument("source")
    parser.add_argument("target")
    parser.add_argument("--voxel-size", type=float, default=0.05)
    arguments = parser.parse_args()
    voxel = arguments.voxel_size

    source = gpureg.read_point_cloud(arguments.source)
    target = gpureg.read_point_cloud(arguments.target)
    found = gpureg.register(source, target, voxel_size=voxel)
    print(found)
    if not found.aligned:
        return 1
    refined = small_gicp.align(
        np.asarray(target.points, np.float64),
        np.asarray(source.points, np.float64),
        init_T_target_source=found.target_from_source,
        downsampling_resolution=voxel / 2,
        max_correspondence_distance=voxel,
    ).T_target_source
    options = gpureg.RegistrationOptions(voxel_size=voxel)
    (checked,) = gpureg.verify(source, target, refined, options=options)
    print(f"refined, confidence {checked.confidence:.3f}\n{refined}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
