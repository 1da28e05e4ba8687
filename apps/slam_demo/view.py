#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Shows a run of slam_demo in the viewer of rerun.io, while it goes on or afterwards.

    view.py OUTPUT [--save FILE.rrd] [--wait SECONDS]

OUTPUT is the folder of slam_demo. Its progress.jsonl is followed until the run ends. Without
arguments it only says whether the package is there.
"""

import argparse
import fcntl
import json
import os
import sys
import time
from pathlib import Path

PACKAGE = "rerun-sdk==0.41.0"  # needs Python 3.11 or later
try:
    import numpy as np
    import rerun as rr
except ImportError as error:
    sys.exit(f"view.py: {error}: python3 -m pip install {PACKAGE}")

VERSION = 1  # of progress.jsonl
POLL = 0.2  # seconds
ADJUSTED = 0.01  # metres that a keyframe moves: then the trajectory before is shown too
GREY, RED, GREEN = (150, 150, 150), (200, 60, 40), (40, 160, 60)
BLUE, ORANGE = (60, 110, 220), (240, 140, 20)
SURFEL = np.dtype(
    [("position", "<f4", 3), ("normal", "<f4", 3), ("radius", "<f4"), ("confidence", "<f4")]
    + [("colour", "u1", 3)]
)


class ViewError(Exception):
    pass


def written(file):
    """Whether the run still goes on: it keeps a lock on the file."""
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True  # or a file system without locks
    fcntl.flock(file, fcntl.LOCK_UN)
    return False


def lines(path, wait):
    """The complete lines of progress.jsonl, each as soon as it is there, until the run ends."""
    deadline = time.monotonic() + wait
    if not path.parent.absolute().parent.is_dir():
        raise ViewError(f"{path.parent}: no such folder")
    if not path.exists() and wait > 0:
        print(f"view.py: waiting {wait:g} s for a run that writes {path}", file=sys.stderr)
    while not path.exists():
        if time.monotonic() > deadline:
            what = "this folder has no progress.jsonl" if path.parent.is_dir() else "no such folder"
            raise ViewError(f"{path.parent}: {what}: name the folder of slam_demo --output")
        time.sleep(POLL)
    with path.open("rb") as file:
        number, rest, ended = 0, b"", False
        while True:
            part = file.readline()
            rest += part
            if rest.endswith(b"\n"):
                number += 1
                yield rest
                rest = b""
            elif part:
                continue
            elif file.tell() > os.fstat(file.fileno()).st_size:
                raise ViewError(f"{path}: another run began: start view.py again")
            elif ended:
                break
            elif number and not written(file):
                ended = True  # what came since the last read is still to be read
            elif not number and time.monotonic() > deadline:
                raise ViewError(f"{path}: no run writes to this file")
            else:
                time.sleep(POLL)
    if rest:
        print(f"view.py: line {number + 1} is incomplete and left out", file=sys.stderr)


def log_strips(path, strips, colours, radius):
    rr.log(path, rr.LineStrips3D(strips, colors=colours, radii=radius))


class View:
    """Logs one line of progress.jsonl after the other."""

    def __init__(self, output, save):
        self.output, self.save = output, save
        self.camera = None
        self.poses, self.sessions, self.loops = {}, {}, {}  # by keyframe, by keyframe, by loop

    def begin(self, head):
        version = head.get("slam_demo_progress") if isinstance(head, dict) else None
        if version is None:
            raise ViewError("progress.jsonl is not of slam_demo")
        if version != VERSION:
            raise ViewError(f"progress.jsonl has version {version}, this view.py reads {VERSION}")
        rr.init("slam_demo", spawn=not self.save)
        if self.save:
            rr.save(self.save)
        fx, fy, cx, cy = head["camera"]
        self.camera = {
            "focal_length": (fx, fy),
            "principal_point": (cx, cy),
            "resolution": (2 * cx, 2 * cy),
        }
        # Of the first camera.
        rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Y_DOWN, static=True)
        image = rr.Pinhole(**self.camera, image_plane_distance=0.3, color=ORANGE)
        rr.log("world/camera/image", image, static=True)

    def add(self, number, line):
        if number == 1:
            return self.begin(line)
        rr.set_time("step", sequence=number)
        rr.set_time("frame", sequence=line["frame"])
        if "keyframe" in line:
            self.add_keyframe(line)
        elif "moved" in line:
            self.move(line["moved"])
        elif "loop" in line:
            self.change_loop(line)
        elif "end" in line:
            self.end(line["end"])

    def add_keyframe(self, line):
        k, entity = line["keyframe"], f"world/keyframes/{line['keyframe']}"
        self.poses[k], self.sessions[k] = line["pose"], line["session"]
        image = rr.Pinhole(**self.camera, image_plane_distance=0.08, color=BLUE)
        rr.log(f"{entity}/image", image)
        # Below the keyframe: they follow it.
        rr.log(f"{entity}/points", rr.Points3D(np.reshape(line["points"], (-1, 3)), radii=0.008))
        self.log_pose(entity, k)
        self.log_pose("world/camera", k)
        self.log_trajectory()

    def move(self, moved):
        before = self.strips()
        metres = [np.subtract(pose[:3], self.poses[k][:3]) for k, *pose in moved]
        if np.linalg.norm(metres, axis=1).max(initial=0) >= ADJUSTED:
            log_strips("world/before", before, GREY, 0.004)
        for k, *pose in moved:
            self.poses[k] = pose
            self.log_pose(f"world/keyframes/{k}", k)
        self.log_pose("world/camera", max(self.poses))
        self.log_trajectory()
        self.log_loops()

    def change_loop(self, line):
        number, state = line["loop"], line["state"]
        a, b = line["keyframes"]
        if state == "accepted":
            self.loops[number] = (a, b)
        else:
            self.loops.pop(number, None)
        rr.log("log", rr.TextLog(f"loop of keyframes {a} and {b}: {state} ({line['reason']})"))
        self.log_loops()

    def end(self, how):
        rr.log("log", rr.TextLog(f"the run is {how}"))
        if (self.output / "map.ply").exists():
            data = (self.output / "map.ply").read_bytes()
            end = data.find(b"end_header\n") + len(b"end_header\n")
            if end < len(b"end_header\n") or (len(data) - end) % SURFEL.itemsize:
                raise ViewError(f"{self.output / 'map.ply'}: not a map of slam_demo")
            map_ = np.frombuffer(data, SURFEL, offset=end)
            points = rr.Points3D(map_["position"], radii=map_["radius"], colors=map_["colour"])
            rr.log("world/map", points)
        if (self.output / "odometry.txt").exists():
            rows = np.loadtxt(self.output / "odometry.txt", ndmin=2).reshape(-1, 8)  # TUM's format
            log_strips("world/odometry", [rows[:, 1:4]], RED, 0.004)

    def strips(self):
        """The keyframes' positions, one strip for each session."""
        strips = {}
        for k in sorted(self.poses):
            strips.setdefault(self.sessions[k], []).append(self.poses[k][:3])
        return list(strips.values())

    def log_trajectory(self):
        log_strips("world/trajectory", self.strips(), GREEN, 0.008)

    def log_loops(self):
        pairs = [[self.poses[a][:3], self.poses[b][:3]] for a, b in self.loops.values()]
        log_strips("world/loops", pairs, ORANGE, 0.008)

    def log_pose(self, entity, k):
        position, quaternion = self.poses[k][:3], rr.Quaternion(xyzw=self.poses[k][3:])
        rr.log(entity, rr.Transform3D(translation=position, quaternion=quaternion))


def show(output, save, wait):
    view = View(output, save)
    for number, text in enumerate(lines(output / "progress.jsonl", wait), 1):
        try:
            line = json.loads(text)
            view.add(number, line)
        except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
            raise ViewError(f"progress.jsonl, line {number}: {error!r}") from error
        if "end" in line:
            return
    print("view.py: the run ended without its last line: it was killed", file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(prog="view.py", description=__doc__.split("\n")[0])
    parser.add_argument("output", type=Path, help="folder of slam_demo --output")
    parser.add_argument("--save", help="write a recording instead of opening the viewer")
    parser.add_argument(
        "--wait", type=float, default=60, help="seconds that a run may take to begin"
    )
    args = parser.parse_args()
    try:
        show(args.output, args.save, args.wait)
    except (ViewError, OSError) as error:
        sys.exit(f"view.py: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
    finally:
        rr.disconnect()  # completes the file


if __name__ == "__main__" and len(sys.argv) > 1:
    main()
