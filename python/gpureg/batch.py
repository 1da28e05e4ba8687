# SPDX-License-Identifier: BSD-3-Clause
"""All pairs of a folder of fragments, on all GPUs of the machine, without losing work."""

from __future__ import annotations

import dataclasses
import numbers
import os
import queue
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

try:
    import pyarrow as pa
except ImportError as error:
    raise ImportError(
        "register_all needs pyarrow: pip install 'gpureg[batch]', or '.[batch]' from a checkout"
    ) from error

from ._batch.plan import Plan
from ._batch.residency import Residency, Stopped
from ._batch.store import Row, Store, read_table
from ._batch.table import row_of
from ._core import BackendUnavailable, Context, RegistrationOptions
from ._progress import Progress, batch_progress
from .fragments import fragment_set
from .registration import ALIGNED

CHUNK = 256  # pairs: what a kill can cost, and what a cluster hands out
MEMORY = 4 << 30


@dataclasses.dataclass(frozen=True)
class BatchRun:
    """A finished run and where its files are.

    Attributes
    ----------
    folder : Path
    pairs, aligned : int
        Pairs tried, and of these aligned.
    resumed : int
        Pairs that earlier calls had done.
    seconds : float
        Of this call.
    """

    folder: Path
    pairs: int
    aligned: int
    resumed: int
    seconds: float

    @property
    def log(self) -> Path:
        """Redwood log of the aligned pairs: T_ij maps fragment j into fragment i."""
        return self.folder / "result.log"

    @property
    def information(self) -> Path:
        """Redwood information matrices of the same pairs."""
        return self.folder / "result.info"

    @property
    def parquet(self) -> Path:
        """One row per pair, in tiles of 64 x 64 fragments."""
        return self.folder / "results.parquet"

    def table(self) -> pa.Table:
        """The Parquet file, read."""
        return read_table(self.parquet)

    def __str__(self) -> str:
        done = self.pairs - self.resumed
        rate = f", {done / self.seconds:.3g} pairs/s" if done and self.seconds else ""
        return f"{self.pairs} pairs, {self.aligned} aligned, {self.resumed} done before, {self.seconds:.1f} s{rate}: {self.folder}"


def all_contexts() -> list[Context]:
    """One per CUDA device of this machine; without any, the CPU's."""
    contexts: list[Context] = []
    try:
        while True:
            contexts.append(Context.cuda(len(contexts)))
    except BackendUnavailable:
        return contexts or [Context.cpu()]


def register_all(
    fragments: Any,
    pairs: Any = "all",
    *,
    output: str | os.PathLike[str],
    options: RegistrationOptions | None = None,
    contexts: Sequence[Context] | None = None,
    progress: Progress = True,
    resume: bool = True,
    chunk_size: int = CHUNK,
    memory: int = MEMORY,
) -> BatchRun:
    """Align pairs of fragments into a folder that survives every interruption.

    Chunks of pairs are written as they finish. A run that was killed, or stopped by Ctrl-C, goes on
    when the same call is made again; the files in the end are, byte for byte, those of an
    uninterrupted run, on any number of devices.

    Parameters
    ----------
    fragments : FragmentSet, folder, or sequence of clouds
    pairs : "all", list of pairs, (M, 2) array, or callable
        Pairs of fragment numbers, see `FragmentSet.choose_pairs`; `gpureg.pruning.Nearest` for
        large sets.
    output : path
        Folder of the run: results.parquet, result.log, result.info; run.json says what the run is.
    options : RegistrationOptions, optional
    contexts : sequence of Context, optional
        One thread each. Default: one per CUDA device, or the CPU.
    progress : bool or callable
        True: a bar of tqdm. A callable gets (pairs done, pairs) several times a second.
    resume : bool
        False: discard what an earlier run left in the folder.
    chunk_size : int
        Pairs per chunk; a kill -9 costs at most one chunk per context, Ctrl-C nothing.
    memory : int
        Bytes that prepared fragments may take per context.

    Returns
    -------
    BatchRun

    Raises
    ------
    ValueError
        Where the folder holds another run; says what differs.
    IoError
        Where a file of the folder is damaged; names it.
    KeyboardInterrupt
        After Ctrl-C; what was done is on disk.

    Examples
    --------
    >>> import numpy as np, gpureg, tempfile
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> fragments = [cloud, cloud + [0.5, 0, 0], cloud - [0, 2, 0]]
    >>> few = gpureg.RegistrationOptions.from_voxel_size(0.05, quality=0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run = gpureg.register_all(fragments, output=folder, options=few, progress=False)
    ...     table = run.table()
    >>> run.pairs, table.column_names[:3], table["i"].to_pylist()
    (3, ['i', 'j', 'status'], [0, 0, 1])
    """
    begin = time.monotonic()
    plan = make_plan(fragments, pairs, options, chunk_size, memory)
    store = Store(Path(output), plan, resume)
    try:
        finished = store.finished()
        left = [chunk for chunk in range(plan.chunks) if chunk not in finished]
        resumed = sum(len(plan.chunk(chunk)) for chunk in finished)
        if left:
            resumed += _Workers(
                plan, store, left, list(contexts) if contexts else all_contexts(), memory
            ).run(progress, resumed)
        return conclude(store, plan, resumed, begin)
    finally:
        store.close()


def make_plan(
    fragments: Any, pairs: Any, options: RegistrationOptions | None, chunk_size: int, memory: int
) -> Plan:
    """Everything that can be wrong is looked at before the first pair runs."""
    options = options or RegistrationOptions()
    options.validate()
    kinds: list[Any] = [numbers.Integral, numbers.Real]  # 4e9 bytes are fine
    for name, value, kind in zip(("chunk_size", "memory"), (chunk_size, memory), kinds):
        if isinstance(value, bool) or not isinstance(value, kind):
            raise TypeError(
                f"{name}: expected a {'whole ' if kind is numbers.Integral else ''}number, got {value!r}"
            )
        if not value >= 1:
            raise ValueError(f"{name} is {value}, expected 1 or more")
    fragments = fragment_set(fragments)
    chosen = fragments.choose_pairs(pairs)
    if len(chosen) == 0:
        raise ValueError(f"pairs: there is none (fragments: {len(fragments)})")
    return Plan.make(fragments, options, chosen, chunk_size)


def conclude(store: Store, plan: Plan, resumed: int, begin: float) -> BatchRun:
    """The final files of a run whose chunks are all there."""
    store.conclude()
    status = read_table(store.table_path, ["status"])["status"]
    aligned = sum(name in ALIGNED for name in status.to_pylist())
    return BatchRun(store.folder, len(plan.pairs), aligned, resumed, time.monotonic() - begin)


def run_chunk(
    plan: Plan,
    chunk: int,
    residency: Residency,
    known: dict[Any, Row],
    add: Any = None,
    stop: threading.Event | None = None,
) -> list[Row]:
    """Rows of one chunk, in its order. known: those that are done; add(row) is called for each that
    is new.
    """
    pairs = plan.chunk(chunk)
    keys = [tuple(key) for key in plan.numbers(pairs).tolist()]
    todo = [k for k, key in enumerate(keys) if key not in known]
    rows = dict(known)

    def take(k: int, result: Any) -> None:
        key = keys[todo[k]]
        rows[key] = row_of(key[0], key[1], result)
        if add is not None:
            add(rows[key])

    residency.align(pairs[todo], take, stop)
    return [rows[key] for key in keys]


class _Workers:
    """One thread per context, each taking the next chunk; the calling thread waits, and hears
    Ctrl-C.
    """

    def __init__(
        self,
        plan: Plan,
        store: Store,
        chunks: Sequence[int],
        contexts: Sequence[Context],
        memory: int,
    ) -> None:
        self._plan, self._store, self._contexts, self._memory = plan, store, contexts, memory
        self._chunks: queue.SimpleQueue[int] = queue.SimpleQueue()
        for chunk in chunks:
            self._chunks.put(chunk)
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._errors: list[BaseException] = []
        self._done = 0
        self._residencies: list[Residency] = []
        self._partial = {chunk: store.partial(chunk) for chunk in chunks}

    def run(self, progress: Progress, before: int) -> int:
        """Returns the number of pairs that partial chunks had."""
        partial = sum(map(len, self._partial.values()))
        self._done = before + partial
        threads = [
            threading.Thread(target=self._work, args=(context,)) for context in self._contexts
        ]
        with batch_progress(progress, "aligning", len(self._plan.pairs), self._done) as report:
            if report is not None:
                report(self._done, self._note())
            for thread in threads:
                thread.start()
            try:
                while any(thread.is_alive() for thread in threads):
                    for thread in threads:
                        thread.join(0.1 / len(threads))
                    if report is not None:
                        report(self._done, self._note())
            finally:
                self._stop.set()
                for thread in threads:
                    thread.join()
            if report is not None:
                report(self._done, self._note())
        if self._errors:
            raise self._errors[0]
        return partial

    def _note(self) -> str:
        """Fragments are prepared before the first of their pairs."""
        return f"{sum(residency.prepared for residency in self._residencies)} clouds prepared"

    def _work(self, context: Context) -> None:
        residency = Residency(context, self._plan.fragments, self._plan.options, self._memory)
        self._residencies.append(residency)
        try:
            while not self._stop.is_set():
                try:
                    chunk = self._chunks.get_nowait()
                except queue.Empty:
                    return
                self._run(chunk, residency)
        except Stopped:
            pass
        except BaseException as error:  # raised again by the thread that waits
            self._errors.append(error)
            self._stop.set()
        finally:
            residency.close()

    def _run(self, chunk: int, residency: Residency) -> None:
        known = self._partial[chunk]
        new: list[Row] = []

        def add(row: Row) -> None:
            new.append(row)
            with self._lock:
                self._done += 1

        try:
            rows = run_chunk(self._plan, chunk, residency, known, add, self._stop)
        except BaseException:
            self._store.write_partial(chunk, [*known.values(), *new])
            raise
        self._store.write(chunk, rows)


__all__: list[str] = ["BatchRun", "all_contexts", "register_all"]
