# SPDX-License-Identifier: BSD-3-Clause
"""Clouds made ready: downsampled, with normals and features, once for all pairs that they take part
in.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

from . import _core
from ._arrays import CoreCloud, core_cloud, several
from ._contexts import checked, context_of
from ._core import Context, IoError, PreparedCloud, RegistrationOptions
from ._progress import Progress, Report, batch_progress
from .fragments import FragmentSet

_TOGETHER = 32  # clouds per call if progress is shown: enough to fill a device
_PIECE_SECONDS = 0.4  # on the CPU


def prepare(
    points: Any,
    normals: Any = None,
    features: Any = None,
    *,
    viewpoints: Any = None,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
) -> PreparedCloud:
    """Downsample a cloud, compute normals and features, and build its search grid.

    Parameters
    ----------
    points : (N, 3) array, path, PointCloud, mesh or Open3D point cloud
        A fourth column, intensities as of KITTI, is not used. A path: what `read_point_cloud` reads, or a mesh (STL, OBJ, OFF, PLY
        with faces). Of these meshes, of trimesh's and of Open3D's, points of the faces are taken,
        half a voxel apart, with the normals of the faces. Metres, any real dtype and layout: numpy, DLPack (torch, jax, ...),
        ``__cuda_array_interface__`` (cupy, ...) or nested lists. float32 rows are read in place;
        everything else is copied once, to float32. Rows with NaN or infinity are dropped and
        counted. What is on the context's GPU as float32, float16 or bfloat16 stays there; only to
        infer viewpoints that are neither given nor declared unknown are points copied to the host.
        Scans of 2-D scanners are recognised in host memory only.
        float64 coordinates too large for float32 (those of a map) lose nothing: their
        centre is taken off first and put back into results.
    normals : (N, 3) array, optional
        Normals are computed; these, of any length, say which side of the surface they are on. Zeros
        and NaN mean unknown.
    features : (N, D) array, optional
        Features of your own instead of FPFH, 1 <= D <= 4096.
    viewpoints : (V, 3) or (3,) array, "auto", "none" or "model", optional
        Sensor positions in the cloud's frame, towards which normals are turned if none are
        given, and from which free space was seen. Given normals that face away from all of them are
        turned round, unless more than an eighth do: then a UserWarning says so, as the viewpoints
        are most likely in another frame, and count as evidence against correct poses. "auto", the
        default: the origin if the surfaces agree with it, else unknown; none if normals are
        given. "none": unknown. "model": seen from everywhere, with given normals that point outwards,
        as of a sampled mesh, which needs no word. ``statistics.viewpoint`` of the cloud has the decision. With an
        unknown viewpoint there is no free space, and alignments try both sides of the surfaces.
    options : RegistrationOptions, optional
        Those of the alignment: ``voxel_size`` and ``prepare`` are used.
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
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    context = context_of(context)
    cloud = core_cloud(
        points, normals, features, viewpoints, options, device=context.backend == "cuda"
    )
    return _core.prepare_batch(context, [cloud], options)[0]


def prepare_batch(
    clouds: Sequence[Any],
    *,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
    progress: Progress = False,
) -> list[PreparedCloud]:
    """`prepare` for many clouds at once: the same results, and faster on a GPU.

    Parameters
    ----------
    clouds : sequence
        Each whatever `prepare` takes as points.
    options, context
        As for `prepare`.
    progress : bool or callable
        True: a bar of tqdm, if installed. A callable gets (clouds done, clouds).

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> rng = np.random.default_rng(1)
    >>> [len(c) > 0 for c in gpureg.prepare_batch([rng.random((500, 3)), rng.random((400, 3))])]
    [True, True]
    """
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    context = context_of(context)
    clouds = several(clouds, "clouds")
    names = [f"clouds[{k}]" for k in range(len(clouds))]
    with batch_progress(progress, "preparing", len(clouds), unit="cloud") as report:
        return _prepare(clouds, names, options, context, report)


def _prepare(
    clouds: Sequence[Any],
    names: Sequence[str],
    options: RegistrationOptions,
    context: Context,
    report: Report | None,
) -> list[PreparedCloud]:
    """At once, or if somebody looks on in pieces. Each cloud is read with its piece."""

    def load(k: int) -> CoreCloud:
        device = context.backend == "cuda"
        return core_cloud(clouds[k], None, None, None, options, names[k], device)

    if report is None:
        return _core.prepare_batch(context, [load(k) for k in range(len(clouds))], options, names)
    out: list[PreparedCloud] = []
    report(0)
    for piece in pieces(len(clouds), context):
        out += _core.prepare_batch(
            context, [load(k) for k in piece], options, [names[k] for k in piece]
        )
        report(len(out))
    return out


def pieces(count: int, context: Context, most: int = _TOGETHER) -> Iterator[range]:
    """The numbers below count in pieces that take a fraction of a second each on the CPU; measures
    the time between its pieces.
    """
    size = 1 if context.backend == "cpu" else most
    begin = 0
    while begin < count:
        start = time.monotonic()
        end = min(count, begin + size)
        yield range(begin, end)
        seconds = max(1e-6, time.monotonic() - start)
        if context.backend == "cpu":
            size = max(1, min(most, int(_PIECE_SECONDS * (end - begin) / seconds)))
        begin = end


def check_prepared(cloud: Any, name: str) -> None:
    if not isinstance(cloud, PreparedCloud):
        shape = f" of shape {cloud.shape}" if hasattr(cloud, "shape") else ""
        raise TypeError(
            f"{name}: expected a PreparedCloud, got {type(cloud).__name__}{shape}; call prepare(), or register() for raw points"
        )


def prepared(
    fragments: Sequence[Any], options: RegistrationOptions, context: Context, progress: bool
) -> list[PreparedCloud]:
    """Those that are not prepared yet, prepared together; a cloud's place stays its own."""
    raw = [k for k, cloud in enumerate(fragments) if not isinstance(cloud, PreparedCloud)]
    clouds = list(fragments)
    names = [f"fragments[{k}]" for k in raw]
    with batch_progress(progress and bool(raw), "preparing", len(raw), unit="cloud") as report:
        done = _prepare([fragments[k] for k in raw], names, options, context, report)
    for k, cloud in zip(raw, done):
        clouds[k] = cloud
    return clouds


def usable_fragments(
    fragments: FragmentSet,
    options: RegistrationOptions,
    context: Context,
    progress: Progress,
    unusable: dict[int, str],
) -> list[PreparedCloud]:
    """Prepared. unusable gets the positions of those that cannot be, and why; raises IoError if
    fewer than two are left.
    """
    with batch_progress(progress, "preparing", len(fragments), unit="cloud") as report:
        prepared = _core.prepare_set(context, fragments._core(), options, report)
    clouds = []
    for k, cloud in enumerate(prepared):
        if isinstance(cloud, str):
            unusable[k] = cloud
        else:
            clouds.append(cloud)
    if unusable and len(clouds) < 2:
        raise IoError(f"fragments: fewer than two can be used: {next(iter(unusable.values()))}")
    return clouds
