# SPDX-License-Identifier: BSD-3-Clause
"""A map: scans with their poses, edges and islands."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import MapGraph, RegistrationOptions
from .fragments import FragmentSet

if TYPE_CHECKING:
    from ._audit import Audit

Poses = npt.NDArray[np.float64]
Points = npt.NDArray[np.float32]


@dataclasses.dataclass(frozen=True)
class MapScan:
    """One scan of a map.

    Attributes
    ----------
    number : int
        Of the fragment.
    name : str
        Of its file, see `FragmentSet.names`.
    placed : bool
    island : int or None
        Index into ``Map.islands``; None if the scan is left out.
    confidence : float
        A lower bound of the probability that the pose is correct; of a scan that is left out, the
        confidence of its best pair.
    reason : str
        "none" if the scan is placed and confirmed, "unusable" if it cannot be read or
        prepared; see ``docs/maps.md``.
    explanation : str
        The reason as a sentence.
    """

    number: int
    name: str
    placed: bool
    island: int | None
    confidence: float
    reason: str
    explanation: str


@dataclasses.dataclass(frozen=True)
class MapEdge:
    """One pair that took part in the pose graph.

    Attributes
    ----------
    source, target : int
        Numbers of fragments.
    target_from_source : (4, 4) float64
        As registered.
    confidence, weight : float
        After loop consistency; in the pose graph.
    map_confidence : float
        In view of the finished map and its audit.
    accepted : bool
    reason : str
        "none", "inconsistent" or "unconfirmed".
    mode : int
        Index into ``RegistrationResult.modes``.
    information : (6, 6) float64
        As for ``gpureg.pose_graph.add_edge``.
    """

    source: int
    target: int
    target_from_source: Poses
    confidence: float
    map_confidence: float
    weight: float
    accepted: bool
    reason: str
    mode: int
    information: Poses


@dataclasses.dataclass(frozen=True)
class MapLink:
    """A place where an island would fall into two parts if fewer edges were correct.

    Attributes
    ----------
    scans : tuple of int
        Numbers of the fragments of the smaller part.
    confidence : float
        That one of the accepted edges between the parts is correct.
    accepted, rejected : int
        Edges between the parts.
    """

    scans: tuple[int, ...]
    confidence: float
    accepted: int
    rejected: int


class Map:
    """Scans with their poses. Made by `reconstruct`; holds no points."""

    def __init__(
        self,
        graph: MapGraph,
        fragments: FragmentSet,
        options: RegistrationOptions,
        refinement: dict[str, Any] | None,
        of: FragmentSet,
        unusable: dict[int, str],
        audit: Audit | None,
        places_look_alike: bool,
    ) -> None:
        """of: the set that the map was made of; unusable: what fragments lacks of it, by position."""
        self._graph, self._fragments, self._options = graph, fragments, options
        self._refinement, self._of = refinement, of
        self._audit, self._places_look_alike = audit, places_look_alike
        numbers = fragments.numbers
        scans = iter(graph.scans)
        self._scans = tuple(
            MapScan(number, name, False, None, 0.0, "unusable", unusable[k])
            if k in unusable
            else MapScan(number, name, *next(scans))
            for k, (number, name) in enumerate(zip(of.numbers, of.names))
        )
        self._edges = tuple(
            MapEdge(numbers[edge[0]], numbers[edge[1]], *edge[2:]) for edge in graph.edges
        )
        self._links = tuple(
            MapLink(tuple(numbers[k] for k in link[0]), *link[1:]) for link in graph.links
        )

    @property
    def islands(self) -> list[list[int]]:
        """Numbers of the fragments of each island, the largest first."""
        return [[self._fragments.numbers[k] for k in island] for island in self._graph.islands]

    @property
    def poses(self) -> Poses:
        """(N, 4, 4) ``island_from_scan`` in the order of the fragments; NaN if a scan is left
        out. The smallest scan of an island has the identity.
        """
        poses = np.full((len(self._scans), 4, 4), np.nan)
        poses[[scan.reason != "unusable" for scan in self._scans]] = self._graph.poses
        return poses

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the fragments, in the order of ``poses`` and ``scans``."""
        return self._of.numbers

    @property
    def names(self) -> tuple[str, ...]:
        """Of the fragments, in the same order."""
        return self._of.names

    @property
    def scans(self) -> tuple[MapScan, ...]:
        """One per fragment, with the reason if it is left out."""
        return self._scans

    @property
    def scales(self) -> npt.NDArray[np.float64] | None:
        """(N,) factors by which the fragments were multiplied, in the order of ``poses``: the map's
        unit per unit of the fragment; None unless scales were unknown. Scans whose scale no pair
        tells have a guess, and are in islands of their own.
        """
        scales = self._of._scales
        return None if scales is None else np.asarray(scales, np.float64)

    @property
    def edges(self) -> tuple[MapEdge, ...]:
        """Accepted and rejected edges."""
        return self._edges

    @property
    def weakest_links(self) -> tuple[MapLink, ...]:
        """Where the islands are held least, in no order."""
        return self._links

    @property
    def refinement(self) -> dict[str, Any] | None:
        """What the joint refinement did; None without one.

        Keys: pairs, correspondences, iterations, rejected_edges, initial_rmse and final_rmse in
        metres, solved.
        """
        return self._refinement

    @property
    def audit(self) -> Audit | None:
        """What the scans say about the map before its refinement; None without ``audit``."""
        return self._audit

    @property
    def places_look_alike(self) -> bool:
        """Whether pairs contradicted each other as those of equal places do. Then only pairs are
        trusted that keep scans of consecutive numbers beside each other.
        """
        return self._places_look_alike

    @property
    def agreement(self) -> tuple[float, float, float]:
        """What `places_look_alike` is decided by: the share of the evidence of all pairs that
        contradicts the others, the pairs that agree for each scan, and the share of long steps
        between scans of consecutive numbers.
        """
        return self._graph.agreement

    def points(
        self, island: int = 0, *, voxel_size: float | None = None
    ) -> tuple[Points, Points | None]:
        """Points of an island, averaged per voxel, and their normals if the scans have some.

        Reads the fragments again, one at a time.

        Parameters
        ----------
        voxel_size : float, optional
            Default: half the voxel size of the registration.

        Returns
        -------
        points : (M, 3) float32, or float64 if float32 is too coarse for map coordinates
        normals : (M, 3) float32 or None

        Raises
        ------
        IndexError
            If there is no such island.
        """
        islands = self._graph.islands
        if not 0 <= island < len(islands):
            raise IndexError(f"island is {island}, but the map has {len(islands)}")
        merged = _core.VoxelMap(self._options.voxel_size / 2 if voxel_size is None else voxel_size)
        poses = self._graph.poses
        for k in islands[island]:
            rows, normals, _, _, origin, _ = self._fragments.load(k, self._options)
            merged.add(
                np.ascontiguousarray(rows),
                None if normals is None else np.ascontiguousarray(normals),
                np.zeros(3) if origin is None else origin,
                poses[k],
            )
        return merged.cloud()

    def __repr__(self) -> str:
        placed = sum(scan.placed for scan in self._scans)
        return f"<gpureg.Map: {placed} of {len(self._scans)} scans placed, islands of {[len(i) for i in self._graph.islands]}>"


__all__ = ["Map", "MapEdge", "MapLink", "MapScan"]
