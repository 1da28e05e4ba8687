# SPDX-License-Identifier: BSD-3-Clause
"""Global registration of point clouds, on the CPU and on NVIDIA GPUs, with the same bits on both.

    import gpureg
    result = gpureg.register(source, target)                    # (N, 3) arrays, or files
    if result.aligned:
        use(result.target_from_source)                          # (4, 4)

Many clouds: `prepare` each once, then `align_batch` the pairs; folders of fragments: `FragmentSet`
and `register_all`.
"""

from typing import TYPE_CHECKING, Any

from ._audit import Audit, AuditedConnection, AuditedIsland, AuditedPair, MendedMap, audit, mend
from ._calibration import (
    CalibrationRun,
    RiskThreshold,
    calibrate,
    control_risk,
    fit_calibration,
    read_calibration,
)
from ._contexts import default_context
from ._core import (
    AuditOptions,
    BackendUnavailable,
    ChangeOptions,
    ChangeResult,
    ConfidenceCalibration,
    Context,
    CorrespondenceMoments,
    DeviceError,
    DriftOptions,
    EdgeNoiseOptions,
    Error,
    ErrorStatistics,
    FindOptions,
    FindResult,
    FoundPart,
    GncOptions,
    InvalidArgument,
    IoError,
    LineProcessOptions,
    LocatedPose,
    LocateOptions,
    LocateResult,
    Loop,
    LoopAcceptanceOptions,
    LoopClosureOptions,
    LoopConsistencyOptions,
    LoopNoiseOptions,
    LoopProposalOptions,
    LoopUpdate,
    MapOptions,
    PairConsistency,
    PartEvidence,
    PointCloud,
    PoseEvidence,
    PoseGraphOptions,
    PoseVerification,
    PreparedCloud,
    PreparedMap,
    PrepareOptions,
    PrepareStatistics,
    ReconstructionOptions,
    RegistrationMode,
    RegistrationOptions,
    RegistrationPrior,
    RegistrationResult,
    RegistrationStatistics,
    ScaledResult,
    ScaledVerification,
    SolverOptions,
    StageTimings,
    StoredScan,
    TimedResult,
    TrajectoryEvaluation,
    VoxelSizeSuggestion,
    __version__,
    describe_backends,
)
from ._loop_consistency import loop_consistency
from ._map import Map, MapEdge, MapLink, MapScan
from ._reconstruction import reconstruct
from ._trajectory import evaluate_trajectory, read_trajectory
from .files import (
    from_depth_image,
    read_cameras,
    read_point_cloud,
    scans_in,
    write_point_cloud,
)
from .fragments import FragmentSet
from .localization import CHANGE_LABELS, change, find, load_map, locate, locate_batch, prepare_map
from .loop_closure import LoopCloser
from .preparation import prepare, prepare_batch
from .registration import (
    BatchInterrupted,
    align,
    align_batch,
    align_scaled_batch,
    align_within,
    register,
    suggest_voxel_size,
)
from .verification import verify, verify_scaled

if TYPE_CHECKING:
    from .batch import BatchRun, register_all


def __getattr__(name: str) -> Any:
    # What needs pyarrow is loaded when it is asked for.
    if name in ("BatchRun", "register_all"):
        from . import batch

        return getattr(batch, name)
    raise AttributeError(f"module 'gpureg' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


__all__ = [
    "CHANGE_LABELS",
    "Audit",
    "AuditOptions",
    "AuditedConnection",
    "AuditedIsland",
    "AuditedPair",
    "BackendUnavailable",
    "BatchInterrupted",
    "BatchRun",
    "CalibrationRun",
    "ChangeOptions",
    "ChangeResult",
    "ConfidenceCalibration",
    "Context",
    "CorrespondenceMoments",
    "DeviceError",
    "DriftOptions",
    "EdgeNoiseOptions",
    "Error",
    "ErrorStatistics",
    "FindOptions",
    "FindResult",
    "FoundPart",
    "FragmentSet",
    "GncOptions",
    "InvalidArgument",
    "IoError",
    "LineProcessOptions",
    "LocateOptions",
    "LocateResult",
    "LocatedPose",
    "Loop",
    "LoopAcceptanceOptions",
    "LoopCloser",
    "LoopClosureOptions",
    "LoopConsistencyOptions",
    "LoopNoiseOptions",
    "LoopProposalOptions",
    "LoopUpdate",
    "Map",
    "MapEdge",
    "MapLink",
    "MapOptions",
    "MapScan",
    "MendedMap",
    "PairConsistency",
    "PartEvidence",
    "PointCloud",
    "PoseEvidence",
    "PoseGraphOptions",
    "PoseVerification",
    "PrepareOptions",
    "PrepareStatistics",
    "PreparedCloud",
    "PreparedMap",
    "ReconstructionOptions",
    "RegistrationMode",
    "RegistrationOptions",
    "RegistrationPrior",
    "RegistrationResult",
    "RegistrationStatistics",
    "RiskThreshold",
    "ScaledResult",
    "ScaledVerification",
    "SolverOptions",
    "StageTimings",
    "StoredScan",
    "TimedResult",
    "TrajectoryEvaluation",
    "VoxelSizeSuggestion",
    "__version__",
    "align",
    "align_batch",
    "align_scaled_batch",
    "align_within",
    "audit",
    "calibrate",
    "change",
    "control_risk",
    "default_context",
    "describe_backends",
    "evaluate_trajectory",
    "find",
    "fit_calibration",
    "from_depth_image",
    "load_map",
    "locate",
    "locate_batch",
    "loop_consistency",
    "mend",
    "prepare",
    "prepare_batch",
    "prepare_map",
    "read_calibration",
    "read_cameras",
    "read_point_cloud",
    "read_trajectory",
    "reconstruct",
    "register",
    "register_all",
    "scans_in",
    "suggest_voxel_size",
    "verify",
    "verify_scaled",
    "write_point_cloud",
]
