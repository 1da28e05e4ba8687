# SPDX-License-Identifier: BSD-3-Clause
"""gpureg itself, through its Python package, on the CPU."""

import os

from methods import VOXEL


class Default:
    label = "gpureg `default`"
    parameters = f"defaults for voxels of {VOXEL:g} m"
    threshold = None  # its own
    refines = False

    def __init__(self):
        import gpureg

        self.gpureg = gpureg
        self.context = gpureg.Context.cpu(int(os.environ.get("OMP_NUM_THREADS", "0")))
        self.options = self.make_options()

    def make_options(self):
        return self.gpureg.RegistrationOptions(voxel_size=VOXEL)

    def version(self):
        return self.gpureg.__version__

    def prepare(self, cloud):
        # It begins where its users do, with raw points: its own downsampling made the clouds that
        # all others get.
        return self.gpureg.prepare(
            cloud.raw,
            cloud.raw_normals,
            viewpoints=cloud.viewpoints,
            options=self.options,
            context=self.context,
        )

    def align(self, source, target, initial, seed):
        self.options.seed = seed
        result = self.gpureg.align(source, target, options=self.options, context=self.context)
        modes = list(getattr(result, "modes", []))
        return {
            "pose": result.target_from_source if result.has_pose else None,
            "score": float(result.confidence),
            "aligned": bool(result.aligned),
            "strict_score": float(modes[0].overlap_confidence) if modes else None,
        }


class LoopSmart(Default):
    label = "gpureg `loopsmart`"
    parameters = "the paper's: 4,000,000 hypotheses, no refinement"

    def make_options(self):
        return self.gpureg.RegistrationOptions.loopsmart(VOXEL)
