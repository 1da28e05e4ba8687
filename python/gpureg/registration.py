# SPDX-License-Identifier: BSD-3-Clause
"""The door: prepare each cloud once, align any pairs of them."""

from __future__ import annotations

import os
import threading
from typing import Any, Callable, List, Literal, Optional, Sequence, Union

from . import _core
from ._arrays import core_cloud, host_points, index_pairs
from ._core import BackendUnavailable, Context, PreparedCloud, PrepareOptions, RegistrationOptions, RegistrationPrior, RegistrationResult, TimedResult, VoxelSizeSuggestion
from ._progress import Progress, batch_progress

_default: Optional[Context] = None
_default_lock = threading.Lock()


def default_context() -> Context:
    """The context that calls without one use: CUDA where a device can be used, else all CPU threads.

    Made at the first call, once per process. A forked child makes its own, on the CPU; CUDA does not
    survive a fork, nor do contexts of your own, as no thread does.
    """
    global _default
    with _default_lock:
        if any(context is not None and context.backend == "cuda" for context in _abandoned):
            raise BackendUnavailable(
                "CUDA does not survive a fork: start processes by multiprocessing's 'spawn' or 'forkserver', or name a context of the CPU"
            )
        if _default is None:
            _default = Context.best()
        return _default


def _forget_default() -> None:
    global _default, _default_lock
    _default_lock = threading.Lock()
    # The parent's threads do not exist here: joining them would wait for ever, so it is never freed.
    _abandoned.append(_default)
    _default = None


_abandoned: List[Optional[Context]] = []
os.register_at_fork(after_in_child=_forget_default)


class BatchInterrupted(KeyboardInterrupt):
    """Ctrl-C in the middle of a batch. What was done by then is in `results`.

    Attributes
    ----------
    results : list of RegistrationResult
        One per pair; pairs never tried have status "skipped".
    """

    def __init__(self, results: List[RegistrationResult]) -> None:
        done = sum(result.status != "skipped" for result in results)
        super().__init__(f"interrupted after {done} of {len(results)} pairs; they are in .results")
        self.results = results


def prepare(
    points: Any,
    normals: Any = None,
    features: Any = None,
    *,
    viewpoints: Any = None,
    options: Optional[PrepareOptions] = None,
    context: Optional[Context] = None,
) -> PreparedCloud:
    """Downsample a cloud, compute normals and features, and build its search grid.

    Parameters
    ----------
    points : (N, 3) array, path, PointCloud or Open3D point cloud
        Metres, any real dtype and layout: numpy, DLPack (torch, jax, ...),
        ``__cuda_array_interface__`` (cupy, ...) or nested lists. float32 rows are read in place;
        everything else is copied once, to float32. Rows with NaN or infinity are dropped and
        counted. What is on the context's GPU as float32, float16 or bfloat16 never leaves it. float64
        coordinates too large for float32 (those of a map) lose nothing: their
        centre is taken off first and put back into results.
    normals : (N, 3) array, optional
        Normals are computed; these, of any length, say which side of the surface they are on. Zeros
        and NaN mean unknown.
    features : (N, D) array, optional
        Features of your own instead of FPFH, 1 <= D <= 4096.
    viewpoints : (V, 3) array, optional
        Sensor positions in the cloud's frame, towards which normals are turned where none are given.
        Default: the origin.
    options : PrepareOptions, optional
        Must suit the options of the alignment: see ``RegistrationOptions.prepare``.
    context : Context, optional
        Default: `default_context()`.

    Returns
    -------
    PreparedCloud
        Resides in the context's memory. Immutable; threads may share it.

    Raises
    ------
    TypeError, ValueError
        Naming the argument and its type or shape.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> points = np.random.default_rng(1).random((2000, 3))
    >>> cloud = gpureg.prepare(points)
    >>> cloud.feature_dimension, cloud.statistics.input_points
    (33, 2000)
    """
    return prepare_batch(
        [_Parts(points, normals, features, viewpoints)], options=options, context=context
    )[0]


class _Parts:
    """A cloud given as several arguments."""

    def __init__(self, points: Any, normals: Any, features: Any, viewpoints: Any) -> None:
        self.parts = (points, normals, features, viewpoints)


def prepare_batch(
    clouds: Sequence[Any],
    *,
    options: Optional[PrepareOptions] = None,
    context: Optional[Context] = None,
) -> List[PreparedCloud]:
    """`prepare` for many clouds at once: the same results, and faster on a GPU.

    Parameters
    ----------
    clouds : sequence
        Each whatever `prepare` takes as points.
    options, context
        As for `prepare`.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> rng = np.random.default_rng(1)
    >>> [len(c) > 0 for c in gpureg.prepare_batch([rng.random((500, 3)), rng.random((400, 3))])]
    [True, True]
    """
    options = _checked(options, PrepareOptions, "options") or PrepareOptions()
    context = _context(context)
    device = context.backend == "cuda"
    single = len(clouds) == 1
    inputs = []
    for k, cloud in enumerate(clouds):
        points, normals, features, viewpoints = cloud.parts if isinstance(cloud, _Parts) else (cloud, None, None, None)
        name = "points" if single else f"clouds[{k}]"
        inputs.append(core_cloud(points, normals, features, viewpoints, options, name, device))
    return _core.prepare_batch(context, inputs, options)


def align(
    source: PreparedCloud,
    target: PreparedCloud,
    *,
    correspondences: Any = None,
    prior: Optional[RegistrationPrior] = None,
    options: Optional[RegistrationOptions] = None,
    context: Optional[Context] = None,
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
        (``target_from_source``, ``max_rotation`` degrees, ``max_translation`` of the source's middle):
        poses that contradict it are dropped. Not together with correspondences.
    options : RegistrationOptions, optional
    context : Context, optional
        Default: `default_context()`. Threads may share one: their calls take turns.

    Returns
    -------
    RegistrationResult
        ``target_from_source`` maps points of the source into the target's frame. Not aligned is a
        status with a reason, not an exception.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = gpureg.prepare(np.random.default_rng(1).random((2000, 3)))
    >>> result = gpureg.align(cloud, cloud)
    >>> result.status, bool(np.allclose(result.target_from_source, np.eye(4), atol=1e-3))
    ('aligned', True)
    """
    _check_prepared(source, "source")
    _check_prepared(target, "target")
    _checked(prior, RegistrationPrior, "prior")
    if prior is not None and correspondences is not None:
        raise TypeError("prior: not together with correspondences")
    if correspondences is not None:
        correspondences = index_pairs(correspondences, "correspondences", (len(source), len(target)))
    options = _checked(options, RegistrationOptions, "options") or RegistrationOptions()
    return _core.align(_context(context), source, target, options, correspondences, prior)


def align_within(
    source: PreparedCloud,
    target: PreparedCloud,
    milliseconds: float,
    *,
    options: Optional[RegistrationOptions] = None,
    context: Optional[Context] = None,
) -> TimedResult:
    """`align` with as much quality as a time allows: the one thing that is not deterministic.

    Parameters
    ----------
    source, target : PreparedCloud
    milliseconds : float
        Wall time. Levels of quality are run upwards, and none that would end later is started; the
        lowest is always run. What is sure early ends early.
    options : RegistrationOptions, optional
        What `RegistrationOptions.with_quality` sets is set per level.
    context : Context, optional

    Returns
    -------
    TimedResult
        ``result`` is that of `align` with ``options.with_quality(quality)``, bit for bit.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = gpureg.prepare(np.random.default_rng(1).random((2000, 3)))
    >>> timed = gpureg.align_within(cloud, cloud, 10000)
    >>> timed.result.status, timed.quality <= timed.highest_quality
    ('aligned', True)
    """
    _check_prepared(source, "source")
    _check_prepared(target, "target")
    options = _checked(options, RegistrationOptions, "options") or RegistrationOptions()
    return _core.align_within(_context(context), source, target, milliseconds, options)


def suggest_voxel_size(clouds: Sequence[Any]) -> VoxelSizeSuggestion:
    """A voxel size that leaves some thousand points of each cloud, and fits their spacing and noise.

    Parameters
    ----------
    clouds : sequence
        Each whatever `prepare` takes as points. At most 16, evenly chosen, are looked at.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> sphere = np.random.default_rng(1).normal(size=(50000, 3))
    >>> sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    >>> gpureg.suggest_voxel_size([sphere]).voxel_size
    0.06
    """
    return _core.suggest_voxel_size([host_points(cloud, f"clouds[{k}]") for k, cloud in enumerate(clouds)])


def align_batch(
    fragments: Sequence[Any],
    pairs: Any,
    *,
    priors: Optional[Sequence[RegistrationPrior]] = None,
    options: Optional[RegistrationOptions] = None,
    context: Optional[Context] = None,
    progress: Union[bool, Callable[[int, int], object]] = False,
) -> List[RegistrationResult]:
    """Align many pairs; each result equals that of `align` bit for bit.

    Parameters
    ----------
    fragments : sequence of PreparedCloud
        Or of whatever `prepare` takes as points; those are prepared with ``options.prepare``.
    pairs : (M, 2) integer array or list of pairs
        Rows (source, target): indices into fragments.
    priors : sequence of RegistrationPrior, optional
        One for each pair, see `align`; ``RegistrationPrior()`` where nothing is known.
    options : RegistrationOptions, optional
    context : Context, optional
    progress : bool or callable
        True: a bar of tqdm, where installed. A callable gets (pairs done, pairs) between chunks.

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
    options = _checked(options, RegistrationOptions, "options") or RegistrationOptions()
    context = _context(context)
    entries = index_pairs(pairs, "pairs", len(fragments))
    known = [] if priors is None else list(priors)
    for k, prior in enumerate(known):
        if not isinstance(prior, RegistrationPrior):
            raise TypeError(f"priors[{k}]: expected a RegistrationPrior, got {prior!r}")
    clouds = _prepared(fragments, options.prepare, context)
    with batch_progress(progress, "aligning", len(entries)) as report:
        results, error = _core.align_batch(context, clouds, entries, options, report, known)
    if isinstance(error, KeyboardInterrupt):
        raise BatchInterrupted(results) from None
    if error is not None:
        raise error
    return results


def register(
    source: Any,
    target: Any,
    voxel_size: Union[float, Literal["auto"], None] = None,
    *,
    quality: Optional[int] = None,
    seed: Optional[int] = None,
    options: Optional[RegistrationOptions] = None,
    time_budget_ms: Optional[float] = None,
    context: Optional[Context] = None,
) -> RegistrationResult:
    """Prepare two clouds and align them: the easy door.

    Parameters
    ----------
    source, target : (N, 3) arrays, paths, or whatever `prepare` takes as points
        Metres, or any unit that voxel_size has, too. Pictures: ``gpureg register --image``.
    voxel_size : float or "auto", optional
        Edge of the downsampling voxel; every other length follows from it. Default:
        ``PrepareOptions().voxel_size``, 0.05. "auto": what `suggest_voxel_size` says.
    quality : int, optional
        From 0, the fastest, to 10, which finds the most. Default: 5.
    seed : int, optional
        Same seed, same bits, on any machine.
    options : RegistrationOptions, optional
        Instead of the three before.
    time_budget_ms : float, optional
        Instead of quality: as much of it as so many milliseconds allow for the alignment, without
        preparation; see `align_within`.
    context : Context, optional

    Returns
    -------
    RegistrationResult

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
    options = _checked(options, RegistrationOptions, "options")
    if options is not None and not (voxel_size is None and quality is None and seed is None):
        raise TypeError("options: give either options, or voxel_size, quality and seed")
    if time_budget_ms is not None and quality is not None:
        raise TypeError("time_budget_ms: give either a time budget or a quality")
    if options is None:
        if voxel_size == "auto":
            suggestion = suggest_voxel_size([source, target])
            if suggestion.reason != "none":
                raise ValueError(f"voxel_size: 'auto', but {suggestion.explanation}")
            voxel_size = suggestion.voxel_size
        elif isinstance(voxel_size, str):
            raise TypeError(f"voxel_size: expected a number or 'auto', got {voxel_size!r}")
        options = RegistrationOptions.from_voxel_size(
            PrepareOptions().voxel_size if voxel_size is None else voxel_size, 5 if quality is None else quality
        )
        if seed is not None:
            options.hypothesis.seed = seed
    context = _context(context)
    clouds = []
    for cloud, name in ((source, "source"), (target, "target")):
        clouds.append(core_cloud(cloud, None, None, None, options.prepare, name, context.backend == "cuda"))
    options.validate()
    a, b = _core.prepare_batch(context, clouds, options.prepare)
    if time_budget_ms is not None:
        return _core.align_within(context, a, b, time_budget_ms, options).result
    return _core.align(context, a, b, options, None)


def _context(context: Optional[Context]) -> Context:
    return _checked(context, Context, "context") or default_context()


def _checked(value: Any, kind: Any, name: str) -> Any:
    if value is not None and not isinstance(value, kind):
        raise TypeError(f"{name}: expected a {kind.__name__}, got {value!r}")
    return value


def _check_prepared(cloud: Any, name: str) -> None:
    if not isinstance(cloud, PreparedCloud):
        shape = f" of shape {cloud.shape}" if hasattr(cloud, "shape") else ""
        raise TypeError(
            f"{name}: expected a PreparedCloud, got {type(cloud).__name__}{shape}; call prepare(), or register() for raw points"
        )


def _prepared(fragments: Sequence[Any], options: PrepareOptions, context: Context) -> List[PreparedCloud]:
    """Those that are not prepared yet, prepared together; a cloud's place stays its own."""
    raw = [k for k, cloud in enumerate(fragments) if not isinstance(cloud, PreparedCloud)]
    device = context.backend == "cuda"
    inputs = [core_cloud(fragments[k], None, None, None, options, f"fragments[{k}]", device) for k in raw]
    clouds = list(fragments)
    for k, cloud in zip(raw, _core.prepare_batch(context, inputs, options)):
        clouds[k] = cloud
    return clouds


__all__ = [
    "BatchInterrupted",
    "Progress",
    "align",
    "align_batch",
    "align_within",
    "default_context",
    "prepare",
    "prepare_batch",
    "register",
    "suggest_voxel_size",
]
