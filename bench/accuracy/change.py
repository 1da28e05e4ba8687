# SPDX-License-Identifier: BSD-3-Clause
"""Changes that `gpureg change` sees where nothing has changed, and in rearranged houses.

    python3 bench/accuracy/change.py --data DATA --work WORK --build build/cpu/bin --output RECORD

Unchanged: pairs of fragments of the red kitchen, each fragment in the map of all others, and pairs of scans of KITTI
(where cars move), at their known poses: the share of points that are labelled new or gone. Rearranged: houses of
`gpureg generate` as they were and some time later, by gpureg_change_bench, which knows the truth.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import resource
import subprocess
from typing import Any

import numpy as np

KITCHEN_STEP, MAP_FRAGMENTS, SCANS = 8, 24, 10
LABELS = ("same", "new", "gone", "occluded", "not_observed")


def read_blocks(path: pathlib.Path) -> dict[int, np.ndarray]:
    rows = np.array(path.read_text().split(), float).reshape(-1, 17)
    return {int(row[0]): row[1:].reshape(4, 4) for row in rows}


def text_of(pose: np.ndarray) -> str:
    return "".join(" ".join(map(repr, row)) + "\n" for row in pose.tolist())


def link_map(work: pathlib.Path, clouds: list[tuple[pathlib.Path, np.ndarray, list[str]]]) -> None:
    """A folder of scans with poses and, where they are known, cameras."""
    work.mkdir(parents=True)
    poses = cameras = ""
    clouds = clouds * 2 if len(clouds) == 1 else clouds  # a folder with poses has two at least
    for k, (path, pose, seen_from) in enumerate(clouds):
        os.symlink(path.resolve(), work / f"cloud_bin_{k}.ply")
        poses += f"{k}\n{text_of(pose)}"
        cameras += "".join(f"{k} {line.split(None, 1)[1]}\n" for line in seen_from)
    (work / "poses.txt").write_text(poses)
    if cameras:
        (work / "cameras.txt").write_text(cameras)


def run(words: list[str]) -> tuple[str, float]:
    """Output, and seconds of the processor: those of the clock depend on what else runs."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(words)}\n{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


class Bench:
    def __init__(self, arguments: argparse.Namespace) -> None:
        self.data, self.work, self.build = arguments.data, arguments.work, arguments.build
        self.output = arguments.output
        self.rows: list[dict[str, Any]] = []

    def add(self, row: dict[str, Any]) -> None:
        self.rows.append(row)
        print(row, flush=True)
        if self.output:
            lines = ",\n ".join(json.dumps(r) for r in self.rows)
            self.output.write_text(f'{{"rows": [\n {lines}\n]}}\n')

    def compare(self, scan: pathlib.Path, map: pathlib.Path, pose: np.ndarray, *more: str) -> Any:
        (self.work / "pose.txt").write_text(text_of(pose))
        result = self.work / "result.json"
        words = [f"{self.build}/gpureg", "change", str(scan), str(map), *more]
        words += ["--pose", str(self.work / "pose.txt"), "--json", str(result)]
        seconds = run(words)[1]
        return json.loads(result.read_text()) | {"seconds": seconds}

    def total(self, name: str, results: list[Any]) -> None:
        scan = {label: sum(r["scan"][label] for r in results) for label in LABELS}
        map = {label: sum(r["map"][label] for r in results) for label in LABELS}
        seen = sum(map.values()) - map["not_observed"]
        worst = max((r["scan"]["new"] / r["scan"]["points"] for r in results), default=0.0)
        self.add(
            {
                "set": name,
                "comparisons": len(results),
                "false_new": round(scan["new"] / sum(scan.values()), 5),
                "worst_scan": round(worst, 5),
                "false_gone": round(map["gone"] / seen, 5),
                "scan_same": round(scan["same"] / sum(scan.values()), 4),
                "cpu_seconds": round(sum(r["seconds"] for r in results) / len(results), 2),
            }
        )

    def kitchen(self) -> None:
        folder = self.data / "redkitchen/fragments"
        poses = read_blocks(folder / "poses.txt")
        cameras: dict[int, list[str]] = {}
        for line in (folder / "cameras.txt").read_text().splitlines():
            if line.strip() and not line.startswith("#"):
                cameras.setdefault(int(line.split()[0]), []).append(line)

        def viewed(number: int) -> list[str]:
            """Scans are compared through folders of one, which have cameras."""
            positions = [line.split()[2:5] for line in cameras[number]]
            return ["--viewpoint", ",".join(positions[len(positions) // 2])]

        def cloud(number: int) -> tuple[pathlib.Path, np.ndarray, list[str]]:
            return folder / f"cloud_bin_{number}.ply", poses[number], cameras[number]

        pairs = [line.split() for line in (folder / "gt.log").read_text().splitlines()]
        overlapping = [(int(p[0]), int(p[1])) for p in pairs if len(p) == 3]
        results = []
        for i, j in overlapping[::KITCHEN_STEP]:
            map = self.work / f"kitchen_{i}_{j}"
            link_map(map, [cloud(i)])
            results.append(self.compare(cloud(j)[0], map, poses[j], *viewed(j)))
        self.total("kitchen, pairs", results)
        results = []
        for number in sorted(poses):
            map = self.work / f"kitchen_without_{number}"
            link_map(map, [cloud(n) for n in sorted(poses) if n != number])
            results.append(self.compare(cloud(number)[0], map, poses[number], *viewed(number)))
        self.total("kitchen, map of the others", results)

    def kitti(self) -> None:
        results = []
        for k, pair in enumerate(json.loads((self.data / "kitti/pairs.json").read_text())):
            if pair["kind"] == "negative":
                continue
            map = self.work / f"kitti_{k}"
            link_map(map, [(self.data / f"kitti/{pair['target']}.ply", np.eye(4), [])])
            scan = self.data / f"kitti/{pair['source']}.ply"
            truth = np.reshape(pair["truth"], (4, 4)).astype(float)
            results.append(self.compare(scan, map, truth, "--voxel-size", "0.3"))
        self.total("KITTI", results)

    def houses(self, seeds: int) -> None:
        for seed in range(1, seeds + 1):
            folders = [self.work / f"house_{seed}_{visit}" for visit in (0, 1)]
            for visit, folder in enumerate(folders):
                count = str(SCANS if visit else MAP_FRAGMENTS)
                words = [f"{self.build}/gpureg", "generate", str(folder), "--seed", str(seed)]
                run([*words, "--rearrange", str(visit), "--fragments", count, "--quiet"])
            words = [f"{self.build}/gpureg_change_bench", str(seed), "1", *map(str, folders)]
            for line in run(words)[0].splitlines():
                self.add({"set": f"house {seed}"} | json.loads(line))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="a new folder")
    parser.add_argument("--build", default="build/cpu/bin")
    parser.add_argument("--output", type=pathlib.Path, help="record, a row a line")
    parser.add_argument("--seeds", type=int, default=3, help="houses")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True)
    bench = Bench(arguments)
    bench.kitchen()
    bench.kitti()
    bench.houses(arguments.seeds)


if __name__ == "__main__":
    main()
