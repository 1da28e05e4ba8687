# SPDX-License-Identifier: BSD-3-Clause
"""The library's confidences are those that bench/accuracy/fit_confidence.py computes from the same
evidence and coefficients.
"""

import pathlib
import re
import sys

import gpureg
import numpy as np
import pytest
from scenes import moved, pose

ROOT = pathlib.Path(__file__).resolve().parents[2]
if not (ROOT / "bench/accuracy/fit_confidence.py").exists():
    pytest.skip("not in a checkout", allow_module_level=True)
sys.path.insert(0, str(ROOT / "bench/accuracy"))
import fit_confidence

SIDES = (
    "overlap",
    "reach",
    "normal_weighted_overlap",
    "seen",
    "impossible",
    "hidden",
    "around",
    "front_violation_near",
    "front_violation_far",
    "behind_surface",
)


def shipped(name):
    """The three regressions of a model, out of the header."""
    text = (ROOT / "src/confidence/confidence_model.hpp").read_text()
    biases = re.search(rf"constexpr Model {name}{{{{(.*)}}}};", text).group(1)
    out = []
    for stage in ("ranking", "confidence", "overlap"):
        fit = fit_confidence.Logistic.__new__(fit_confidence.Logistic)
        fit.weights = np.array(
            re.search(rf"{name}_{stage}\[\] = {{([^}}]*)}}", text).group(1).split(","), float
        )
        fit.bias = float(re.search(rf"{name}_{stage}, ([^}}]*)}}", biases + "}").group(1))
        out.append(fit)
    return out


def evidence_of(mode):
    e = mode.evidence
    return {
        **{side: [getattr(e, f"source_{side}"), getattr(e, f"target_{side}")] for side in SIDES},
        "match_inliers": e.match_inliers,
        "match_support": e.match_support,
        "information_eigenvalues": list(e.information_eigenvalues),
    }


def expected(modes, name, refined, points):
    """Confidence and overlap confidence of the best mode."""
    model, (ranking, confidence, overlap) = fit_confidence.MODELS[name], shipped(name)

    class Run:
        x = {
            model: [np.array([fit_confidence.measures(e, *model) for e in map(evidence_of, modes)])]
        }

    Run.refined = refined
    x, best, share = fit_confidence.second_view(Run, model, ranking)
    assert best == [0]
    few = fit_confidence.with_so_few_points(evidence_of(modes[0]), points)
    sigmoid = [1 / (1 + np.exp(-fit.logit(x)[0])) for fit in (confidence, overlap)]
    sure = min(sigmoid[0], share[0]) * few
    return sure, min(sigmoid[1], sure)


def corner(seed, boxes, points):
    """A corner of a room with boxes, of which it is half seen."""
    rng = np.random.default_rng(7)
    parts = [rng.random((points, 3)) * 3 * (np.arange(3) != axis) for axis in range(3)]
    for _ in range(boxes):
        faces = rng.integers(0, 6, points // 8)
        box = rng.random((points // 8, 3))
        box[np.arange(len(box)), faces % 3] = faces // 3
        parts.append(rng.random(3) * 2 + box * (0.2 + rng.random(3) * 0.5))
    cloud = np.concatenate(parts)
    side = np.random.default_rng(seed).normal(size=3)
    return cloud[(cloud - 1.3) @ side > -0.5] + np.random.default_rng(seed).normal(size=3) * 1e-3


@pytest.mark.parametrize("name", fit_confidence.MODELS)
def test_as_fitted(name):
    free_space, surface_sides = fit_confidence.MODELS[name]
    options = gpureg.RegistrationOptions.from_voxel_size(0.05)
    options.min_confidence = 0
    if not free_space:
        options.prepare.depth_maps = 0
    if not surface_sides:
        options.prepare.surface_side_distance = 0
    seen = set()
    for seed, boxes, points in (
        (1, 6, 6000),
        (2, 3, 6000),
        (3, 1, 3000),
        (4, 6, 300),
        (5, 4, 12000),
    ):
        a, b = corner(seed, boxes, points), moved(corner(seed + 50, boxes, points), pose(seed))
        eye = np.array([[1.3, 1.4, 1.5]])
        source = gpureg.prepare(a, viewpoints=eye, options=options.prepare)
        target = gpureg.prepare(b, viewpoints=moved(eye, pose(seed)), options=options.prepare)
        result = gpureg.align(source, target, options=options)
        assert result.modes
        want = expected(
            result.modes, name, options.evidence.modes, (len(source.points), len(target.points))
        )
        np.testing.assert_allclose(
            (result.modes[0].confidence, result.modes[0].overlap_confidence),
            want,
            rtol=1e-6,
            atol=1e-9,
        )
        front = sum(evidence_of(result.modes[0])["front_violation_near"])
        seen.add(
            "above"
            if front > fit_confidence.MIN_VERIFIED_FRONT_VIOLATION
            else "between"
            if front > fit_confidence.MIN_FRONT_VIOLATION
            else "below"
        )
    assert not surface_sides or len(seen) > 1, seen
