# SPDX-License-Identifier: BSD-3-Clause
"""apps/slam_demo/view.py: what it logs of a progress.jsonl, through a recorder instead of rerun."""

import fcntl
import importlib.util
import json
import subprocess
import sys
import threading
import time
import types
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).resolve().parents[3] / "apps/slam_demo/view.py"
HEAD = {"slam_demo_progress": 1, "camera": [500, 510, 320, 240]}


def keyframe(k, frame, x, session=0):
    pose = [x, 0, 0, 0, 0, 0, 1]
    return {"keyframe": k, "frame": frame, "time": frame / 30, "session": session} | {
        "pose": pose,
        "points": [[0, 0, 2]],
    }


def loop(number, state, frame):
    return {"loop": number, "frame": frame, "keyframes": [0, 2], "state": state, "reason": "why"}


LINES = [
    HEAD,
    keyframe(0, 0, 0),
    keyframe(1, 10, 1),
    keyframe(2, 20, 2),
    loop(0, "accepted", 30),
    {"moved": [[1, 1.001, 0, 0, 0, 0, 0, 1]], "frame": 31},  # 1 mm
    {"moved": [[1, 1.5, 0, 0, 0, 0, 0, 1], [2, 2.5, 0, 0, 0, 0, 0, 1]], "frame": 32},
    loop(0, "retracted", 40),
    keyframe(3, 50, 7, session=1),
    {"end": "finished", "frame": 60},
]


class Recorder(types.ModuleType):
    """Stands for the module rerun: keeps the entities that are logged, with their times."""

    def __init__(self):
        super().__init__("rerun")
        self.times, self.logged, self.calls = {}, [], []
        self.ViewCoordinates = types.SimpleNamespace(RIGHT_HAND_Y_DOWN="y down")

    def init(self, name, spawn):
        self.calls.append(("init", name, spawn))

    def save(self, path):
        self.calls.append(("save", path))

    def disconnect(self):
        self.calls.append(("disconnect",))

    def set_time(self, timeline, sequence):
        self.times[timeline] = sequence

    def log(self, path, entity, static=False):
        self.logged.append((path, entity, None if static else dict(self.times)))

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *args, **words: (name, args, words)

    def of(self, path):
        """Frame and first argument of what was logged for an entity."""
        return [
            (t and t["frame"], e[1][0] if e[1] else e[2]) for p, e, t in self.logged if p == path
        ]


@pytest.fixture
def recorder(monkeypatch):
    recorder = Recorder()
    monkeypatch.setitem(sys.modules, "rerun", recorder)
    return recorder


def view(monkeypatch, *words):
    """Runs the program; returns what it exits with."""
    monkeypatch.setattr(sys, "argv", ["view.py", *map(str, words)])
    spec = importlib.util.spec_from_file_location("slam_demo_view", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    try:
        module.main()
    except SystemExit as exit:
        return exit.code
    return None


def write(folder, lines, rest=""):
    text = "".join(json.dumps(line) + "\n" for line in lines) + rest
    (folder / "progress.jsonl").write_text(text)


def test_a_finished_run(tmp_path, monkeypatch, recorder):
    write(tmp_path, LINES)
    dtype = [("floats", "<f4", 8), ("colour", "u1", 3)]
    surfels = np.zeros(2, dtype)
    surfels["floats"][1, :3] = 1, 2, 3
    (tmp_path / "map.ply").write_bytes(b"ply\nend_header\n" + surfels.tobytes())
    (tmp_path / "odometry.txt").write_text("# time\n0.0 0 0 0 0 0 0 1\n0.1 5 6 7 0 0 0 1\n")
    assert view(monkeypatch, tmp_path, "--save", "a.rrd") is None
    assert recorder.calls == [("init", "slam_demo", False), ("save", "a.rrd"), ("disconnect",)]

    a, b, c, d = [0, 0, 0], [1, 0, 0], [2, 0, 0], [7, 0, 0]
    b1, b2, c2 = [1.001, 0, 0], [1.5, 0, 0], [2.5, 0, 0]
    assert recorder.of("world/trajectory") == [
        (0, [[a]]),
        (10, [[a, b]]),
        (20, [[a, b, c]]),
        (31, [[a, b1, c]]),
        (32, [[a, b2, c2]]),
        (50, [[a, b2, c2], [d]]),
    ]
    assert recorder.of("world/before") == [(32, [[a, b1, c]])], "only of an adjustment"
    assert recorder.of("world/loops") == [
        (30, [[a, c]]),
        (31, [[a, c]]),
        (32, [[a, c2]]),
        (40, []),
    ], "a retracted loop disappears"
    poses = recorder.of("world/keyframes/1")
    assert [(frame, pose["translation"]) for frame, pose in poses] == [(10, b), (31, b1), (32, b2)]
    assert [frame for frame, _ in recorder.of("world/keyframes/1/points")] == [10], "they follow"
    assert [frame for frame, _ in recorder.of("world/keyframes/3/image")] == [50]
    assert [pose["translation"] for _, pose in recorder.of("world/camera")][-1] == d
    ((frame, positions),) = recorder.of("world/map")
    assert frame == 60
    np.testing.assert_array_equal(positions, [[0, 0, 0], [1, 2, 3]])
    np.testing.assert_array_equal(recorder.of("world/odometry")[0][1], [[[0, 0, 0], [5, 6, 7]]])
    assert [text for _, text in recorder.of("log")] == [
        "loop of keyframes 0 and 2: accepted (why)",
        "loop of keyframes 0 and 2: retracted (why)",
        "the run is finished",
    ]
    steps = [times["step"] for _, _, times in recorder.logged if times]
    assert steps == sorted(steps) and steps[-1] == len(LINES)


def test_a_run_that_goes_on(tmp_path, monkeypatch, recorder):
    """It begins after the view, with half lines, and is done when the view ends."""
    folder = tmp_path / "later"
    seen = []

    def run():
        time.sleep(0.1)
        folder.mkdir()
        with (folder / "progress.jsonl").open("w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            for line in LINES:
                text = json.dumps(line) + "\n"
                for part in (text[:9], text[9:]):
                    file.write(part)
                    file.flush()
                    time.sleep(0.02)
                if line is LINES[3]:
                    deadline = time.monotonic() + 20
                    while not recorder.of("world/keyframes/2") and time.monotonic() < deadline:
                        time.sleep(0.01)
                    seen.append(len(recorder.of("world/trajectory")))

    thread = threading.Thread(target=run)
    thread.start()
    assert view(monkeypatch, folder) is None
    thread.join()
    assert recorder.calls[0] == ("init", "slam_demo", True), "the viewer is opened"
    assert seen and seen[0] >= 2, "keyframes are shown while the run goes on"
    assert len(recorder.of("world/trajectory")) == 6


def test_a_run_that_was_killed(tmp_path, monkeypatch, recorder, capsys):
    write(tmp_path, LINES[:4], rest='{"loop": 0, "fra')
    assert view(monkeypatch, tmp_path) is None
    error = capsys.readouterr().err
    assert "view.py: line 5 is incomplete and left out" in error
    assert "the run ended without its last line: it was killed" in error
    assert len(recorder.of("world/trajectory")) == 3


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([{"slam_demo_progress": 2}], "has version 2, this view.py reads 1"),
        ([{"other": 1}], "progress.jsonl is not of slam_demo"),
        ([[1]], "progress.jsonl is not of slam_demo"),
        ([HEAD, {"keyframe": 0, "frame": 1}], "progress.jsonl, line 2: KeyError('pose')"),
        ([HEAD, keyframe(0, 0, 0) | {"pose": [1]}, 5], "progress.jsonl, line 3: TypeError"),
        ([HEAD, loop(0, "accepted", 1)], "progress.jsonl, line 2: KeyError(0)"),
    ],
)
def test_files_that_are_no_progress(tmp_path, monkeypatch, recorder, lines, message):
    write(tmp_path, lines)
    assert message in view(monkeypatch, tmp_path)
    assert recorder.calls[-1] == ("disconnect",)


def test_a_line_of_a_later_kind_is_left_out(tmp_path, monkeypatch, recorder):
    write(tmp_path, [HEAD, {"unknown": 1, "frame": 3}, LINES[-1]])
    assert view(monkeypatch, tmp_path) is None


def test_folders_without_a_run(tmp_path, monkeypatch, recorder):
    assert f"{tmp_path}: this folder has no" in view(monkeypatch, tmp_path, "--wait", 0)
    assert "none: no such folder: name" in view(monkeypatch, tmp_path / "none", "--wait", 0)
    assert "no such folder" in view(monkeypatch, tmp_path / "none/none")
    (tmp_path / "progress.jsonl").touch()
    assert "no run writes to this file" in view(monkeypatch, tmp_path, "--wait", 0)


def test_another_run_into_the_same_folder(tmp_path, monkeypatch, recorder):
    write(tmp_path, LINES[:2])
    with (tmp_path / "progress.jsonl").open("r+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        timer = threading.Timer(0.5, file.truncate, [5])
        timer.start()
        assert "another run began: start view.py again" in view(monkeypatch, tmp_path)
        timer.join()


def test_no_map(tmp_path, monkeypatch, recorder):
    write(tmp_path, LINES)
    (tmp_path / "map.ply").write_bytes(b"ply\nend_header\n" + bytes(5))
    assert "map.ply: not a map of slam_demo" in view(monkeypatch, tmp_path)


@pytest.mark.skipif(
    importlib.util.find_spec("rerun") is None,
    reason="rerun is not installed (pip install 'gpureg[hosts]')",
)
def test_the_package_records_a_run(tmp_path):
    """With the real module: what is logged has its types."""
    write(tmp_path, LINES)
    record = tmp_path / "run.rrd"
    done = subprocess.run(
        [sys.executable, SCRIPT, tmp_path, "--save", record], capture_output=True, text=True
    )
    assert done.returncode == 0 and "Warning" not in done.stderr, done.stderr
    assert record.read_bytes()[:3] == b"RRF"


def test_it_says_how_to_install_rerun():
    program = f"import runpy, sys; sys.modules['rerun'] = None; runpy.run_path({str(SCRIPT)!r})"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 1
    assert "python3 -m pip install rerun-sdk==" in done.stderr


def test_a_real_recording(tmp_path):
    pytest.importorskip("rerun")
    write(tmp_path, LINES)
    words = [tmp_path, "--save", tmp_path / "a.rrd"]
    done = subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    recording = (tmp_path / "a.rrd").read_bytes()
    for entity in (b"/world/trajectory", b"/world/loops", b"/world/keyframes/3/points"):
        assert entity in recording
