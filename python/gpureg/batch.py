# SPDX-License-Identifier: BSD-3-Clause
"""All pairs of a folder of fragments, on all GPUs of the machine, without losing work."""

from __future__ import annotations

import dataclasses
import numbers
import os
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

from . import _core
from ._batch.folder import INFORMATION, JOURNAL, LOG, TABLE, RunFolder, read_table
from ._core import BackendUnavailable, Context, RegistrationOptions
from ._progress import Progress, batch_progress
from .fragments import fragment_set, options_for

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
        return self.folder / LOG

    @property
    def information(self) -> Path:
        """Redwood information matrices of the same pairs."""
        return self.folder / INFORMATION

    @property
    def parquet(self) -> Path:
        """One row per pair, in tiles of 64 x 64 fragments; ``name_i`` and ``name_j`` say which files
        the numbers ``i`` and ``j`` are.
        """
        return self.folder / TABLE

    @property
    def journal(self) -> Path:
        """All results without loss, for `reconstruct`, ``gpureg reconstruct --results`` and further
        calls of `register_all`.
        """
        return self.folder / JOURNAL

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
    memory: int = MEMORY,
) -> BatchRun:
    """Align pairs of fragments into a folder that survives every interruption.

    Results are written as they come. A run that was killed, or stopped by Ctrl-C, goes on
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
        Folder of the run: pairs.journal, and of it results.parquet, result.log and result.info.
    options : RegistrationOptions, optional
        Default: those of the voxel size that some fragments suggest.
    contexts : sequence of Context, optional
        One thread each. Default: one per CUDA device, or the CPU.
    progress : bool or callable
        True: a bar of tqdm. A callable gets (pairs done, pairs) several times a second.
    resume : bool
        False: discard what an earlier run left in the folder.
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
        If the journal is damaged. If no pair has two usable fragments.
    KeyboardInterrupt
        After Ctrl-C; what was done is on disk.

    Examples
    --------
    >>> import numpy as np, gpureg, tempfile
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> fragments = [cloud, cloud + [0.5, 0, 0], cloud - [0, 2, 0]]
    >>> few = gpureg.RegistrationOptions(voxel_size=0.05, quality=0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run = gpureg.register_all(fragments, output=folder, options=few, progress=False)
    ...     table = run.table()
    >>> run.pairs, table.column_names[:3], table["i"].to_pylist()
    (3, ['i', 'j', 'status'], [0, 0, 1])
    """
    begin = time.monotonic()
    run = open_run(fragments, pairs, output, options, resume, memory)
    try:
        unusable: dict[int, str] = {}
        if run.left():
            total, done = run.journal.size, run.journal.done
            with batch_progress(progress, "aligning", total, done) as report:

                def tell(done: int, prepared: int) -> None:
                    if report is not None:
                        report(done, f"{prepared} clouds prepared")

                tell(done, 0)
                unusable = _core.register_set(
                    list(contexts) if contexts else all_contexts(),
                    run.source,
                    run.journal,
                    run.options,
                    int(memory),
                    tell,
                )
                if report is not None:  # those that cannot be done count as done
                    report(total)
        return conclude(run, begin, unusable)
    finally:
        run.close()


def open_run(
    fragments: Any,
    pairs: Any,
    output: str | os.PathLike[str],
    options: RegistrationOptions | None,
    resume: bool,
    memory: int,
) -> RunFolder:
    """Everything that can be wrong is looked at before the first pair runs."""
    if options is not None:
        options.validate()
    if isinstance(memory, bool) or not isinstance(memory, numbers.Real):  # 4e9 bytes are fine
        raise TypeError(f"memory: expected a number, got {memory!r}")
    if not memory >= 1:
        raise ValueError(f"memory is {memory}, expected 1 or more")
    fragments = fragment_set(fragments)
    chosen = fragments.choose_pairs(pairs)
    if len(chosen) == 0:
        raise ValueError(f"pairs: there is none (fragments: {len(fragments)})")
    journal = os.fspath(Path(output) / JOURNAL)
    known = _core.voxel_size_of_journal(journal) if resume else 0
    return RunFolder(
        Path(output), fragments, options_for(options, fragments, known), chosen, resume
    )


def conclude(run: RunFolder, begin: float, unusable: dict[int, str]) -> BatchRun:
    """The final files. unusable: positions of fragments, and why."""
    aligned = run.conclude(unusable)
    return BatchRun(
        run.folder,
        run.journal.done,
        aligned,
        run.journal.resumed,
        time.monotonic() - begin,
        {run.fragments.numbers[k]: unusable[k] for k in sorted(unusable)},
    )


__all__: list[str] = ["BatchRun", "all_contexts", "register_all"]
