# SPDX-License-Identifier: BSD-3-Clause
"""Converts arrays, clouds and files to float32 rows, which the core takes.

Errors name the argument and the shape or type that it has.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import FindOptions, MapOptions, PointCloud, PreparedCloud, RegistrationOptions
from ._device import DeviceRows, device_rows, on_device, stream_of
from ._formats import read_foreign
from ._mesh import mesh_as_cloud

FloatArray = npt.NDArray[np.float32]
Rows = FloatArray | DeviceRows
#: (points, normals, features, viewpoints, origin, streams), all but the points may be None. With
#: streams, the first three are on a device, each written by the stream of its place.
#: viewpoints False: the viewpoint is unknown, and not to be inferred; True: the cloud is a model.
CoreCloud = tuple[
    Rows,
    Rows | None,
    Rows | None,
    FloatArray | bool | None,
    npt.NDArray[np.float64] | None,
    tuple[int, int, int] | None,
]

_HOST_DEVICES = (1, 3)  # DLPack's kDLCPU and kDLCUDAHost
# float32 must resolve this part of a voxel, or coordinates are moved before they become float32.
_FINE_VOXEL = 0.05  # of clouds that are stored before anybody says a voxel size
_PARTS_OF_VOXEL = 256
_MILLIMETRE = 1e-3  # what stands in for the voxel where points are kept as they are
# A cloud that float32 divides into so many steps is fine whatever its unit: a part in millimetres,
# three thousand of them away, say.
_STEPS = 1 << 17


def to_numpy(value: Any, name: str) -> npt.NDArray[Any]:
    """An array on the host that shares memory with value where that is possible.

    Raises ValueError for a masked array with masked entries: what they hold is not meant.
    """
    if isinstance(value, np.ma.MaskedArray):
        value = _unmasked(value, name)
    if isinstance(value, np.ndarray):
        return value
    if hasattr(value, "detach"):  # a tensor that is part of a graph refuses DLPack
        value = value.detach()
    if hasattr(value, "__dlpack_device__"):
        if value.__dlpack_device__()[0] not in _HOST_DEVICES:
            return _from_device(value, name)
        try:
            return np.from_dlpack(value)
        except (BufferError, RuntimeError, TypeError, ValueError) as error:
            raise TypeError(f"{name}: numpy cannot take this {_kind(value)}: {error}") from None
    if hasattr(value, "__cuda_array_interface__"):
        return _from_device(value, name)
    try:
        return np.asarray(value)
    except (TypeError, ValueError) as error:  # such as rows of different lengths
        raise TypeError(f"{name}: no array can be made of this {_kind(value)}: {error}") from None


def _unmasked(value: np.ma.MaskedArray[Any, Any], name: str) -> npt.NDArray[Any]:
    mask = np.ma.getmaskarray(value)
    if mask.any():
        row = int(np.argwhere(mask)[0][0])
        raise ValueError(
            f"{name}: row {row} is masked, as are {int(mask.sum())} entries; drop such rows first (numpy.ma.compress_rows) (shape {value.shape})"
        )
    return value.data


def float64(value: Any, name: str) -> npt.NDArray[np.float64]:
    """Numbers that are no coordinates of a cloud: poses, times, confidences."""
    return np.asarray(to_numpy(value, name), np.float64, order="C")


def _kind(value: Any) -> str:
    dtype = f" of {value.dtype}" if hasattr(value, "dtype") else ""
    return f"{type(value).__name__}{dtype}"


def _from_device(value: Any, name: str) -> npt.NDArray[Any]:
    """A copy on the host, by the means of the library that the array is from."""
    for method in ("cpu", "get", "copy_to_host"):  # torch, cupy, numba
        if hasattr(value, method):
            return np.asarray(getattr(value, method)())
    raise TypeError(f"{name}: no way to copy a {_kind(value)} from its device")


def matrix(value: Any, name: str, columns: int | None, rows: int | None = None) -> npt.NDArray[Any]:
    """Checks type and shape; returns the array as it is."""
    array = to_numpy(value, name)
    if (
        array.dtype == object and array.ndim == 0
    ):  # what numpy makes of None, dictionaries and generators
        raise TypeError(f"{name}: expected an array of numbers, got {_kind(value)}")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected numbers, got dtype {array.dtype} (shape {array.shape})")
    wanted = f"({'N' if rows is None else rows}, {'D' if columns is None else columns})"
    if array.ndim != 2 or (columns is not None and array.shape[1] != columns):
        raise ValueError(f"{name}: expected shape {wanted}, got {array.shape}")
    if rows is not None and array.shape[0] != rows:
        raise ValueError(f"{name}: expected shape {wanted}, one row per point, got {array.shape}")
    return array


def points_as_array(cloud: PointCloud, dtype: Any, copy: bool | None) -> npt.NDArray[Any]:
    """What numpy.asarray makes of a PointCloud."""
    if copy is False:
        raise ValueError("copy: the points of a cloud are always copied, expected None or True")
    return np.asarray(cloud.points, dtype)


def coordinates(value: Any, name: str) -> npt.NDArray[Any]:
    """(N, 3) coordinates; a fourth column is the intensity that a LiDAR measured."""
    array = to_numpy(value, name)
    if array.ndim == 2 and array.shape[1] == 4:
        array = array[:, :3]
    return matrix(value if array.dtype == object else array, name, 3)  # messages say what it is


def float_rows(array: npt.NDArray[Any], name: str) -> FloatArray:
    """float32 rows. No copy where they are that already, also with room between the rows."""
    size = array.itemsize
    if (
        array.dtype == np.float32
        and array.dtype.isnative
        and array.flags.aligned
        and (array.shape[1] <= 1 or array.strides[1] == size)
        and (
            array.shape[0] <= 1
            or (array.strides[0] % size == 0 and array.strides[0] >= size * array.shape[1])
        )
    ):
        return array
    with np.errstate(over="ignore"):
        rows = np.array(array, dtype=np.float32, order="C")
    if rows.dtype != array.dtype and array.dtype.itemsize > 4:
        lost = np.isfinite(array) & ~np.isfinite(rows)
        if lost.any():
            row = int(np.argwhere(lost)[0][0])
            raise ValueError(
                f"{name}: row {row} is {array[row].tolist()}, too large for float32 (shape {array.shape})"
            )
    return rows


def origin_of(points: npt.NDArray[Any], voxel_size: float) -> npt.NDArray[np.float64] | None:
    """What to take off coordinates that float32 is too coarse for; None where it is fine enough.

    Only types finer than float32 can hold such coordinates.
    """
    bounds = _bounds(points)
    if bounds is None:
        return None
    if _step(bounds[2]) * _PARTS_OF_VOXEL <= (voxel_size or _MILLIMETRE):
        return None
    return _middle(points)[0]


def _middle(points: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], float]:
    """Their median, rounded, and the longest side of the middle 90 %: single far points move
    neither.
    """
    finite = points[np.isfinite(points).all(axis=1)]
    sample = np.asarray(finite[:: len(finite) // 4096 + 1], np.float64)
    low, median, high = np.percentile(sample, [5, 50, 95], axis=0)
    return np.round(median), float((high - low).max())


def _bounds(
    points: npt.NDArray[Any],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], float] | None:
    """Lowest and highest coordinates, and the largest magnitude; None where casting to float32
    loses nothing, or is an error.
    """
    if points.dtype.itemsize <= 4 or len(points) == 0:
        return None
    finite = points[np.isfinite(points).all(axis=1)]
    if len(finite) == 0:
        return None
    low, high = finite.min(axis=0).astype(np.float64), finite.max(axis=0).astype(np.float64)
    largest = max(float(np.abs(low).max()), float(np.abs(high).max()))
    if largest > float(np.finfo(np.float32).max):
        return None  # an error that float_rows explains
    return low, high, largest


def _step(largest: float) -> float:
    """From one float32 to the next."""
    return float(np.spacing(np.float32(largest)))


def stored_cloud(
    points: Any, normals: Any, viewpoints: Any
) -> tuple[FloatArray, FloatArray | None, FloatArray | None, npt.NDArray[np.float64] | None]:
    """What a PointCloud holds: float32 rows, and the origin that was taken off points and
    viewpoints, or None.
    """
    raw = coordinates(points, "points")
    rows, bounds, origin = float_rows(raw, "points"), _bounds(raw), None
    if bounds is not None and not np.array_equal(rows, raw, equal_nan=True):
        step = _step(bounds[2])
        middle, spread = _middle(raw)
        if step * _PARTS_OF_VOXEL > _FINE_VOXEL and step * _STEPS > spread:
            origin, rows = middle, float_rows(raw - middle, "points")
    if normals is not None:
        normals = matrix(normals, "normals", 3)
        # As many as points, or none: that is how a cloud shows that it has none.
        normals = (
            float_rows(matrix(normals, "normals", 3, len(raw)), "normals") if len(normals) else None
        )
    if viewpoints is not None:
        views = _finite_viewpoints(_positions(viewpoints, "viewpoints"), "viewpoints")
        viewpoints = float_rows(views if origin is None else views - origin, "viewpoints")
    return rows, normals, viewpoints, origin


def _finite_viewpoints(value: Any, name: str) -> Any:
    rows = matrix(value, name, 3)
    finite = np.isfinite(rows)
    if not finite.all():
        row = int(np.argwhere(~finite)[0][0])
        raise ValueError(
            f"{name}: row {row} is {rows[row].tolist()}, expected finite coordinates (shape {rows.shape})"
        )
    return rows


def core_cloud(
    points: Any,
    normals: Any,
    features: Any,
    viewpoints: Any,
    options: RegistrationOptions | MapOptions | FindOptions,
    name: str = "points",
    device: bool = False,
) -> CoreCloud:
    """One cloud for the core. points may also be a PointCloud, a path, a mesh, or look like Open3D's
    cloud.

    device: what is on a GPU stays there, where that is possible.
    """
    prefix = "" if name == "points" else f"{name}."
    known = _viewpoints(viewpoints, prefix + "viewpoints")
    points, normals, viewpoints = _unpack(
        points, normals, None if known is False else known, name, 0.5 * options.voxel_size
    )
    word = known if isinstance(known, bool) else None
    if isinstance(viewpoints, bool):  # a mesh, or one of the words
        word, viewpoints = (viewpoints if word is None else word), None
    if word and normals is None:
        raise ValueError(f"{prefix}normals: None, expected those of the model, outwards")
    if device and on_device(points):
        stay = _stay_on_device(points, normals, features, viewpoints, prefix)
        if stay is not None:
            return stay if word is None else (*stay[:3], word, *stay[4:])
    raw = coordinates(points, name)
    count = raw.shape[0]
    origin = origin_of(raw, options.voxel_size)
    views = None if viewpoints is None else _finite_viewpoints(viewpoints, prefix + "viewpoints")
    if origin is not None:
        raw, views = raw - origin, None if views is None else views - origin
    return (
        float_rows(raw, name),
        None
        if normals is None
        else float_rows(matrix(normals, prefix + "normals", 3, count), prefix + "normals"),
        None
        if features is None
        else float_rows(matrix(features, prefix + "features", None, count), prefix + "features"),
        word
        if word is not None
        else None
        if views is None
        else np.ascontiguousarray(float_rows(views, prefix + "viewpoints")),
        origin,
        None,
    )


def _viewpoints(value: Any, name: str) -> Any:
    """None: to be inferred; False: unknown; True: a model; else rows."""
    if value is None or (isinstance(value, str) and value == "auto"):
        return None
    if isinstance(value, str):
        if value in ("none", "model"):
            return value == "model"
        raise ValueError(
            f"{name}: expected (V, 3) positions, 'none', 'model' or 'auto', got {value!r}"
        )
    return _positions(value, name)


def _positions(value: Any, name: str) -> npt.NDArray[Any]:
    """Rows; (3,) is one."""
    rows = to_numpy(value, name)
    return rows.reshape(1, 3) if rows.shape == (3,) else rows


def host_points(cloud: Any, name: str) -> FloatArray:
    """float32 rows of the points alone, on the host. Large coordinates lose their origin."""
    raw = coordinates(_unpack(cloud, None, None, name, 0.0)[0], name)
    origin = origin_of(raw, 0.0)
    return float_rows(raw if origin is None else raw - origin, name)


def _stay_on_device(
    points: Any, normals: Any, features: Any, viewpoints: Any, prefix: str
) -> CoreCloud | None:
    """None where a part is on the host, or has a type or shape that the host path converts or
    refuses.
    """
    if any(part is not None and not on_device(part) for part in (normals, features)):
        return None
    rows, normal_rows, feature_rows = (
        None if part is None else device_rows(part) for part in (points, normals, features)
    )
    if rows is None or rows.columns != 3:
        return None
    if normals is not None and (normal_rows is None or normal_rows[1:3] != rows[1:3]):
        return None
    if features is not None and (feature_rows is None or feature_rows.rows != rows.rows):
        return None
    views = (
        None
        if viewpoints is None
        else float_rows(matrix(viewpoints, prefix + "viewpoints", 3), prefix + "viewpoints")
    )
    # Each array may be the work of another stream; a part that is missing waits for none.
    of_points = stream_of(rows.owner)
    streams = (
        of_points,
        of_points if normal_rows is None else stream_of(normal_rows.owner),
        of_points if feature_rows is None else stream_of(feature_rows.owner),
    )
    return (
        rows,
        normal_rows,
        feature_rows,
        None if views is None else np.ascontiguousarray(views),
        None,
        streams,
    )


def _unpack(
    points: Any, normals: Any, viewpoints: Any, name: str, spacing: float
) -> tuple[Any, Any, Any]:
    """Clouds that carry their normals along. spacing: of the samples of a mesh."""
    scan = read_foreign(points)
    if scan is not None:
        return scan[0], normals, scan[1] if viewpoints is None else viewpoints
    mesh = mesh_as_cloud(points, name, spacing)
    if mesh is not None:
        points = mesh
    if isinstance(points, str | os.PathLike):
        points = _core.read_point_cloud(os.fspath(points))
    if isinstance(points, PointCloud):
        own = normals is None and len(points.normals) > 0
        if own:
            normals = points.normals
        if viewpoints is None and len(points.viewpoints):
            viewpoints = points.viewpoints
        if viewpoints is None and points.model and own:
            viewpoints = True
        return points.points, normals, viewpoints
    if hasattr(points, "points") and hasattr(points, "has_normals"):  # open3d.geometry.PointCloud
        if normals is None and points.has_normals():
            normals = np.asarray(points.normals)
        return np.asarray(points.points).reshape(-1, 3), normals, viewpoints
    if hasattr(points, "point") and hasattr(
        points.point, "positions"
    ):  # open3d.t.geometry.PointCloud
        if normals is None and "normals" in points.point:
            normals = points.point.normals
        return points.point.positions, normals, viewpoints
    return points, normals, viewpoints


def several(value: Any, name: str) -> list[Any]:
    """A sequence of clouds as a list; refuses what is one cloud, whose letters or points would be
    taken for clouds.
    """
    shape = getattr(value, "shape", None)
    single = is_one_cloud(value)
    if not single:
        try:
            return list(value)
        except TypeError:  # not iterable
            pass
    given = (
        repr(value)
        if isinstance(value, str | bytes | os.PathLike)
        else _kind(value) + ("" if shape is None else f", shape {tuple(shape)}")
    )
    raise TypeError(
        f"{name}: expected a sequence of clouds, got {'one: ' if single else ''}{given}"
    )


def is_one_cloud(value: Any) -> bool:
    shape = getattr(value, "shape", None)
    rows = shape is not None and len(shape) < 3 and getattr(value, "dtype", None) != object
    return rows or isinstance(value, str | bytes | os.PathLike | PointCloud | PreparedCloud)


def index_pairs(
    value: Any, name: str, count: int | tuple[int, int] | None
) -> npt.NDArray[np.uint32]:
    """(M, 2) indices below count (one for each column; None: not known); an empty list is (0, 2)."""
    array = to_numpy(value if hasattr(value, "shape") else list(value), name)
    if array.size == 0 and array.ndim <= 2:
        array = np.zeros((0, 2), np.int64)
    if array.dtype.kind not in "iu":
        raise TypeError(
            f"{name}: expected whole numbers, got dtype {array.dtype} (shape {array.shape})"
        )
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"{name}: expected shape (M, 2), got {array.shape}")
    limits = (count, count) if isinstance(count, int) else count or (2**32, 2**32)
    wrong = (array < 0) | (array >= np.asarray(limits))
    if wrong.any():
        row = int(np.argwhere(wrong)[0][0])
        if count is None:
            raise ValueError(
                f"{name}[{row}] is {tuple(array[row].tolist())}, expected indices from 0 to {2**32 - 1} (shape {array.shape})"
            )
        raise ValueError(
            f"{name}[{row}] is {tuple(array[row].tolist())}, but there are {' and '.join(map(str, limits[:1] if isinstance(count, int) else limits))} (shape {array.shape})"
        )
    return np.ascontiguousarray(array, dtype=np.uint32)
