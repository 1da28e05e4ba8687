# SPDX-License-Identifier: BSD-3-Clause
"""Clouds made ready: downsampled, with normals and features, once for all pairs that they take part
in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from . import _core
from ._arrays import core_cloud, several
from ._contexts import checked, context_of
from ._core import Context, PreparedCloud, PrepareOptions


def prepare(
    points: Any,
    normals: Any = None,
    features: Any = None,
    *,
    viewpoints: Any = None,
    options: PrepareOptions | None = None,
    context: Context | None = None,
) -> PreparedCloud:
    """Downsample a cloud, compute normals and features, and build its search grid.

    Parameters
    ----------
    points : (N, 3) array, path, PointCloud or Open3D point cloud
        Metres, any real dtype and layout: numpy, DLPack (torch, jax, ...),
        ``__cuda_array_interface__`` (cupy, ...) or nested lists. float32 rows are read in place;
        everything else is copied once, to float32. Rows with NaN or infinity are dropped and
        counted. What is on the context's GPU as float32, float16 or bfloat16 never leaves it.
        float64 coordinates too large for float32 (those of a map) lose nothing: their
        centre is taken off first and put back into results.
    normals : (N, 3) array, optional
        Normals are computed; these, of any length, say which side of the surface they are on. Zeros
        and NaN mean unknown.
    features : (N, D) array, optional
        Features of your own instead of FPFH, 1 <= D <= 4096.
    viewpoints : (V, 3) array, optional
        Sensor positions in the cloud's frame, towards which normals are turned where none are
        given, and from which free space was seen. Given normals that face away from all of them are
        turned round, unless more than an eighth do: then a UserWarning says so, as the viewpoints
        are most likely in another frame, and count as evidence against correct poses. Default: the origin, or
        none where normals are given.
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
    options = checked(options, PrepareOptions, "options") or PrepareOptions()
    context = context_of(context)
    cloud = core_cloud(
        points, normals, features, viewpoints, options, device=context.backend == "cuda"
    )
    return _core.prepare_batch(context, [cloud], options)[0]


def prepare_batch(
    clouds: Sequence[Any],
    *,
    options: PrepareOptions | None = None,
    context: Context | None = None,
) -> list[PreparedCloud]:
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
    options = checked(options, PrepareOptions, "options") or PrepareOptions()
    context = context_of(context)
    device = context.backend == "cuda"
    inputs = [
        core_cloud(cloud, None, None, None, options, f"clouds[{k}]", device)
        for k, cloud in enumerate(several(clouds, "clouds"))
    ]
    return _core.prepare_batch(
        context, inputs, options, [f"clouds[{k}]" for k in range(len(inputs))]
    )


def check_prepared(cloud: Any, name: str) -> None:
    if not isinstance(cloud, PreparedCloud):
        shape = f" of shape {cloud.shape}" if hasattr(cloud, "shape") else ""
        raise TypeError(
            f"{name}: expected a PreparedCloud, got {type(cloud).__name__}{shape}; call prepare(), or register() for raw points"
        )


def prepared(
    fragments: Sequence[Any], options: PrepareOptions, context: Context
) -> list[PreparedCloud]:
    """Those that are not prepared yet, prepared together; a cloud's place stays its own."""
    raw = [k for k, cloud in enumerate(fragments) if not isinstance(cloud, PreparedCloud)]
    device = context.backend == "cuda"
    inputs = [
        core_cloud(fragments[k], None, None, None, options, f"fragments[{k}]", device) for k in raw
    ]
    clouds = list(fragments)
    for k, cloud in zip(
        raw, _core.prepare_batch(context, inputs, options, [f"fragments[{k}]" for k in raw])
    ):
        clouds[k] = cloud
    return clouds
