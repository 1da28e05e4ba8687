# SPDX-License-Identifier: BSD-3-Clause
"""bench/accuracy/fit_confidence.py and the library agree on the features and on the coefficients of
the confidence.
"""

import pathlib
import sys

import gpureg
import numpy as np
import pytest
from gpureg import _core
from scenes import moved, pose

ROOT = pathlib.Path(__file__).resolve().parents[2]
if not (ROOT / "bench/accuracy/fit_confidence.py").exists():
    pytest.skip("not in a checkout", allow_module_level=True)
sys.path.insert(0, str(ROOT / "bench/accuracy"))
import fit_confidence

from confidence import model_header
from confidence.regressions import ALL_MODELS, MODELS, SIGNS

HEADER = (ROOT / "src/confidence/confidence_model.hpp").read_text()
SIDES = tuple(
    name.removeprefix("source_")
    for name in vars(gpureg.PoseEvidence)
    if name.startswith("source_") and name != "source_residual"
)
ALONE = ("match_inliers", "match_support", "information_eigenvalues")


def evidence_of(mode):
    """As in a result's JSON."""
    e = mode.evidence
    sides = {key: [getattr(e, f"source_{key}"), getattr(e, f"target_{key}")] for key in SIDES}
    return {**sides, **{key: getattr(e, key) for key in ALONE}}


def some_evidence(modes=3):
    rng = np.random.default_rng(1)
    sides = {key: rng.uniform(0.1, 0.5, (modes, 2)) for key in SIDES}
    return {
        **sides,
        "match_inliers": np.arange(modes) + 10.0,
        "match_support": np.full(modes, 0.01),
        "information_eigenvalues": np.sort(rng.uniform(1, 9, (modes, 6))),
    }


def run_of(result, options, source, target):
    """The modes of one pair, as the script sees them."""
    run = fit_confidence.Run.__new__(fit_confidence.Run)
    run.evidence = fit_confidence.columns([evidence_of(mode) for mode in result.modes])
    run.modes_per_pair, run.refined = np.array([len(result.modes)]), 24
    run.factor = fit_confidence.overlap_factor(
        run.evidence["overlap"], len(source.points), len(target.points)
    )
    return run


def corner(seed, boxes, points):
    """Half of a corner of a room with boxes."""
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


def test_the_fit_knows_how_many_modes_were_ranked():
    assert fit_confidence.refined_modes({"quality": 5, "tune": ""}) == 24
    assert fit_confidence.refined_modes({"quality": 5, "tune": "evidence.modes=7"}) == 7
    assert fit_confidence.refined_modes({"evidence": {"modes": 9}}) == 9  # before options were few


@pytest.mark.parametrize("name", MODELS)
def test_the_shipped_coefficients_make_the_confidences(name):
    model, regressions = MODELS[name], model_header.read_header(HEADER)[name]
    options = gpureg.RegistrationOptions(voxel_size=0.05)
    options.min_confidence = 0
    if not model.free_space:
        options.prepare.depth_maps = 0
    if not model.surface_sides:
        options.prepare.surface_side_distance = 0
    differs = set()
    for seed, boxes, points in (
        (1, 6, 6000),
        (2, 3, 6000),
        (3, 1, 3000),
        (4, 6, 300),
        (5, 4, 12000),
    ):
        a, b = corner(seed, boxes, points), moved(corner(seed + 50, boxes, points), pose(seed))
        eye = np.array([[1.3, 1.4, 1.5]])
        source = gpureg.prepare(a, viewpoints=eye, options=options)
        there = moved(eye, pose(seed))
        if model.model:  # the normals say which side is outside
            target = gpureg.prepare(b, normals=there - b, viewpoints="model", options=options)
        else:
            target = gpureg.prepare(b, viewpoints=there, options=options)
        result = gpureg.align(source, target, options=options)
        assert result.modes
        run = run_of(result, options, source, target)
        best, confidence, overlapping = fit_confidence.confidences(run, model, regressions)
        assert best.tolist() == [0]
        np.testing.assert_allclose(
            (result.modes[0].confidence, result.modes[0].overlap_confidence),
            (confidence[0], overlapping[0]),
            # On a model the pose is the one of its mode whose normals agree best, and has the
            # confidence of the likeliest.
            rtol=1e-3 if model.model else 1e-9,
            atol=1e-12,
        )
        ranking, verified = (
            run.features(model, regressand, best) for regressand in ("ranking", "confidence")
        )
        names = np.array(_core._confidence_feature_names())
        differs.update(names[(ranking != verified).any(0)])
    # Small front violations rank modes alone, where free space is known. In models, what the scan saw through
    # verifies alone, and how well normals agree verifies up to the share of noisy scans.
    of_one_alone = {
        (True, True, False): {"log_front_violation_near"},
        (False, True, True): {"log_higher_weighted_overlap", "log_higher_violation"},
    }
    assert differs == of_one_alone.get(tuple(model)[:3], set())


def test_the_header_is_of_todays_format():
    written = model_header.header(model_header.read_header(HEADER))
    assert "".join(written.split()) == "".join(HEADER.split())


RANK = (
    "log_odds",
    "margin",
    "distinct_share",
    "share",
    "rival_match_inliers",
    "third_match_inliers",
)
RANK += ("rival_match_support", "rival_weighted_overlap")
RANK += ("match_inliers_lead", "match_support_lead", "weighted_overlap_lead")


def test_models_use_features_that_their_evidence_has():
    names = np.array(_core._confidence_feature_names())
    assert len(set(names)) == len(names)
    for name, regressions in model_header.read_header(HEADER).items():
        model = ALL_MODELS[name]
        for stage, regressand in (("ranking", "ranking"), ("confidence", "confidence")):
            x = _core._confidence_features(some_evidence(), *model[:3], regressand)
            there = set(names[(x != 0).any(0)]) | (set(RANK) if stage == "confidence" else set())
            of = regressions[stage]
            used = set(names[of.weights != 0]) | {names[k] for k, *_ in of.steps}
            assert used and used <= there, (name, stage)
            if model.additive and stage == "confidence":
                assert all(np.sign(rise) == SIGNS[names[k]] for k, _, _, rise in of.steps)


def test_rank_among_the_modes_of_each_pair():
    names = _core._confidence_feature_names()
    own = np.zeros((3, len(names)))
    own[:, names.index("log_match_inliers")] = 4, 5, 3
    odds = [3.0, 20.0, 1.0]
    table = _core._confidence_rank_features(odds, own, [2, 0, 1], 10)
    rows = [dict(zip(names, row)) for row in table.tolist()]
    assert [(r["log_odds"], r["margin"], r["distinct_share"]) for r in rows] == [
        (3, -11, 0.2),
        (14, 11, 0.2),
        (1, 15, 0.1),
    ]
    assert [r["rival_match_inliers"] for r in rows] == [5, 4, 0]
    assert [r["match_inliers_lead"] for r in rows] == [-1, 1, 3]
    assert rows[1]["share"] == pytest.approx(np.log(1e4))
    for counts in ([2], [2, 2]):
        with pytest.raises(ValueError, match="modes_per_pair"):
            _core._confidence_rank_features(odds, own, counts, 10)
    with pytest.raises(ValueError, match="own"):
        _core._confidence_rank_features(odds, own[:2], [2, 1], 10)


def test_wrong_evidence_is_named():
    evidence = some_evidence()
    for key, values, message in (
        ("observed", None, "no 'observed'"),
        ("overlap", np.zeros(3), "expected 2 numbers"),
        ("occluded", np.zeros((2, 2)), "as many rows"),
    ):
        wrong = {k: v for k, v in evidence.items() if k != key}
        if values is not None:
            wrong[key] = values
        with pytest.raises(ValueError, match=message):
            _core._confidence_features(wrong, True, True, False, "ranking")
    with pytest.raises(ValueError, match="regressand"):
        _core._confidence_features(evidence, True, True, False, "pose")


def test_changed_evidence_is_of_one_side():
    evidence = some_evidence()
    evidence["observed"][1] = 0
    side, share = np.array([0, 1, 1]), np.full(3, 0.1)
    out = fit_confidence.changed(evidence, side, share, np.full(3, 0.5))
    of_side, other = (np.arange(3), side), (np.arange(3), 1 - side)
    for key in SIDES:
        np.testing.assert_array_equal(out[key][other], evidence[key][other])
    np.testing.assert_allclose(out["overlap"][of_side], 0.9 * evidence["overlap"][of_side])
    violation = evidence["free_space_violation"][of_side]
    np.testing.assert_allclose(
        out["free_space_violation"][of_side],
        np.where(np.arange(3) == 1, violation, 0.9 * violation + 0.1),
    )
    assert (out["front_violation_far"] >= 0.9 * evidence["front_violation_far"]).all()
