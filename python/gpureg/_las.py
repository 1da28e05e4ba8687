# SPDX-License-Identifier: BSD-3-Clause
"""LAS and LAZ files, through laspy: the optional extra ``gpureg[formats]``."""

from __future__ import annotations

import os
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from ._core import IoError

# Points are read in pieces of so many bytes: the header of a damaged file may announce any number.
_PIECE = 1 << 24

# LAZ: layers of each kind of item of a point (points, colours, colours with infrared, wave packets).
# Every extra byte is one.
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}
_EXTRA_BYTES = 14


def read_las(path: str | os.PathLike[str]) -> npt.NDArray[np.float64]:
    """(N, 3) coordinates in the file's unit, with its scale and offset applied.

    float64, as map coordinates need it: `prepare` and `register` lose nothing of them. Memory
    grows with the points that the file holds, not with those that its header announces.

    Raises
    ------
    ImportError
        Without laspy: ``pip install gpureg[formats]``.
    IoError
        Naming the file and the reason.
    """
    name = os.fspath(path)
    try:
        import laspy
    except ImportError:
        raise ImportError(
            f"{name}: LAS and LAZ files need laspy: pip install 'gpureg[formats]'"
        ) from None
    try:
        return _read(laspy, name)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # laspy has no type for damaged files, nor has lazrs for panics
        raise IoError(f"{name}: {type(error).__name__}: {error}") from error


def _check_header(name: str) -> tuple[bool, int, int, int]:
    """Whether the points are compressed, the bytes of the header, where the points start, and the
    bytes of one.

    laspy reads as many records before the points as the header announces, also beyond the end.
    """
    with open(name, "rb") as file:
        header = file.read(107)
    if len(header) < 107 or header[:4] != b"LASF":
        raise ValueError("it does not start as a LAS file")
    header_size, start, records, point_format, size = struct.unpack_from("<HIIBH", header, 94)
    if start > os.path.getsize(name) or header_size + 54 * records > start:
        raise ValueError(f"{records} records announced before the points at byte {start}")
    return point_format >= 128 or point_format & 64 != 0, header_size, start, size


def _check_chunks(name: str, start: int, size: int) -> int:
    """The number of chunks.

    lazrs allocates as many entries as their table announces. Every chunk begins with a whole point.
    """
    with open(name, "rb") as file:
        file.seek(start)
        (table,) = struct.unpack("<q", file.read(8))
        if table == -1:
            file.seek(-8, os.SEEK_END)
            (table,) = struct.unpack("<q", file.read(8))
        if not start < table <= os.path.getsize(name) - 8:
            raise ValueError(
                "no table of chunks: damaged, or an old LAZ, to be converted with PDAL"
            )
        file.seek(table + 4)
        chunks = int(struct.unpack("<I", file.read(4))[0])
    if (chunks - 1) * size > os.path.getsize(name):
        raise ValueError(f"{chunks} chunks announced, more than the file has room for")
    return chunks


def _layers(records: bytes) -> tuple[int, int]:
    """Layers of a chunk of LAZ points, 0 where they have none, and the points of a chunk, from the
    records before the points.
    """
    at = 0
    while at + 54 <= len(records):
        user, number, length = struct.unpack_from("<16sHH", records, at + 2)
        at += 54
        if user.rstrip(b"\0") == b"laszip encoded" and number == 22204:
            break
        at += length
    else:
        return 0, 0
    (points,) = struct.unpack_from("<I", records, at + 12)
    (items,) = struct.unpack_from("<H", records, at + 32)
    layers = 0
    for k in range(items):
        kind, width = struct.unpack_from("<HH", records, at + 34 + 6 * k)
        layers += width if kind == _EXTRA_BYTES else _LAYERS.get(kind, 0)
    return layers, points


def _check_layers(
    name: str, header_size: int, start: int, size: int, chunks: int, count: int
) -> None:
    """lazrs allocates the layers of a chunk before it reads them, each as large as its chunk says.

    A chunk is a whole point, the number of its points, the sizes of its layers, and these.
    """
    room = os.path.getsize(name)
    with open(name, "rb") as file:
        file.seek(header_size)
        layers, points = _layers(file.read(start - header_size))
        if layers == 0:
            return
        at = start + 8  # after the place of the table of chunks
        for _ in range(max(chunks, -(-count // max(points, 1)))):
            file.seek(at + size + 4)
            sizes = struct.unpack(f"<{layers}I", file.read(4 * layers))
            at += size + 4 + 4 * layers + sum(sizes)
            if at > room:
                raise ValueError(f"a layer of {max(sizes)} bytes announced, more than there are")


def _read(laspy: Any, name: str) -> npt.NDArray[np.float64]:
    compressed, header_size, start, size = _check_header(name)
    chunks = _check_chunks(name, start, size) if compressed else 0
    # The parallel decompressor allocates by the sizes of the chunks in their table.
    with laspy.open(name, laz_backend=laspy.LazBackend.Lazrs, read_evlrs=False) as file:
        count, held = file.header.point_count, (os.path.getsize(name) - start) // max(size, 1)
        if not compressed and count > held:
            raise ValueError(f"truncated: {count} points announced, {held} are there")
        if compressed:
            _check_layers(name, header_size, start, size, chunks, count)
        pieces = [
            np.column_stack([np.asarray(axis, np.float64) for axis in (part.x, part.y, part.z)])
            for part in file.chunk_iterator(max(1, _PIECE // max(size, 1)))
        ]
    return np.concatenate(pieces) if pieces else np.zeros((0, 3))
