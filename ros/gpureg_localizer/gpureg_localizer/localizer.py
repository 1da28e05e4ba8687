# SPDX-License-Identifier: BSD-3-Clause
"""The pose of a PointCloud2 in a map. Imports nothing of ROS: messages are whatever has their fields."""

from __future__ import annotations

import dataclasses
from typing import Any

import gpureg
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

_TYPES = {7: "f4", 8: "f8"}  # sensor_msgs/PointField: FLOAT32, FLOAT64


def points_of(message: Any) -> npt.NDArray[Any]:
    """The finite points of a sensor_msgs/PointCloud2.

    Returns
    -------
    (N, 3) float32, or float64 where one of x, y and z is.

    Raises
    ------
    ValueError
        Naming the field of the message that does not fit.
    """
    if message.is_bigendian:
        raise ValueError("is_bigendian: true, expected little-endian data")
    width, height = int(message.width), int(message.height)
    step, row = int(message.point_step), int(message.row_step)
    formats, offsets = [], []
    known = {field.name: field for field in message.fields}
    for name in "xyz":
        if name not in known:
            raise ValueError(f"fields: {name} is missing, there are {', '.join(known) or 'none'}")
        kind, offset = int(known[name].datatype), int(known[name].offset)
        if kind not in _TYPES:
            raise ValueError(
                f"fields: datatype of {name} is {kind}, expected 7 (FLOAT32) or 8 (FLOAT64)"
            )
        formats.append("<" + _TYPES[kind])
        offsets.append(offset)
        if offset + np.dtype(formats[-1]).itemsize > step:
            raise ValueError(
                f"fields: offset of {name} is {offset}, which does not fit point_step {step}"
            )
    if row < width * step:
        raise ValueError(f"row_step: {row}, expected width * point_step = {width * step} or more")
    data = np.frombuffer(message.data, np.uint8)
    if len(data) != row * height:
        raise ValueError(f"data: {len(data)} bytes, expected row_step * height = {row * height}")
    rows = np.ascontiguousarray(data.reshape(height, row)[:, : width * step])
    dtype = np.dtype(
        {"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": step}
    )
    values = rows.reshape(-1).view(dtype)
    points = np.stack([values[name] for name in "xyz"], axis=1)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        raise ValueError(f"data: none of {width * height} points is finite")
    return np.asarray(points, points.dtype.newbyteorder("="))


def quaternion_of(rotation: FloatArray) -> FloatArray:
    """x, y, z, w of a rotation matrix, w >= 0."""
    r, trace = rotation, np.trace(rotation)
    outer = np.empty((4, 4))  # four times the outer product of the quaternion with itself
    outer[:3, :3] = r + r.T + (1 - trace) * np.eye(3)
    outer[3, :3] = outer[:3, 3] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    outer[3, 3] = 1 + trace
    row = outer[np.argmax(np.diag(outer))]  # the longest is the most accurate
    return np.asarray(np.copysign(1, row[3]) * row / np.linalg.norm(row))


def _skew(v: FloatArray) -> FloatArray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def _inflation(weak: float, typical: float, most: float) -> float:
    """Variance factor of a direction with eigenvalue weak, relative to a typical direction."""
    if not typical > 0:
        return 1.0
    return max(1.0, typical / weak) if weak > typical / most else most


def noise_of(options: Any, voxel_size: float) -> tuple[gpureg.EdgeNoiseOptions, float]:
    """Noise of a registered pose and unit of rotations, of options in voxels, in metres."""
    noise = options.noise.replace(
        translation=options.noise.translation * voxel_size,
        max_translation=options.noise.max_translation * voxel_size,
    )
    return noise, options.information_unit * voxel_size


def covariance_of(
    target_from_source: FloatArray,
    evidence: gpureg.PoseEvidence,
    moments: gpureg.CorrespondenceMoments,
    noise: gpureg.EdgeNoiseOptions,
    unit: float,
) -> FloatArray:
    """(6, 6) covariance of a pose as ROS has it: the position x, y, z (metres), then rotations about
    the fixed axes x, y, z of the target (radians).

    The model is that of the edges of a map (src/reconstruction/edge_noise.cpp): errors about the
    centre of the overlap, larger along the direction that the geometry holds weakly.

    Parameters
    ----------
    moments : of the source, whose centre is that of the overlap.
    unit : float
        Length in which the eigenvalues count rotations: twenty voxels.
    """
    # In gpureg the rotation comes first; errors here are about the centre, in the target's axes.
    turn, shift = np.radians(noise.rotation) ** 2, noise.translation**2
    covariance = np.diag([turn] * 3 + [shift] * 3)
    eigenvalues = evidence.information_eigenvalues
    if eigenvalues[5] > 0:
        typical = 0.5 * (eigenvalues[2] + eigenvalues[3])
        most = (noise.max_translation / noise.translation) ** 2
        covariance *= _inflation(eigenvalues[1], typical, most)
        direction = np.array(evidence.weakest_direction) * np.repeat([1, unit], 3)
        extra = shift / unit**2 * (_inflation(eigenvalues[0], typical, most) - 1)
        covariance += extra * np.outer(direction, direction)
    rotation = target_from_source[:3, :3]
    centre = moments.sum / moments.count if moments.count else np.zeros(3)
    # A rotation about the centre moves the origin of the source, which is -R c away from it.
    by_error = np.zeros((6, 6))
    by_error[:3, :3] = _skew(rotation @ centre)
    by_error[:3, 3:] = by_error[3:, :3] = np.eye(3)
    return np.asarray(by_error @ covariance @ by_error.T)


@dataclasses.dataclass(frozen=True)
class Location:
    """Answer of a `Localizer`. Without a pose where the cloud was not found.

    Attributes
    ----------
    text : str
        For people: found with which confidence, or why not.
    position, quaternion, covariance : arrays of 3, 4 (x, y, z, w) and 36 numbers, or None
        Of the frame of the cloud in the map, as geometry_msgs/PoseWithCovariance has them.
    """

    text: str
    position: FloatArray | None = None
    quaternion: FloatArray | None = None
    covariance: FloatArray | None = None

    @property
    def found(self) -> bool:
        return self.position is not None


class Localizer:
    """Finds clouds in a map.

    Parameters
    ----------
    map : path or gpureg.PreparedMap
        A file of ``PreparedMap.save`` or ``gpureg locate --save-map``.

    Raises
    ------
    gpureg.IoError
        Naming the file that is no map.
    """

    def __init__(self, map: Any, *, context: gpureg.Context | None = None) -> None:
        self.map = map if isinstance(map, gpureg.PreparedMap) else gpureg.load_map(map)
        self._context = context
        self._noise, self._unit = noise_of(
            gpureg.ReconstructionOptions(), self.map.options.voxel_size
        )

    def locate(self, message: Any) -> Location:
        """The pose of a sensor_msgs/PointCloud2 in the map.

        Raises
        ------
        ValueError
            Naming the field of the message that does not fit; where the cloud is in another unit
            than the map.
        """
        result = gpureg.locate(points_of(message), self.map, context=self._context)
        if not result.found:
            if result.status == "ambiguous":
                count = 1 + sum(pose.alias for pose in result.poses)
                return Location(f"ambiguous: {count} places in this map look alike")
            return Location(f"not in this map with probability {result.absent_probability:.2f}")
        best = result.poses[0]
        pose, verification = best.map_from_scan, best.verification
        covariance = covariance_of(
            pose, verification.evidence, verification.source_moments, self._noise, self._unit
        )
        return Location(
            f"found with confidence {best.confidence:.2f}",
            pose[:3, 3],
            quaternion_of(pose[:3, :3]),
            covariance.reshape(36),
        )
