# SPDX-License-Identifier: BSD-3-Clause
"""The fragments of a scene: listed once, loaded when they are needed."""

from __future__ import annotations

import errno
import hashlib
import os
import warnings
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import CoreCloud, core_cloud, host_points, several, to_numpy
from ._contexts import checked
from ._core import IoError, MapOptions, RegistrationOptions

_PIECE = 1 << 20  # bytes of a file that are in memory while its fingerprint is made


class FragmentSet:
    """Fragments with numbers, in ascending order. Holds no points: those stay where they are.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> rng = np.random.default_rng(1)
    >>> fragments = gpureg.FragmentSet.from_clouds([rng.random((100, 3)) for _ in range(3)])
    >>> len(fragments), fragments.numbers
    (3, (0, 1, 2))
    """

    def __init__(
        self,
        numbers: Sequence[int],
        sources: Sequence[Any],
        viewpoints: dict[int, Any] | None = None,
        names: Sequence[str] | None = None,
        scales: Sequence[float] | None = None,
    ) -> None:
        if len(set(numbers)) != len(numbers):
            raise ValueError("numbers: one is there twice")
        if list(numbers) != sorted(numbers):
            raise ValueError("numbers: not in ascending order")
        self._numbers = tuple(int(number) for number in numbers)
        self._sources = tuple(sources)
        self._viewpoints = viewpoints or {}
        self._names = tuple(_names_of(self._numbers, sources) if names is None else names)
        if len(self._names) != len(self._numbers):
            raise ValueError(f"names: {len(self._names)} for {len(self._numbers)} fragments")
        self._scales = None if scales is None else tuple(float(scale) for scale in scales)
        if self._scales is not None and len(self._scales) != len(self._numbers):
            raise ValueError(f"scales: {len(self._scales)} for {len(self._numbers)} fragments")

    @classmethod
    def from_directory(
        cls, directory: str | os.PathLike[str], recursive: bool = False
    ) -> FragmentSet:
        """The clouds and meshes of a folder, with sensor positions from its cameras.txt if it has
        one.

        Parameters
        ----------
        directory : path
            A folder: its files ``cloud_bin_<i>`` with their numbers, and where it has none, all its
            clouds in natural order (scan2 before scan10). Names that differ by a number alone keep
            it (scan_12.ply is 12); else numbers count from 0. Or a pattern (``"scans/*.ply"``,
            ``"scans/**/*.ply"``), or a text file with one path a line, relative to its folder, and
            perhaps a name after it.
        recursive : bool
            Also the clouds of all subfolders, whose names have the path.

        Warns
        -----
        UserWarning
            About files that are no clouds, and links to nothing.

        Raises
        ------
        IoError
            Saying what the folder holds instead of clouds; where a scan or a number is there twice.

        Examples
        --------
        >>> import gpureg, tempfile, os
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     for name in ("hall.ply", "stairs 10.ply", "stairs 9.ply"):
        ...         gpureg.write_point_cloud(os.path.join(folder, name), [[0, 0, 0]])
        ...     scans = gpureg.FragmentSet.from_directory(folder)
        >>> scans.names
        ('hall.ply', 'stairs 9.ply', 'stairs 10.ply')
        """
        path = os.fsencode(directory)
        found, notes = _core.list_scans(path, bool(recursive))
        for note in notes:
            warnings.warn(note, stacklevel=2)
        numbers, names = [scan[0] for scan in found], [scan[2] for scan in found]
        cameras = Path(_core.folder_of_scans(path)) / "cameras.txt"
        viewpoints: dict[int, Any] = (
            _core.read_cameras(os.fsencode(cameras), numbers, names) if cameras.exists() else {}
        )
        return cls(numbers, [scan[1] for scan in found], viewpoints, names)

    @classmethod
    def from_clouds(cls, clouds: Sequence[Any], names: Sequence[str] | None = None) -> FragmentSet:
        """Clouds in memory, or paths: whatever `prepare` takes as points. Their numbers are 0, 1,
        2, ...; their names, unless given, those of files, and else the numbers.
        """
        clouds = several(clouds, "clouds")
        return cls(range(len(clouds)), clouds, None, names)

    def __len__(self) -> int:
        return len(self._numbers)

    def __repr__(self) -> str:
        return f"<gpureg.FragmentSet of {len(self)} fragments>"

    @property
    def numbers(self) -> tuple[int, ...]:
        """As in the files' names, ascending."""
        return self._numbers

    @property
    def names(self) -> tuple[str, ...]:
        """Of each fragment, for people: the name of its file, or what a list calls it."""
        return self._names

    @property
    def count(self) -> int:
        """What Redwood's files give as the number of fragments: one more than the largest number."""
        return self._numbers[-1] + 1 if self._numbers else 0

    def without(self, positions: Collection[int]) -> FragmentSet:
        """The others, under their numbers."""
        kept = [k for k in range(len(self)) if k not in positions]
        return FragmentSet(
            [self._numbers[k] for k in kept],
            [self._sources[k] for k in kept],
            self._viewpoints,
            [self._names[k] for k in kept],
            None if self._scales is None else [self._scales[k] for k in kept],
        )

    def scaled(self, scales: Sequence[float]) -> FragmentSet:
        """The same fragments, each multiplied by its scale when it is loaded."""
        return FragmentSet(self._numbers, self._sources, self._viewpoints, self._names, scales)

    def load(
        self, position: int, options: RegistrationOptions | MapOptions, device: bool = False
    ) -> CoreCloud:
        """The fragment at a position (not: of a number), as the core takes it; device: on a GPU, if
        it is there. Thread-safe. Raises OSError for all that is wrong with a file.
        """
        source, number = self._sources[position], self._numbers[position]
        if self._scales is not None:  # the spacing of meshes is in the fragment's unit
            size = options.voxel_size / self._scales[position]
            options, device = RegistrationOptions(voxel_size=size), False
        try:
            cloud = core_cloud(
                source,
                None,
                None,
                self._viewpoints.get(number),
                options,
                f"fragments[{position}]",
                device,
            )
            return cloud if self._scales is None else _times(self._scales[position], cloud)
        except ValueError as error:
            if isinstance(source, str | os.PathLike):
                raise IoError(str(error)) from error
            raise

    def _core(self, fingerprints: bool = False) -> _core.FragmentSource:
        """As the library takes it. fingerprints: for a journal; reads all data once."""
        return _core.FragmentSource(
            self._names,
            [self.fingerprint(k) for k in range(len(self))] if fingerprints else [],
            self.load,
        )

    def check_files(self) -> None:
        """Raises FileNotFoundError for a path where nothing is: that is no bad fragment, but a wrong
        argument.
        """
        for source in self._sources:
            if isinstance(source, str | os.PathLike) and not os.path.lexists(_file_of(source)):
                raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(source))

    def fingerprint(self, position: int) -> str:
        """Tells whether a fragment is the one that an earlier run saw: a digest of all its data;
        "unreadable" for a file that is there and cannot be read.
        """
        digest = hashlib.blake2b(digest_size=16)
        source = self._sources[position]
        if isinstance(source, str | os.PathLike):
            try:
                digest.update(os.fspath(source)[len(_file_of(source)) :].encode())  # its part
                with open(_file_of(source), "rb") as file:
                    while piece := file.read(_PIECE):
                        digest.update(piece)
            except FileNotFoundError:
                raise
            except OSError:
                return "unreadable"
        else:
            for part in self.load(position, RegistrationOptions())[:5]:
                digest.update(b"-" if part is None else np.ascontiguousarray(part).tobytes())
        viewpoints = self._viewpoints.get(self._numbers[position])
        if viewpoints is not None:
            digest.update(np.ascontiguousarray(viewpoints).tobytes())
        return digest.hexdigest()

    def _voxel_size(self) -> float:
        """What `gpureg.suggest_voxel_size` says of at most eight of them, evenly chosen; 0.05 where
        these suggest none. One that cannot be read has no say.
        """
        clouds, count = [], min(len(self), 8)
        for k in range(count):
            try:
                place = k * len(self) // count
                points = host_points(self._sources[place], "fragments")
                clouds.append(points if self._scales is None else points * self._scales[place])
            except (OSError, ValueError):
                continue
        return _core.suggest_voxel_size(clouds).voxel_size or RegistrationOptions().voxel_size

    def choose_pairs(self, pairs: Any = "all") -> npt.NDArray[np.int64]:
        """(M, 2) positions i < j.

        Parameters
        ----------
        pairs : "all", list of pairs, (M, 2) array, or callable
            Pairs of fragment numbers, or of names, in either order; repetitions count once. A
            callable gets this set and returns them.

        Examples
        --------
        >>> import gpureg
        >>> fragments = gpureg.FragmentSet([2, 5, 9], [None] * 3)
        >>> fragments.choose_pairs("all").tolist()
        [[0, 1], [0, 2], [1, 2]]
        >>> fragments.choose_pairs([(9, 2), (2, 9)]).tolist()
        [[0, 2]]
        """
        if isinstance(pairs, str):
            if pairs != "all":
                raise ValueError(
                    f'pairs: expected "all", pairs of numbers or a callable, got {pairs!r}'
                )
            return np.stack(np.triu_indices(len(self), 1), axis=1)
        if callable(pairs):
            pairs = pairs(self)
        chosen = to_numpy(
            pairs if hasattr(pairs, "shape") else [self._numbered(pair) for pair in pairs], "pairs"
        )
        if chosen.size == 0:
            return np.zeros((0, 2), np.int64)
        if chosen.dtype.kind not in "iu" or chosen.ndim != 2 or chosen.shape[1] != 2:
            raise ValueError(
                f"pairs: expected whole numbers of shape (M, 2), got {chosen.dtype} of shape {chosen.shape}"
            )
        numbers = np.asarray(self._numbers)
        positions = np.minimum(np.searchsorted(numbers, chosen), len(numbers) - 1)
        unknown = numbers[positions] != chosen
        if unknown.any():
            raise ValueError(f"pairs: there is no fragment {chosen[unknown][0]}")
        positions.sort(axis=1)
        same = positions[:, 0] == positions[:, 1]
        if same.any():
            raise ValueError(f"pairs: {chosen[same][0].tolist()} is a fragment and itself")
        _, first = np.unique(positions, axis=0, return_index=True)
        return np.asarray(positions[np.sort(first)], np.int64)

    def _numbered(self, pair: Any) -> Any:
        """A pair with numbers in place of names."""
        if isinstance(pair, str) or not hasattr(pair, "__iter__"):
            return pair
        return [self._number(word) if isinstance(word, str) else word for word in pair]

    def _number(self, word: str) -> int:
        place = _core.find_scan(self._numbers, self._names, word)
        if place is None:
            raise ValueError(f"pairs: there is no fragment named {word!r}")
        return self._numbers[place]


def _times(scale: float, cloud: CoreCloud) -> CoreCloud:
    """The cloud, which is on the host, with all its lengths multiplied."""
    points, normals, features, viewpoints, origin, streams = cloud
    return (
        np.asarray(points * np.float32(scale)),
        normals,
        features,
        viewpoints * np.float32(scale) if isinstance(viewpoints, np.ndarray) else viewpoints,
        None if origin is None else origin * scale,
        streams,
    )


def _names_of(numbers: Sequence[int], sources: Sequence[Any]) -> list[str]:
    """Names of files without their folders, where they differ; else numbers."""
    names = [
        os.path.basename(os.fspath(source))
        if isinstance(source, str | os.PathLike)
        else str(number)
        for number, source in zip(numbers, sources)
    ]
    return names if len(set(names)) == len(names) else [str(number) for number in numbers]


def _file_of(path: str | os.PathLike[str]) -> str:
    """Without the scan that it names: "a.e57" of "a.e57#2"."""
    return _core.scan_path(os.fspath(path))[0]


def options_for(
    options: RegistrationOptions | None, fragments: FragmentSet, voxel_size: float = 0
) -> RegistrationOptions:
    """The given ones; else those of a voxel size that is known, or that the fragments suggest."""
    if options is None:
        return RegistrationOptions(voxel_size=voxel_size or fragments._voxel_size())
    checked(options, RegistrationOptions, "options").validate()
    return options


def fragment_set(fragments: Any) -> FragmentSet:
    """A set as it is; a folder or a list of clouds as a set."""
    if isinstance(fragments, FragmentSet):
        return fragments
    if isinstance(fragments, str | os.PathLike):
        return FragmentSet.from_directory(fragments)
    return FragmentSet.from_clouds(several(fragments, "fragments"))


__all__: list[str] = ["FragmentSet"]
