# SPDX-License-Identifier: BSD-3-Clause
"""The methods of bench/peers by name. Each is one class:

label       for tables
parameters  what it runs with, as its own documentation recommends for voxels of 5 cm
threshold   score from which on a pair is reported
refines     True: starts from the poses of another method (loopsmart's), whose score it keeps
__init__    imports what it needs; ImportError or FileNotFoundError: it is not installed here
version     of what does the work
prepare     cloud -> what it keeps of a cloud; cloud.points and cloud.normals: (n, 3) float64
arrays, the same for every method align       (source, target, initial, seed) -> (4 x 4
target_from_source or None, score)"""

import importlib
import os

VOXEL = float(
    os.environ.get("GPUREG_PEER_VOXEL", "0.05")
)  # metres; of the clouds, and what every length follows from

# name: (module, class)
METHODS = {
    "gpureg_default": ("gpureg_package", "Default"),
    "gpureg_loopsmart": ("gpureg_package", "LoopSmart"),
    "open3d_ransac": ("open3d_global", "Ransac"),
    "open3d_fgr": ("open3d_global", "FastGlobal"),
    "pcl_prerejective": ("pcl_prerejective", "Prerejective"),
    "kiss_matcher_005": ("kiss", "Fine"),
    "kiss_matcher_010": ("kiss", "Coarse"),
    "sc2_pcr": ("sc2_pcr", "SecondOrder"),
    "teaser": ("teaser", "Teaser"),
    "turboreg": ("turboreg", "Turbo"),
    "loopsmart_open3d_icp": ("refinement", "Open3dIcp"),
    "loopsmart_small_gicp": ("refinement", "SmallGicp"),
}
REFINED = "gpureg_loopsmart"  # whose poses the refinements start from


def load(name):
    """The class; raises ImportError only when it is constructed."""
    module, attribute = METHODS[name]
    return getattr(importlib.import_module(f"methods.{module}"), attribute)
