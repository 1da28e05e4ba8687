# SPDX-License-Identifier: BSD-3-Clause
# Types of the compiled module. python/tests/test_stubs.py compares it with the module.
import os
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

_Float32 = npt.NDArray[np.float32]
_Float64 = npt.NDArray[np.float64]
# On a device: address, rows, columns, floats from row to row, and what keeps the memory alive.
_DeviceRows = tuple[int, int, int, int, Any]
_Rows = _Float32 | _DeviceRows
# Points, normals, features, viewpoints, origin; and the streams that wrote the first three, or None for clouds of the host.
_Cloud = tuple[
    _Rows,
    _Rows | None,
    _Rows | None,
    _Float32 | None,
    _Float64 | None,
    tuple[int, int, int] | None,
]

__version__: str

class Error(Exception): ...
class InvalidArgument(Error, ValueError): ...
class BackendUnavailable(Error, RuntimeError): ...
class DeviceError(Error, RuntimeError): ...
class IoError(Error, OSError): ...

class Context:
    @staticmethod
    def cpu(threads: int = 0) -> Context: ...
    @overload
    @staticmethod
    def cuda(device: int = 0) -> Context: ...
    @overload
    @staticmethod
    def cuda(devices: Sequence[int], memory_budget: int = 0) -> Context: ...
    @staticmethod
    def best() -> Context: ...
    @property
    def backend(self) -> Literal["cpu", "cuda"]: ...
    @property
    def threads(self) -> int: ...
    @property
    def description(self) -> str: ...
    @property
    def device_memory(self) -> list[dict[str, int]]: ...
    def trim(self) -> None: ...

class PrepareOptions:
    # fields of PrepareOptions
    downsample: bool
    normal_radius: float
    feature_radius: float
    wide_feature_radius: float
    max_correspondence_distance: float
    depth_maps: int
    surface_side_distance: float
    keep_range_limits: bool
    def __init__(
        self,
        *,
        downsample: bool = ...,
        normal_radius: float = ...,
        feature_radius: float = ...,
        wide_feature_radius: float = ...,
        max_correspondence_distance: float = ...,
        depth_maps: int = ...,
        surface_side_distance: float = ...,
        keep_range_limits: bool = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        downsample: bool = ...,
        normal_radius: float = ...,
        feature_radius: float = ...,
        wide_feature_radius: float = ...,
        max_correspondence_distance: float = ...,
        depth_maps: int = ...,
        surface_side_distance: float = ...,
        keep_range_limits: bool = ...,
    ) -> PrepareOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class ConfidenceCalibration:
    # fields of ConfidenceCalibration
    slope: float
    offset: float
    def __init__(
        self,
        *,
        slope: float = ...,
        offset: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        slope: float = ...,
        offset: float = ...,
    ) -> ConfidenceCalibration: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields
    def __call__(self, confidence: float) -> float: ...
    @property
    def is_identity(self) -> bool: ...

class RegistrationOptions:
    # fields of RegistrationOptions
    voxel_size: float
    quality: int
    seed: int
    min_confidence: float
    accept_symmetry: bool
    calibration: ConfidenceCalibration
    method: Literal["compatibility", "quadruples"]
    quadruples: int
    refine_iterations: int
    prepare: PrepareOptions
    tune: str
    def __init__(
        self,
        *,
        voxel_size: float = ...,
        quality: int = ...,
        seed: int = ...,
        min_confidence: float = ...,
        accept_symmetry: bool = ...,
        calibration: ConfidenceCalibration = ...,
        method: Literal["compatibility", "quadruples"] = ...,
        quadruples: int = ...,
        refine_iterations: int = ...,
        prepare: PrepareOptions = ...,
        tune: str = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        voxel_size: float = ...,
        quality: int = ...,
        seed: int = ...,
        min_confidence: float = ...,
        accept_symmetry: bool = ...,
        calibration: ConfidenceCalibration = ...,
        method: Literal["compatibility", "quadruples"] = ...,
        quadruples: int = ...,
        refine_iterations: int = ...,
        prepare: PrepareOptions = ...,
        tune: str = ...,
    ) -> RegistrationOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields
    @staticmethod
    def loopsmart(voxel_size: float = ...) -> RegistrationOptions: ...

class RegistrationStatistics:
    # fields of RegistrationStatistics
    @property
    def source_points(self) -> int: ...
    @property
    def target_points(self) -> int: ...
    @property
    def correspondences(self) -> int: ...
    @property
    def hypotheses(self) -> int: ...
    @property
    def survivors(self) -> int: ...
    @property
    def scored(self) -> int: ...
    @property
    def points_scored(self) -> int: ...
    @property
    def consensus(self) -> int: ...
    @property
    def inliers(self) -> int: ...
    @property
    def refine_iterations(self) -> int: ...
    @property
    def swapped(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class StageTimings:
    # fields of StageTimings
    @property
    def match(self) -> float: ...
    @property
    def propose(self) -> float: ...
    @property
    def rank(self) -> float: ...
    @property
    def refine(self) -> float: ...
    @property
    def verify(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields
    @property
    def total(self) -> float: ...

class PrepareStatistics:
    # fields of PrepareStatistics
    @property
    def input_points(self) -> int: ...
    @property
    def invalid_points(self) -> int: ...
    @property
    def stray_points(self) -> int: ...
    @property
    def range_limit_points(self) -> int: ...
    @property
    def smallest_range(self) -> float: ...
    @property
    def largest_range(self) -> float: ...
    @property
    def points(self) -> int: ...
    @property
    def points_without_normal(self) -> int: ...
    @property
    def points_without_feature(self) -> int: ...
    @property
    def viewpoint(self) -> Literal["given", "origin", "normals", "none", "model"]: ...
    @property
    def repaired_normals(self) -> int: ...
    @property
    def flat(self) -> bool: ...
    @property
    def downsample(self) -> float: ...
    @property
    def normals(self) -> float: ...
    @property
    def features(self) -> float: ...
    @property
    def grid(self) -> float: ...
    @property
    def depth_maps(self) -> float: ...
    @property
    def surface_sides(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields
    @property
    def total(self) -> float: ...

class CorrespondenceMoments:
    @property
    def count(self) -> int: ...
    @property
    def sum(self) -> _Float64: ...
    @property
    def outer(self) -> _Float64: ...
    def information_redwood(self) -> _Float64: ...
    def information_open3d(self) -> _Float64: ...

class PoseEvidence:
    # fields of PoseEvidence
    @property
    def match_inliers(self) -> int: ...
    @property
    def match_support(self) -> float: ...
    @property
    def source_overlap(self) -> float: ...
    @property
    def target_overlap(self) -> float: ...
    @property
    def source_overlap_any_normal(self) -> float: ...
    @property
    def target_overlap_any_normal(self) -> float: ...
    @property
    def source_residual(self) -> float: ...
    @property
    def target_residual(self) -> float: ...
    @property
    def source_normal_weighted_overlap(self) -> float: ...
    @property
    def target_normal_weighted_overlap(self) -> float: ...
    @property
    def source_observed(self) -> float: ...
    @property
    def target_observed(self) -> float: ...
    @property
    def source_free_space_violation(self) -> float: ...
    @property
    def target_free_space_violation(self) -> float: ...
    @property
    def source_occluded(self) -> float: ...
    @property
    def target_occluded(self) -> float: ...
    @property
    def source_near_surface(self) -> float: ...
    @property
    def target_near_surface(self) -> float: ...
    @property
    def source_front_violation_near(self) -> float: ...
    @property
    def target_front_violation_near(self) -> float: ...
    @property
    def source_front_violation_far(self) -> float: ...
    @property
    def target_front_violation_far(self) -> float: ...
    @property
    def source_behind_surface(self) -> float: ...
    @property
    def target_behind_surface(self) -> float: ...
    @property
    def information_eigenvalues(self) -> list[float]: ...
    @property
    def weakest_direction(self) -> list[float]: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class RegistrationMode:
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def overlap_confidence(self) -> float: ...
    @property
    def equivalent(self) -> bool: ...
    @property
    def evidence(self) -> PoseEvidence: ...
    @property
    def rank_before_refinement(self) -> int: ...
    def to_dict(self) -> dict[str, Any]: ...

class PoseVerification:
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def overlap_confidence(self) -> float: ...
    @property
    def evidence(self) -> PoseEvidence: ...
    @property
    def inliers(self) -> int: ...
    @property
    def points(self) -> int: ...
    @property
    def inlier_ratio(self) -> float: ...
    @property
    def inlier_rmse(self) -> float: ...
    @property
    def source_moments(self) -> CorrespondenceMoments: ...
    @property
    def target_moments(self) -> CorrespondenceMoments: ...

class RegistrationResult:
    @property
    def status(
        self,
    ) -> Literal["aligned", "not_aligned", "skipped", "aligned_up_to_symmetry"]: ...
    @property
    def reason(self) -> str: ...
    @property
    def explanation(self) -> str: ...
    @property
    def advice(self) -> str: ...
    @property
    def aligned(self) -> bool: ...
    @property
    def has_pose(self) -> bool: ...
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def symmetry_confidence(self) -> float: ...
    @property
    def equivalent_poses(self) -> int: ...
    @property
    def modes(self) -> list[RegistrationMode]: ...
    @property
    def inlier_ratio(self) -> float: ...
    @property
    def inlier_rmse(self) -> float: ...
    @property
    def voxel_size(self) -> float: ...
    @property
    def source_moments(self) -> CorrespondenceMoments: ...
    @property
    def target_moments(self) -> CorrespondenceMoments: ...
    @property
    def flat(self) -> bool: ...
    @property
    def source_viewpoint(self) -> Literal["given", "origin", "normals", "none", "model"]: ...
    @property
    def target_viewpoint(self) -> Literal["given", "origin", "normals", "none", "model"]: ...
    @property
    def statistics(self) -> RegistrationStatistics: ...
    @property
    def timings(self) -> StageTimings: ...
    def to_dict(self) -> dict[str, Any]: ...
    def __bool__(self) -> bool: ...

class LoopConsistencyOptions:
    # fields of LoopConsistencyOptions
    voxel_size: float
    closing_angle: float
    closing_distance: float
    false_closure_rate: float
    missed_closure_rate: float
    max_odds_factor: float
    min_confidence: float
    min_alternative_confidence: float
    modes: int
    neighbors: int
    iterations: int
    threads: int
    def __init__(
        self,
        *,
        voxel_size: float = ...,
        closing_angle: float = ...,
        closing_distance: float = ...,
        false_closure_rate: float = ...,
        missed_closure_rate: float = ...,
        max_odds_factor: float = ...,
        min_confidence: float = ...,
        min_alternative_confidence: float = ...,
        modes: int = ...,
        neighbors: int = ...,
        iterations: int = ...,
        threads: int = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        voxel_size: float = ...,
        closing_angle: float = ...,
        closing_distance: float = ...,
        false_closure_rate: float = ...,
        missed_closure_rate: float = ...,
        max_odds_factor: float = ...,
        min_confidence: float = ...,
        min_alternative_confidence: float = ...,
        modes: int = ...,
        neighbors: int = ...,
        iterations: int = ...,
        threads: int = ...,
    ) -> LoopConsistencyOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class PairConsistency:
    # fields of PairConsistency
    @property
    def confidence(self) -> float: ...
    @property
    def mode(self) -> int: ...
    @property
    def loops(self) -> int: ...
    @property
    def path(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class ScaledResult:
    @property
    def aligned(self) -> bool: ...
    def __bool__(self) -> bool: ...
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def scale(self) -> float: ...
    @property
    def scale_status(self) -> str: ...
    @property
    def scale_deviation(self) -> float: ...
    @property
    def information(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def candidates(self) -> list[tuple[float, float]]: ...
    @property
    def explanation(self) -> str: ...
    @property
    def result(self) -> RegistrationResult: ...

class ScaledVerification:
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def scale(self) -> float: ...
    @property
    def scale_status(self) -> str: ...
    @property
    def scale_deviation(self) -> float: ...
    @property
    def information(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def verification(self) -> PoseVerification: ...

class TimedResult:
    @property
    def result(self) -> RegistrationResult: ...
    @property
    def quality(self) -> int: ...
    @property
    def highest_quality(self) -> int: ...
    @property
    def levels(self) -> int: ...
    @property
    def milliseconds(self) -> float: ...

class VoxelSizeSuggestion:
    @property
    def voxel_size(self) -> float: ...
    @property
    def reason(self) -> str: ...
    @property
    def explanation(self) -> str: ...
    @property
    def spacing(self) -> float: ...
    @property
    def noise(self) -> float: ...
    @property
    def flat(self) -> bool: ...
    @property
    def points(self) -> int: ...

class RegistrationPrior:
    def __init__(
        self,
        *,
        source_up: npt.ArrayLike | None = None,
        target_up: npt.ArrayLike | None = None,
        max_angle: float = 10.0,
        target_from_source: npt.ArrayLike | None = None,
        max_rotation: float = 30.0,
        max_translation: float = 1.0,
    ) -> None: ...

class PreparedCloud:
    def __len__(self) -> int: ...
    @property
    def feature_dimension(self) -> int: ...
    @property
    def statistics(self) -> PrepareStatistics: ...
    @property
    def voxel_size(self) -> float: ...
    @property
    def origin(self) -> _Float64: ...
    @property
    def points(self) -> npt.NDArray[Any]: ...
    @property
    def normals(self) -> _Float32: ...
    @property
    def features(self) -> _Float32: ...
    @property
    def viewpoints(self) -> npt.NDArray[Any]: ...

class PointCloud:
    def __init__(
        self,
        points: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        viewpoints: npt.ArrayLike | None = None,
    ) -> None: ...
    def __len__(self) -> int: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]: ...
    @property
    def points(self) -> npt.NDArray[Any]: ...
    @property
    def normals(self) -> _Float32: ...
    @property
    def viewpoints(self) -> npt.NDArray[Any]: ...
    @property
    def model(self) -> bool: ...

def describe_backends() -> list[str]: ...
def prepare_batch(
    context: Context,
    clouds: Sequence[Any],
    options: RegistrationOptions,
    names: Sequence[str] = ...,
) -> list[PreparedCloud]: ...
def align(
    context: Context,
    source: PreparedCloud,
    target: PreparedCloud,
    options: RegistrationOptions,
    correspondences: npt.NDArray[np.uint32] | None = None,
    prior: RegistrationPrior | None = None,
) -> RegistrationResult: ...
def verify(
    context: Context,
    source: PreparedCloud,
    target: PreparedCloud,
    poses: npt.NDArray[np.float64],
    options: RegistrationOptions,
    refine: bool,
    search_alternatives: bool,
) -> list[PoseVerification]: ...
def align_batch(
    context: Context,
    clouds: list[PreparedCloud],
    pairs: npt.NDArray[np.uint32],
    options: RegistrationOptions,
    progress: Callable[[int], object] | None = None,
    priors: Sequence[RegistrationPrior] = ...,
) -> tuple[list[RegistrationResult], BaseException | None]: ...
def loop_consistency(
    pairs: npt.NDArray[np.uint32],
    results: Sequence[RegistrationResult],
    options: LoopConsistencyOptions,
) -> list[PairConsistency]: ...
def align_scaled_batch(
    context: Context,
    clouds: Sequence[Any],
    pairs: Sequence[tuple[int, int]],
    least: float,
    most: float,
    options: RegistrationOptions,
    names: list[str] = ...,
) -> list[ScaledResult]: ...
def align_scaled_auto(
    context: Context,
    source: Any,
    target: Any,
    least: float,
    most: float,
    options: RegistrationOptions,
) -> ScaledResult: ...
def verify_scaled(
    context: Context,
    source: Any,
    target: Any,
    similarities: npt.NDArray[np.float64],
    options: RegistrationOptions,
    refine: bool,
    search_alternatives: bool,
) -> list[ScaledVerification]: ...
def align_within(
    context: Context,
    source: PreparedCloud,
    target: PreparedCloud,
    milliseconds: float,
    options: RegistrationOptions,
) -> TimedResult: ...
def suggest_voxel_size(clouds: list[_Float32]) -> VoxelSizeSuggestion: ...
def question_units(source: _Float32, target: _Float32, failed: bool) -> str: ...
def calibrate(
    context: Context,
    clouds: Sequence[Any],
    options: RegistrationOptions,
    self_pairs: int,
    scan_pairs: int,
    poses: npt.NDArray[np.float64] | None,
    progress: Callable[[int, int], object] | None,
) -> dict[str, Any]: ...
def fit_calibration(
    confidences: Sequence[float], correct: Sequence[bool], weights: Sequence[float]
) -> tuple[ConfidenceCalibration, bool]: ...
def control_risk(
    confidences: Sequence[float],
    correct: Sequence[bool],
    scans: Sequence[Sequence[int]] | None,
    scan_groups: Sequence[int],
    scenes: Sequence[int] | None,
    max_risk: float,
    max_failure: float,
    calibration: ConfidenceCalibration,
) -> dict[str, Any]: ...

class StoredScan:
    @property
    def name(self) -> str: ...
    @property
    def points(self) -> int: ...
    @property
    def file_from_scan(self) -> _Float64 | None: ...

def read_point_cloud(path: str, part: int = 0) -> PointCloud: ...
def scans_in(path: str) -> list[StoredScan]: ...
def scan_path(path: str) -> tuple[str, int]: ...
def is_mesh(path: str) -> bool: ...
def sample_mesh_file(path: str, spacing: float) -> tuple[PointCloud, str]: ...
def sample_mesh(
    vertices: _Float64, faces: npt.NDArray[Any], spacing: float
) -> tuple[PointCloud, str]: ...
def write_point_cloud(path: str, cloud: PointCloud) -> None: ...
def list_scans(
    path: str | bytes, recursive: bool
) -> tuple[list[tuple[int, str, str]], list[str]]: ...
def names_scans(path: str | bytes) -> bool: ...
def folder_of_scans(path: str | bytes) -> str: ...
def find_scan(numbers: Sequence[int], names: Sequence[str], word: str) -> int | None: ...
def read_cameras(
    path: str | bytes, numbers: Sequence[int], names: Sequence[str]
) -> dict[int, _Float64]: ...
def write_text(path: str, content: str) -> None: ...
def write_log(path: str, entries: Sequence[tuple[int, int, int, _Float64]]) -> None: ...
def write_information(path: str, entries: Sequence[tuple[int, int, int, _Float64]]) -> None: ...
def read_log(path: str) -> list[tuple[int, int, int, _Float64]]: ...
def evaluate(
    folder: str, reports: Sequence[tuple[int, int, int, _Float64]]
) -> dict[str, float]: ...
def _confidence_feature_names() -> list[str]: ...
def _confidence_features(
    evidence: dict[str, _Float64],
    free_space: bool,
    surface_sides: bool,
    model: bool,
    regressand: str,
) -> _Float64: ...
def _confidence_rank_features(
    log_odds: Sequence[float], modes_per_pair: Sequence[int], refined: int
) -> _Float64: ...
def _refined_modes(options: RegistrationOptions) -> int: ...
def _confidence_factor(points: Any, of: Any) -> Any: ...
def _part_features(evidence: dict[str, float]) -> list[float]: ...

class GncOptions:
    # fields of GncOptions
    inlier_probability: float
    mu_step: float
    max_rounds: int
    min_bridge_confidence: float
    consensus: bool
    def __init__(
        self,
        *,
        inlier_probability: float = ...,
        mu_step: float = ...,
        max_rounds: int = ...,
        min_bridge_confidence: float = ...,
        consensus: bool = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        inlier_probability: float = ...,
        mu_step: float = ...,
        max_rounds: int = ...,
        min_bridge_confidence: float = ...,
        consensus: bool = ...,
    ) -> GncOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class LineProcessOptions:
    # fields of LineProcessOptions
    odometry_weight: float
    tau: float
    tau_not_squared: bool
    min_weight: float
    max_rounds: int
    def __init__(
        self,
        *,
        odometry_weight: float = ...,
        tau: float = ...,
        tau_not_squared: bool = ...,
        min_weight: float = ...,
        max_rounds: int = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        odometry_weight: float = ...,
        tau: float = ...,
        tau_not_squared: bool = ...,
        min_weight: float = ...,
        max_rounds: int = ...,
    ) -> LineProcessOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class DriftOptions:
    # fields of DriftOptions
    translation_per_metre: float
    rotation_per_metre: float
    rotation_per_degree: float
    min_translation: float
    min_rotation: float
    def __init__(
        self,
        *,
        translation_per_metre: float = ...,
        rotation_per_metre: float = ...,
        rotation_per_degree: float = ...,
        min_translation: float = ...,
        min_rotation: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        translation_per_metre: float = ...,
        rotation_per_metre: float = ...,
        rotation_per_degree: float = ...,
        min_translation: float = ...,
        min_rotation: float = ...,
    ) -> DriftOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class LoopNoiseOptions:
    # fields of LoopNoiseOptions
    translation: float
    rotation: float
    def __init__(
        self,
        *,
        translation: float = ...,
        rotation: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        translation: float = ...,
        rotation: float = ...,
    ) -> LoopNoiseOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class SolverOptions:
    # fields of SolverOptions
    max_iterations: int
    relative_tolerance: float
    initial_damping: float
    def __init__(
        self,
        *,
        max_iterations: int = ...,
        relative_tolerance: float = ...,
        initial_damping: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        max_iterations: int = ...,
        relative_tolerance: float = ...,
        initial_damping: float = ...,
    ) -> SolverOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class PoseGraphOptions:
    # fields of PoseGraphOptions
    robust: Literal["none", "gnc", "line_process"]
    gnc: GncOptions
    line_process: LineProcessOptions
    drift: DriftOptions
    loop_noise: LoopNoiseOptions
    solver: SolverOptions
    use_initial_poses: bool
    threads: int
    def __init__(
        self,
        *,
        robust: Literal["none", "gnc", "line_process"] = ...,
        gnc: GncOptions = ...,
        line_process: LineProcessOptions = ...,
        drift: DriftOptions = ...,
        loop_noise: LoopNoiseOptions = ...,
        solver: SolverOptions = ...,
        use_initial_poses: bool = ...,
        threads: int = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        robust: Literal["none", "gnc", "line_process"] = ...,
        gnc: GncOptions = ...,
        line_process: LineProcessOptions = ...,
        drift: DriftOptions = ...,
        loop_noise: LoopNoiseOptions = ...,
        solver: SolverOptions = ...,
        use_initial_poses: bool = ...,
        threads: int = ...,
    ) -> PoseGraphOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class EdgeNoiseOptions:
    # fields of EdgeNoiseOptions
    translation: float
    rotation: float
    max_translation: float
    def __init__(
        self,
        *,
        translation: float = ...,
        rotation: float = ...,
        max_translation: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        translation: float = ...,
        rotation: float = ...,
        max_translation: float = ...,
    ) -> EdgeNoiseOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class AuditOptions:
    # fields of AuditOptions
    max_shift: float
    max_shift_per_metre: float
    max_contradicted: float
    min_confirmed: float
    most_pairs: int
    def __init__(
        self,
        *,
        max_shift: float = ...,
        max_shift_per_metre: float = ...,
        max_contradicted: float = ...,
        min_confirmed: float = ...,
        most_pairs: int = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        max_shift: float = ...,
        max_shift_per_metre: float = ...,
        max_contradicted: float = ...,
        min_confirmed: float = ...,
        most_pairs: int = ...,
    ) -> AuditOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class ReconstructionOptions:
    # fields of ReconstructionOptions
    voxel_size: float
    consistency: LoopConsistencyOptions
    noise: EdgeNoiseOptions
    drift: DriftOptions
    information_unit: float
    min_edge_confidence: float
    min_connection_confidence: float
    modes: int
    min_island: int
    threads: int
    def __init__(
        self,
        *,
        voxel_size: float = ...,
        consistency: LoopConsistencyOptions = ...,
        noise: EdgeNoiseOptions = ...,
        drift: DriftOptions = ...,
        information_unit: float = ...,
        min_edge_confidence: float = ...,
        min_connection_confidence: float = ...,
        modes: int = ...,
        min_island: int = ...,
        threads: int = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        voxel_size: float = ...,
        consistency: LoopConsistencyOptions = ...,
        noise: EdgeNoiseOptions = ...,
        drift: DriftOptions = ...,
        information_unit: float = ...,
        min_edge_confidence: float = ...,
        min_connection_confidence: float = ...,
        modes: int = ...,
        min_island: int = ...,
        threads: int = ...,
    ) -> ReconstructionOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class LoopProposalOptions:
    # fields of LoopProposalOptions
    coarse_voxel_size: float
    min_overlap: float
    max_dilation: float
    min_uncertainty: float
    min_time: float
    per_fragment: int
    between_frames: int
    confirming_candidate: int
    def __init__(
        self,
        *,
        coarse_voxel_size: float = ...,
        min_overlap: float = ...,
        max_dilation: float = ...,
        min_uncertainty: float = ...,
        min_time: float = ...,
        per_fragment: int = ...,
        between_frames: int = ...,
        confirming_candidate: int = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        coarse_voxel_size: float = ...,
        min_overlap: float = ...,
        max_dilation: float = ...,
        min_uncertainty: float = ...,
        min_time: float = ...,
        per_fragment: int = ...,
        between_frames: int = ...,
        confirming_candidate: int = ...,
    ) -> LoopProposalOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class LoopAcceptanceOptions:
    # fields of LoopAcceptanceOptions
    min_confidence: float
    alone: float
    confirmed: float
    together: float
    between_frames: float
    same_place_overlap: float
    drift_probability: float
    max_drift_ratio: float
    def __init__(
        self,
        *,
        min_confidence: float = ...,
        alone: float = ...,
        confirmed: float = ...,
        together: float = ...,
        between_frames: float = ...,
        same_place_overlap: float = ...,
        drift_probability: float = ...,
        max_drift_ratio: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        min_confidence: float = ...,
        alone: float = ...,
        confirmed: float = ...,
        together: float = ...,
        between_frames: float = ...,
        same_place_overlap: float = ...,
        drift_probability: float = ...,
        max_drift_ratio: float = ...,
    ) -> LoopAcceptanceOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class DamagedJournal(IoError): ...

class FragmentSource:
    def __init__(
        self,
        names: Sequence[str],
        fingerprints: Sequence[str],
        load: Callable[[int, RegistrationOptions], Any],
    ) -> None: ...

class PairJournal:
    def __init__(
        self,
        path: str,
        options: RegistrationOptions,
        fragments: FragmentSource,
        pairs: npt.NDArray[np.uint32],
        mode: str,
    ) -> None: ...
    @property
    def size(self) -> int: ...
    @property
    def done(self) -> int: ...
    @property
    def resumed(self) -> int: ...
    @property
    def note(self) -> int | None: ...
    def set_note(self, note: int) -> None: ...
    def has(self, pair: int) -> bool: ...
    def result(self, pair: int) -> RegistrationResult: ...
    def add(self, pair: int, result: RegistrationResult) -> None: ...
    def flush(self) -> None: ...
    def close(self) -> None: ...

class FragmentAligner:
    def __init__(
        self,
        context: Context,
        fragments: FragmentSource,
        options: RegistrationOptions,
        memory: int,
    ) -> None: ...
    def align(
        self,
        pairs: npt.NDArray[np.uint32],
        on_result: Callable[[int, RegistrationResult], object],
    ) -> None: ...
    @property
    def unusable(self) -> dict[int, str]: ...

def voxel_size_of_journal(path: str) -> float: ...
def read_journal(
    path: str,
) -> tuple[list[str], npt.NDArray[np.uint32], list[RegistrationResult]]: ...
def in_tiles(pairs: npt.NDArray[np.uint32]) -> list[int]: ...
def prepare_set(
    context: Context,
    fragments: FragmentSource,
    options: RegistrationOptions,
    progress: Callable[[int], object] | None = None,
) -> list[PreparedCloud | str]: ...
def register_set(
    contexts: Sequence[Context],
    fragments: FragmentSource,
    journal: PairJournal,
    options: RegistrationOptions,
    memory: int,
    progress: Callable[[int, int], object] | None,
) -> dict[int, str]: ...

class MapOptions:
    # fields of MapOptions
    voxel_size: float
    prepare: PrepareOptions
    tile_size: float
    halo: float
    def __init__(
        self,
        *,
        voxel_size: float = ...,
        prepare: PrepareOptions = ...,
        tile_size: float = ...,
        halo: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        voxel_size: float = ...,
        prepare: PrepareOptions = ...,
        tile_size: float = ...,
        halo: float = ...,
    ) -> MapOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class LocateOptions:
    # fields of LocateOptions
    registration: RegistrationOptions
    min_confidence: float
    coarse_factor: float
    coarse_tiles: int
    fine_tiles: int
    candidates: int
    neighborhood: float
    def __init__(
        self,
        *,
        registration: RegistrationOptions = ...,
        min_confidence: float = ...,
        coarse_factor: float = ...,
        coarse_tiles: int = ...,
        fine_tiles: int = ...,
        candidates: int = ...,
        neighborhood: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        registration: RegistrationOptions = ...,
        min_confidence: float = ...,
        coarse_factor: float = ...,
        coarse_tiles: int = ...,
        fine_tiles: int = ...,
        candidates: int = ...,
        neighborhood: float = ...,
    ) -> LocateOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class PreparedMap:
    def __len__(self) -> int: ...
    @property
    def tiles(self) -> int: ...
    @property
    def options(self) -> MapOptions: ...
    @property
    def cloud(self) -> PointCloud: ...
    def save(self, path: str | os.PathLike[str]) -> None: ...

class LocatedPose:
    @property
    def map_from_scan(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def alias(self) -> bool: ...
    @property
    def verification(self) -> PoseVerification: ...

class LocateResult:
    @property
    def status(self) -> str: ...
    @property
    def found(self) -> bool: ...
    @property
    def map_from_scan(self) -> _Float64: ...
    @property
    def poses(self) -> list[LocatedPose]: ...
    @property
    def absent_probability(self) -> float: ...
    @property
    def scan_points(self) -> int: ...
    @property
    def stage(self) -> Literal["from_above", "coarse_tiles", "tiles"]: ...
    @property
    def tiles(self) -> int: ...
    @property
    def neighborhood_points(self) -> int: ...

def load_map(path: str | os.PathLike[str]) -> PreparedMap: ...
def make_map(
    context: Context,
    clouds: Iterable[Any],
    poses: npt.NDArray[np.float64] | None,
    options: MapOptions,
) -> PreparedMap: ...
def locate(
    context: Context,
    scans: Sequence[Any],
    map: PreparedMap,
    options: LocateOptions,
    up: tuple[_Float64, _Float64, float] | None,
    near: tuple[_Float64, float] | None,
    names: Sequence[str],
) -> list[LocateResult]: ...

class ChangeOptions:
    # fields of ChangeOptions
    tolerance: float
    translation_sigma: float
    rotation_sigma: float
    min_extent: float
    viewpoints: int
    refine: bool
    def __init__(
        self,
        *,
        tolerance: float = ...,
        translation_sigma: float = ...,
        rotation_sigma: float = ...,
        min_extent: float = ...,
        viewpoints: int = ...,
        refine: bool = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        tolerance: float = ...,
        translation_sigma: float = ...,
        rotation_sigma: float = ...,
        min_extent: float = ...,
        viewpoints: int = ...,
        refine: bool = ...,
    ) -> ChangeOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class ChangeResult:
    @property
    def map_from_scan(self) -> _Float64: ...
    @property
    def inlier_ratio(self) -> float: ...
    @property
    def scan_labels(self) -> npt.NDArray[np.uint8]: ...
    @property
    def scan_probabilities(self) -> npt.NDArray[np.float32]: ...
    @property
    def map_labels(self) -> npt.NDArray[np.uint8]: ...
    @property
    def map_probabilities(self) -> npt.NDArray[np.float32]: ...

def find_changes(
    context: Context,
    scan: Any,
    map: PreparedMap,
    pose: _Float64,
    options: ChangeOptions,
) -> ChangeResult: ...

class FindOptions:
    # fields of FindOptions
    voxel_size: float
    quality: int
    seed: int
    min_confidence: float
    def __init__(
        self,
        *,
        voxel_size: float = ...,
        quality: int = ...,
        seed: int = ...,
        min_confidence: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        voxel_size: float = ...,
        quality: int = ...,
        seed: int = ...,
        min_confidence: float = ...,
    ) -> FindOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class PartEvidence:
    # fields of PartEvidence
    @property
    def occluded(self) -> float: ...
    @property
    def supported(self) -> float: ...
    @property
    def violated(self) -> float: ...
    @property
    def contour(self) -> float: ...
    @property
    def contour_length(self) -> float: ...
    @property
    def area(self) -> float: ...
    @property
    def cell(self) -> float: ...
    @property
    def residual(self) -> float: ...
    @property
    def weakest(self) -> float: ...
    @property
    def third_weakest(self) -> float: ...
    @property
    def votes(self) -> int: ...
    @property
    def rival(self) -> float: ...
    @property
    def viewpoint_known(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields

class FoundPart:
    @property
    def scene_from_part(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def evidence(self) -> PartEvidence: ...
    @property
    def equivalent_poses(self) -> int: ...

class FindResult:
    @property
    def status(self) -> str: ...
    @property
    def explanation(self) -> str: ...
    @property
    def instances(self) -> list[FoundPart]: ...
    @property
    def doubtful(self) -> list[FoundPart]: ...
    @property
    def voxel_size(self) -> float: ...
    @property
    def evidence_voxel_size(self) -> float: ...
    @property
    def diameter(self) -> float: ...
    @property
    def scene_extent(self) -> float: ...
    @property
    def part_points(self) -> int: ...
    @property
    def scene_points(self) -> int: ...
    @property
    def neighborhoods(self) -> int: ...

def find(context: Context, part: Any, scene: Any, options: FindOptions) -> FindResult: ...

class LoopClosureOptions:
    # fields of LoopClosureOptions
    registration: RegistrationOptions
    proposals: LoopProposalOptions
    acceptance: LoopAcceptanceOptions
    noise: EdgeNoiseOptions
    information_unit: float
    host_noise: LoopNoiseOptions
    graph: PoseGraphOptions
    drift_correlation: float
    gravity_sigma: float
    modes: int
    chunk: int
    optimize: bool
    information_from_correspondences: bool
    accept_by_graph_alone: bool
    def __init__(
        self,
        *,
        registration: RegistrationOptions = ...,
        proposals: LoopProposalOptions = ...,
        acceptance: LoopAcceptanceOptions = ...,
        noise: EdgeNoiseOptions = ...,
        information_unit: float = ...,
        host_noise: LoopNoiseOptions = ...,
        graph: PoseGraphOptions = ...,
        drift_correlation: float = ...,
        gravity_sigma: float = ...,
        modes: int = ...,
        chunk: int = ...,
        optimize: bool = ...,
        information_from_correspondences: bool = ...,
        accept_by_graph_alone: bool = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        registration: RegistrationOptions = ...,
        proposals: LoopProposalOptions = ...,
        acceptance: LoopAcceptanceOptions = ...,
        noise: EdgeNoiseOptions = ...,
        information_unit: float = ...,
        host_noise: LoopNoiseOptions = ...,
        graph: PoseGraphOptions = ...,
        drift_correlation: float = ...,
        gravity_sigma: float = ...,
        modes: int = ...,
        chunk: int = ...,
        optimize: bool = ...,
        information_from_correspondences: bool = ...,
        accept_by_graph_alone: bool = ...,
    ) -> LoopClosureOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]
    # end of fields
    @staticmethod
    def loopsmart(voxel_size: float = ...) -> LoopClosureOptions: ...

class PoseGraph:
    def __init__(self) -> None: ...
    @property
    def node_count(self) -> int: ...
    @property
    def edge_count(self) -> int: ...
    def add_node(self, id: int, world_from_node: _Float64 | None, fixed: bool) -> None: ...
    def add_edge(
        self,
        source: int,
        target: int,
        target_from_source: _Float64,
        information: _Float64 | None,
        kind: str,
        confidence: float,
    ) -> int: ...
    def add_mode(
        self,
        edge: int,
        target_from_source: _Float64,
        information: _Float64 | None,
        confidence: float,
    ) -> None: ...
    def add_gravity(self, node: int, up: _Float64, sigma_degrees: float) -> None: ...
    def add_prior(self, node: int, world_from_node: _Float64, information: _Float64) -> None: ...
    def validate(self) -> None: ...

class PoseGraphResult:
    @property
    def status(
        self,
    ) -> Literal["converged", "max_iterations", "cancelled", "no_nodes", "failed"]: ...
    @property
    def reason(self) -> str: ...
    @property
    def converged(self) -> bool: ...
    @property
    def world_from_node(self) -> _Float64: ...
    @property
    def accepted(self) -> npt.NDArray[np.bool_]: ...
    @property
    def weights(self) -> _Float64: ...
    @property
    def modes(self) -> npt.NDArray[np.int64]: ...
    @property
    def squared_errors(self) -> _Float64: ...
    @property
    def components(self) -> list[list[int]]: ...
    @property
    def iterations(self) -> int: ...
    @property
    def initial_cost(self) -> float: ...
    @property
    def final_cost(self) -> float: ...

def optimize_pose_graph(
    graph: PoseGraph, robust: str, loopsmart: bool, threads: int
) -> PoseGraphResult: ...
def read_g2o(path: str, radians: bool) -> PoseGraph: ...
def write_g2o(
    path: str, graph: PoseGraph, result: PoseGraphResult | None, radians: bool
) -> None: ...
def read_open3d_pose_graph(path: str) -> PoseGraph: ...
def write_open3d_pose_graph(
    path: str, graph: PoseGraph, result: PoseGraphResult | None
) -> None: ...

class Loop:
    @property
    def source(self) -> int: ...
    @property
    def target(self) -> int: ...
    @property
    def from_host(self) -> bool: ...
    @property
    def state(self) -> Literal["candidate", "accepted", "rejected", "retracted"]: ...
    @property
    def reason(self) -> str: ...
    @property
    def explanation(self) -> str: ...
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def information(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def weight(self) -> float: ...
    @property
    def drift_ratio(self) -> float: ...

class LoopUpdate:
    @property
    def changed(self) -> list[Loop]: ...
    @property
    def poses(self) -> dict[int, _Float64]: ...
    @property
    def registered(self) -> int: ...
    @property
    def proposals_left(self) -> int: ...
    @property
    def status(
        self,
    ) -> Literal["converged", "max_iterations", "cancelled", "no_nodes", "failed"]: ...
    @property
    def reason(self) -> str: ...

class LoopCloser:
    def __init__(
        self,
        context: Context,
        options: LoopClosureOptions,
    ) -> None: ...
    def add(
        self,
        id: int,
        cloud: PreparedCloud | None,
        world_from_fragment: _Float64 | None,
        session: int,
        time: float,
        up: _Float64 | None,
    ) -> None: ...
    def add_odometry(
        self,
        source: int,
        target: int,
        target_from_source: _Float64,
        covariance: _Float64 | None,
    ) -> None: ...
    def set_covisible(self, id: int, others: list[int]) -> None: ...
    def propose(self, source: int, target: int, prior: RegistrationPrior | None) -> None: ...
    def add_loop(
        self,
        source: int,
        target: int,
        target_from_source: _Float64,
        information: _Float64 | None,
        confidence: float,
    ) -> None: ...
    def add_result(self, source: int, target: int, result: RegistrationResult) -> None: ...
    def set_poses(self, poses: dict[int, _Float64]) -> None: ...
    def remove(self, id: int) -> None: ...
    def process(self, milliseconds: float | None, registrations: int | None) -> LoopUpdate: ...
    @property
    def poses(self) -> dict[int, _Float64]: ...
    @property
    def frames(self) -> dict[int, int]: ...
    @property
    def loops(self) -> list[Loop]: ...
    def graph(self) -> PoseGraph: ...
    def save(self, path: str) -> None: ...
    def load(self, path: str, clouds: Any) -> None: ...
    def __len__(self) -> int: ...

class MapGraph:
    @property
    def poses(self) -> _Float64: ...
    @property
    def scans(self) -> list[tuple[bool, int | None, float, str, str]]: ...
    @property
    def edges(
        self,
    ) -> list[tuple[int, int, _Float64, float, float, float, bool, str, int, _Float64]]: ...
    @property
    def links(self) -> list[tuple[list[int], float, int, int]]: ...
    @property
    def islands(self) -> list[list[int]]: ...
    @property
    def agreement(self) -> tuple[float, float, float]: ...

class VoxelMap:
    def __init__(self, voxel_size: float) -> None: ...
    def add(
        self, points: _Float32, normals: _Float32 | None, origin: _Float64, map_from_scan: _Float64
    ) -> None: ...
    def cloud(self) -> tuple[npt.NDArray[Any], _Float32 | None]: ...

class ReconstructOptions:
    def __init__(
        self,
        registration: RegistrationOptions,
        graph: ReconstructionOptions,
        audit: AuditOptions,
        with_audit: bool,
        with_refinement: bool,
        journal: str,
    ) -> None: ...

def reconstruct_set(
    context: Context,
    fragments: FragmentSource,
    pairs: npt.NDArray[np.uint32] | None,
    results: list[RegistrationResult] | None,
    odometry: _Float64 | list[tuple[int, int, _Float64, _Float64 | None]],
    options: ReconstructOptions,
    scales: list[float] | None,
    progress: Callable[[int, int, int], object] | None,
) -> dict[str, Any]: ...
def find_scales(
    context: Context,
    fragments: FragmentSource,
    least: float,
    most: float,
    options: RegistrationOptions,
    journal: str,
    progress: Callable[[int, int], object] | None,
) -> list[tuple[float, int]]: ...

class AuditRecord:
    @property
    def pairs(self) -> list[tuple[int, int, str, float, float, float, float, float]]: ...
    @property
    def connections(self) -> list[tuple[str, float, int, int, list[int], int, int, int]]: ...
    @property
    def order(self) -> list[int]: ...
    @property
    def islands(self) -> list[list[int]]: ...
    @property
    def verdicts(self) -> list[str]: ...
    @property
    def verdict(self) -> str: ...

def audit(
    context: Context,
    clouds: list[PreparedCloud],
    poses: _Float64,
    islands: list[int],
    options: RegistrationOptions,
    audit_options: AuditOptions,
) -> AuditRecord: ...
def mend(
    context: Context,
    clouds: list[PreparedCloud],
    poses: _Float64,
    islands: list[int],
    found: AuditRecord,
    options: RegistrationOptions,
    audit_options: AuditOptions,
) -> tuple[_Float64, list[int], list[int], int, AuditRecord]: ...
def learn_words(clouds: list[_Float32], most: int) -> _Float32: ...
def describe_features(features: _Float32, words: _Float32) -> _Float32: ...

class CloudSummary:
    @property
    def descriptor(self) -> _Float32: ...
    def __len__(self) -> int: ...

def summarize_cloud(cloud: PreparedCloud, words: _Float32) -> CloudSummary: ...
def likely_pairs(
    summaries: Sequence[CloudSummary], neighbors: int, consecutive: int
) -> npt.NDArray[np.int64]: ...

class ErrorStatistics:
    @property
    def count(self) -> int: ...
    @property
    def rmse(self) -> float: ...
    @property
    def mean(self) -> float: ...
    @property
    def median(self) -> float: ...
    @property
    def deviation(self) -> float: ...
    @property
    def min(self) -> float: ...
    @property
    def max(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class TrajectoryEvaluation:
    @property
    def estimated(self) -> int: ...
    @property
    def true_poses(self) -> int: ...
    @property
    def matched(self) -> int: ...
    @property
    def truth_from_estimate(self) -> _Float64: ...
    @property
    def path_length(self) -> float: ...
    @property
    def absolute_translation(self) -> ErrorStatistics: ...
    @property
    def absolute_rotation(self) -> ErrorStatistics: ...
    @property
    def relative_translation(self) -> ErrorStatistics: ...
    @property
    def relative_rotation(self) -> ErrorStatistics: ...

def read_pose_file(
    path: str, numbers: Sequence[int], names: Sequence[str], folder: str
) -> tuple[_Float64, list[int]]: ...
def read_odometry(
    path: str,
    numbers: Sequence[int],
    names: Sequence[str],
    folder: str,
) -> _Float64 | list[tuple[int, int, _Float64, None]]: ...
def read_trajectory(path: str, format: str) -> tuple[_Float64, _Float64]: ...
def evaluate_trajectory(
    times: _Float64,
    poses: _Float64,
    true_times: _Float64,
    true_poses: _Float64,
    max_difference: float,
    align: bool,
    delta: float,
    delta_unit: str,
) -> TrajectoryEvaluation: ...
