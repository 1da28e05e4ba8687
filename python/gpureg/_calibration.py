# SPDX-License-Identifier: BSD-3-Clause
"""Scale of the confidence for one sensor."""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _core
from ._arrays import float64, several, to_numpy
from ._contexts import checked, context_of
from ._core import ConfidenceCalibration, Context, IoError, RegistrationOptions, __version__
from ._progress import Progress, Report, batch_progress
from .fragments import fragment_set, options_for

_KIND = "calibration"
_FORMAT_VERSION = 1
_NO_GROUP = 2**32 - 1
# Confidences do not depend on these.
_NOT_OF_SCENES = ("seed", "min_confidence", "accept_symmetry", "calibration")


def _plain(value: Any) -> Any:
    """Options as dicts."""
    names = getattr(value, "_fields", None)
    return value if names is None else {name: _plain(getattr(value, name)) for name in names}


@dataclasses.dataclass(frozen=True)
class RiskThreshold:
    """Result of `control_risk`.

    Attributes
    ----------
    max_risk : float
        That was asked for.
    max_failure : float
        That was asked for.
    supported : bool
        False: the samples are no proof for any threshold.
    min_confidence : float
        For ``RegistrationOptions.min_confidence``; 1 if nothing is supported.
    scans : int
    scenes : int
        0 of both: all samples count as independent.
    samples : int
    reported : int
        Those from ``min_confidence`` on.
    wrong : int
        The false ones of these.
    recall : float
        Share of the correct samples that are reported, [0, 1].
    more_samples : int or None
        If it is not supported: how many more would do if their shares of false poses stay as they
        are. None: no number would do.
    more_scans, more_scenes : int or None
        The same in scans; in scenes, at least.
    """

    max_risk: float
    max_failure: float
    supported: bool
    min_confidence: float
    scans: int
    scenes: int
    samples: int
    reported: int
    wrong: int
    recall: float
    more_samples: int | None
    more_scans: int | None
    more_scenes: int | None

    def _json(self) -> dict[str, Any]:
        out = dataclasses.asdict(self)
        out["false"] = out.pop("wrong")
        more = {"more_samples", "more_scans", "more_scenes"}
        unit = "scenes" if self.scenes else "scans" if self.scans else "samples"
        gone = {"min_confidence", "reported", "false", "recall"}
        gone = (more if self.supported else gone | more - {f"more_{unit}"}) | {"scans", "scenes"}
        return {name: value for name, value in out.items() if name not in gone - {unit}}


@dataclasses.dataclass(frozen=True)
class CalibrationRun:
    """Result of `calibrate`.

    Attributes
    ----------
    calibration : ConfidenceCalibration
        For ``RegistrationOptions.calibration``.
    enough_samples : bool
        False: the calibration changes nothing.
    error_before : float
        Expected calibration error of the samples, without the calibration.
    error_after : float
        The same with it.
    counts : dict
        ``pairs``, ``samples`` and ``correct`` of ``one_scan``, ``loop_consistency`` and
        ``trajectory``.
    voxel_size : float
        That it was made with.
    risk : RiskThreshold or None
        The answer to ``max_risk``.
    samples : tuple of list
        Confidences of the decided pairs of different scans, and whether they are correct.
    scans : list of tuple
        Numbers of their scans. With them and `scan_groups` they are the input of `control_risk`.
    scan_groups : list of int
        Group of each scan: all pairs of a group were aligned; 2**32 - 1: it is in none.
    clouds : list of int
        Hashes of the clouds, by which ``calibrate --scenes`` of the command tells scenes apart.
    options : RegistrationOptions
        That it was made with.
    """

    calibration: ConfidenceCalibration
    enough_samples: bool
    error_before: float
    error_after: float
    counts: dict[str, dict[str, int]]
    voxel_size: float
    risk: RiskThreshold | None = None
    samples: tuple[Sequence[float], Sequence[bool]] = ((), ())
    scans: Sequence[tuple[int, int]] = ()
    scan_groups: Sequence[int] = ()
    clouds: Sequence[int] = ()
    options: RegistrationOptions = dataclasses.field(
        default_factory=RegistrationOptions, compare=False
    )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file that ``--calibration`` of the command and `read_calibration` read,
        completely or not at all.

        Raises
        ------
        IoError
            Naming the file and the reason.
        """
        document = {
            "format_version": _FORMAT_VERSION,
            "gpureg": _KIND,
            "version": __version__,
            "slope": self.calibration.slope,
            "offset": self.calibration.offset,
            "enough_samples": self.enough_samples,
            "samples": self.counts,
            "calibration_error": {"before": self.error_before, "after": self.error_after},
            "voxel_size": self.voxel_size,
            "preset": "default",
            "options": {k: v for k, v in _plain(self.options).items() if k not in _NOT_OF_SCENES},
            "clouds": list(self.clouds),
            "decided_pairs": dict(zip(("confidence", "correct"), self.samples, strict=True)),
        }
        if self.risk is not None:
            document["risk"] = self.risk._json()
        _core.write_text(os.fspath(path), json.dumps(document, indent=1) + "\n")


def calibrate(
    clouds: Any,
    *,
    poses: Any = None,
    self_pairs: int = 200,
    scan_pairs: int = 600,
    max_risk: float | None = None,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
    progress: Progress = False,
) -> CalibrationRun:
    """Scale the confidence to the sensor that made these clouds. No truth is needed.

    Parameters
    ----------
    clouds : path, FragmentSet, or sequence
        A folder of fragments; or clouds, each whatever `prepare` takes as points. A dozen or more,
        some of which overlap.
    poses : (N, 4, 4) array, optional
        ``world_from_cloud``, accurate to about a voxel; NaN if it is not known. They decide
        which poses are correct. Default: loops decide.
    self_pairs : int
        Pairs made of one scan.
    scan_pairs : int
        Largest number of pairs of different scans; if there are more, those within groups of
        consecutive scans.
    max_risk : float, optional
        Also find the threshold of `control_risk` for this share, on the pairs of different scans.
    options : RegistrationOptions, optional
        The calibration holds for its voxel size. Default: those of the one that some clouds suggest.
    context : Context, optional
    progress : bool or callable
        True: a bar of tqdm, if installed. A callable gets (pairs done, pairs).

    Returns
    -------
    CalibrationRun

    Raises
    ------
    TypeError, ValueError
        Naming the argument.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> rng = np.random.default_rng(1)
    >>> run = gpureg.calibrate([rng.random((1000, 3)) for _ in range(2)], self_pairs=2)
    >>> run.enough_samples, run.calibration
    (False, ConfidenceCalibration(slope=1.0, offset=0.0))
    """
    checked(options, RegistrationOptions, "options")
    context = context_of(context)
    numbers = {"self_pairs": self_pairs, "scan_pairs": scan_pairs}
    for name, value in numbers.items():
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
            raise TypeError(f"{name}: expected a whole number >= 0, got {value!r}")
        numbers[name] = min(int(value), 2**32 - 1)  # the library refuses large ones by name
    if not isinstance(clouds, str | os.PathLike) and not hasattr(clouds, "numbers"):
        clouds = several(clouds, "clouds")
    fragments = fragment_set(clouds)
    known = None
    if poses is not None:
        known = float64(poses, "poses")
        if known.shape != (len(fragments), 4, 4):
            raise ValueError(
                f"poses: expected shape ({len(fragments)}, 4, 4), got {np.shape(poses)}"
            )
    options = options_for(options, fragments)
    inputs = [fragments.load(k, options) for k in range(len(fragments))]
    with _told(progress) as tell:
        found = _core.calibrate(
            context, inputs, options, numbers["self_pairs"], numbers["scan_pairs"], known, tell
        )
    risk = None
    if max_risk is not None:
        risk = _control_risk(
            found["samples"],
            (found["scans"], found["scan_groups"]),
            None,
            max_risk,
            0.05,
            found["calibration"],
        )
    voxel_size = options.voxel_size
    return CalibrationRun(voxel_size=voxel_size, risk=risk, options=copy.copy(options), **found)


@contextlib.contextmanager
def _told(progress: Progress) -> Iterator[Callable[[int, int], None] | None]:
    """Progress of a call that knows its total only once it runs."""
    with contextlib.ExitStack() as stack:
        reports: list[Report | None] = []

        def tell(done: int, total: int) -> None:
            if not reports:
                reports.append(stack.enter_context(batch_progress(progress, "aligning", total)))
            if reports[0] is not None:
                reports[0](done)

        yield tell if progress else None


def fit_calibration(
    confidences: Any, correct: Any, weights: Any = None
) -> tuple[ConfidenceCalibration, bool]:
    """Fit a calibration to poses whose truth you know.

    Parameters
    ----------
    confidences : (N,) floats
        Before any calibration.
    correct : (N,) bools
    weights : (N,) floats, optional

    Returns
    -------
    calibration : ConfidenceCalibration
    enough_samples : bool
        False: fewer than ten correct or ten false poses; the calibration changes nothing.

    Examples
    --------
    >>> import gpureg
    >>> calibration, enough = gpureg.fit_calibration([0.9, 0.6] * 50, [True, False] * 50)
    >>> enough, calibration.slope > 1, calibration(0.6) < 0.3
    (True, True, True)
    """
    values, verdicts = _labelled(confidences, correct)
    weight = np.ones(values.shape) if weights is None else float64(weights, "weights")
    if weight.shape != values.shape:
        raise ValueError(f"weights: expected shape {values.shape}, got {weight.shape}")
    return _core.fit_calibration(values.tolist(), verdicts.tolist(), weight.tolist())


def control_risk(
    confidences: Any,
    correct: Any,
    *,
    scans: Any = None,
    scan_groups: Any = None,
    scenes: Any = None,
    max_risk: float = 0.01,
    max_failure: float = 0.05,
) -> RiskThreshold:
    """Find the lowest confidence from which at most ``max_risk`` of the reported poses are false.

    With probability ``1 - max_failure`` over the samples this is so in the long run for pairs like
    them, whatever the confidence is worth; with ``scans``, for the pairs of further scans; with
    ``scenes``, for the pairs of a further scene.

    Parameters
    ----------
    confidences : (N,) floats
        Of pairs, drawn like those of later.
    correct : (N,) bools
    scans : (N, 2) ints, optional
        The two scans of each pair, numbers from 0. Pairs of one folder share scans, and one bad scan
        makes many pairs false: without a false report, 10 % takes 94 scans, 5 % takes 192 and 1 %
        takes 978, drawn independently of each other. Default: no two pairs share a scan.
    scan_groups : (S,) ints, optional
        Group of each scan, 2**32 - 1 for none: all pairs of a group were aligned, and no others.
        Default: all scans of ``scans`` are one group.
    scenes : (N,) labels, optional
        Scene of each pair: buildings, not parts of one. 19 or more are needed for a ``max_failure``
        of 0.05.
    max_risk, max_failure : float
        In (0, 1).

    Returns
    -------
    RiskThreshold

    Raises
    ------
    TypeError, ValueError
        Naming the argument; for a pair of scans that is given twice.

    Examples
    --------
    >>> import gpureg
    >>> gpureg.control_risk([0.99] * 100, [True] * 100, max_risk=0.05).min_confidence
    0.05
    >>> pairs = [(i, j) for i in range(24) for j in range(i)]
    >>> found = gpureg.control_risk([0.99] * 276, [True] * 276, scans=pairs, max_risk=0.05)
    >>> found.supported, found.more_scans
    (False, 168)
    """
    values, verdicts = _labelled(confidences, correct)
    groups = of_scans = None
    if scans is not None and scenes is not None:
        raise ValueError("scenes: not with scans, a further scene has scans of its own")
    if scan_groups is not None and scans is None:
        raise ValueError("scan_groups: needs scans")
    if scans is not None:
        pairs = _numbers(scans, "scans")
        if pairs.shape != (len(values), 2):
            raise ValueError(f"scans: expected shape ({len(values)}, 2), got {pairs.shape}")
        if scan_groups is None:
            found, inverse = np.unique(pairs, return_inverse=True)
            pairs, of_all = inverse.reshape(pairs.shape), np.zeros(len(found), np.int64)
        else:
            of_all = _numbers(scan_groups, "scan_groups")
        of_scans = (pairs.tolist(), of_all.tolist())
    if scenes is not None:
        labels = to_numpy(scenes, "scenes")
        if labels.shape != values.shape:
            raise ValueError(f"scenes: expected shape {values.shape}, got {labels.shape}")
        groups = np.unique(labels, return_inverse=True)[1].tolist()
    identity = ConfidenceCalibration()
    samples = (values.tolist(), verdicts.tolist())
    return _control_risk(samples, of_scans, groups, max_risk, max_failure, identity)


def _numbers(values: Any, name: str) -> Any:
    """Of scans or groups, which are small."""
    numbers = to_numpy(values, name)
    if numbers.dtype.kind not in "iu" or np.any(numbers < 0) or np.any(numbers > _NO_GROUP):
        raise TypeError(f"{name}: expected whole numbers >= 0, got {numbers.dtype}")
    return numbers.astype(np.int64)


def _labelled(confidences: Any, correct: Any) -> tuple[Any, Any]:
    values, verdicts = float64(confidences, "confidences"), to_numpy(correct, "correct")
    if values.ndim != 1:
        raise ValueError(f"confidences: expected shape (N,), got {values.shape}")
    if verdicts.dtype != np.bool_:
        raise TypeError(f"correct: expected bools, got {verdicts.dtype}")
    if verdicts.shape != values.shape:
        raise ValueError(f"correct: expected shape {values.shape}, got {verdicts.shape}")
    return values, verdicts


def _control_risk(
    samples: tuple[Sequence[float], Sequence[bool]],
    scans: tuple[Sequence[Sequence[int]], Sequence[int]] | None,
    scenes: list[int] | None,
    max_risk: float,
    max_failure: float,
    calibration: ConfidenceCalibration,
) -> RiskThreshold:
    pairs, groups = scans or (None, [])
    found = _core.control_risk(*samples, pairs, groups, scenes, max_risk, max_failure, calibration)
    return RiskThreshold(max_risk=max_risk, max_failure=max_failure, **found)


def read_calibration(path: str | os.PathLike[str]) -> ConfidenceCalibration:
    """Read the file of ``gpureg calibrate`` or `CalibrationRun.save`.

    Raises
    ------
    IoError
        Naming file and field.
    """
    name = os.fspath(path)
    try:
        document = json.loads(Path(path).read_text())
    except OSError as error:
        raise IoError(f"cannot read {name}: {error.strerror}") from None
    except ValueError as error:
        raise IoError(f"{name}: {error}") from None
    kind = document.get("gpureg") if isinstance(document, dict) else None
    if kind != _KIND:
        raise IoError(f'{name}: no calibration of `gpureg calibrate`, "gpureg" is not "{_KIND}"')
    version = document.get("format_version", 1)
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise IoError(f'{name}: "format_version" is {version!r}, expected an integer >= 1')
    if version > _FORMAT_VERSION:
        raise IoError(
            f"{name}: format version {version}, this gpureg reads versions up to "
            f"{_FORMAT_VERSION}; a newer gpureg wrote it"
        )
    values = {}
    for field in ("slope", "offset"):
        value = document.get(field)
        fine = isinstance(value, int | float) and not isinstance(value, bool)
        if not fine or not math.isfinite(value) or (field == "slope" and value <= 0):
            expected = "a number > 0" if field == "slope" else "a number"
            raise IoError(f'{name}: "{field}" is {value!r}, expected {expected}')
        values[field] = float(value)
    return ConfidenceCalibration(**values)


__all__ = [
    "CalibrationRun",
    "RiskThreshold",
    "calibrate",
    "control_risk",
    "fit_calibration",
    "read_calibration",
]
