# SPDX-License-Identifier: BSD-3-Clause
# Types of the compiled module. python/tests/test_stubs.py compares it with the module.
from collections.abc import Callable, Sequence
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
    voxel_size: float
    normal_radius: float
    feature_radius: float
    wide_feature_radius: float
    max_correspondence_distance: float
    depth_maps: int
    surface_side_distance: float
    def __init__(
        self,
        *,
        voxel_size: float = ...,
        normal_radius: float = ...,
        feature_radius: float = ...,
        wide_feature_radius: float = ...,
        max_correspondence_distance: float = ...,
        depth_maps: int = ...,
        surface_side_distance: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        voxel_size: float = ...,
        normal_radius: float = ...,
        feature_radius: float = ...,
        wide_feature_radius: float = ...,
        max_correspondence_distance: float = ...,
        depth_maps: int = ...,
        surface_side_distance: float = ...,
    ) -> PrepareOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class CompatibilityOptions:
    max_matches: int
    seeds: int
    max_members: int
    triangles: int
    refits: int
    tolerance: float
    max_turn: float
    consensus_distance: float
    seed_separation: float
    def __init__(
        self,
        *,
        max_matches: int = ...,
        seeds: int = ...,
        max_members: int = ...,
        triangles: int = ...,
        refits: int = ...,
        tolerance: float = ...,
        max_turn: float = ...,
        consensus_distance: float = ...,
        seed_separation: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        max_matches: int = ...,
        seeds: int = ...,
        max_members: int = ...,
        triangles: int = ...,
        refits: int = ...,
        tolerance: float = ...,
        max_turn: float = ...,
        consensus_distance: float = ...,
        seed_separation: float = ...,
    ) -> CompatibilityOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class QuadrupleOptions:
    count: int
    neighbors: int
    mutual: bool
    edge_similarity: float
    max_survivors: int
    max_normal_angle: float
    max_verification_normal_angle: float
    min_inlier_ratio: float
    def __init__(
        self,
        *,
        count: int = ...,
        neighbors: int = ...,
        mutual: bool = ...,
        edge_similarity: float = ...,
        max_survivors: int = ...,
        max_normal_angle: float = ...,
        max_verification_normal_angle: float = ...,
        min_inlier_ratio: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        count: int = ...,
        neighbors: int = ...,
        mutual: bool = ...,
        edge_similarity: float = ...,
        max_survivors: int = ...,
        max_normal_angle: float = ...,
        max_verification_normal_angle: float = ...,
        min_inlier_ratio: float = ...,
    ) -> QuadrupleOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class RefineOptions:
    max_iterations: int
    kernel_width: float
    def __init__(
        self,
        *,
        max_iterations: int = ...,
        kernel_width: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        max_iterations: int = ...,
        kernel_width: float = ...,
    ) -> RefineOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class EvidenceOptions:
    sample: int
    modes: int
    max_normal_angle: float
    mode_angle: float
    mode_distance: float
    degeneracy_search_distance: float
    free_space_margin: float
    min_range: float
    def __init__(
        self,
        *,
        sample: int = ...,
        modes: int = ...,
        max_normal_angle: float = ...,
        mode_angle: float = ...,
        mode_distance: float = ...,
        degeneracy_search_distance: float = ...,
        free_space_margin: float = ...,
        min_range: float = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        sample: int = ...,
        modes: int = ...,
        max_normal_angle: float = ...,
        mode_angle: float = ...,
        mode_distance: float = ...,
        degeneracy_search_distance: float = ...,
        free_space_margin: float = ...,
        min_range: float = ...,
    ) -> EvidenceOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class RegistrationOptions:
    seed: int
    min_confidence: float
    method: Literal["compatibility", "quadruples"]
    smaller_as_source: bool
    prepare: PrepareOptions
    compatibility: CompatibilityOptions
    quadruples: QuadrupleOptions
    refine: RefineOptions
    evidence: EvidenceOptions
    def __init__(
        self,
        *,
        seed: int = ...,
        min_confidence: float = ...,
        method: Literal["compatibility", "quadruples"] = ...,
        smaller_as_source: bool = ...,
        prepare: PrepareOptions = ...,
        compatibility: CompatibilityOptions = ...,
        quadruples: QuadrupleOptions = ...,
        refine: RefineOptions = ...,
        evidence: EvidenceOptions = ...,
    ) -> None: ...
    def replace(
        self,
        *,
        seed: int = ...,
        min_confidence: float = ...,
        method: Literal["compatibility", "quadruples"] = ...,
        smaller_as_source: bool = ...,
        prepare: PrepareOptions = ...,
        compatibility: CompatibilityOptions = ...,
        quadruples: QuadrupleOptions = ...,
        refine: RefineOptions = ...,
        evidence: EvidenceOptions = ...,
    ) -> RegistrationOptions: ...
    @staticmethod
    def from_voxel_size(voxel_size: float, quality: int = 5) -> RegistrationOptions: ...
    @staticmethod
    def loopsmart(voxel_size: float = ...) -> RegistrationOptions: ...
    def with_quality(self, quality: int) -> RegistrationOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class RegistrationStatistics:
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

class StageTimings:
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
    @property
    def total(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class PrepareStatistics:
    @property
    def input_points(self) -> int: ...
    @property
    def invalid_points(self) -> int: ...
    @property
    def points(self) -> int: ...
    @property
    def points_without_normal(self) -> int: ...
    @property
    def points_without_feature(self) -> int: ...
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
    @property
    def total(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

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

class RegistrationMode:
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def confidence(self) -> float: ...
    @property
    def overlap_confidence(self) -> float: ...
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
    def status(self) -> Literal["aligned", "not_aligned", "skipped"]: ...
    @property
    def reason(self) -> str: ...
    @property
    def explanation(self) -> str: ...
    @property
    def aligned(self) -> bool: ...
    @property
    def has_candidate(self) -> bool: ...
    @property
    def target_from_source(self) -> _Float64: ...
    @property
    def score(self) -> float: ...
    @property
    def modes(self) -> list[RegistrationMode]: ...
    @property
    def inlier_ratio(self) -> float: ...
    @property
    def inlier_rmse(self) -> float: ...
    @property
    def source_moments(self) -> CorrespondenceMoments: ...
    @property
    def target_moments(self) -> CorrespondenceMoments: ...
    @property
    def statistics(self) -> RegistrationStatistics: ...
    @property
    def timings(self) -> StageTimings: ...
    def to_dict(self) -> dict[str, Any]: ...
    def __bool__(self) -> bool: ...

class LoopConsistencyOptions:
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
    def __init__(
        self,
        *,
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
    ) -> None: ...
    def replace(
        self,
        *,
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
    ) -> LoopConsistencyOptions: ...
    @staticmethod
    def from_voxel_size(voxel_size: float) -> LoopConsistencyOptions: ...
    def validate(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]
    _fields: tuple[str, ...]

class PairConsistency:
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
    def options(self) -> PrepareOptions: ...
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
    @property
    def points(self) -> _Float32: ...
    @property
    def normals(self) -> _Float32: ...
    @property
    def viewpoints(self) -> _Float32: ...

def describe_backends() -> list[str]: ...
def prepare_batch(
    context: Context, clouds: Sequence[_Cloud], options: PrepareOptions, names: Sequence[str] = ...
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
    on_result: Callable[[int, RegistrationResult], object] | None = None,
) -> tuple[list[RegistrationResult], BaseException | None]: ...
def loop_consistency(
    pairs: npt.NDArray[np.uint32],
    results: Sequence[RegistrationResult],
    options: LoopConsistencyOptions,
) -> list[PairConsistency]: ...
def align_within(
    context: Context,
    source: PreparedCloud,
    target: PreparedCloud,
    milliseconds: float,
    options: RegistrationOptions,
) -> TimedResult: ...
def suggest_voxel_size(clouds: list[_Float32]) -> VoxelSizeSuggestion: ...
def read_point_cloud(path: str) -> PointCloud: ...
def write_point_cloud(path: str, cloud: PointCloud) -> None: ...
def list_fragments(folder: str) -> list[tuple[int, str]]: ...
def read_cameras(path: str) -> dict[int, _Float32]: ...
def read_pairs(path: str) -> list[tuple[int, int]]: ...
def write_log(path: str, entries: Sequence[tuple[int, int, int, _Float64]]) -> None: ...
def write_information(path: str, entries: Sequence[tuple[int, int, int, _Float64]]) -> None: ...
def read_log(path: str) -> list[tuple[int, int, int, _Float64]]: ...
def evaluate(
    folder: str, reports: Sequence[tuple[int, int, int, _Float64]]
) -> dict[str, float]: ...
def _confidence_feature_names() -> list[str]: ...
def _confidence_features(
    evidence: dict[str, _Float64], free_space: bool, surface_sides: bool, regressand: str
) -> _Float64: ...
def _confidence_rank_features(
    log_odds: Sequence[float], modes_per_pair: Sequence[int], refined: int
) -> _Float64: ...
def _confidence_factor(points: Any, of: Any) -> Any: ...

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
