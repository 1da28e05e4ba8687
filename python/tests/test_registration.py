# SPDX-License-Identifier: BSD-3-Clause
"""register, prepare, align, align_batch: poses, equal bits, interruption, threads."""

import copy
import os
import pickle
import threading
import time

import gpureg
import numpy as np
import pytest
from interrupts import ctrl_c
from scenes import error_of, few, moved, pose, room

# Voxels of the moved cloud hold other points than those of the cloud at rest: centroids, and so the
# pose, differ by a fraction of the voxel (5 cm).
CLOSE = 0.02

#: Lengths shorter than those that an alignment asks for by default.
SHORTER = gpureg.RegistrationOptions(prepare=gpureg.PrepareOptions(max_correspondence_distance=1))


def bits(result):
    """Everything but times."""
    state = result.to_dict()
    del state["timings"]
    # One by one: pickle notes which equal strings are one object.
    return tuple(pickle.dumps(value) for value in state.values())


def test_register_finds_the_pose(source, target, truth):
    result = gpureg.register(source, target, quality=2)
    assert result and result.aligned and result.status == "aligned" and result.reason == "none"
    assert error_of(result, truth) < CLOSE
    assert result.target_from_source.dtype == np.float64
    assert 0.4 < result.inlier_ratio <= 1 and 0 < result.inlier_rmse < 0.05
    assert result.statistics.hypotheses == 128
    assert result.timings.total > 0
    assert repr(result).startswith("<gpureg.RegistrationResult aligned, confidence ")


def test_modes_carry_their_evidence(source, target):
    result = gpureg.register(source, target, voxel_size=0.05)
    assert len(result.modes) > 1
    best, alternative = result.modes[:2]
    assert (
        np.array_equal(best.target_from_source, result.target_from_source)
        and best.confidence == result.confidence
    )
    assert best.confidence >= alternative.confidence and best.overlap_confidence <= best.confidence
    assert best.evidence.match_support > alternative.evidence.match_support
    assert len(
        best.evidence.information_eigenvalues
    ) == 6 and best.evidence.information_eigenvalues == sorted(
        best.evidence.information_eigenvalues
    )
    assert repr(best).startswith("<gpureg.RegistrationMode, confidence ")
    paper = gpureg.align(
        gpureg.prepare(source),
        gpureg.prepare(target),
        options=gpureg.RegistrationOptions(method="quadruples", quadruples=20000),
    )
    assert paper.aligned and paper.modes == [] and paper.confidence == paper.inlier_ratio


@pytest.mark.parametrize("method", ["loopsmart", "default"])
def test_register_equals_prepare_and_align(source, target, method):
    options = few() if method == "loopsmart" else gpureg.RegistrationOptions()
    a, b = (gpureg.prepare(cloud, options=options) for cloud in (source, target))
    if method == "default":
        assert a.statistics.viewpoint == "none"  # two preparations and four alignments
    assert bits(gpureg.register(source, target, options=options)) == bits(
        gpureg.align(a, b, options=options)
    )
    both = gpureg.align_batch([a, b], [(0, 1), (1, 0)], options=options)
    assert bits(both[0]) == bits(gpureg.align(a, b, options=options))
    assert bits(both[1]) == bits(gpureg.align(b, a, options=options))


def test_any_number_of_threads_gives_the_same_bits(source, target):
    results = [
        gpureg.register(source, target, quality=1, context=gpureg.Context.cpu(n)) for n in (1, 2, 5)
    ]
    assert len({bits(r) for r in results}) == 1


def test_seed_and_voxel_size_are_used(source, target):
    first = gpureg.register(source, target, quality=1, seed=1)
    assert bits(first) != bits(gpureg.register(source, target, quality=1, seed=2))
    coarse = gpureg.register(source, target, 0.1, quality=1)
    assert coarse.statistics.source_points < first.statistics.source_points


def test_no_alignment_is_a_status(source):
    result = gpureg.register(source, np.random.default_rng(0).random((9000, 3)), quality=1)
    assert result.status == "not_aligned" and not result.aligned and not result
    assert result.reason in ("too_little_overlap", "clutter") and result.confidence < 0.5
    assert "% of the" in result.explanation and result.advice
    if not result.has_pose:
        assert np.isnan(result.target_from_source).all()


def test_reasons_have_names_numbers_and_advice(source):
    few_points = gpureg.register(source, source[:200], 0.1, quality=1)
    assert few_points.reason == "too_few_points"
    assert "the target has" in few_points.explanation and "voxel_size" in few_points.advice
    aligned = gpureg.register(source, source, 0.1, quality=1)
    assert aligned.explanation == "the clouds were aligned" and aligned.advice == ""


@pytest.mark.filterwarnings("error")
def test_other_units_are_a_question(source):
    with pytest.warns(UserWarning, match=r"units different\? target is 3\.3 times larger.* feet"):
        gpureg.register(source, 3.28084 * np.ascontiguousarray(source[::-1]), 0.1, quality=0)
    with pytest.warns(UserWarning, match=r"units different\? target is 1000 times larger"):
        gpureg.register(source, 1000 * source, 0.1, quality=0)
    assert gpureg.register(source, source, 0.1, quality=1).aligned  # no warning


def test_points_that_are_not_finite_are_counted_in_a_warning(source):
    mostly = source.copy()
    mostly[5:] = np.nan
    text = f"{len(source) - 5} of the {len(source)} points of the target are not finite"
    with pytest.warns(UserWarning, match=text):
        assert not gpureg.register(source, mostly, 0.1, quality=0).aligned


def test_own_features_and_correspondences(source, target, truth):
    # Features that know the answer: the coordinates at rest.
    options = few(2000)
    options.prepare.downsample = False
    a = gpureg.prepare(source, features=source, options=options)
    b = gpureg.prepare(target, features=source, options=options)
    assert a.feature_dimension == 3
    assert (
        error_of(gpureg.align(a, b, options=options), truth) < 1e-4
    )  # the same points, in float32
    index = np.arange(len(a))
    result = gpureg.align(a, b, correspondences=np.stack([index, index], axis=1), options=options)
    assert error_of(result, truth) < 1e-4
    assert gpureg.align(a, b, correspondences=[], options=options).reason == "no_usable_features"


def test_prepared_cloud_shows_what_it_holds(source):
    cloud = gpureg.prepare(source, viewpoints=[[1, 1, 5]])
    n = len(cloud)
    assert cloud.points.shape == cloud.normals.shape == (n, 3)
    assert cloud.features.shape == (n, 33)
    assert cloud.viewpoints.tolist() == [[1, 1, 5]]
    assert cloud.statistics.points == n and cloud.voxel_size == 0.05
    assert cloud.origin.tolist() == [0, 0, 0]
    with pytest.raises(AttributeError):
        cloud.points = source


def test_results_travel(source, target):
    result = gpureg.register(source, target, quality=1)
    for other in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert bits(other) == bits(result)
        assert other.timings == result.timings and other.statistics == result.statistics
    information = result.source_moments.information_redwood()
    assert information.shape == (6, 6) and np.allclose(information, information.T)
    assert information[0, 0] == result.source_moments.count


def test_progress_counts_up(source):
    context = gpureg.Context.cpu(1)
    cloud = gpureg.prepare(source, context=context)
    seen = []
    gpureg.align_batch(
        [cloud] * 3,
        [(0, 1)] * 20,
        options=few(500),
        context=context,
        progress=lambda *a: seen.append(a),
    )
    assert seen[0] == (0, 20) and seen[-1] == (20, 20) and seen == sorted(seen) and len(seen) > 3


@pytest.mark.parametrize("watched", [False, True])
def test_a_batch_is_checked_before_its_first_pair(source, watched):
    cloud = gpureg.prepare(source)
    other = gpureg.prepare(source, options=SHORTER)
    seen = []
    with pytest.raises(gpureg.InvalidArgument, match=r"clouds\[1\] was prepared with"):
        gpureg.align_batch(
            [cloud, other],
            [(0, 0), (0, 1)],
            progress=(lambda *a: seen.append(a)) if watched else False,
        )
    assert not seen


def test_preparation_shows_its_progress(source, capsys):
    clouds = [source[k::12] for k in range(12)]
    seen = []
    prepared = gpureg.prepare_batch(clouds, progress=lambda *a: seen.append(a))
    assert seen[0] == (0, 12) and seen[-1] == (12, 12) and seen == sorted(seen) and len(seen) > 2
    for one, other in zip(prepared, gpureg.prepare_batch(clouds)):
        assert np.array_equal(one.points, other.points)
        assert np.array_equal(one.features, other.features)
    assert gpureg.prepare_batch([], progress=True) == []
    with pytest.raises(ValueError, match=r"^clouds\[1\]: expected shape"):
        gpureg.prepare_batch([source, source[:, :2]], progress=lambda *a: None)
    pytest.importorskip("tqdm")
    gpureg.align_batch([*prepared[:2], clouds[2]], [(0, 2)], options=few(100), progress=True)
    shown = capsys.readouterr().err
    assert "preparing" in shown and "1/1" in shown and "aligning" in shown


def test_error_in_progress_comes_out(source):
    def progress(done, total):
        if done:
            raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        gpureg.align_batch(
            [gpureg.prepare(source)], [(0, 0)] * 100, options=few(500), progress=progress
        )


def test_ctrl_c_keeps_what_is_done(source):
    cloud = gpureg.prepare(source)
    begin = time.monotonic()
    # A few pairs long, on a slow machine, too: what is under way is dropped.
    gpureg.align_batch([cloud], [(0, 0)] * 3, options=few(20000))
    seconds = time.monotonic() - begin
    with pytest.raises(KeyboardInterrupt) as caught, ctrl_c(after=1 + seconds) as pressed:
        gpureg.align_batch([cloud], [(0, 0)] * 100_000, options=few(20000))
    assert time.monotonic() - pressed[0] < 30
    assert isinstance(caught.value, gpureg.BatchInterrupted)
    results = caught.value.results
    done = [r.status != "skipped" for r in results]
    assert len(results) == 100_000 and 0 < sum(done) < len(done)
    assert done == sorted(done, reverse=True)
    assert bits(results[0]) == bits(gpureg.align(cloud, cloud, options=few(20000)))


def test_other_threads_run_during_a_call(source):
    cloud = gpureg.prepare(source)
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.wait(0.005):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    gpureg.align(cloud, cloud, options=few(200_000))
    end = time.monotonic()
    stop.set()
    thread.join()
    # A call that held the interpreter would show none between its ends.
    assert sum(begin < t < end for t in ticks) >= min(5, (end - begin) / 0.1)


def test_four_threads_get_correct_results():
    clouds = [room(seed, 3000) for seed in range(4)]
    poses = [pose(seed) for seed in range(4)]
    expected = [gpureg.register(c, moved(c, t), options=few(5000)) for c, t in zip(clouds, poses)]
    got = [None] * 4

    def work(k):
        context = gpureg.Context.cpu(1) if k % 2 else None  # own contexts and the shared one
        for _ in range(3):
            got[k] = gpureg.register(
                clouds[k], moved(clouds[k], poses[k]), options=few(5000), context=context
            )

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [bits(r) for r in got] == [bits(r) for r in expected]


def test_forked_child_works(source):
    gpureg.register(source, source, quality=0)  # the default context has threads now, or a device
    cuda = gpureg.default_context().backend == "cuda"
    child = os.fork()
    if child == 0:
        try:
            good = gpureg.register(source, source, quality=0).aligned
        except gpureg.BackendUnavailable as error:
            good = cuda and "fork" in str(error)
        os._exit(0 if good else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_clouds_of_other_lengths_are_refused(source):
    cloud = gpureg.prepare(source, options=SHORTER)
    with pytest.raises(gpureg.InvalidArgument, match="prepared with max_correspondence_distance"):
        gpureg.align(cloud, cloud)
