# SPDX-License-Identifier: BSD-3-Clause
"""register_all on a Ray cluster: an actor per GPU, or per share of the CPUs, each with fragments of
its own in memory.

Scheduling, retries and placement are Ray's. What comes out does not depend on them: the files are,
byte for byte, those of `gpureg.register_all` on one machine.
"""

from __future__ import annotations

import os
import time
from typing import Any

try:
    import ray
    from ray.util import ActorPool
except ImportError as error:
    raise ImportError(
        "gpureg.ray needs Ray: pip install 'gpureg[ray]', or '.[ray]' from a checkout"
    ) from error

import numpy as np
import numpy.typing as npt

from . import _core
from ._batch.folder import RunFolder
from ._contexts import whole_number_of
from ._core import Context, RegistrationOptions, RegistrationResult
from ._progress import Progress, Report, batch_progress
from .batch import MEMORY, BatchRun, conclude, open_run
from .fragments import FragmentSet

_CHUNK = 256  # pairs that an actor takes at a time
# of one actor, before the run gives up: a chunk that kills whoever takes it shall not go on for
# ever
_DEATHS = 16
_POLL = 0.2  # seconds between two looks at the progress of chunks under way


class ProgressBoard:
    """Where actors write how many pairs of their chunk are done."""

    def __init__(self) -> None:
        self._done: dict[int, int] = {}

    def write(self, chunk: int, done: int) -> None:
        self._done[chunk] = done

    def read(self) -> dict[int, int]:
        return self._done


class ChunkWorker:
    """What an actor does: chunks of pairs, one after another, its fragments resident in between."""

    def __init__(
        self, fragments: FragmentSet, options: RegistrationOptions, memory: int, threads: int
    ) -> None:
        context = (
            Context.cpu(threads) if threads else Context.cuda()
        )  # Ray shows an actor its own GPU as device 0
        self._aligner = _core.FragmentAligner(context, fragments._core(), options, memory)

    def run(
        self, chunk: int, pairs: npt.NDArray[np.uint32], board: Any = None
    ) -> tuple[int, list[tuple[int, RegistrationResult]], dict[int, str]]:
        """The chunk, its results by row, and the fragments that could not be used so far."""
        results: list[tuple[int, RegistrationResult]] = []
        told = time.monotonic()

        def take(row: int, result: RegistrationResult) -> None:
            nonlocal told
            results.append((row, result))
            now = time.monotonic()
            if board is not None and now - told >= _POLL:
                board.write.remote(chunk, len(results))
                told = now

        self._aligner.align(pairs, take)
        return chunk, results, self._aligner.unusable


def register_all(
    fragments: Any,
    pairs: Any = "all",
    *,
    output: str | os.PathLike[str],
    options: RegistrationOptions | None = None,
    actors: int | None = None,
    gpus: bool | None = None,
    progress: Progress = True,
    resume: bool = True,
    chunk_size: int = _CHUNK,
    memory: int = MEMORY,
) -> BatchRun:
    """`gpureg.register_all` on the machines of a Ray cluster.

    Connects to the cluster that ``ray.init`` was called for, or that RAY_ADDRESS names; else starts
    one on this machine. An actor that dies is restarted, and its chunk tried again. The driver
    writes the files; a run goes on after the driver's death, too, here or with
    `gpureg.register_all`.

    Parameters
    ----------
    fragments, pairs, output, options, progress, resume, memory
        As for `gpureg.register_all`; memory is per actor. Progress counts pairs of unfinished chunks,
        too; those are done again after the driver's death. Folders must be where every machine finds
        them under the same name; clouds in memory travel by Ray's object store.
    actors : int, optional
        Default: one per GPU of the cluster, or one per CPU.
    gpus : bool, optional
        Whether actors use a GPU each. Default: if the cluster has any.
    chunk_size : int
        Pairs that an actor takes at a time.

    Returns
    -------
    BatchRun

    Raises
    ------
    ray.exceptions.RayActorError
        If an actor died more often than can be an accident; what was done is on disk.
    """
    begin = time.monotonic()
    whole_number_of(chunk_size, "chunk_size", 1)
    run = open_run(fragments, pairs, output, options, resume, memory)
    workers: list[Any] = []
    unusable: dict[int, str] = {}
    try:
        left = run.left()
        if left:
            if not ray.is_initialized():
                ray.init()
            chunks = [left[k : k + chunk_size] for k in range(0, len(left), chunk_size)]
            workers = _start(run, int(memory), actors, gpus)
            done = run.journal.done
            with batch_progress(progress, "aligning", run.journal.size, done) as report:
                _run(run, chunks, workers, report, unusable)
        return conclude(run, begin, unusable)
    finally:
        for worker in workers:
            ray.kill(worker)
        run.close()


def _run(
    run: RunFolder,
    chunks: list[list[int]],
    workers: list[Any],
    report: Report | None,
    unusable: dict[int, str],
) -> None:
    """Each chunk is written as it comes back. unusable gets what could not be used."""
    board = None if report is None else ray.remote(ProgressBoard).options(num_cpus=0).remote()
    pool = ActorPool(workers)
    for task in enumerate(chunks):
        pool.submit(
            lambda worker, task: worker.run.remote(task[0], run.pairs[task[1]], board), task
        )
    before = run.journal.done
    done = dict.fromkeys(range(len(chunks)), 0)
    try:
        while pool.has_next():
            try:
                chunk, results, bad = pool.get_next_unordered(timeout=_POLL)
                for row, result in results:
                    run.journal.add(chunks[chunk][row], result)
                run.journal.flush()
                unusable.update(bad)
                done[chunk] = len(chunks[chunk])
            except TimeoutError:
                for chunk, count in _read(board).items():
                    # A chunk that is tried again after its actor's death begins anew.
                    done[chunk] = max(done[chunk], count)
            if report is not None:
                report(before + sum(done.values()))
    finally:
        if board is not None:
            ray.kill(board)


def _read(board: Any) -> dict[int, int]:
    """Nothing if the board cannot be asked: a run does not fail for its progress."""
    if board is None:
        return {}
    try:
        found: dict[int, int] = ray.get(board.read.remote(), timeout=_POLL)
        return found
    except ray.exceptions.RayError:
        return {}


def _start(run: RunFolder, memory: int, actors: int | None, gpus: bool | None) -> list[Any]:
    resources = ray.cluster_resources()
    cpus, devices = float(resources.get("CPU", 1)), int(resources.get("GPU", 0))
    if gpus is None:
        gpus = devices > 0
    count = actors or (devices if gpus else int(cpus)) or 1
    if count < 1:
        raise ValueError(f"actors is {actors}, expected 1 or more")
    share = cpus / count
    limits: dict[str, Any] = {"max_restarts": _DEATHS, "max_task_retries": _DEATHS}
    if gpus:
        limits.update(num_gpus=min(1, devices / count), num_cpus=min(1.0, share))
    else:
        limits.update(num_cpus=int(share) if share >= 1 else share)
    shared = ray.put(run.fragments)
    threads = 0 if gpus else max(1, int(share))
    actor = ray.remote(ChunkWorker).options(**limits)
    return [actor.remote(shared, run.options, memory, threads) for _ in range(count)]


__all__ = ["register_all"]
