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
from .plan import Key, Plan, difference
from .table import entries_of, table_of

Row = dict[str, Any]

_NAMES = ("name_i", "name_j")  # columns of the final table
_DIGEST = 16  # bytes before the Parquet data of a chunk: their digest


class Store:
    """run.json says what the run is; chunks/NNNNNN-*.chunk are finished chunks, *.partial those that
    lack pairs; results.parquet, result.log and result.info, made of them at the end, replace them.

    A fragment of which there is no pair yet may change, come or go: pairs are kept, and put into the
    chunks of the new plan.
    """

    def __init__(self, folder: Path, plan: Plan, resume: bool) -> None:
        self.folder, self._plan, self._manifest = folder, plan, plan.manifest()
        self._chunks = folder / "chunks"
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = open(folder / "run.lock", "w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise IoError(f"output: {folder} is in use by another run") from None
        try:
            self._open(resume)
        except BaseException:
            self.close()
            raise

    def _open(self, resume: bool) -> None:
        path = self.folder / "run.json"
        if not resume:
            path.unlink(missing_ok=True)  # first: a folder without it holds nothing
            shutil.rmtree(self._chunks, ignore_errors=True)
            for result in (self.table_path, self.log_path, self.information_path):
                result.unlink(missing_ok=True)
        before = None
        if path.exists():
            try:
                before = dict(json.loads(path.read_text()))
            except (TypeError, ValueError) as error:
                raise IoError(
                    f"output: {path} is damaged ({error}); resume=False starts anew"
                ) from None
            before.pop("unusable", None)
        elif self._chunks.exists() or self.table_path.exists():
            raise IoError(
                f"output: {self.folder} holds results without run.json; take another folder, or resume=False"
            )
        now = json.loads(json.dumps(self._manifest))
        if before != now:
            if before is not None:
                self._check_goes_on(before, now)
            self._take_over()
            self._write_manifest()
        elif not self._has_all_pairs():
            self._take_over()

    def _check_goes_on(self, before: Row, now: Row) -> None:
        """Raises ValueError if the folder has pairs that are none of this run's."""
        keys = {key for table in self._tables() for key in _keys_of(table)}
        used = {number for key in keys for number in key}
        changed = _renamed(before, now, used) or difference(
            _of_fragments(before, used), _of_fragments(now, used)
        )
        planned = map(tuple, self._plan.numbers(self._plan.pairs).tolist())
        if not changed and not keys <= set(planned):
            changed = difference(before.get("pairs"), now["pairs"], "pairs")
        if changed:
            raise ValueError(
                f"output: {self.folder} holds a run that is not this one: {changed}; take another folder, or resume=False to start anew"
            )

    def _has_all_pairs(self) -> bool:
        return self.complete and read_table(self.table_path, ["i"]).num_rows == len(
            self._plan.pairs
        )

    def _tables(self) -> Iterator[pa.Table]:
        """All pairs that there are, perhaps some of them twice."""
        if self.complete:
            table = read_table(self.table_path)
            yield table.drop_columns([name for name in _NAMES if name in table.column_names])
        for pattern in ("*.chunk", "*.partial"):
            for path in sorted(self._chunks.glob(pattern)):
                yield read_chunk(path)

    def _take_over(self) -> None:
        """Puts what there is into the chunks of the plan. Nothing is deleted before it is there."""
        self._chunks.mkdir(exist_ok=True)
        finished = self._chunk_files("chunk")
        mine = set(finished.values()) | set(self._chunk_files("partial").values())
        strangers = [path for path in self._chunks.iterdir() if path not in mine]
        if strangers or self.complete:
            tables = list(self._tables())
            places = {key: k for k, key in enumerate(key for t in tables for key in _keys_of(t))}
            for chunk in range(self._plan.chunks):
                rows = [places[key] for key in self._plan.keys(chunk) if key in places]
                if rows and chunk not in finished:
                    pool = pa.concat_tables(tables)
                    self._write_table(chunk, pool.take(pa.array(rows)).combine_chunks())
        for path in (*strangers, self.table_path, self.log_path, self.information_path):
            path.unlink(missing_ok=True)

    def _write_manifest(self, unusable: dict[int, str] | None = None) -> None:
        document = {**self._manifest, **({"unusable": unusable} if unusable else {})}
        _write(
            self.folder / "run.json",
            lambda temporary: temporary.write_text(json.dumps(document, indent=1)),
        )

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
        return set(self._chunk_files("chunk"))

    def _chunk_files(self, kind: str) -> dict[int, Path]:
        paths = {k: self._path(k, kind) for k in range(self._plan.chunks)}
        there = set(self._chunks.glob(f"*.{kind}"))
        return {k: path for k, path in paths.items() if path in there}

    def _path(self, chunk: int, kind: str) -> Path:
        return self._chunks / f"{self._plan.name(chunk)}.{kind}"

    def partial(self, chunk: int) -> dict[Key, Row]:
        """What an interrupted run has left of a chunk."""
        path = self._path(chunk, "partial")
        if not path.exists():
            return {}
        return {(row["i"], row["j"]): row for row in read_chunk(path).to_pylist()}

    def write(self, chunk: int, rows: Sequence[Row]) -> None:
        """Pairs of a chunk in any order, on disk when this returns. It is finished with all of them."""
        places = {key: k for k, key in enumerate(self._plan.keys(chunk))}
        if rows:
            self._write_table(
                chunk, table_of(sorted(rows, key=lambda row: places[row["i"], row["j"]]))
            )

    def _write_table(self, chunk: int, table: pa.Table) -> None:
        stream = pa.BufferOutputStream()
        pq.write_table(table, stream)
        data = stream.getvalue().to_pybytes()
        finished = table.num_rows == len(self._plan.chunk(chunk))
        path = self._path(chunk, "chunk" if finished else "partial")
        _write(path, lambda temporary: temporary.write_bytes(_digest(data) + data))
        if finished:
            self._path(chunk, "partial").unlink(missing_ok=True)

    def conclude(self, unusable: dict[int, str]) -> None:
        """All chunks into one table and the two Redwood files; memory holds the aligned pairs'
        matrices, nothing else. unusable: numbers of fragments whose pairs are missing, and why.
        """
        if not self.complete:
            if next(self._read(), None) is None:
                raise IoError(f"fragments: no pair can be aligned: {next(iter(unusable.values()))}")
            self._write_manifest(unusable)
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
            for path in (self._path(chunk, "chunk"), self._path(chunk, "partial")):
                if path.exists():
                    yield read_chunk(path)
                    break

    def _with_names(self, table: pa.Table) -> pa.Table:
        names = dict(zip(self._plan.fragments.numbers, self._plan.fragments.names))
        for column, name in zip(("i", "j"), _NAMES):
            values = [names[number] for number in table[column].to_pylist()]
            table = table.append_column(name, pa.array(values, pa.string()))
        return table

    def _merge(self, temporary: Path) -> None:
        with contextlib.ExitStack() as stack:
            writer = None
            for table in self._read():
                table = self._with_names(table)
                if writer is None:
                    writer = stack.enter_context(pq.ParquetWriter(temporary, table.schema))
                writer.write_table(table)


def _keys_of(table: pa.Table) -> Iterator[Key]:
    return zip(table["i"].to_pylist(), table["j"].to_pylist())


def _renamed(before: Row, now: Row, used: set[int]) -> str:
    """Which fragment has another file than before, as where files come and go whose numbers are
    places; empty where none has.
    """
    names = {entry["number"]: entry.get("name") for entry in now["fragments"]}
    for entry in before.get("fragments", []):
        number, name = entry["number"], entry.get("name")
        if number in used and name is not None and names.get(number) != name:
            return f"fragment {number} was {name!r}, now {names.get(number, 'none')!r}: the list of scans has changed"
    return ""


def _of_fragments(manifest: Row, numbers: set[int]) -> Row:
    """A manifest without its pairs, and without what it says of other fragments."""
    fragments = [entry for entry in manifest.get("fragments", []) if entry["number"] in numbers]
    return {**manifest, "pairs": None, "fragments": fragments}


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
