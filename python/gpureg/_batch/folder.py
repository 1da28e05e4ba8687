# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a run: a journal of all results, and the tables that are made of it at the end."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from .. import _core
from .._core import InvalidArgument, IoError, RegistrationOptions, RegistrationResult
from ..fragments import FragmentSet
from ..registration import ALIGNED
from .table import row_of, table_of

JOURNAL, TABLE, LOG, INFORMATION = (
    "pairs.journal",
    "results.parquet",
    "result.log",
    "result.info",
)
_ROWS = 4096  # of the table that are in memory together


class RunFolder:
    """Whatever moment a process dies at, the results that it had are in the journal. A fragment of
    which there is no pair yet may change, come or go.
    """

    def __init__(
        self,
        folder: Path,
        fragments: FragmentSet,
        options: RegistrationOptions,
        pairs: npt.NDArray[np.int64],
        resume: bool,
    ) -> None:
        """pairs: positions i < j, in the order of the log."""
        self.folder, self.fragments, self.options = folder, fragments, options
        self.source = fragments._core(fingerprints=True)
        self.pairs = np.ascontiguousarray(pairs[:, ::-1], np.uint32)  # the later into the earlier
        folder.mkdir(parents=True, exist_ok=True)
        older = [folder / name for name in ("run.json", "run.lock", "chunks")]
        if resume and older[0].exists():
            raise IoError(
                f"output: {folder} holds a run of an older gpureg; take another folder, or resume=False to start anew"
            )
        try:
            self.journal = _core.PairJournal(
                os.fspath(folder / JOURNAL),
                options,
                self.source,
                self.pairs,
                "resume" if resume else "restart",
            )
        except _core.DamagedJournal as error:
            raise IoError(f"output: {error}; resume=False starts anew") from None
        except InvalidArgument as error:
            raise InvalidArgument(
                f"output: {folder} holds a run that is not this one: {error}; take another folder, or resume=False to start anew"
            ) from None
        if not resume:
            shutil.rmtree(older.pop(), ignore_errors=True)
            for path in (*older, *map(folder.joinpath, (TABLE, LOG, INFORMATION))):
                path.unlink(missing_ok=True)

    def close(self) -> None:
        self.journal.close()

    def left(self) -> list[int]:
        """Pairs without a result, in the order of work."""
        return [k for k in _core.in_tiles(self.pairs) if not self.journal.has(k)]

    def conclude(self, unusable: dict[int, str]) -> int:
        """Writes the tables, unless they are there. Returns the number of aligned pairs."""
        if self.journal.done == 0:
            raise IoError(f"fragments: no pair can be aligned: {next(iter(unusable.values()))}")
        names = (TABLE, LOG, INFORMATION)
        if self.journal.note == self._state() and all((self.folder / n).exists() for n in names):
            try:
                status = read_table(self.folder / TABLE, ["status"])["status"].to_pylist()
                return sum(name in ALIGNED for name in status)
            except IoError:
                pass  # made again
        aligned = self._write_logs()
        _write(self.folder / TABLE, self._write_table)
        self.journal.set_note(self._state())
        return aligned

    def _state(self) -> int:
        """Of what the tables say: results, and the numbers of the fragments."""
        state = repr((self.journal.done, self.fragments.numbers, self.fragments.names))
        return int.from_bytes(hashlib.blake2b(state.encode(), digest_size=8).digest(), "little")

    def _results(self, order: Any) -> Iterator[tuple[int, int, RegistrationResult]]:
        numbers = self.fragments.numbers
        for k in order:
            if self.journal.has(k):
                source, target = self.pairs[k].tolist()
                yield numbers[target], numbers[source], self.journal.result(k)

    def _write_logs(self) -> int:
        log, information = [], []
        for i, j, result in self._results(range(len(self.pairs))):
            if not result.aligned:
                continue
            moments = result.source_moments.information_redwood()
            log.append((i, j, self.fragments.count, result.target_from_source))
            information.append((i, j, self.fragments.count, moments))
        _core.write_log(os.fspath(self.folder / LOG), log)
        _core.write_information(os.fspath(self.folder / INFORMATION), information)
        return len(log)

    def _write_table(self, temporary: Path) -> None:
        names = dict(zip(self.fragments.numbers, self.fragments.names))
        rows: list[dict[str, Any]] = []
        writer: pq.ParquetWriter | None = None
        try:

            def write() -> None:
                nonlocal writer
                table = table_of(rows)
                writer = writer or pq.ParquetWriter(temporary, table.schema)
                writer.write_table(table)
                rows.clear()

            for i, j, result in self._results(_core.in_tiles(self.pairs)):
                rows.append({**row_of(i, j, result), "name_i": names[i], "name_j": names[j]})
                if len(rows) == _ROWS:
                    write()
            if rows:
                write()
        finally:
            if writer is not None:
                writer.close()


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
        raise IoError(
            f"output: {path} is damaged ({reason}); the same call makes it anew"
        ) from None


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
