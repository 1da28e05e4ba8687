# SPDX-License-Identifier: BSD-3-Clause
"""All pairs of a folder of fragments, on all GPUs of the machine, without losing work."""

from __future__ import annotations

import contextlib
import dataclasses
import numbers
import os
import queue
import threading
import time
from collections.abc import Callable, Sequence
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
    unusable : dict of int to str
        Fragments that could not be read or prepared, and why; their pairs are missing.
    """

    folder: Path
    pairs: int
    aligned: int
    resumed: int
    seconds: float
    unusable: dict[int, str] = dataclasses.field(default_factory=dict)

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
        """One row per pair, in tiles of 64 x 64 fragments; ``name_i`` and ``name_j`` say which files
        the numbers ``i`` and ``j`` are.
        """
        return self.folder / "results.parquet"

    def table(self) -> pa.Table:
        """The Parquet file, read."""
        return read_table(self.parquet)

    def __str__(self) -> str:
        done = self.pairs - self.resumed
        rate = f", {done / self.seconds:.3g} pairs/s" if done and self.seconds else ""
        without = f", without the fragments {', '.join(map(str, self.unusable))}"
        return (
            f"{self.pairs} pairs, {self.aligned} aligned, {self.resumed} done before"
            f"{without if self.unusable else ''}, {self.seconds:.1f} s{rate}: {self.folder}"
        )


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
    uninterrupted run, on any number of devices. A fragment that cannot be read or prepared costs its
    own pairs, and is named in the result; once it is repaired, or removed where the numbers of the
    others stay, the same call does what is missing.

    Parameters
    ----------
    fragments : FragmentSet, path as for `FragmentSet.from_directory`, or sequence of clouds
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
        If the folder holds another run; names the difference.
    IoError
        If a file of the folder is damaged; names it. If no pair has two usable fragments.
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
        unusable: dict[int, str] = {}
        if left:
            workers = _Workers(
                plan, store, left, list(contexts) if contexts else all_contexts(), memory
            )
            resumed += workers.run(progress, resumed)
            unusable = workers.unusable
        return conclude(store, plan, resumed, begin, unusable)
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


def conclude(
    store: Store, plan: Plan, resumed: int, begin: float, unusable: dict[int, str]
) -> BatchRun:
    """The final files of a run whose chunks are all there. unusable: positions of fragments, and
    why.
    """
    numbers = plan.fragments.numbers
    named = {numbers[position]: unusable[position] for position in sorted(unusable)}
    store.conclude(named)
    status = read_table(store.table_path, ["status"])["status"].to_pylist()
    aligned = sum(name in ALIGNED for name in status)
    return BatchRun(store.folder, len(status), aligned, resumed, time.monotonic() - begin, named)


def run_chunk(
    plan: Plan,
    chunk: int,
    residency: Residency,
    known: dict[Any, Row],
    add: Any = None,
    stop: Callable[[], bool] | None = None,
) -> list[Row]:
    """Rows of one chunk, in its order, without the pairs of fragments that cannot be used. known:
    those that are done; add(row) is called for each that is new.
    """
    pairs, keys = plan.chunk(chunk), plan.keys(chunk)
    todo = [k for k, key in enumerate(keys) if key not in known]
    rows: dict[Any, Row] = dict(known)

    def take(k: int, result: Any) -> None:
        key = keys[todo[k]]
        rows[key] = row_of(key[0], key[1], result)
        if add is not None:
            add(rows[key])

    residency.align(pairs[todo], take, stop)
    return [rows[key] for key in keys if key in rows]


class _Workers:
    """One thread per context, each taking the next chunk; the calling thread waits, and hears
    Ctrl-C.

    Ctrl-C raises between any two instructions of the calling thread. That thread therefore shares
    with the others only what is never half done: integers, and queues and locks written in C. It
    neither joins a running thread nor asks whether it lives: Python before 3.13 takes a thread for
    dead whose `join` was interrupted, and would end the process under it.
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
        self._stopping = False
        self._lock = threading.Lock()
        self._begun = self._ended = 0  # threads
        self._endings: queue.SimpleQueue[None] = queue.SimpleQueue()  # wakes who waits
        self._errors: list[BaseException] = []
        self._done = 0
        self._residencies: list[Residency] = []
        self._partial = {chunk: store.partial(chunk) for chunk in chunks}

    def run(self, progress: Progress, before: int) -> int:
        """Returns the number of pairs that partial chunks had."""
        partial = sum(map(len, self._partial.values()))
        self._done = before + partial
        threads: list[threading.Thread] = []
        with batch_progress(progress, "aligning", len(self._plan.pairs), self._done) as report:
            if report is not None:
                report(self._done, self._note())
            try:
                for context in self._contexts:
                    thread = threading.Thread(target=self._work, args=(context,))
                    thread.start()
                    threads.append(thread)
                while self._ended < len(self._contexts):
                    self._wait(0.1)
                    if report is not None:
                        report(self._done, self._note())
            finally:
                self._wind_up(threads)
            if report is not None:
                report(self._done, self._note())
        if self._errors:
            raise self._errors[0]
        return partial

    def _wait(self, seconds: float) -> None:
        with contextlib.suppress(queue.Empty):
            self._endings.get(timeout=seconds)

    def _wind_up(self, threads: Sequence[threading.Thread]) -> None:
        """Returns when no thread works any more, however often Ctrl-C is pressed: nothing else keeps
        the interpreter, and the lock of the folder, until then.
        """
        pressed: KeyboardInterrupt | None = None
        while True:
            try:
                with self._lock:  # a thread that begins later sees it, and returns
                    self._stopping = True
                while self._ended < self._begun:
                    self._wait(0.1)
                for thread in threads:  # past their work
                    thread.join()
                break
            except KeyboardInterrupt as again:
                pressed = again
        if pressed is not None:
            raise pressed

    @property
    def unusable(self) -> dict[int, str]:
        return {k: why for residency in self._residencies for k, why in residency.unusable.items()}

    def _note(self) -> str:
        """Fragments are prepared before the first of their pairs."""
        return f"{sum(residency.prepared for residency in self._residencies)} clouds prepared"

    def _work(self, context: Context) -> None:
        with self._lock:
            if self._stopping:
                return
            self._begun += 1
        try:
            self._take_chunks(context)
        except Stopped:
            pass
        except BaseException as error:  # raised again by the thread that waits
            self._errors.append(error)
            self._stopping = True
        finally:
            with self._lock:
                self._ended += 1
            self._endings.put(None)

    def _take_chunks(self, context: Context) -> None:
        residency = Residency(context, self._plan.fragments, self._plan.options, self._memory)
        self._residencies.append(residency)
        try:
            while not self._stopping:
                try:
                    chunk = self._chunks.get_nowait()
                except queue.Empty:
                    return
                self._run(chunk, residency)
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
            rows = run_chunk(self._plan, chunk, residency, known, add, lambda: self._stopping)
        except BaseException:
            self._store.write(chunk, [*known.values(), *new])
            raise
        self._store.write(chunk, rows)
        with self._lock:  # those that cannot be done count as done
            self._done += len(self._plan.chunk(chunk)) - len(rows)


__all__: list[str] = ["BatchRun", "all_contexts", "register_all"]
