# SPDX-License-Identifier: BSD-3-Clause
"""TEASER++, where a user has built its Python module; there is no wheel. Matches: mutual nearest
neighbours of FPFH.
"""

import numpy as np

from methods import VOXEL
from methods.sc2_pcr import SecondOrder


def solve(p, q, noise, scaled=False):
    """Its solver after the motion from p to q, matched points, as its 3DMatch example calls it.

    scaled: the motion has a scale, too."""
    import teaserpp_python

    parameters = teaserpp_python.RobustRegistrationSolver.Params()
    parameters.cbar2 = 1
    parameters.noise_bound = noise
    parameters.estimate_scaling = scaled
    parameters.rotation_estimation_algorithm = (
        teaserpp_python.RobustRegistrationSolver.ROTATION_ESTIMATION_ALGORITHM.GNC_TLS
    )
    parameters.rotation_gnc_factor = 1.4
    parameters.rotation_max_iterations = 100
    parameters.rotation_cost_threshold = 1e-12
    solver = teaserpp_python.RobustRegistrationSolver(parameters)
    solver.solve(p.T.astype(np.float64), q.T.astype(np.float64))
    return solver


class Teaser(SecondOrder):
    label = "TEASER++"
    parameters = f"mutual FPFH matches, noise bound {VOXEL:g} m, GNC-TLS, as its 3DMatch example"
    threshold = 5  # translation inliers

    def __init__(self):
        import teaserpp_python

        super().__init__()
        self.module = teaserpp_python

    def version(self):
        return getattr(self.module, "__version__", "")

    def align(self, source, target, initial, seed):
        likeness = source[1] @ target[1].T
        forward, backward = likeness.argmax(1), likeness.argmax(0)
        mutual = np.flatnonzero(backward[forward] == np.arange(len(forward)))
        if len(mutual) < 4:
            return {"pose": None, "score": 0.0}
        solver = solve(source[0][mutual], target[0][forward[mutual]], VOXEL)
        solution = solver.getSolution()
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = solution.rotation, np.asarray(solution.translation).reshape(3)
        return {"pose": pose, "score": float(len(solver.getTranslationInliers()))}
