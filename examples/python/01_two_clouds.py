# SPDX-License-Identifier: BSD-3-Clause
"""Two clouds: aligns them and prints the pose, draws a picture, or opens a viewer.

    python 01_two_clouds.py source.ply target.ply --voxel-size 0.05 --picture before_after.png

The picture needs matplotlib, and the viewer (--view) Open3D. Exit status: 0 aligned, 1 not aligned.
"""

from __future__ import annotations

import argparse
import sys

import gpureg
import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]


def picture(path: str, source: Points, target: Points, moved: Points) -> None:
    """Both clouds from above, before and after."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(12, 6))
    for axis, title, cloud in ((axes[0], "before", source), (axes[1], "after", moved)):
        axis.scatter(target[:, 0], target[:, 1], s=0.3, color="tab:blue", label="target")
        axis.scatter(cloud[:, 0], cloud[:, 1], s=0.3, color="tab:orange", label="source")
        axis.set(title=title, aspect="equal", xlabel="x, m", ylabel="y, m")
    axes[0].legend(markerscale=10)
    figure.savefig(path, dpi=120)


def view(target: Points, moved: Points) -> None:
    import open3d

    clouds = []
    for points, color in ((target, (0.1, 0.4, 0.8)), (moved, (1.0, 0.6, 0.1))):
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        cloud.paint_uniform_color(color)
        clouds.append(cloud)
    open3d.visualization.draw_geometries(clouds)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source")
    parser.add_argument("target")
    parser.add_argument("--voxel-size", type=float, default=0.05)
    parser.add_argument("--picture")
    parser.add_argument("--view", action="store_true")
    arguments = parser.parse_args()

    clouds = [gpureg.read_point_cloud(path) for path in (arguments.source, arguments.target)]
    result = gpureg.register(clouds[0], clouds[1], voxel_size=arguments.voxel_size)
    print(result)
    if not result.aligned:
        print(result.explanation)
        return 1
    pose = result.target_from_source  # p_target = R p_source + t
    print(pose)
    source, target = (np.asarray(cloud.points, np.float64) for cloud in clouds)
    moved = source @ pose[:3, :3].T + pose[:3, 3]
    if arguments.picture:
        picture(arguments.picture, source, target, moved)
    if arguments.view:
        view(target, moved)
    return 0


if __name__ == "__main__":
    sys.exit(main())
