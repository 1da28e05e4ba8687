# SPDX-License-Identifier: BSD-3-Clause
"""Global registration of point clouds, on the CPU and on NVIDIA GPUs, with the same bits on both.

    import gpureg
    result = gpureg.register(source, target, voxel_size=0.05)   # (N, 3) arrays, metres
    if result.aligned:
        use(result.target_from_source)                          # (4, 4)

Many clouds: `prepare` each once, then `align_batch` the pairs; folders of fragments: `FragmentSet`
and `register_all`.
"""

from ._core import (
    BackendUnavailable,
    Context,
    CorrespondenceMoments,
    DeviceError,
    Error,
    HypothesisOptions,
    InvalidArgument,
    IoError,
    PointCloud,
    PreparedCloud,
    PrepareOptions,
    PrepareStatistics,
    RefineOptions,
    RegistrationOptions,
    RegistrationResult,
    RegistrationStatistics,
    ScoreOptions,
    StageTimings,
    __version__,
    describe_backends,
)
from .files import read_point_cloud, write_point_cloud
from .registration import (
    BatchInterrupted,
    align,
    align_batch,
    default_context,
    prepare,
    prepare_batch,
    register,
)

__all__ = [
    "BackendUnavailable",
    "BatchInterrupted",
    "Context",
    "CorrespondenceMoments",
    "DeviceError",
    "Error",
    "HypothesisOptions",
    "InvalidArgument",
    "IoError",
    "PointCloud",
    "PrepareOptions",
    "PrepareStatistics",
    "PreparedCloud",
    "RefineOptions",
    "RegistrationOptions",
    "RegistrationResult",
    "RegistrationStatistics",
    "ScoreOptions",
    "StageTimings",
    "__version__",
    "align",
    "align_batch",
    "default_context",
    "describe_backends",
    "prepare",
    "prepare_batch",
    "read_point_cloud",
    "register",
    "write_point_cloud",
]
