# SPDX-License-Identifier: BSD-3-Clause
"""One map of unordered scans: a folder of fragments cloud_bin_<i>.ply, no pose known.

python 07_map.py scans/ --output map.ply
"""

from __future__ import annotations

import argparse

import gpureg


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder")
    parser.add_argument("--output", required=True)
    parser.add_argument("--voxel-size", type=float, default=0.05)
    arguments = parser.parse_args()

    options = gpureg.RegistrationOptions(voxel_size=arguments.voxel_size)
    scene = gpureg.reconstruct(arguments.folder, options=options, progress=True)
    for k, island in enumerate(scene.islands):
        print(f"island {k}: scans {island}")
    for scan in scene.scans:
        if not scan.placed:
            print(f"left out: scan {scan.number}, {scan.explanation}")
    if scene.weakest_links:
        weakest = min(scene.weakest_links, key=lambda link: link.confidence)
        print(f"weakest connection: confidence {weakest.confidence:.3f}, of scans {weakest.scans}")
    if scene.islands:
        points, normals = scene.points()
        gpureg.write_point_cloud(arguments.output, points, normals)
        print(f"{len(points)} points in {arguments.output}")


if __name__ == "__main__":
    main()
