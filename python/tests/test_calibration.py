# SPDX-License-Identifier: BSD-3-Clause
"""Calibration of the confidence: fit, clouds, files, options."""

import json
import math
import resource
import signal

import gpureg
import numpy as np
import pytest
import scenes

CALIBRATION = gpureg.ConfidenceCalibration(slope=0.5, offset=-1.0)


def mapped(confidence):
    x = CALIBRATION.offset + CALIBRATION.slope * math.log(confidence / (1 - confidence))
    return 1 / (1 + math.exp(-x))


def options(calibration=None):
    out = gpureg.RegistrationOptions(voxel_size=0.1, quality=0)
    out.min_confidence = 0
    if calibration is not None:
        out.calibration = calibration
    return out


@pytest.fixture(scope="module")
def clouds():
    """Scans of one room that share no point, each in a frame of its own, and their poses."""
    room = scenes.room(points=48000)
    poses = [scenes.pose(k) for k in range(8)]
    return [scenes.moved(room[k::8], np.linalg.inv(p)) for k, p in enumerate(poses)], poses


def test_the_calibration_is_a_function():
    assert gpureg.ConfidenceCalibration().is_identity
    assert gpureg.ConfidenceCalibration()(0.3) == 0.3
    assert CALIBRATION(0.8) == pytest.approx(mapped(0.8), abs=1e-15)
    with pytest.raises(ValueError, match="calibration.slope is 0"):
        gpureg.RegistrationOptions(calibration=gpureg.ConfidenceCalibration(slope=0)).validate()
    with pytest.raises(TypeError, match="slope: expected a number, got 'a'"):
        gpureg.ConfidenceCalibration(slope="a")


def test_every_call_maps_its_confidences(clouds):
    a, b, c = clouds[0][:3]
    plain, scaled = options(), options(CALIBRATION)
    source, target = gpureg.prepare_batch([a, b], options=plain)
    calls = {
        "register": lambda o: gpureg.register(a, b, options=o).confidence,
        "align": lambda o: gpureg.align(source, target, options=o).confidence,
        "align_batch": lambda o: gpureg.align_batch([a, b, c], [(0, 1), (1, 2)], options=o)[
            0
        ].confidence,
        "align_within": lambda o: gpureg.align_within(
            source, target, 1e-3, options=o
        ).result.confidence,
    }
    for name, call in calls.items():
        before = call(plain)
        assert 0 < before < 1, name
        assert call(scaled) == pytest.approx(mapped(before), abs=1e-12), name
        assert call(options(gpureg.ConfidenceCalibration())) == before, name
    pose = gpureg.align(source, target, options=plain).target_from_source
    before = gpureg.verify(source, target, pose, options=plain)[0].confidence
    after = gpureg.verify(source, target, pose, options=scaled)[0].confidence
    assert after == pytest.approx(mapped(before), abs=1e-12)


def test_fit():
    rng = np.random.default_rng(1)
    x = rng.uniform(-5, 5, 5000)
    correct = rng.random(5000) < 1 / (1 + np.exp(-(1 + 0.6 * x)))
    confidences = 1 / (1 + np.exp(-x))
    calibration, enough = gpureg.fit_calibration(confidences, correct)
    assert enough
    assert calibration.slope == pytest.approx(0.6, abs=0.1)  # standard errors are about 0.03
    assert calibration.offset == pytest.approx(1, abs=0.2)
    light, _ = gpureg.fit_calibration(confidences, correct, np.full(5000, 1e-4))
    assert abs(light.offset) < 0.5 * abs(calibration.offset)
    same, enough = gpureg.fit_calibration(confidences[:5], correct[:5])
    assert same.is_identity and not enough


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0.5], [1]), "correct: expected bools"),
        (([0.5], [True, False]), "correct: expected shape"),
        (([[0.5]], [True]), "confidences: expected shape"),
        (([0.5], [True], [1, 2]), "weights: expected shape"),
        (([1.5], [True]), r"samples\[0\].confidence is 1.5"),
        (([0.5], [True], [-1]), r"samples\[0\].weight"),
    ],
)
def test_bad_samples_are_named(arguments, message):
    with pytest.raises((TypeError, ValueError), match=message):
        gpureg.fit_calibration(*arguments)


def test_from_clouds_to_results(clouds, tmp_path):
    seen = []
    run = gpureg.calibrate(
        clouds[0], self_pairs=16, options=options(), progress=lambda *p: seen.append(p)
    )
    assert seen[-1] == (44, 44)
    assert run.counts["one_scan"]["pairs"] == 16
    assert run.counts["loop_consistency"]["pairs"] == 28
    assert run.counts["trajectory"]["pairs"] == 0
    assert run.voxel_size == 0.1
    other = gpureg.calibrate(
        clouds[0], self_pairs=16, options=options(CALIBRATION), context=gpureg.Context.cpu(3)
    )
    assert other == run
    run.save(tmp_path / "c.json")
    assert gpureg.read_calibration(tmp_path / "c.json") == run.calibration
    document = json.loads((tmp_path / "c.json").read_text())
    assert document["samples"] == run.counts and document["voxel_size"] == 0.1
    gpureg.register(*clouds[0][:2], options=options(run.calibration))


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path):
    run = gpureg.CalibrationRun(gpureg.ConfidenceCalibration(), True, 0.2, 0.1, {}, 0.05)
    path = tmp_path / "calibration.json"
    run.save(path)
    before = path.read_bytes()
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) // 2, limit[1]))  # as a full disk
    try:
        with pytest.raises(gpureg.IoError, match="cannot write .*calibration.json"):
            run.save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, handler)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_poses_decide(clouds):
    points, poses = clouds
    poses = np.array(poses)
    run = gpureg.calibrate(points, poses=poses, self_pairs=0, options=options())
    assert run.counts["trajectory"]["pairs"] == 28
    assert run.counts["loop_consistency"]["pairs"] == 0
    poses[2] = np.nan
    shifted = gpureg.calibrate(points, poses=poses, self_pairs=0, options=options())
    assert shifted.counts["trajectory"]["pairs"] == 21
    with pytest.raises(ValueError, match=r"poses: expected shape \(8, 4, 4\), got \(7, 4, 4\)"):
        gpureg.calibrate(points, poses=poses[:7], options=options())
    poses[2] = 2 * np.eye(4)
    with pytest.raises(ValueError, match=r"world_from_cloud\[2\] is no rigid motion"):
        gpureg.calibrate(points, poses=poses, options=options())


def test_a_folder(clouds, tmp_path):
    for k in range(2):
        gpureg.write_point_cloud(tmp_path / f"cloud_bin_{k}.ply", clouds[0][k])
    run = gpureg.calibrate(tmp_path, self_pairs=2, options=options())
    assert run.counts["loop_consistency"]["pairs"] == 1
    assert not run.enough_samples and run.calibration.is_identity


def test_bad_arguments_are_named(clouds):
    for name in ("self_pairs", "scan_pairs"):
        for value in (-1, 1.5, "many", True):
            with pytest.raises(TypeError, match=f"{name}: expected a whole number"):
                gpureg.calibrate(clouds[0], **{name: value})
        with pytest.raises(ValueError, match=f"{name} is .*, expected at most 1,000,000"):
            gpureg.calibrate(clouds[0], **{name: 10**12})
    with pytest.raises(ValueError, match="method"):
        gpureg.calibrate(clouds[0], options=gpureg.RegistrationOptions.loopsmart(0.1))
    with pytest.raises(TypeError, match="clouds"):
        gpureg.calibrate(5)


def test_an_error_of_the_callback_ends_the_call(clouds):
    class Stop(Exception):
        pass

    def stop(done, total):
        raise Stop

    with pytest.raises(Stop):
        gpureg.calibrate(clouds[0], self_pairs=64, options=options(), progress=stop)


def test_a_promised_risk(clouds, tmp_path):
    run = gpureg.calibrate(clouds[0], self_pairs=8, max_risk=0.001, options=options())
    assert not run.risk.supported and run.risk.min_confidence == 1
    run.save(tmp_path / "c.json")
    document = json.loads((tmp_path / "c.json").read_text())
    risk, pairs = document["risk"], document["decided_pairs"]
    assert risk["scans"] == 8 and risk["more_scans"] > 900 and "more_samples" not in risk
    assert len(document["clouds"]) == 8
    assert document["options"]["voxel_size"] == pytest.approx(0.1)
    assert "seed" not in document["options"]
    again = gpureg.control_risk(
        *run.samples, scans=run.scans, scan_groups=run.scan_groups, max_risk=0.001
    )
    assert again == run.risk
    assert len(pairs["confidence"]) == len(pairs["correct"]) == risk["samples"] > 0
    assert "scenes" not in risk and "more_scenes" not in risk
    assert risk["max_risk"] == 0.001 and "min_confidence" not in risk
    found = gpureg.control_risk(
        [0.95] * 400 + [0.2] * 100, [True] * 400 + [False] * 100, max_risk=0.05
    )
    assert (found.supported, found.min_confidence, found.reported, found.wrong) == (
        True,
        0.3,
        400,
        0,
    )
    assert found.recall == 1 and found.more_samples is None


def test_pairs_share_scans():
    pairs = np.array([(i, j) for i in range(24) for j in range(i)])
    confidences, correct = np.full(len(pairs), 0.95), np.full(len(pairs), True)
    assert gpureg.control_risk(confidences, correct, max_risk=0.05).supported
    few = gpureg.control_risk(confidences, correct, scans=pairs, max_risk=0.05)
    assert (few.supported, few.scans, few.more_scans) == (False, 24, 168)
    assert few == gpureg.control_risk(confidences, correct, scans=1000 * pairs, max_risk=0.05)
    groups = [k // 12 for k in range(96)]  # as many scans as it takes
    pairs = [(i, j) for i in range(96) for j in range(i) if groups[i] == groups[j]]
    found = gpureg.control_risk(
        [0.95] * len(pairs), [True] * len(pairs), scans=pairs, scan_groups=groups, max_risk=0.1
    )
    assert found.supported and found.scans == 96


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"scans": [[0, 1]]}, ValueError, r"scans: expected shape \(2, 2\), got \(1, 2\)"),
        ({"scans": [[0, 1], [1, 0]]}, ValueError, r"samples\[1\].target is 0, expected a pair"),
        ({"scans": [[0, 1], [2, 2]]}, ValueError, r"samples\[1\].target is 2"),
        ({"scans": [[0, 1], [2, -1]]}, TypeError, "scans: expected whole numbers"),
        ({"scans": [[0.5, 1], [2, 1]]}, TypeError, "scans: expected whole numbers"),
        ({"scan_groups": [0, 0]}, ValueError, "scan_groups: needs scans"),
        ({"scans": [[0, 1], [2, 3]], "scan_groups": [0, 0, 1]}, ValueError, "target is 3"),
        ({"scans": [[0, 1], [2, 3]], "scenes": [0, 1]}, ValueError, "scenes: not with scans"),
    ],
)
def test_bad_scans_are_named(arguments, error, message):
    with pytest.raises(error, match=message):
        gpureg.control_risk([0.9, 0.9], [True, True], **arguments)


def test_places_have_a_threshold_of_their_own():
    options = gpureg.LocateOptions(registration=gpureg.RegistrationOptions(voxel_size=0.1))
    options.registration.calibration = CALIBRATION
    room = gpureg.prepare_map(scenes.room(points=20000), options=gpureg.MapOptions(voxel_size=0.1))
    with pytest.raises(ValueError, match="registration.calibration is given"):
        gpureg.locate(scenes.room(points=2000), room, options=options)


def test_a_promised_risk_of_scenes():
    confidences, correct = np.tile([0.95, 0.4], 20), np.tile([True, False], 20)
    scenes = np.repeat([f"building {k}" for k in range(20)], 2)
    found = gpureg.control_risk(confidences, correct, scenes=scenes, max_risk=0.05)
    assert (found.supported, found.scenes, found.reported, found.wrong) == (True, 20, 20, 0)
    assert found.min_confidence == np.nextafter(0.4, 1)
    few = gpureg.control_risk(confidences[:30], correct[:30], scenes=scenes[:30], max_risk=0.05)
    assert not few.supported and few.more_scenes == 4
    with pytest.raises(ValueError, match=r"scenes: expected shape \(40,\), got \(39,\)"):
        gpureg.control_risk(confidences, correct, scenes=scenes[1:])


@pytest.mark.parametrize(
    ("confidences", "correct", "max_risk", "error"),
    [
        ([0.5], [True, False], 0.1, ValueError),
        ([[0.5]], [[True]], 0.1, ValueError),
        ([0.5], [1], 0.1, TypeError),
        ([1.5], [True], 0.1, ValueError),
        ([0.5], [True], 0, ValueError),
    ],
)
def test_bad_samples_of_a_risk(confidences, correct, max_risk, error):
    with pytest.raises(error):
        gpureg.control_risk(confidences, correct, max_risk=max_risk)


GOOD = {"format_version": 1, "gpureg": "calibration", "slope": 0.5, "offset": -1}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format_version": 2}, "format version 2, this gpureg reads versions up to 1"),
        ({"format_version": "1"}, "\"format_version\" is '1'"),
        ({"gpureg": "batch"}, 'no calibration .*"gpureg"'),
        ({"slope": 0}, '"slope" is 0, expected a number > 0'),
        ({"slope": float("nan")}, '"slope" is nan'),
        ({"slope": None}, '"slope" is None'),
        ({"offset": float("inf")}, '"offset" is inf'),
        ({"offset": "1"}, "\"offset\" is '1'"),
        ({"offset": True}, '"offset" is True'),
    ],
)
def test_bad_files_are_named(tmp_path, change, message):
    path = tmp_path / "c.json"
    path.write_text(json.dumps({**GOOD, **change}))
    with pytest.raises(gpureg.IoError, match=message) as error:
        gpureg.read_calibration(path)
    assert "c.json" in str(error.value)


def test_broken_files_are_named(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps(GOOD))
    assert gpureg.read_calibration(path) == CALIBRATION
    path.write_text(json.dumps(GOOD)[:30])
    with pytest.raises(gpureg.IoError, match="c.json"):
        gpureg.read_calibration(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(gpureg.IoError, match="c.json"):
        gpureg.read_calibration(path)
    with pytest.raises(gpureg.IoError, match="none.json"):
        gpureg.read_calibration(tmp_path / "none.json")
