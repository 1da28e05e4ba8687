# SPDX-License-Identifier: BSD-3-Clause
"""Refinements: they start from loopsmart's pose, which is not refined, and keep its score."""

import importlib.metadata
import os

import numpy as np

from methods import VOXEL


class Open3dIcp:
    label = "`loopsmart` + Open3D ICP"
    parameters = "point to plane, distance 1.5 voxels, 30 iterations"
    threshold = None  # that of the poses it starts from
    refines = True

    def __init__(self):
        import open3d

        self.o3d = open3d

    def version(self):
        return self.o3d.__version__

    def prepare(self, cloud):
        own = self.o3d.geometry.PointCloud(self.o3d.utility.Vector3dVector(cloud.points))
        own.normals = self.o3d.utility.Vector3dVector(cloud.normals)
        return own

    def align(self, source, target, initial, seed):
        registration = self.o3d.pipelines.registration
        result = registration.registration_icp(
            source,
            target,
            1.5 * VOXEL,
            initial,
            registration.TransformationEstimationPointToPlane(),
            registration.ICPConvergenceCriteria(max_iteration=30),
        )
        return {"pose": np.asarray(result.transformation)}


class SmallGicp:
    label = "`loopsmart` + small_gicp"
    parameters = "GICP, 10 neighbours, distance 1.5 voxels, 20 iterations"
    threshold = None
    refines = True

    def __init__(self):
        import small_gicp

        self.module = small_gicp
        self.threads = int(os.environ.get("OMP_NUM_THREADS", "0")) or os.cpu_count()

    def version(self):
        return importlib.metadata.version("small-gicp")

    def prepare(self, cloud):
        own = self.module.PointCloud(cloud.points)
        tree = self.module.KdTree(own, num_threads=self.threads)
        self.module.estimate_covariances(own, tree, num_neighbors=10, num_threads=self.threads)
        return own, tree

    def align(self, source, target, initial, seed):
        result = self.module.align(
            target[0],
            source[0],
            target[1],
            initial,
            registration_type="GICP",
            max_correspondence_distance=1.5 * VOXEL,
            num_threads=self.threads,
            max_iterations=20,
        )
        return {"pose": np.asarray(result.T_target_source)}
