# SPDX-License-Identifier: BSD-3-Clause
"""Where in a map a scan is, or that it is not there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import CoreCloud, core_cloud, float64, several
from ._contexts import checked, context_of
from ._core import (
    ChangeOptions,
    ChangeResult,
    Context,
    FindOptions,
    FindResult,
    LocateOptions,
    LocateResult,
    MapOptions,
    PreparedMap,
    RegistrationOptions,
    load_map,
)
from ._map import Map
from .fragments import FragmentSet


def _set_of(scans: Any, name: str) -> FragmentSet | list[Any]:
    if isinstance(scans, str | os.PathLike) and _core.names_scans(os.fsencode(scans)):
        return FragmentSet.from_directory(scans)
    return scans if isinstance(scans, FragmentSet) else several(scans, name)


def _load(scans: FragmentSet | list[Any], options: MapOptions, name: str, k: int) -> CoreCloud:
    if isinstance(scans, FragmentSet):
        return scans.load(k, options)
    return core_cloud(scans[k], None, None, None, options, f"{name}[{k}]")


def prepare_map(
    clouds: Any,
    poses: Any = None,
    *,
    options: MapOptions | None = None,
    context: Context | None = None,
) -> PreparedMap:
    """Make a map that scans are located in.

    Parameters
    ----------
    clouds : cloud; if poses are given a sequence of scans, a folder or a FragmentSet
        Each whatever `prepare` takes as points. Scans that know where they were seen from (by
        cameras.txt, by the viewpoints of a `PointCloud`, or at the origin of their frame) are best:
        what was seen through tells places apart that look alike.
    poses : Map or (N, 4, 4) array, optional
        A `Map` of these scans: its largest island. Or ``map_from_scan`` of each scan, all in one
        frame; those that are NaN are left out. None: clouds is one cloud in the frame of the map.
    options : MapOptions, optional
        Default: voxels of 5 cm.
    context : Context, optional

    Returns
    -------
    PreparedMap
        Immutable. ``save(path)`` writes it, `load_map` reads it.

    Raises
    ------
    ValueError
        Naming the scan whose pose is no rigid motion; for a voxel size that does not fit; for a
        `Map` without an island.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> room = np.random.default_rng(1).random((20000, 3)) * [4, 3, 2]
    >>> map = gpureg.prepare_map(room, options=gpureg.MapOptions(voxel_size=0.1))
    >>> map.tiles
    1
    """
    options = checked(options, MapOptions, "options") or MapOptions()
    context = context_of(context)
    if poses is None:
        cloud = core_cloud(clouds, None, None, None, options, "clouds")
        return _core.make_map(context, [cloud], None, options)
    scans = _set_of(clouds, "clouds")
    matrices = _largest_island(poses) if isinstance(poses, Map) else float64(poses, "poses")
    if matrices.shape != (len(scans), 4, 4):
        raise ValueError(
            f"poses: expected shape ({len(scans)}, 4, 4), one for each scan, got {np.shape(poses)}"
        )
    placed = np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2)))

    def inputs() -> Iterator[CoreCloud]:  # one scan in memory at a time
        for k in placed:
            yield _load(scans, options, "clouds", int(k))

    return _core.make_map(context, inputs(), matrices[placed], options)


def _largest_island(map: Map) -> npt.NDArray[np.float64]:
    if not map.islands:
        raise ValueError("poses: the map has no island")
    poses = map.poses
    poses[[scan.island != 0 for scan in map.scans]] = np.nan
    return poses


def _vector(value: Any, name: str) -> npt.NDArray[np.float64]:
    vector = float64(value, name)
    if vector.shape != (3,):
        raise ValueError(f"{name}: expected shape (3,), got {vector.shape}")
    return vector


def locate_batch(
    scans: Any,
    map: PreparedMap,
    *,
    scan_up: Any = None,
    map_up: Any = (0.0, 0.0, 1.0),
    max_angle: float = 10.0,
    near: tuple[Any, float] | None = None,
    options: LocateOptions | None = None,
    context: Context | None = None,
) -> list[LocateResult]:
    """`locate` for many scans at once: the same results, and each tile is prepared once.

    scans: a sequence, a path as for `FragmentSet.from_directory`, or a `FragmentSet`.
    """
    map = checked(map, PreparedMap, "map")
    options = checked(options, LocateOptions, "options") or LocateOptions(
        registration=RegistrationOptions(voxel_size=map.options.voxel_size)
    )
    context = context_of(context)
    clouds = _set_of(scans, "scans")
    names = (
        list(clouds.names)
        if isinstance(clouds, FragmentSet)
        else [f"scans[{k}]" for k in range(len(clouds))]
    )
    inputs = [_load(clouds, map.options, "scans", k) for k in range(len(clouds))]
    up = (
        None
        if scan_up is None
        else (_vector(scan_up, "scan_up"), _vector(map_up, "map_up"), float(max_angle))
    )
    place = None if near is None else (_vector(near[0], "near"), float(near[1]))
    return _core.locate(context, inputs, map, options, up, place, names)


def locate(
    scan: Any,
    map: PreparedMap,
    *,
    scan_up: Any = None,
    map_up: Any = (0.0, 0.0, 1.0),
    max_angle: float = 10.0,
    near: tuple[Any, float] | None = None,
    options: LocateOptions | None = None,
    context: Context | None = None,
) -> LocateResult:
    """Find the pose of a scan in a map, or say that it is not there.

    Parameters
    ----------
    scan
        Whatever `prepare` takes as points.
    map : PreparedMap
        Of `prepare_map` or `load_map`.
    scan_up, map_up : (3,) arrays, optional
        The vertical direction in both, and by how many degrees it may be off: max_angle.
    near : ((x, y, z), radius), optional
        Rough position of the origin of the scan's frame in the map, metres.
    options : LocateOptions, optional
        ``registration`` has the voxel size of the map.
    context : Context, optional

    Returns
    -------
    LocateResult
        ``status`` is 'found', 'ambiguous' (places that look alike) or 'not_found'; ``poses`` has the
        candidates, ``absent_probability`` the probability that none of them is correct.

    Raises
    ------
    ValueError
        For a scan that looks as if it was in another unit than the map, and options of another
        voxel size.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> room = np.random.default_rng(1).random((20000, 3)) * [4, 3, 2]
    >>> map = gpureg.prepare_map(room, options=gpureg.MapOptions(voxel_size=0.1))
    >>> gpureg.locate(np.random.default_rng(2).random((3000, 3)) * 3, map).status
    'not_found'
    """
    return locate_batch(
        [scan],
        map,
        scan_up=scan_up,
        map_up=map_up,
        max_angle=max_angle,
        near=near,
        options=options,
        context=context,
    )[0]


#: Names of the labels of a `ChangeResult`, by number.
CHANGE_LABELS = ("same", "new", "gone", "occluded", "not_observed")


def change(
    scan: Any,
    map: PreparedMap,
    map_from_scan: Any = None,
    *,
    options: ChangeOptions | None = None,
    context: Context | None = None,
) -> ChangeResult | None:
    """Tell which points of a scan are new, and which of a map are gone.

    A point is new or gone only where the other cloud saw through it: between a sensor position and
    the surface behind. In a map without sensor positions, what stands before its surfaces as seen
    from the scan is new.

    Parameters
    ----------
    scan
        Whatever `prepare` takes as points.
    map : PreparedMap
        Of `prepare_map` or `load_map`. Those of scans with poses know from where they were seen.
    map_from_scan : (4, 4) array, optional
        Pose of the scan, which is refined. None: the scan is located first.
    options : ChangeOptions, optional
    context : Context, optional

    Returns
    -------
    ChangeResult or None
        Labels and probabilities of every point of both; None if the scan was not found.

    Raises
    ------
    ValueError
        For a pose that is no rigid motion, and a scan that looks as if it was in another unit.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> room = np.random.default_rng(1).random((20000, 3)) * [4, 3, 2]
    >>> map = gpureg.prepare_map(room, options=gpureg.MapOptions(voxel_size=0.1))
    >>> result = gpureg.change(room, map, np.eye(4))
    >>> gpureg.CHANGE_LABELS[result.scan_labels[0]]
    'same'
    """
    map = checked(map, PreparedMap, "map")
    options = checked(options, ChangeOptions, "options") or ChangeOptions()
    context = context_of(context)
    if map_from_scan is None:
        where = locate(scan, map, context=context)
        if not where.found:
            return None
        map_from_scan = where.map_from_scan
    pose = float64(map_from_scan, "map_from_scan")
    if pose.shape != (4, 4):
        raise ValueError(f"map_from_scan: expected shape (4, 4), got {pose.shape}")
    cloud = core_cloud(scan, None, None, None, map.options, "scan")
    return _core.find_changes(context, cloud, map, pose, options)


# Meshes get as many samples as any part needs, whatever their unit.
_ANY_SCALE = FindOptions(voxel_size=0)


def find(
    part: Any,
    scene: Any,
    *,
    part_normals: Any = None,
    scene_viewpoints: Any = None,
    options: FindOptions | None = None,
    context: Context | None = None,
) -> FindResult:
    """Find the instances of a known part in a scene: bin picking, templates, furniture in rooms.

    Parameters
    ----------
    part
        Whatever `prepare` takes as points: a mesh (best), or a scan of the part.
    scene
        The same, in the unit of the part: a scan with its sensor at the origin of its frame, or with
        scene_viewpoints.
    part_normals : (N, 3) array, optional
        That point outwards: the part is a model, as a mesh is.
    scene_viewpoints : (V, 3) or (3,) array, "auto" or "none", optional
        Sensor positions in the scene's frame, as for `prepare`.
    options : FindOptions, optional
    context : Context, optional

    Returns
    -------
    FindResult
        ``instances``: each with ``scene_from_part``, a confidence and its evidence. Nothing found is a
        status, not an exception.

    Raises
    ------
    ValueError
        For a voxel size that does not suit the part, and a scene that must be in another unit.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> part = np.random.default_rng(1).random((2000, 3))
    >>> gpureg.find(part, np.zeros((0, 3))).status
    'too_few_scene_points'
    """
    options = checked(options, FindOptions, "options") or FindOptions()
    context = context_of(context)
    model = None if part_normals is None else "model"
    of_part = core_cloud(part, part_normals, None, model, _ANY_SCALE, "part")
    of_scene = core_cloud(scene, None, None, scene_viewpoints, _ANY_SCALE, "scene")
    return _core.find(context, of_part, of_scene, options)


__all__ = ["CHANGE_LABELS", "change", "find", "load_map", "locate", "locate_batch", "prepare_map"]
