# SPDX-License-Identifier: BSD-3-Clause
"""register_all: complete, equal, and not to be killed."""

import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import threading
import time

import gpureg
import numpy as np
import pytest
from scenes import few, moved, pose, room

pytest.importorskip("pyarrow")

import many


@pytest.fixture(scope="module")
def timed(tmp_path_factory):
    """The uninterrupted run, and the seconds that it takes."""
    begin = time.monotonic()
    run = many.run(tmp_path_factory.mktemp("whole"))
    return run, time.monotonic() - begin


@pytest.fixture(scope="module")
def whole(timed):
    return timed[0]


def files_of(run):
    return [path.read_bytes() for path in (run.parquet, run.log, run.information)]


def test_table_is_what_align_says(whole):
    assert whole.pairs == many.FRAGMENTS * (many.FRAGMENTS - 1) // 2 and whole.resumed == 0
    rows = whole.table().to_pylist()
    assert len({(row["i"], row["j"]) for row in rows}) == whole.pairs
    clouds = gpureg.prepare_batch(many.fragments(), options=many.options())
    assert sum(row["status"] == "aligned" for row in rows) == whole.aligned > 100
    for row in random.Random(1).sample(rows, 25):
        result = gpureg.align(clouds[row["j"]], clouds[row["i"]], options=many.options())
        assert row["status"] == result.status and row["confidence"] == result.confidence
        assert row["inliers"] == result.statistics.inliers
        if result.has_pose:
            assert row["target_from_source"] == result.target_from_source.ravel().tolist()
        else:
            assert row["target_from_source"] is None
    log = gpureg._core.read_log(str(whole.log))
    assert [entry[:3] for entry in log] == sorted(
        (row["i"], row["j"], many.FRAGMENTS) for row in rows if row["status"] == "aligned"
    )
    assert sorted(path.name for path in whole.folder.iterdir()) == [
        "pairs.journal",
        "result.info",
        "result.log",
        "results.parquet",
    ]


def test_contexts_and_memory_change_nothing(tmp_path):
    clouds = many.fragments()[:12]
    keywords = {"options": few(500, 0.08), "progress": False}
    one = gpureg.register_all(clouds, output=tmp_path / "one", **keywords)
    # Room for three or four fragments: they come and go.
    contexts = [gpureg.Context.cpu(1) for _ in range(3)]
    other = gpureg.register_all(
        clouds, output=tmp_path / "other", contexts=contexts, memory=500_000, **keywords
    )
    assert files_of(one) == files_of(other)


def test_a_finished_run_is_not_done_again(whole):
    before = {
        path: path.stat().st_mtime_ns for path in (whole.parquet, whole.log, whole.information)
    }
    again = many.run(whole.folder)
    assert again.resumed == again.pairs == whole.pairs and again.aligned == whole.aligned
    assert before == {path: path.stat().st_mtime_ns for path in before}


def pairs_in(folder):
    journal = folder / "pairs.journal"
    if not journal.exists():
        return 0
    return len(gpureg._core.read_journal(str(journal))[1])


def test_ten_kills(whole, timed, tmp_path):
    """kill -9 at ten random moments, from before the first pair to the middle of a chunk."""
    seed = int(os.environ.get("GPUREG_KILL_SEED", "1"))
    rng = random.Random(seed)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    kept = []
    for kill in range(10):
        child = subprocess.Popen(
            [sys.executable, many.__file__, str(tmp_path)],
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        )
        assert child.stdout.readline() == "started\n"
        if kill % 3 == 1:  # a slow machine, too, shall have finished something
            while pairs_in(tmp_path) <= kept[-1]:
                assert child.poll() is None
                time.sleep(0.01)
        elif kill % 3 == 2:
            child.stdout.readline()  # it aligns
        time.sleep(rng.random() * timed[1] / 20)  # all ten: a fourth of a run at most
        assert (
            child.poll() is None
        ), "the run ended before it was killed: it is too short for this test"
        child.send_signal(signal.SIGKILL)
        child.wait()
        child.stdout.close()
        kept.append(pairs_in(tmp_path))
    assert kept == sorted(kept), "a result was lost"
    run = many.run(tmp_path)
    print(f"seed {seed}: pairs after each kill {kept}, then {run}")
    assert run.resumed == kept[-1] > 0
    assert files_of(run) == files_of(whole)


def test_ctrl_c_from_outside_loses_nothing(whole, tmp_path):
    """A signal like that of a terminal, at several moments of one run: before a thread runs, while
    fragments are prepared, in the middle of pairs, and more than once.
    """
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    kept = 0
    for wanted, delay, presses in [
        (0, 0, 1),
        (0, 0.05, 1),
        (30, 0, 1),
        (30, 0.03, 5),
        (30, 0.1, 1),
    ]:
        child = subprocess.Popen(
            [sys.executable, many.__file__, str(tmp_path)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
        assert child.stdout.readline() == "started\n"
        first = done = int(child.stdout.readline())
        assert first >= kept, "what the run before had counted was lost"
        while done < first + wanted:
            done = int(child.stdout.readline())
        time.sleep(delay)
        for _ in range(presses):
            child.send_signal(signal.SIGINT)
            time.sleep(0.02)
        output, errors = child.communicate(timeout=120)
        assert child.returncode == -signal.SIGINT, errors  # not SIGABRT: C++ was waited for
        assert "KeyboardInterrupt" in errors and "FATAL" not in errors
        kept = max([done, *map(int, output.split())])
    assert kept >= 90
    run = many.run(tmp_path)
    assert run.resumed >= kept
    assert files_of(run) == files_of(whole)


def test_ctrl_c_loses_nothing(whole, tmp_path):
    done, pressed = [], []

    def progress(count, total):
        done.append(count)
        if count >= 40 and not pressed:
            pressed.append(count)
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        many.run(tmp_path, progress=progress, contexts=[gpureg.Context.cpu(1)])
    run = many.run(tmp_path)
    # All that was counted, also of the chunk in the middle of which it came.
    assert run.resumed >= done[-1] >= 40
    assert files_of(run) == files_of(whole)


def test_a_file_that_is_not_there_is_named_at_once(tmp_path):
    with pytest.raises(FileNotFoundError, match="missing.ply"):
        gpureg.register_all([many.fragments()[0], tmp_path / "missing.ply"], output=tmp_path / "a")


class TestABadFragment:
    """Costs its own pairs; once it is repaired or removed, the same call does what is missing."""

    BAD, COUNT = 3, 7
    keywords = {"options": few(500, 0.08), "progress": False}

    @pytest.fixture()
    def folder(self, tmp_path):
        folder = tmp_path / "scans"
        folder.mkdir()
        for k, cloud in enumerate(many.fragments()[: self.COUNT]):
            gpureg.write_point_cloud(folder / f"cloud_bin_{k}.ply", cloud)
        return folder

    def damage(self, folder, size=1000):
        path = folder / f"cloud_bin_{self.BAD}.ply"
        whole = path.read_bytes()
        path.write_bytes(whole[:size])
        return path, whole

    def without(self, table):
        return [row for row in table.to_pylist() if self.BAD not in (row["i"], row["j"])]

    def test_the_others_finish(self, folder, tmp_path):
        whole = gpureg.register_all(folder, output=tmp_path / "whole", **self.keywords)
        path, _ = self.damage(folder)
        run = gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)
        assert list(run.unusable) == [self.BAD] and path.name in run.unusable[self.BAD]
        assert "truncated" in run.unusable[self.BAD] and "without the fragments 3" in str(run)
        assert run.pairs == 15 and run.table().to_pylist() == self.without(whole.table())
        again = gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)
        assert (again.resumed, again.pairs, again.unusable) == (15, 15, run.unusable)
        assert files_of(again) == files_of(run)

    @pytest.mark.parametrize("interrupted", [False, True])
    def test_repaired(self, folder, tmp_path, interrupted):
        whole = gpureg.register_all(folder, output=tmp_path / "whole", **self.keywords)
        path, content = self.damage(folder)
        self.run(folder, tmp_path, interrupted)
        path.write_bytes(content)
        run = gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)
        assert run.resumed == 15 and not run.unusable
        assert files_of(run) == files_of(whole)

    @pytest.mark.parametrize("interrupted", [False, True])
    def test_removed(self, folder, tmp_path, interrupted):
        path, _ = self.damage(folder)
        self.run(folder, tmp_path, interrupted)
        path.unlink()
        run = gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)
        assert run.resumed == run.pairs == 15 and not run.unusable
        whole = gpureg.register_all(folder, output=tmp_path / "whole", **self.keywords)
        assert files_of(run) == files_of(whole)

    def run(self, folder, tmp_path, interrupted):
        if not interrupted:
            gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)
            return
        with pytest.MonkeyPatch.context() as patch, pytest.raises(RuntimeError, match="killed"):
            patch.setattr(gpureg._batch.folder.RunFolder, "conclude", killed)
            gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)

    def test_a_fragment_with_pairs_must_not_change(self, folder, tmp_path):
        gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)
        self.damage(folder)
        with pytest.raises(ValueError, match="cloud_bin_3.ply is another cloud than before"):
            gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)

    def test_points_that_cannot_be_prepared(self, tmp_path):
        clouds = many.fragments()[:3]
        bad = 4000 * np.random.default_rng(3).random((30_000, 3), np.float32)  # millimetres
        run = gpureg.register_all(
            [clouds[0], bad, clouds[2]], output=tmp_path / "run", **self.keywords
        )
        assert run.pairs == 1 and "nearly all of 30000" in run.unusable[1]

    def test_nothing_but_bad_ones_is_an_error(self, folder, tmp_path):
        for path in sorted(folder.iterdir())[1:]:
            path.write_bytes(b"ply")
        with pytest.raises(gpureg.IoError, match="no pair can be aligned: .*cloud_bin_1.ply"):
            gpureg.register_all(folder, output=tmp_path / "run", **self.keywords)


def test_progress_moves(tmp_path):
    seen, begin = [], time.monotonic()
    run = gpureg.register_all(
        many.fragments()[:9],
        output=tmp_path,
        options=few(4_000_000, 0.08),
        contexts=[gpureg.Context.cpu(1)],
        progress=lambda done, total: seen.append(done),
    )
    seconds = time.monotonic() - begin
    assert run.pairs == 36 and seen[0] == 0 and seen[-1] == 36 and seen == sorted(seen)
    print(f"{len(set(seen))} distinct values in {seconds:.1f} s")
    assert len(set(seen)) >= 5


def test_a_bar_shows_what_is_under_way(tmp_path, capsys):
    pytest.importorskip("tqdm")
    gpureg.register_all(many.fragments()[:4], output=tmp_path, options=few(100, 0.08))
    shown = capsys.readouterr().err
    assert "6/6" in shown and "4 clouds prepared" in shown


def test_another_run_is_refused(source, tmp_path):
    clouds = [source[:500], source[500:1000], source[1000:1500]]
    gpureg.register_all(clouds, output=tmp_path, options=few(100, 0.1), progress=False)
    for change, message in [
        ({"options": few(101, 0.1)}, "options.quadruples was 100, now 101"),
        ({"options": few(100, 0.1), "pairs": [(0, 1)]}, "pair 0 2 is none of this run"),
    ]:
        with pytest.raises(ValueError, match=message):
            gpureg.register_all(
                clouds, output=tmp_path, progress=False, **{"pairs": "all", **change}
            )
    with pytest.raises(ValueError, match="0 is another cloud than before"):
        gpureg.register_all(clouds[::-1], output=tmp_path, options=few(100, 0.1), progress=False)
    fresh = gpureg.register_all(
        clouds, [(0, 1)], output=tmp_path, options=few(101, 0.1), progress=False, resume=False
    )
    assert fresh.pairs == 1 and fresh.resumed == 0
    fresh.journal.write_text("{")
    with pytest.raises(gpureg.IoError, match="pairs.journal is damaged.*resume=False starts anew"):
        gpureg.register_all(clouds, output=tmp_path, progress=False)
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(gpureg.IoError, match="a run of an older gpureg.*resume=False"):
        gpureg.register_all(clouds, output=tmp_path, progress=False)
    again = gpureg.register_all(
        clouds, output=tmp_path, options=few(10, 0.1), progress=False, resume=False
    )
    assert again.pairs == 3 and not (tmp_path / "run.json").exists()


def test_the_table_has_the_names_of_the_files(source, tmp_path):
    scans, keywords = tmp_path / "scans", {"options": few(100, 0.1), "progress": False}
    scans.mkdir()
    for k, name in enumerate(["room 10.ply", "hall <b>.ply", "room 9.ply"]):
        gpureg.write_point_cloud(scans / "next.ply", source[500 * k : 500 * k + 500])
        (scans / "next.ply").rename(scans / name)
    run = gpureg.register_all(scans, output=tmp_path / "run", **keywords)
    table = run.table()
    assert table["name_i"].to_pylist() == ["hall <b>.ply", "hall <b>.ply", "room 9.ply"]
    assert table["name_j"].to_pylist() == ["room 9.ply", "room 10.ply", "room 10.ply"]
    assert gpureg.register_all(scans, output=tmp_path / "run", **keywords).resumed == 3
    # More pairs, taken up from the finished table.
    two = gpureg.register_all(scans, [(0, 1)], output=tmp_path / "two", **keywords)
    assert two.pairs == 1
    all_of_two = gpureg.register_all(scans, output=tmp_path / "two", **keywords)
    assert all_of_two.resumed == 1 and files_of(all_of_two) == files_of(run)
    # Another file comes first, and moves the numbers: results go by names.
    gpureg.write_point_cloud(scans / "attic.ply", source[:500])
    more = gpureg.register_all(scans, output=tmp_path / "run", **keywords)
    assert (more.resumed, more.pairs) == (3, 6)
    whole = gpureg.register_all(scans, output=tmp_path / "whole", **keywords)
    assert files_of(more) == files_of(whole)
    # Pairs of the list alone.
    (scans / "attic.ply").unlink()
    with pytest.raises(ValueError, match="attic.ply is not there any more"):
        gpureg.register_all(scans, output=tmp_path / "run", **keywords)


def test_two_processes_do_not_share_a_folder(source, tmp_path):
    seen = []

    def progress(done, total):
        try:
            gpureg.register_all([source, source], output=tmp_path, progress=False)
        except gpureg.IoError as error:
            seen.append(str(error))

    gpureg.register_all([source, source], output=tmp_path, options=few(100), progress=progress)
    assert seen and "is in use: another run" in seen[0]


def test_nothing_to_do_is_an_error(source, tmp_path):
    with pytest.raises(ValueError, match="pairs: there is none"):
        gpureg.register_all([source], output=tmp_path)
    assert not list(tmp_path.iterdir())


def test_threads_of_a_failed_run_end(source, tmp_path):
    before = threading.active_count()
    with pytest.raises(RuntimeError, match="enough"):
        gpureg.register_all(
            [source] * 30,
            output=tmp_path,
            options=few(20000),
            progress=lambda *_: (_ for _ in ()).throw(RuntimeError("enough")),
        )
    assert threading.active_count() == before


COMMAND = pathlib.Path(gpureg.__file__).with_name("bin") / "gpureg"


@pytest.mark.skipif(not COMMAND.exists(), reason="this build has no command")
class TestCommand:
    def run(self, *arguments):
        return subprocess.run(
            [sys.executable, "-m", "gpureg", *map(str, arguments)], capture_output=True, text=True
        )

    def test_help_and_status(self, tmp_path):
        shown = self.run("--help")
        assert shown.returncode == 0
        for verb in ("register", "batch", "evaluate", "report", "generate", "info"):
            assert verb in shown.stdout
        assert self.run("--version").stdout == f"gpureg {gpureg.__version__}\n"
        assert self.run("info", tmp_path / "nowhere.ply").returncode == 2

    def test_register_all_writes_the_command_s_log(self, tmp_path):
        folder = tmp_path / "scene"
        folder.mkdir()
        whole = room(7, 4000)
        for k in range(5):
            gpureg.write_point_cloud(folder / f"cloud_bin_{k}.ply", moved(whole[:: k + 1], pose(k)))
        options = gpureg.RegistrationOptions.loopsmart(0.06)
        options.quadruples = 20000
        self.compare(
            folder,
            tmp_path,
            ["--preset", "loopsmart", "--set", "quadruples=20000", "--voxel-size", 0.06],
            options,
        )

    def test_red_kitchen(self, kitchen, tmp_path):
        # What is compared does not depend on the quality, time does.
        self.compare(
            kitchen,
            tmp_path,
            ["--quality", 0, "--voxel-size", 0.05],
            gpureg.RegistrationOptions(voxel_size=0.05, quality=0),
        )

    def test_pair_map_and_place_are_the_command_s(self, tmp_path):
        folder, voxel_size = tmp_path / "scene", 0.06
        folder.mkdir()
        whole = room(7, 8000)
        for k in range(4):
            gpureg.write_point_cloud(folder / f"cloud_bin_{k}.ply", moved(whole[k::4], pose(k)))
        a, b = folder / "cloud_bin_0.ply", folder / "cloud_bin_1.ply"

        def command(*arguments):
            assert self.run(*arguments, "--voxel-size", voxel_size).returncode in (0, 1)

        command("register", a, b, "--json", tmp_path / "pair.json")
        command("reconstruct", folder, "-o", tmp_path / "map")
        command("locate", a, tmp_path / "map/map.ply", "--json", tmp_path / "place.json")
        pair = json.loads((tmp_path / "pair.json").read_text())["result"]
        scene = json.loads((tmp_path / "map/reconstruction.json").read_text())
        place = json.loads((tmp_path / "place.json").read_text())["scans"][0]

        result = gpureg.register(a, b, voxel_size)
        assert pair["target_from_source"] == result.target_from_source.ravel().tolist()
        assert pair["confidence"] == result.confidence
        options = gpureg.RegistrationOptions(voxel_size=voxel_size)
        made = gpureg.reconstruct(folder, options=options)
        assert made.islands == scene["islands"] == [[0, 1, 2, 3]]
        for scan, matrix in zip(scene["scans"], made.poses):
            assert scan["island_from_scan"] == matrix.ravel().tolist()
        map_options = gpureg.MapOptions(voxel_size=voxel_size)
        place_map = gpureg.prepare_map(tmp_path / "map/map.ply", options=map_options)
        found = gpureg.locate(a, place_map)
        assert [entry["map_from_scan"] for entry in place["poses"]] == [
            entry.map_from_scan.ravel().tolist() for entry in found.poses
        ]

    def compare(self, folder, tmp_path, arguments, options):
        done = self.run(
            "batch",
            folder,
            *arguments,
            "-o",
            tmp_path / "c.log",
            "--info",
            tmp_path / "c.info",
            "--json",
            tmp_path / "c.json",
        )
        assert done.returncode == 0, done.stderr
        run = gpureg.register_all(folder, output=tmp_path / "run", options=options, progress=False)
        assert run.log.read_bytes() == (tmp_path / "c.log").read_bytes()
        assert run.information.read_bytes() == (tmp_path / "c.info").read_bytes()
        rows = {(row["i"], row["j"]): row for row in run.table().to_pylist()}
        pairs = json.loads((tmp_path / "c.json").read_text())["pairs"]
        assert len(pairs) == len(rows) == run.pairs
        for pair in pairs:
            row = rows[pair["i"], pair["j"]]
            assert row["target_from_source"] == pair["T_ij"]
            for name in ("status", "reason", "confidence", "inlier_ratio", "inlier_rmse"):
                assert row[name] == pair[name], name
            for name, value in pair["statistics"].items():
                assert row[name] == value, name
        assert np.isfinite([row["confidence"] for row in rows.values()]).all()


@pytest.mark.parametrize(
    ("library", "code", "extra"),
    [
        ("pyarrow", "import gpureg; gpureg.register_all", "batch"),
        ("ray", "import gpureg.ray", "ray"),
    ],
)
def test_what_is_missing_is_named_with_both_ways_to_install_it(library, code, extra):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    code = f"import sys; sys.modules[{library!r}] = None; {code}"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment
    )
    assert (
        f"pip install 'gpureg[{extra}]', or '.[{extra}]' from a checkout"
        in done.stderr.splitlines()[-1]
    )


def test_damaged_files_are_named(tmp_path):
    clouds = many.fragments()[:3]
    keywords = {"output": tmp_path, "options": few(10, 0.08), "progress": False}
    run = gpureg.register_all(clouds, **keywords)
    whole = run.parquet.read_bytes()
    for damaged in (b"PAR1 and no more", whole[: len(whole) // 2], b""):
        run.parquet.write_bytes(damaged)
        with pytest.raises(
            gpureg.IoError, match=r"results.parquet is damaged \(.*\); the same call makes it anew"
        ):
            run.table()
        assert gpureg.register_all(clouds, **keywords).resumed == 3
        assert run.parquet.read_bytes() == whole
    run.parquet.unlink()
    with pytest.raises(FileNotFoundError, match="results.parquet"):
        run.table()


def test_a_changed_bit_is_not_resumed(tmp_path):
    clouds = many.fragments()[:3]
    keywords = {"output": tmp_path, "options": few(10, 0.08), "progress": False}
    run = gpureg.register_all(clouds, **keywords)
    whole = run.journal.read_bytes()
    rng = random.Random(1)
    for place in [0, len(whole) - 1, *rng.sample(range(len(whole)), 50)]:
        flipped = bytearray(whole)
        flipped[place] ^= 1 << rng.randrange(8)
        run.journal.write_bytes(flipped)
        with pytest.raises(gpureg.IoError, match="pairs.journal is damaged"):
            gpureg.register_all(clouds, **keywords)
    run.journal.write_bytes(whole)
    assert gpureg.register_all(clouds, **keywords).resumed == 3


def killed(*_):
    raise RuntimeError("killed")


def test_sizes_are_checked(tmp_path):
    name = "memory"
    for value, error, message in (
        (-1, ValueError, f"{name} is -1, expected 1 or more"),
        ("1", TypeError, f"{name}: expected a (whole )?number, got '1'"),
    ):
        with pytest.raises(error, match=message):
            gpureg.register_all(many.fragments()[:3], output=tmp_path / "run", **{name: value})
    assert not (tmp_path / "run").exists()


def test_the_voxel_size_is_chosen_and_kept(tmp_path):
    clouds = [3 * moved(room(7, 9000)[k::3], pose(k)) for k in range(3)]
    chosen = gpureg.suggest_voxel_size(clouds).voxel_size
    assert chosen != 0.05
    run = gpureg.register_all(clouds, output=tmp_path / "a", progress=False)
    assert run.table()["voxel_size"].to_pylist() == [chosen] * 3
    wide = gpureg.RegistrationOptions(voxel_size=0.3)
    coarse = gpureg.register_all(clouds, output=tmp_path / "b", options=wide, progress=False)
    again = gpureg.register_all(clouds, output=tmp_path / "b", progress=False)
    assert again.resumed == 3 and again.table()["voxel_size"].to_pylist() == [0.3] * 3
    map = gpureg.reconstruct(clouds, results=coarse, refine=False)
    assert map._options.voxel_size == pytest.approx(0.3)
    assert gpureg.audit(clouds, map).verdict
