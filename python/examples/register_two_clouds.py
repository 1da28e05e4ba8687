# SPDX-License-Identifier: BSD-3-Clause
"""Register two clouds and look at them: a picture by matplotlib, and a viewer where Open3D or rerun
is installed.

python register_two_clouds.py source.ply target.ply --voxel-size 0.05 --picture before_after.png
"""

from __future__ import annotations

import argparse
import sys

import gpureg
import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]


def picture(path: str, source: Points, target: Points, target_from_source: Points) -> None:
    """Both clouds from above, before and after."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    moved = source @ target_from_source[:3, :3].T + target_from_source[:3, 3]
    figure, axes = pyplot.subplots(1, 2, figsize=(12, 6))
    for axis, title, cloud in ((axes[0], "before", source), (axes[1], "after", moved)):
        axis.scatter(target[:, 0], target[:, 1], s=0.3, color="tab:blue", label="target")
        axis.scatter(cloud[:, 0], cloud[:, 1], s=0.3, color="tab:orange", label="source")
        axis.set(title=title, aspect="equal", xlabel="x, m", ylabel="y, m")
    axes[0].legend(markerscale=10)
    figure.savefig(path, dpi=120)


def view(source: Points, target: Points, target_from_source: Points) -> None:
    """In 3D, with whichever viewer is there."""
    moved = source @ target_from_source[:3, :3].T + target_from_source[:3, 3]
    try:
        import open3d

        clouds = []
        for points, color in ((target, (0.1, 0.4, 0.8)), (moved, (1.0, 0.6, 0.1))):
            cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
            cloud.paint_uniform_color(color)
            clouds.append(cloud)
        open3d.visualization.draw_geometries(clouds)
        return
    except ImportError:
        pass
    try:
        import rerun
    except ImportError:
        print("no viewer: pip install open3d, or rerun-sdk")
        return
    rerun.init("gpureg", spawn=True)
    rerun.log("target", rerun.Points3D(target, colors=[25, 100, 200]))
    rerun.log("source", rerun.Points3D(moved, colors=[255, 150, 25]))


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

    source, target = (
        gpureg.read_point_cloud(arguments.source),
        gpureg.read_point_cloud(arguments.target),
    )
    result = gpureg.register(source, target, voxel_size=arguments.voxel_size)
    print(result)
    if not result.aligned:
        print(result.explanation)
        return 1
    print(result.target_from_source)
    points = [np.asarray(cloud.points, np.float64) for cloud in (source, target)]
    if arguments.picture:
        picture(arguments.picture, points[0], points[1], result.target_from_source)
    if arguments.view:
        view(points[0], points[1], result.target_from_source)
    return 0


if __name__ == "__main__":
    sys.exit(main())
