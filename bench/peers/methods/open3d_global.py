# SPDX-License-Identifier: BSD-3-Clause
"""Open3D's global registration, as its tutorial "Global registration" has it for voxels of 5 cm,
with the tutorial's radii.
"""

import numpy as np

from methods import VOXEL


class Open3d:
    refines = False

    def __init__(self):
        import open3d

        self.o3d = open3d
        open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)

    def version(self):
        return self.o3d.__version__

    def prepare(self, cloud):
        o3d = self.o3d
        own = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points))
        own.normals = o3d.utility.Vector3dVector(
            cloud.normals
        )  # a hint: estimate_normals keeps their side
        own.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * VOXEL, 30))
        feature = o3d.pipelines.registration.compute_fpfh_feature(
            own, o3d.geometry.KDTreeSearchParamHybrid(5 * VOXEL, 100)
        )
        return own, feature


class Ransac(Open3d):
    label = "Open3D RANSAC"
    parameters = (
        "400,000 iterations, confidence 0.999, distance 1.5 voxels, 3 points, edge similarity 0.9"
    )
    threshold = 0.3

    def align(self, source, target, initial, seed):
        registration, distance = self.o3d.pipelines.registration, 1.5 * VOXEL
        self.o3d.utility.random.seed(seed)
        result = registration.registration_ransac_based_on_feature_matching(
            source[0],
            target[0],
            source[1],
            target[1],
            False,
            distance,
            registration.TransformationEstimationPointToPoint(False),
            3,
            [
                registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
                registration.CorrespondenceCheckerBasedOnDistance(distance),
            ],
            registration.RANSACConvergenceCriteria(400_000, 0.999),
        )
        return {
            "pose": np.asarray(result.transformation) if result.fitness > 0 else None,
            "score": float(result.fitness),
        }


class FastGlobal(Open3d):
    label = "Open3D FGR"
    parameters = "distance 0.5 voxels, absolute scale, the rest by default"
    threshold = 0.3

    def align(self, source, target, initial, seed):
        registration = self.o3d.pipelines.registration
        self.o3d.utility.random.seed(seed)
        option = registration.FastGlobalRegistrationOption(
            maximum_correspondence_distance=0.5 * VOXEL, use_absolute_scale=True
        )
        result = registration.registration_fgr_based_on_feature_matching(
            source[0], target[0], source[1], target[1], option
        )
        # Its own fitness counts matches; RANSAC's counts points within 1.5 voxels, which tells more
        # about a pose.
        fitness = registration.evaluate_registration(
            source[0], target[0], 1.5 * VOXEL, result.transformation
        ).fitness
        return {"pose": np.asarray(result.transformation), "score": float(fitness)}
