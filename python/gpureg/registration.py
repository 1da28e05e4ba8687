# SPDX-License-Identifier: BSD-3-Clause
"""Alignment: any pairs of prepared clouds, and the short way for two."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, overload

import numpy as np

from . import _core
from ._arrays import core_cloud, host_points, index_pairs, is_one_cloud, several
from ._contexts import checked, context_of, milliseconds_of, number_of, whole_number_of
from ._core import (
    Context,
    InvalidArgument,
    PreparedCloud,
    RegistrationOptions,
    RegistrationPrior,
    RegistrationResult,
    ScaledResult,
    TimedResult,
    VoxelSizeSuggestion,
)
from ._progress import batch_progress
from .preparation import check_prepared, prepared

#: Values of ``RegistrationResult.status`` if a pose is reported.
ALIGNED = ("aligned", "aligned_up_to_symmetry")


class BatchInterrupted(KeyboardInterrupt):
    """Ctrl-C in the middle of a batch. What was done by then is in `results`.

    Attributes
    ----------
    results : list of RegistrationResult
        One per pair; pairs never tried have status "skipped".
    """

    def __init__(self, results: list[RegistrationResult]) -> None:
        done = sum(result.status != "skipped" for result in results)
        super().__init__(f"interrupted after {done} of {len(results)} pairs; they are in .results")
        self.results = results


def align(
    source: PreparedCloud,
    target: PreparedCloud,
    *,
    correspondences: Any = None,
    prior: RegistrationPrior | None = None,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
) -> RegistrationResult:
    """Find the pose of one prepared cloud in the frame of another.

    Parameters
    ----------
    source, target : PreparedCloud
        Made by `prepare` on the same backend and device.
    correspondences : (M, 2) integer array, optional
        Rows (source point, target point) to use instead of feature matches; indices into
        ``PreparedCloud.points``.
    prior : RegistrationPrior, optional
        Gravity (``source_up``, ``target_up``, ``max_angle`` degrees) and an approximate pose
        (``target_from_source``, ``max_rotation`` degrees, ``max_translation`` of the source's
        middle): poses that contradict it are dropped.
    options : RegistrationOptions, optional
    context : Context, optional
        Default: `default_context()`. Threads may share one: their calls take turns.

    Returns
    -------
    RegistrationResult
        ``target_from_source`` maps points of the source into the target's frame. Not aligned is a
        status with a reason, not an exception.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C, within a fraction of a second on the CPU; nothing runs on.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = gpureg.prepare(np.random.default_rng(1).random((2000, 3)))
    >>> result = gpureg.align(cloud, cloud)
    >>> result.status, bool(np.allclose(result.target_from_source, np.eye(4), atol=1e-3))
    ('aligned', True)
    """
    check_prepared(source, "source")
    check_prepared(target, "target")
    checked(prior, RegistrationPrior, "prior")
    if correspondences is not None:
        correspondences = index_pairs(
            correspondences, "correspondences", (len(source), len(target))
        )
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    return _core.align(context_of(context), source, target, options, correspondences, prior)


def align_within(
    source: PreparedCloud,
    target: PreparedCloud,
    milliseconds: float,
    *,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
) -> TimedResult:
    """`align` with as much quality as a time allows: the one thing that is not deterministic.

    Parameters
    ----------
    source, target : PreparedCloud
    milliseconds : float
        Wall time. Levels of quality are run upwards, and none that would end later is started; the
        lowest is always run. What is sure early ends early.
    options : RegistrationOptions, optional
        ``quality`` is set per level.
    context : Context, optional

    Returns
    -------
    TimedResult
        ``result`` is that of `align` with this ``quality``, bit for bit.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = gpureg.prepare(np.random.default_rng(1).random((2000, 3)))
    >>> timed = gpureg.align_within(cloud, cloud, 10000)
    >>> timed.result.status, timed.quality <= timed.highest_quality
    ('aligned', True)
    """
    check_prepared(source, "source")
    check_prepared(target, "target")
    milliseconds = milliseconds_of(milliseconds, "milliseconds")
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    return _core.align_within(context_of(context), source, target, milliseconds, options)


def suggest_voxel_size(clouds: Any) -> VoxelSizeSuggestion:
    """A voxel size that leaves some thousand points of each cloud, and fits their spacing and
    noise.

    Parameters
    ----------
    clouds : cloud, or sequence of clouds
        Each whatever `prepare` takes as points. At most 16, evenly chosen, are looked at.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> sphere = np.random.default_rng(1).normal(size=(50000, 3))
    >>> sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    >>> gpureg.suggest_voxel_size(sphere).voxel_size
    0.06
    """
    if is_one_cloud(clouds):
        return _core.suggest_voxel_size([host_points(clouds, "clouds")])
    return _core.suggest_voxel_size(
        [host_points(cloud, f"clouds[{k}]") for k, cloud in enumerate(several(clouds, "clouds"))]
    )


def align_batch(
    fragments: Sequence[Any],
    pairs: Any,
    *,
    priors: Sequence[RegistrationPrior] | None = None,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
    progress: bool | Callable[[int, int], object] = False,
) -> list[RegistrationResult]:
    """Align many pairs; each result equals that of `align` bit for bit.

    Parameters
    ----------
    fragments : sequence of PreparedCloud
        Or of whatever `prepare` takes as points; those are prepared with the options.
    pairs : (M, 2) integer array or list of pairs
        Rows (source, target): indices into fragments.
    priors : sequence of RegistrationPrior, optional
        One for each pair, see `align`; ``RegistrationPrior()`` if nothing is known.
    options : RegistrationOptions, optional
    context : Context, optional
    progress : bool or callable
        True: a bar of tqdm, if installed. A callable gets (pairs done, pairs) every few pairs.

    Returns
    -------
    list of RegistrationResult
        One per pair, in the order of pairs.

    Raises
    ------
    BatchInterrupted
        After Ctrl-C (a KeyboardInterrupt); its ``results`` hold what is done.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> shifted = cloud + [0.5, 0, 0]
    >>> results = gpureg.align_batch([cloud, shifted], [(0, 1), (1, 0)])
    >>> [round(float(r.target_from_source[0, 3]), 2) for r in results]
    [0.5, -0.5]
    """
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    context = context_of(context)
    fragments = several(fragments, "fragments")
    entries = index_pairs(pairs, "pairs", len(fragments))
    known = [] if priors is None else list(priors)
    for k, prior in enumerate(known):
        if not isinstance(prior, RegistrationPrior):
            raise TypeError(f"priors[{k}]: expected a RegistrationPrior, got {prior!r}")
    clouds = prepared(fragments, options, context, progress is True)
    with batch_progress(progress, "aligning", len(entries)) as report:
        results, error = _core.align_batch(context, clouds, entries, options, report, known)
    if isinstance(error, KeyboardInterrupt):
        raise BatchInterrupted(results) from None
    if error is not None:
        raise error
    return results


def scale_range(scale: Any) -> tuple[float, float]:
    """(least, most) of a scale; (0, 0): free."""
    if isinstance(scale, str):
        if scale != "free":
            raise ValueError(f"scale: expected 'free', a number or (least, most), got {scale!r}")
        return 0.0, 0.0
    if isinstance(scale, int | float | np.integer | np.floating) and not isinstance(scale, bool):
        ends = [float(scale), float(scale)]
    elif isinstance(scale, tuple | list) and len(scale) == 2:
        ends = [float(end) for end in scale]
    else:
        raise TypeError(f"scale: expected 'free', a number or (least, most), got {scale!r}")
    for end in ends:
        if not (np.isfinite(end) and end > 0):
            raise InvalidArgument(f"scale: {scale!r}, expected finite numbers > 0")
    if ends[0] > ends[1]:
        raise InvalidArgument(f"scale: {scale!r}, expected the smaller end first")
    return ends[0], ends[1]


def align_scaled_batch(
    clouds: Sequence[Any],
    pairs: Any,
    *,
    scale: Any = "free",
    options: RegistrationOptions | None = None,
    context: Context | None = None,
) -> list[ScaledResult]:
    """Find scale and pose of many pairs of clouds whose scales differ by unknown factors.

    Parameters
    ----------
    clouds : sequence
        Of whatever `prepare` takes as points, on the host.
    pairs : (M, 2) integer array or list of pairs
        Rows (source, target): indices into clouds.
    scale : "free", (least, most) or float
        Lengths of the target's unit per unit of the source.
    options : RegistrationOptions, optional
        Voxel size and all lengths are in the unit of the targets.
    context : Context, optional

    Returns
    -------
    list of ScaledResult
        One per pair, in the order of pairs.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> [result] = gpureg.align_scaled_batch([cloud / 2, cloud], [(0, 1)], scale=(1.5, 3))
    >>> result.aligned, round(result.scale, 2)
    (True, 2.0)
    """
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    least, most = scale_range(scale)
    clouds = several(clouds, "clouds")
    entries = index_pairs(pairs, "pairs", len(clouds))
    inputs = [
        core_cloud(cloud, None, None, None, options, f"clouds[{k}]")
        for k, cloud in enumerate(clouds)
    ]
    return _core.align_scaled_batch(
        context_of(context), inputs, [(int(s), int(t)) for s, t in entries], least, most, options
    )


@overload
def register(
    source: Any,
    target: Any,
    voxel_size: float | None = ...,
    *,
    quality: int | None = ...,
    seed: int | None = ...,
    prior: RegistrationPrior | None = ...,
    scale: None = ...,
    source_viewpoint: Any = ...,
    target_viewpoint: Any = ...,
    options: RegistrationOptions | None = ...,
    time_budget_ms: float | None = ...,
    context: Context | None = ...,
) -> RegistrationResult: ...
@overload
def register(
    source: Any,
    target: Any,
    voxel_size: float | None = ...,
    *,
    quality: int | None = ...,
    seed: int | None = ...,
    scale: Any,
    source_viewpoint: Any = ...,
    target_viewpoint: Any = ...,
    options: RegistrationOptions | None = ...,
    context: Context | None = ...,
) -> ScaledResult: ...
def register(
    source: Any,
    target: Any,
    voxel_size: float | None = None,
    *,
    quality: int | None = None,
    seed: int | None = None,
    prior: RegistrationPrior | None = None,
    scale: Any = None,
    source_viewpoint: Any = None,
    target_viewpoint: Any = None,
    options: RegistrationOptions | None = None,
    time_budget_ms: float | None = None,
    context: Context | None = None,
) -> RegistrationResult | ScaledResult:
    """Prepare two clouds and align them.

    Parameters
    ----------
    source, target : (N, 3) arrays, paths, or whatever `prepare` takes as points
        Metres, or any unit that voxel_size has, too. Pictures: ``gpureg register --image``.
    voxel_size : float, optional
        Edge of the downsampling voxel; every other length follows from it. Default: what
        `suggest_voxel_size` says; the result has it.
    quality : int, optional
        From 0, the fastest, to 10, the highest recall. Default: 5.
    seed : int, optional
        Same seed, same bits, for any threads and backend.
    prior : RegistrationPrior, optional
        What is known of the pose, in the frames of source and target; see `align`.
    scale : "free", (least, most) or float, optional
        Lengths of the target's unit per unit of the source. "free": searched; (least, most):
        searched in that range. voxel_size is in the target's unit. Not together with a prior or a
        time budget.
    source_viewpoint, target_viewpoint : (3,) or (V, 3) array, "auto", "none" or "model", optional
        Where the clouds were seen from: viewpoints of `prepare`.
    options : RegistrationOptions, optional
        Instead of voxel_size, quality and seed.
    time_budget_ms : float, optional
        Instead of quality: as much of it as this many milliseconds allow for the alignment, without
        preparation; see `align_within`. Not together with a prior.
    context : Context, optional

    Returns
    -------
    RegistrationResult, or ScaledResult where scale is given
        ``target_from_source`` moves points of the source into the target's frame, with the scale
        in it: ``p_target = R p_source + t``. As a condition, a result is its ``aligned``. Where it is
        not, ``explanation`` and ``advice`` say why and what to try.

    Warns
    -----
    UserWarning
        Where the extents suggest that the clouds have different units.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> points = np.random.default_rng(1).random((2000, 3))
    >>> turned = points @ np.diag([-1, -1, 1])
    >>> result = gpureg.register(points, turned, voxel_size=0.05)
    >>> np.round(result.target_from_source[:3, :3]) + 0.0
    array([[-1.,  0.,  0.],
           [ 0., -1.,  0.],
           [ 0.,  0.,  1.]])
    """
    options = checked(options, RegistrationOptions, "options")
    checked(prior, RegistrationPrior, "prior")
    if prior is not None and time_budget_ms is not None:
        raise TypeError("prior: not together with time_budget_ms")
    if scale is not None and not (prior is None and time_budget_ms is None):
        raise TypeError("scale: not together with a prior or time_budget_ms")
    ends = None if scale is None else scale_range(scale)
    if options is not None and not (voxel_size is None and quality is None and seed is None):
        raise TypeError("options: give either options, or voxel_size, quality and seed")
    if time_budget_ms is not None and quality is not None:
        raise TypeError("time_budget_ms: give either a time budget or a quality")
    if time_budget_ms is not None:
        time_budget_ms = milliseconds_of(time_budget_ms, "time_budget_ms")
    automatic = options is None and voxel_size is None
    if options is None:
        options = RegistrationOptions()
        if voxel_size is not None:
            options.voxel_size = number_of(voxel_size, "voxel_size")
        else:
            # Where the scale is searched, align_scaled_auto() chooses it; meshes need one before.
            asked = [(source, "source"), (target, "target")][ends is not None :]
            found = _core.suggest_voxel_size([host_points(cloud, name) for cloud, name in asked])
            if found.voxel_size > 0:  # else there is nothing to align, in voxels of any size
                options.voxel_size = found.voxel_size
        if quality is not None:
            options.quality = whole_number_of(quality, "quality", 0)
        if seed is not None:
            options.seed = seed
    context = context_of(context)
    clouds = []
    device = context.backend == "cuda" and ends is None
    for cloud, viewpoint, name in (
        (source, source_viewpoint, "source"),
        (target, target_viewpoint, "target"),
    ):
        clouds.append(core_cloud(cloud, None, None, viewpoint, options, name, device))
    options.validate()
    if ends is not None and automatic:
        return _core.align_scaled_auto(context, clouds[0], clouds[1], *ends, options)
    if ends is not None:
        return _core.align_scaled_batch(
            context, clouds, [(0, 1)], *ends, options, ["source", "target"]
        )[0]
    try:
        a, b = _core.prepare_batch(context, clouds, options, ["source", "target"])
    except InvalidArgument as error:
        question = _unit_question(clouds, True)
        raise InvalidArgument(f"{error}; {question}") if question else error from None
    if time_budget_ms is not None:
        result = _core.align_within(context, a, b, time_budget_ms, options).result
    else:
        result = _core.align(context, a, b, options, None, prior)
    questions = [_unit_question(clouds, not result.aligned)]
    if not result.aligned:
        questions += [_not_finite(a, "source"), _not_finite(b, "target")]
    for question in filter(None, questions):
        warnings.warn(question, UserWarning, stacklevel=2)
    return result


def _not_finite(cloud: PreparedCloud, name: str) -> str:
    """Say how many points of a cloud are not finite, where nearly all are not."""
    missing, points = cloud.statistics.invalid_points, cloud.statistics.input_points
    if missing == 0 or 10 * missing < 9 * points:
        return ""
    return f"{missing} of the {points} points of the {name} are not finite"


def _unit_question(clouds: list[Any], failed: bool) -> str:
    """Ask whether the units of both clouds differ; empty on the device, and where they need not."""
    source, target = (cloud[0] for cloud in clouds)
    if not (isinstance(source, np.ndarray) and isinstance(target, np.ndarray)):
        return ""
    return _core.question_units(source, target, failed)
