# SPDX-License-Identifier: BSD-3-Clause
"""A real Ray cluster on this machine: any number of actors, also dying ones, gives the table of one
machine.
"""

import os
import pathlib
import signal
import sys

import pytest

pytest.importorskip("pyarrow")
ray = pytest.importorskip("ray")

import gpureg
import gpureg.ray
import many
from scenes import few


@pytest.fixture(scope="module", autouse=True)
def cluster():
    paths = os.pathsep.join(p for p in sys.path if p)
    ray.init(
        num_cpus=4,
        include_dashboard=False,
        configure_logging=False,
        log_to_driver=False,
        runtime_env={"env_vars": {"PYTHONPATH": paths}},
    )
    yield
    ray.shutdown()


def scene():
    return many.fragments()[:20], {"options": few(3000, 0.08), "progress": False}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    clouds, keywords = scene()
    return gpureg.register_all(clouds, output=tmp_path_factory.mktemp("one"), **keywords)


def files_of(run):
    return [path.read_bytes() for path in (run.parquet, run.log, run.information)]


@pytest.mark.parametrize("actors", [1, 4])
def test_any_number_of_actors(whole, tmp_path, actors):
    clouds, keywords = scene()
    run = gpureg.ray.register_all(clouds, output=tmp_path, actors=actors, chunk_size=10, **keywords)
    assert run.pairs == 190 and run.resumed == 0
    assert files_of(run) == files_of(whole)


def workers():
    """Process ids of the actors that are in the middle of a chunk: Ray writes that into their
    titles.
    """
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if path.read_bytes().startswith(b"ray::ChunkWorker.run"):
                found.append(int(path.parent.name))
        except OSError:
            pass  # gone meanwhile
    return found


def test_an_actor_is_killed_midway(whole, tmp_path):
    clouds, keywords = scene()
    killed = []

    def progress(done, total):
        if 30 <= done < total and not killed:
            busy = workers()
            if busy:
                os.kill(busy[0], signal.SIGKILL)
                killed.append(busy[0])

    run = gpureg.ray.register_all(
        clouds, output=tmp_path, actors=2, chunk_size=10, **{**keywords, "progress": progress}
    )
    assert killed
    assert files_of(run) == files_of(whole)


def test_either_goes_on_where_the_other_stopped(whole, tmp_path):
    clouds, keywords = scene()

    def stop(done, total):
        if done >= 50:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gpureg.register_all(clouds, output=tmp_path, **{**keywords, "progress": stop})
    run = gpureg.ray.register_all(clouds, output=tmp_path, chunk_size=10, **keywords)
    assert run.resumed >= 50 and files_of(run) == files_of(whole)


def test_progress_moves_within_a_chunk(tmp_path):
    seen = []
    long = few(4_000_000, 0.08)
    long.tune = "quadruples.max_survivors=262144"
    gpureg.ray.register_all(
        many.fragments()[:9],
        output=tmp_path,
        actors=1,
        options=long,
        progress=lambda done, total: seen.append(done),
    )
    # How many of the pieces are seen depends on the machine; the chunk is all 36 pairs.
    assert seen[-1] == 36 and seen == sorted(seen) and any(0 < done < 36 for done in seen)


def test_errors_come_out(tmp_path):
    missing = gpureg.FragmentSet.from_clouds([[[0.0, 0, 0]], [[1.0, 2]]])
    with pytest.raises(ValueError, match=r"fragments\[1\]: expected shape \(N, 3\), got \(1, 2\)"):
        gpureg.ray.register_all(missing, output=tmp_path, progress=False)


def test_a_bad_fragment_costs_its_own_pairs(tmp_path):
    for k, cloud in enumerate(many.fragments()[:5]):
        gpureg.write_point_cloud(tmp_path / f"cloud_bin_{k}.ply", cloud)
    bad = tmp_path / "cloud_bin_3.ply"
    content = bad.read_bytes()
    bad.write_bytes(content[:1000])
    keywords = {"options": few(500, 0.08), "progress": False}
    run = gpureg.ray.register_all(
        tmp_path, output=tmp_path / "a", actors=2, chunk_size=4, **keywords
    )
    assert run.pairs == 6 and list(run.unusable) == [3] and "truncated" in run.unusable[3]
    bad.write_bytes(content)
    run = gpureg.ray.register_all(
        tmp_path, output=tmp_path / "a", actors=2, chunk_size=4, **keywords
    )
    assert run.resumed == 6 and not run.unusable
    one = gpureg.register_all(tmp_path, output=tmp_path / "b", **keywords)
    assert files_of(run) == files_of(one)
