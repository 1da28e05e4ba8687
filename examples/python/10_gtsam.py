# SPDX-License-Identifier: BSD-3-Clause
"""Loops of gpureg in iSAM2 of GTSAM, and their retraction.

    pip install gtsam
    python 10_gtsam.py FOLDER ODOMETRY [--voxel-size 0.05] [-o poses.txt]

FOLDER has the fragments in order, as PLY or PCD files. ODOMETRY has a row for each: its number and
world_from_fragment by rows, as 08_kiss_icp.py writes them. iSAM2 optimises. An accepted loop
becomes a factor, whose index is kept; a retracted one is taken out by that index.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import gpureg
import gtsam
import numpy as np
import numpy.typing as npt


def covariance_of(motion: npt.NDArray[np.float64], drift: float) -> npt.NDArray[np.float64]:
    """Of a motion by odometry that drifts by a share of the way, and by 10 degrees a metre times
    that: (rotation in radians, translation in metres), in the frame of the later fragment.
    """
    way = max(0.1, float(np.linalg.norm(motion[:3, 3])))
    sigmas = np.repeat([np.radians(10 * drift), drift], 3) * way
    return np.diag(sigmas**2)


class Isam2:
    """Poses of fragments, and the loops between them. Not thread-safe."""

    def __init__(self) -> None:
        self.isam = gtsam.ISAM2()
        self.factors = gtsam.NonlinearFactorGraph()  # for the next update()
        self.values = gtsam.Values()
        self.loops: dict[tuple[int, int], int] = {}  # (source, target): index of the factor

    def start(self, fragment: int, world_from_fragment: npt.NDArray[np.float64]) -> None:
        """The first fragment stays where it is."""
        pose = gtsam.Pose3(world_from_fragment)
        noise = gtsam.noiseModel.Isotropic.Sigma(6, 1e-6)
        self.factors.add(gtsam.PriorFactorPose3(fragment, pose, noise))
        self.values.insert(fragment, pose)

    def add_odometry(
        self,
        fragment: int,
        before: int,
        before_from_fragment: npt.NDArray[np.float64],
        covariance: npt.NDArray[np.float64],
    ) -> None:
        """A new fragment."""
        motion = gtsam.Pose3(before_from_fragment)
        noise = gtsam.noiseModel.Gaussian.Covariance(covariance)
        self.factors.add(gtsam.BetweenFactorPose3(before, fragment, motion, noise))
        known = self.values if self.values.exists(before) else self.isam.calculateEstimate()
        self.values.insert(fragment, known.atPose3(before).compose(motion))

    def update(self, changed: Iterable[gpureg.Loop]) -> None:
        """Takes up what LoopCloser.process() has changed."""
        removed, added = [], {}
        for loop in changed:
            edge = loop.source, loop.target
            if loop.state == "retracted":
                removed.append(self.loops.pop(edge))
            elif loop.state == "accepted":
                added[edge] = self.factors.size()
                noise = gtsam.noiseModel.Gaussian.Information(loop.information)
                pose = gtsam.Pose3(loop.target_from_source)
                self.factors.add(gtsam.BetweenFactorPose3(loop.target, loop.source, pose, noise))
        result = self.isam.update(self.factors, self.values, removed)
        indices = result.getNewFactorsIndices()
        self.loops.update({edge: indices[place] for edge, place in added.items()})
        self.factors, self.values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        for _ in range(5):  # a loop moves the poses far: linearised again where they are now
            self.isam.update()

    def poses(self) -> dict[int, npt.NDArray[np.float64]]:
        values = self.isam.calculateEstimate()
        return {int(key): values.atPose3(key).matrix() for key in values.keys()}


def main() -> int:
    parser = argparse.ArgumentParser(description="Loops of gpureg in iSAM2 of GTSAM.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("odometry", type=Path)
    parser.add_argument("--voxel-size", type=float, default=0.05, help="metres")
    parser.add_argument("--drift", type=float, default=0.02, help="of odometry, as a share")
    parser.add_argument("-o", "--output", type=Path, default=Path("poses.txt"))
    arguments = parser.parse_args()

    registration = gpureg.RegistrationOptions(voxel_size=arguments.voxel_size)
    options = gpureg.LoopClosureOptions(registration=registration)
    options.optimize = False  # iSAM2 does
    closer = gpureg.LoopCloser(options=options)
    isam = Isam2()
    odometry = np.loadtxt(arguments.odometry, ndmin=2)[:, 1:].reshape(-1, 4, 4)
    files = sorted(
        (p for p in arguments.folder.iterdir() if p.suffix in (".ply", ".pcd")),
        key=lambda p: (len(p.name), p.name),  # cloud_bin_10 after cloud_bin_9
    )
    if len(files) != len(odometry):
        parser.error(f"{len(files)} fragments, but {len(odometry)} rows of odometry")
    for here, (file, world_from_fragment) in enumerate(zip(files, odometry, strict=True)):
        points = gpureg.read_point_cloud(file).points
        cloud = gpureg.prepare(points, options=options.registration)
        closer.add(here, cloud, world_from_fragment, time=float(here))
        if here == 0:
            isam.start(here, world_from_fragment)
        else:
            motion = np.linalg.inv(odometry[here - 1]) @ world_from_fragment
            covariance = covariance_of(motion, arguments.drift)
            closer.add_odometry(here, here - 1, motion, covariance)
            isam.add_odometry(here, here - 1, motion, covariance)
        changed = closer.process().changed
        for loop in changed:
            print(f"fragment {here}: {loop.source} -> {loop.target} {loop.state} ({loop.reason})")
        isam.update(changed)
        closer.set_poses(isam.poses())
    rows = [np.r_[id, pose.ravel()] for id, pose in sorted(isam.poses().items())]
    np.savetxt(arguments.output, rows, fmt="%.9g", header="fragment, world_from_fragment by rows")
    print(f"{len(rows)} fragments, {len(isam.loops)} loops in {arguments.output}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
