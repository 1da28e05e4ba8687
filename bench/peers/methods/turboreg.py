# SPDX-License-Identifier: BSD-3-Clause
"""TurboReg (Yan et al., ICCV 2025) on a GPU, where a user has built its Python module; there is no
wheel. Matches: for each point the nearest FPFH of Open3D, as in its example for 3DMatch.
"""

import importlib.metadata

import numpy as np

from methods import VOXEL
from methods.open3d_global import Open3d


class Turbo(Open3d):
    label = "TurboReg, GPU"
    parameters = "Open3D's FPFH, one match a point, at most 6,000, the best; the numbers of its example for 3DMatch, in voxels"
    threshold = 0.05  # share of the matches that agree; its interface returns the pose alone
    most, inlier = 6000, 2 * VOXEL

    def __init__(self):
        import torch  # first: the module needs its libraries
        import turboreg_gpu

        if not torch.cuda.is_available():
            raise ImportError("TurboReg needs a CUDA device")
        super().__init__()
        self.torch = torch
        # Matches, difference of lengths, pivots, suppression and inliers in metres, measure.
        self.solver = turboreg_gpu.TurboRegGPU(
            self.most, 0.24 * VOXEL, 2000, 3 * VOXEL, self.inlier, "IN"
        )

    def version(self):
        try:
            return importlib.metadata.version("turboreg_gpu")
        except importlib.metadata.PackageNotFoundError:
            return ""

    def on_device(self, array):
        return self.torch.from_numpy(np.ascontiguousarray(array, np.float32)).cuda()

    def prepare(self, cloud):
        own, feature = super().prepare(cloud)
        points, rows = np.asarray(own.points), np.asarray(feature.data).T
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        keep = lengths[:, 0] > 0
        return self.on_device(points[keep]), self.on_device(rows[keep] / lengths[keep])

    def align(self, source, target, initial, seed):
        if min(len(source[0]), len(target[0])) < 4:
            return {"pose": None, "score": 0.0}
        likeness = source[1] @ target[1].T
        nearest = likeness.argmax(1)
        p, q = source[0], target[0][nearest]
        if len(p) > self.most:
            alike = (source[1] * target[1][nearest]).sum(1)
            best = alike.argsort()[-self.most :]
            p, q = p[best], q[best]
        pose = self.solver.run_reg(p, q).cpu().numpy().astype(np.float64)
        moved = p.cpu().numpy() @ pose[:3, :3].T + pose[:3, 3]
        agree = np.linalg.norm(moved - q.cpu().numpy(), axis=1) < self.inlier
        return {"pose": pose, "score": float(agree.mean())}
