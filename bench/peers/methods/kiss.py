# SPDX-License-Identifier: BSD-3-Clause
"""KISS-Matcher. Its interface keeps nothing of a cloud, so that a pair includes the features of
both.
"""

import importlib.metadata

import numpy as np

from methods import VOXEL


class Fine:
    label = f"KISS-Matcher, {VOXEL:g} m"
    voxel, sample = VOXEL, False  # the clouds are downsampled to that already
    parameters = f"voxel size {VOXEL:g} m, the rest by default; features of both clouds made anew for each pair"
    threshold = 5  # final inliers; its examples call fewer a failure
    refines = False

    def __init__(self):
        import kiss_matcher

        self.module = kiss_matcher

    def version(self):
        return importlib.metadata.version("kiss-matcher")

    def prepare(self, cloud):
        return np.asfortranarray(cloud.points.T)

    def align(self, source, target, initial, seed):
        matcher = self.module.KISSMatcher(
            self.module.KISSMatcherConfig(self.voxel, use_voxel_sampling=self.sample)
        )
        solution = matcher.prune_and_solve(*matcher.match(source, target))
        if not solution.valid:
            return {"pose": None, "score": 0.0}
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = solution.rotation, np.asarray(solution.translation).reshape(3)
        return {"pose": pose, "score": float(matcher.get_num_final_inliers())}


class Coarse(Fine):
    label = f"KISS-Matcher, {2 * VOXEL:g} m"
    voxel, sample = 2 * VOXEL, True
    parameters = f"voxel size {2 * VOXEL:g} m, the rest by default; features of both clouds made anew for each pair"
