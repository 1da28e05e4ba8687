# SPDX-License-Identifier: BSD-3-Clause
"""Evidence and confidence for poses that another method proposes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import core_cloud, float64
from ._contexts import checked, context_of
from ._core import Context, PoseVerification, RegistrationOptions, ScaledVerification
from .preparation import prepared


def verify(
    source: Any,
    target: Any,
    poses: Any,
    *,
    refine: bool = False,
    search_alternatives: bool = True,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
) -> list[PoseVerification]:
    """Verify poses of another method: ICP, a learned network, odometry, an image loop.

    Parameters
    ----------
    source, target : PreparedCloud
        Or whatever `prepare` takes as points; those are prepared with the options.
    poses : (4, 4) or (K, 4, 4) array
        ``target_from_source`` of each pose, in the frames of source and target.
    refine : bool
        Refine every pose by ICP before it is verified.
    search_alternatives : bool
        Also align the pair, so that the confidence takes the alternatives into account, as that of
        `align` does. Without, the poses compete with each other only: faster, and too confident
        if the clouds overlap well in several poses.
    options : RegistrationOptions, optional
    context : Context, optional

    Returns
    -------
    list of PoseVerification
        One for each pose, in their order. A pose that `align` returned gets the evidence that it
        had there.

    Raises
    ------
    ValueError
        Naming the pose that is no rigid motion.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = gpureg.prepare(np.random.default_rng(1).random((2000, 3)))
    >>> beside = np.eye(4)
    >>> beside[0, 3] = 0.5
    >>> [v.confidence > 0.5 for v in gpureg.verify(cloud, cloud, [np.eye(4), beside])]
    [True, False]
    """
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    context = context_of(context)
    matrices = _matrices(poses, "poses")
    first, second = prepared([source, target], options, context, False)
    return _core.verify(context, first, second, matrices, options, refine, search_alternatives)


def verify_scaled(
    source: Any,
    target: Any,
    similarities: Any,
    *,
    refine: bool = False,
    search_alternatives: bool = True,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
) -> list[ScaledVerification]:
    """Verify similarities of another method: TEASER++, Umeyama's fit, a loop of a monocular run.

    Those of other scales compete with each other. Scales that nobody proposes are not searched:
    `register` with a scale does that.

    Parameters
    ----------
    source, target : points, on the host
        As for `register`; prepared with the options, the source at each scale.
    similarities : (4, 4) or (K, 4, 4) array
        p_target = M p_source; the upper left 3 x 3 of M is a rotation times the scale.
    refine : bool
        Refine every similarity, its scale too, before it is verified.
    search_alternatives : bool
        As for `verify`, at the scale of each similarity.
    options : RegistrationOptions, optional
        The voxel size is in the unit of the target.
    context : Context, optional

    Returns
    -------
    list of ScaledVerification
        One for each, in their order.

    Raises
    ------
    ValueError
        Naming the matrix that is no similarity.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> half = np.diag([0.5, 0.5, 0.5, 1])
    >>> [v.confidence > 0.5 for v in gpureg.verify_scaled(2 * cloud, cloud, [half, np.eye(4)])]
    [True, False]
    """
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    context = context_of(context)
    matrices = _matrices(similarities, "similarities")
    first = core_cloud(source, None, None, None, options, "source")
    second = core_cloud(target, None, None, None, options, "target")
    return _core.verify_scaled(
        context, first, second, matrices, options, refine, search_alternatives
    )


def _matrices(poses: Any, name: str) -> npt.NDArray[np.float64]:
    """(K, 4, 4), each with a last row of 0, 0, 0, 1."""
    matrices = float64(poses, name)
    if matrices.ndim == 2:
        matrices = matrices[None]
    if matrices.ndim != 3 or matrices.shape[1:] != (4, 4):
        raise ValueError(f"{name}: expected shape (4, 4) or (K, 4, 4), got {np.shape(poses)}")
    rows = np.abs(matrices[:, 3] - [0, 0, 0, 1]).max(axis=1, initial=0)
    for k in np.flatnonzero(~(rows <= 1e-6)):
        raise ValueError(
            f"{name}[{k}]: its last row is {matrices[k, 3].tolist()}, expected [0, 0, 0, 1]"
        )
    return matrices


__all__ = ["verify", "verify_scaled"]
