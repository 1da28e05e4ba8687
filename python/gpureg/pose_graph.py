# SPDX-License-Identifier: BSD-3-Clause
"""Robust SE(3) pose graphs: which loops are correct, and where the scans are.

from gpureg import pose_graph
graph = pose_graph.read_g2o("graph.g2o")
result = pose_graph.optimize(graph)
result.world_from_node, result.accepted        # (N, 4, 4), (M,)
"""

from __future__ import annotations

import os
from typing import Any, Literal, Union

import numpy as np

from . import _core
from ._core import PoseGraph, PoseGraphResult

Path = Union[str, "os.PathLike[str]"]


def add_node(
    graph: PoseGraph, id: int, world_from_node: Any = None, *, fixed: bool = False
) -> None:
    """Add a node.

    Parameters
    ----------
    world_from_node : (4, 4) array, optional
        Metres. None: computed from the edges.
    fixed : bool
        The node keeps its pose, which it then needs.
    """
    pose = None if world_from_node is None else np.asarray(world_from_node, np.float64)
    graph.add_node(id, pose, fixed)


def add_edge(
    graph: PoseGraph,
    source: int,
    target: int,
    target_from_source: Any,
    *,
    information: Any = None,
    kind: Literal["odometry", "loop"] = "loop",
    confidence: float = 0.5,
) -> int:
    """Add a measured relative pose; returns its position.

    Parameters
    ----------
    target_from_source : (4, 4) array
        p_target = target_from_source @ p_source, metres.
    information : (6, 6) array, optional
        Inverse covariance of the right perturbation: rotation (radians) first, then translation
        (metres), in the source's frame. None: the noise of the library's options.
    kind : 'odometry' or 'loop'
        Odometry is trusted; a loop may be rejected.
    confidence : float
        Prior probability that a loop is correct; 0.5 says nothing.

    Examples
    --------
    >>> import numpy as np
    >>> from gpureg import pose_graph
    >>> graph = pose_graph.PoseGraph()
    >>> for k in range(3):
    ...     pose_graph.add_node(graph, k)
    >>> step = np.eye(4)
    >>> step[0, 3] = 1
    >>> for k in range(2):
    ...     _ = pose_graph.add_edge(graph, k + 1, k, step, kind="odometry")
    >>> pose_graph.optimize(graph).world_from_node[:, 0, 3].round(6).tolist()
    [0.0, 1.0, 2.0]
    """
    matrix = None if information is None else np.asarray(information, np.float64)
    pose = np.asarray(target_from_source, np.float64)
    return graph.add_edge(source, target, pose, matrix, kind, confidence)


def add_mode(
    graph: PoseGraph,
    edge: int,
    target_from_source: Any,
    *,
    information: Any = None,
    confidence: float = 0.5,
) -> None:
    """Add a further mode to the loop at that position: at most one mode of an edge counts."""
    matrix = None if information is None else np.asarray(information, np.float64)
    graph.add_mode(edge, np.asarray(target_from_source, np.float64), matrix, confidence)


def optimize(
    graph: PoseGraph,
    *,
    robust: Literal["none", "gnc", "line_process"] = "gnc",
    loopsmart: bool = False,
    threads: int = 0,
) -> PoseGraphResult:
    """Estimate the poses of a graph and decide which loops are correct.

    Parameters
    ----------
    robust : 'none', 'gnc' or 'line_process'
        How wrong loops are kept out.
    loopsmart : bool
        The constants of the LoopSmart paper instead, which need odometry that is nearly exact.
    threads : int
        0: one per core. The result does not depend on it.

    Raises
    ------
    InvalidArgument
        A ValueError naming field, place and value.
    """
    return _core.optimize_pose_graph(graph, robust, loopsmart, threads)


def read_g2o(path: Path, *, radians: bool = False) -> PoseGraph:
    """Read VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX. Consecutive ids are odometry, others loops.

    Parameters
    ----------
    radians : bool
        The rotation's information is per radian, as GTSAM writes it, and not per unit of the
        quaternion vector, as g2o does.
    """
    return _core.read_g2o(os.fspath(path), radians)


def write_g2o(
    path: Path, graph: PoseGraph, result: PoseGraphResult | None = None, *, radians: bool = False
) -> None:
    """Write a graph; with a result its poses and chosen modes, without the rejected loops."""
    _core.write_g2o(os.fspath(path), graph, result, radians)


def read_open3d(path: Path) -> PoseGraph:
    """Read an Open3D PoseGraph (JSON): "uncertain" edges are loops, others odometry."""
    return _core.read_open3d_pose_graph(os.fspath(path))


def write_open3d(path: Path, graph: PoseGraph, result: PoseGraphResult | None = None) -> None:
    """Write an Open3D PoseGraph (JSON); the ids must be 0, 1, ..."""
    _core.write_open3d_pose_graph(os.fspath(path), graph, result)


__all__ = [
    "PoseGraph",
    "PoseGraphResult",
    "add_edge",
    "add_mode",
    "add_node",
    "optimize",
    "read_g2o",
    "read_open3d",
    "write_g2o",
    "write_open3d",
]
