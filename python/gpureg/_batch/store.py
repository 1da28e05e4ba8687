# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a run. Whatever moment a process dies at, what it had finished is there and whole."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute
import pyarrow.parquet as pq

from .. import _core
from .._core import IoError
from .plan import Plan, difference
from .table import Key, entries_of, table_of

Row = dict[str, Any]

_DIGEST = 16  # bytes before the Parquet data of a chunk: their digest


class Store:
    """run.json says what the run is; chunks/NNNNNN.chunk are finished chunks; results.parquet,
    result.log and result.info, made of them at the end, replace them."""

    def __init__(self, folder: Path, plan: Plan, resume: bool) -> None:
        self.folder, self._plan = folder, plan
        self._chunks = folder / "chunks"
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = open(folder / "run.lock", "w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise IoError(f"output: {folder} is in use by another run") from None
        try:
            self._open(plan.manifest(), resume)
        except BaseException:
            self.close()
            raise

    def _open(self, manifest: Row, resume: bool) -> None:
        path = self.folder / "run.json"
        if not resume:
            path.unlink(missing_ok=True)  # first: a folder without it holds nothing
            shutil.rmtree(self._chunks, ignore_errors=True)
            for result in (self.table_path, self.log_path, self.information_path):
                result.unlink(missing_ok=True)
        if path.exists():
            try:
                before = json.loads(path.read_text())
            except ValueError as error:
                raise IoError(
                    f"output: {path} is damaged ({error}); resume=False starts anew"
                ) from None
            changed = difference(before, json.loads(json.dumps(manifest)))
            if changed:
                raise ValueError(
                    f"output: {self.folder} holds a run that is not this one: {changed}; take another folder, or resume=False to start anew"
                )
        else:
            if self._chunks.exists() or self.table_path.exists():
                raise IoError(
                    f"output: {self.folder} holds results without run.json; take another folder, or resume=False"
                )
            _write(path, lambda temporary: temporary.write_text(json.dumps(manifest, indent=1)))
        if not self.complete:
            self._chunks.mkdir(exist_ok=True)

    def close(self) -> None:
        self._lock.close()

    @property
    def table_path(self) -> Path:
        return self.folder / "results.parquet"

    @property
    def log_path(self) -> Path:
        return self.folder / "result.log"

    @property
    def information_path(self) -> Path:
        return self.folder / "result.info"

    @property
    def complete(self) -> bool:
        return self.table_path.exists()

    def finished(self) -> set[int]:
        """Numbers of the chunks that are done."""
        if self.complete:
            return set(range(self._plan.chunks))
        return {int(path.stem) for path in self._chunks.glob("*.chunk") if path.stem.isdigit()}

    def partial(self, chunk: int) -> dict[Key, Row]:
        """What an interrupted run has left of a chunk."""
        path = self._chunks / f"{chunk:06d}.partial"
        if not path.exists():
            return {}
        return {(row["i"], row["j"]): row for row in read_chunk(path).to_pylist()}

    def write(self, chunk: int, rows: Sequence[Row]) -> None:
        """A finished chunk, on disk when this returns."""
        self._write_rows(self._chunks / f"{chunk:06d}.chunk", rows)
        (self._chunks / f"{chunk:06d}.partial").unlink(missing_ok=True)

    def write_partial(self, chunk: int, rows: Sequence[Row]) -> None:
        if rows:
            self._write_rows(self._chunks / f"{chunk:06d}.partial", rows)

    def _write_rows(self, path: Path, rows: Sequence[Row]) -> None:
        stream = pa.BufferOutputStream()
        pq.write_table(table_of(rows), stream)
        data = stream.getvalue().to_pybytes()
        _write(path, lambda temporary: temporary.write_bytes(_digest(data) + data))

    def conclude(self) -> None:
        """All chunks into one table and the two Redwood files; memory holds the aligned pairs'
        matrices, nothing else.
        """
        if not self.complete:
            positions = {
                tuple(pair): k
                for k, pair in enumerate(self._plan.numbers(self._plan.pairs).tolist())
            }

            def in_order(column: str, size: int) -> list[Any]:
                entries = [
                    e
                    for chunk in self._read()
                    for e in entries_of(chunk, column, size, self._plan.fragments.count)
                ]
                return sorted(entries, key=lambda entry: positions[entry[:2]])

            _core.write_log(str(self.log_path), in_order("target_from_source", 4))
            _core.write_information(str(self.information_path), in_order("information", 6))
            _write(self.table_path, self._merge)  # last: it says that the run is complete
        shutil.rmtree(self._chunks, ignore_errors=True)

    def _read(self) -> Iterator[pa.Table]:
        for chunk in range(self._plan.chunks):
            yield read_chunk(self._chunks / f"{chunk:06d}.chunk")

    def _merge(self, temporary: Path) -> None:
        with contextlib.ExitStack() as stack:
            writer = None
            for table in self._read():
                if writer is None:
                    writer = stack.enter_context(pq.ParquetWriter(temporary, table.schema))
                writer.write_table(table)


def read_chunk(path: Path) -> pa.Table:
    """The rows of a chunk, or of a part of one. A changed bit would otherwise become a result."""
    content = path.read_bytes()
    if _digest(content[_DIGEST:]) != content[:_DIGEST]:
        raise IoError(f"output: {path} is damaged (its checksum differs); resume=False starts anew")
    return pq.read_table(pa.BufferReader(content[_DIGEST:]))


def _digest(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=_DIGEST).digest()


def read_table(path: Path, columns: list[str] | None = None) -> pa.Table:
    """A Parquet file of a run. Nothing that gpureg writes is ever half there, but disks fail and
    people edit.
    """
    try:
        return pq.read_table(path, columns=columns)
    except (FileNotFoundError, PermissionError):
        raise
    except (pa.ArrowException, OSError) as error:
        reason = str(error).partition("\n")[0]
        raise IoError(f"output: {path} is damaged ({reason}); resume=False starts anew") from None


def _write(path: Path, fill: Any) -> None:
    """All or nothing, also over a power cut: a temporary file, flushed, takes the place of the old
    one.
    """
    temporary = path.with_name(path.name + ".tmp")
    fill(temporary)
    with open(temporary, "rb") as file:
        os.fsync(file.fileno())
    os.replace(temporary, path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
