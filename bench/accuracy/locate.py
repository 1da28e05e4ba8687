# SPDX-License-Identifier: BSD-3-Clause
"""Left-out fragments located in maps of the others, and fragments of other scenes, which are not there.

    python3 bench/accuracy/locate.py --data DATA --work WORK --command build/cpu/bin/gpureg

Every STEP-th fragment of the red kitchen, the houses A and B and hospital E is left out and asked for,
turned at random and with its middle camera at the origin, in the map of its scene and, with --maps joint, in
one map of all scenes, where those of --copies stand twice: either place is correct, and the other has to be
an alias. Those of the next scene are asked for in the map of each scene, too. A pose is correct if its RMSE
over the points of the scan is below 0.2 m.

With --generated FOLDER --inside N the scenes are those of FOLDER, by `gpureg generate --fragments 50`, one map of
the first N, 30 m apart, and the fragments of the others are not there. --thin K: the map has every K-th fragment.
The record then has counts, and keeps its other maps.
"""

from __future__ import annotations

import json
import os
import pathlib
import resource
import subprocess
from typing import Any

import numpy as np
import record

SCENES = {"kitchen": "redkitchen/fragments", "A": "house/A", "B": "house/B", "E": "hospital/E"}
CORRECT, FIRST, GAP = 0.2, 2, 40.0


def moved(points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    return points @ pose[:3, :3].T + pose[:3, 3]


def read_points(path: pathlib.Path) -> np.ndarray:
    with open(path, "rb") as file:
        header = []
        while (line := file.readline().decode().strip()) != "end_header":
            header.append(line.split())
        count = next(int(h[2]) for h in header if h[:2] == ["element", "vertex"])
        width = sum(h[0] == "property" for h in header)
        if any(h[0] == "property" and h[1] not in ("float", "float32") for h in header):
            raise SystemExit(f"{path}: not of float32 alone")
        return np.fromfile(file, "<f4", count * width).reshape(count, width)[:, :3].astype(float)


def write_points(path: pathlib.Path, points: np.ndarray) -> None:
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    path.write_bytes(header.encode() + points.astype("<f4").tobytes())


def read_poses(path: pathlib.Path) -> dict[int, np.ndarray]:
    numbers = path.read_text().split()
    rows = np.array(numbers, float).reshape(-1, 17)
    return {int(row[0]): row[1:].reshape(4, 4) for row in rows}


class Scene:
    def __init__(self, folder: pathlib.Path, step: int) -> None:
        self.folder = folder
        self.poses = read_poses(folder / "poses.txt")
        self.cameras: dict[int, list[list[str]]] = {}
        for line in (folder / "cameras.txt").read_text().splitlines():
            if line.strip() and not line.startswith("#"):
                self.cameras.setdefault(int(line.split()[0]), []).append(line.split())
        self.left_out = [n for n in sorted(self.poses) if n % step == FIRST]

    def query(self, number: int, path: pathlib.Path, seed: int) -> np.ndarray:
        """Writes the scan; returns scan_from_fragment."""
        cameras = self.cameras[number]
        middle = np.array(cameras[len(cameras) // 2][2:5], float)
        q, _ = np.linalg.qr(np.random.default_rng([seed, number]).normal(size=(3, 3)))
        frame = np.eye(4)
        frame[:3, :3] = q * np.sign(np.linalg.det(q))
        frame[:3, 3] = -frame[:3, :3] @ middle
        write_points(path, moved(read_points(self.folder / f"cloud_bin_{number}.ply"), frame))
        return frame


def map_folder(
    work: pathlib.Path,
    scenes: dict[str, Scene],
    shifts: dict[tuple[str, int], np.ndarray],
    thin: int = 1,
) -> pathlib.Path:
    work.mkdir(parents=True)
    poses, cameras, count = "", "", 0
    for (name, _), shift in shifts.items():
        scene = scenes.get(name)
        kept = [n for n in sorted(scene.poses) if n not in scene.left_out] if scene else []
        for number in kept[::thin]:
            source = (scene.folder / f"cloud_bin_{number}.ply").resolve()
            os.symlink(source, work / f"cloud_bin_{count}.ply")
            pose = shift @ scene.poses[number]
            poses += f"{count}\n" + "".join(
                " ".join(map(repr, row)) + "\n" for row in pose.tolist()
            )
            cameras += "".join(" ".join([str(count), *c[1:]]) + "\n" for c in scene.cameras[number])
            count += 1
    (work / "poses.txt").write_text(poses)
    (work / "cameras.txt").write_text(cameras)
    return work


def recall(rows: list[dict[str, Any]], precision: float) -> int:
    """Most first poses that are correct while so many of those with their confidence are."""
    best = right = 0
    for count, row in enumerate(sorted(rows, key=lambda row: -row["confidence"]), 1):
        right += row["correct"]
        if right >= precision * count:
            best = right
    return best


def counts(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Of the rows of one map."""
    here, away = [r for r in rows if r["here"]], [r for r in rows if not r["here"]]
    found = [r for r in here if r["status"] == "found"]
    return {
        "map": rows[0]["map"],
        "commit": record.commit(),
        "min_confidence": rows[0]["min_confidence"],
        "map_points": rows[0]["map_points"],
        "tiles": rows[0]["tiles"],
        "asked": len(here),
        "first_correct": sum(r["correct"] for r in here),
        "found": len(found),
        "found_wrong": sum(not r["correct"] for r in found),
        "ambiguous": sum(r["status"] == "ambiguous" for r in here),
        "recall_at_precision_99": recall(rows, 0.99),
        "strangers": len(away),
        "strangers_found": sum(r["status"] == "found" for r in away),
    }


def main() -> None:
    parser = record.plain_parser(__doc__)
    parser.add_argument("--data", type=pathlib.Path, help="needed without --generated")
    parser.add_argument("--generated", type=pathlib.Path)
    parser.add_argument("--inside", type=int, default=8)
    parser.add_argument("--thin", type=int, default=1)
    parser.add_argument("--name", help="of that map in the record")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="a new folder")
    parser.add_argument("--command", default="build/cpu/bin/gpureg")
    parser.add_argument("--output", type=pathlib.Path, help="record, a row a line")
    parser.add_argument("--step", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--maps", nargs="+", default=["single"], choices=["single", "joint"])
    parser.add_argument("--copies", nargs="*", default=[], choices=SCENES, help="in the joint map")
    arguments = parser.parse_args()
    if not arguments.generated and not arguments.data:
        parser.error("one of --data and --generated is needed")
    if arguments.generated:
        folders = {f.name: f for f in sorted(arguments.generated.iterdir())}
    else:
        folders = {n: arguments.data / f for n, f in SCENES.items()}
    scenes = {n: Scene(f, arguments.step) for n, f in folders.items()}
    names, work = list(scenes), arguments.work
    # By scene and copy. Maps of one scene have its frame.
    shifts = {(name, 0): np.eye(4) for name in names}
    rows: list[dict[str, Any]] = []
    run: dict[str, Any] = {"seed": arguments.seed, "step": arguments.step}

    def gpureg(*words: str | pathlib.Path) -> float:
        """CPU seconds: those of the clock depend on what else runs."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [arguments.command, "locate", "--voxel-size", "0.05", *map(str, words)],
            capture_output=True,
        )
        if done.returncode not in (0, 1):
            raise SystemExit(done.stderr.decode())
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def ask(kind: str, map: pathlib.Path, of: str, here: bool) -> None:
        scene, paths, truths = scenes[of], [], []
        for number in scene.left_out:
            paths.append(work / f"{of}_{number}.ply")
            frame = scene.query(number, paths[-1], arguments.seed)
            truth = scene.poses[number] @ np.linalg.inv(frame)
            truths.append([shift @ truth for name, shift in shifts.items() if name[0] == of])
        seconds = gpureg(*paths, map, "--viewpoint", "0,0,0", "--json", work / "result.json")
        result = json.loads((work / "result.json").read_text())
        for path, places, scan in zip(paths, truths, result["scans"]):
            points = read_points(path)
            errors = [
                [
                    float(
                        np.sqrt(((moved(points, pose) - moved(points, place)) ** 2).sum(1).mean())
                    )
                    for place in places
                ]
                for pose in (np.reshape(p["map_from_scan"], (4, 4)) for p in scan["poses"])
            ]
            first = scan["poses"][0]["confidence"] if errors else 0.0
            aliases = [e for e, p in zip(errors, scan["poses"]) if p["alias"]]
            row = {
                "map": kind,
                "scan": path.stem,
                "here": here,
                "status": scan["status"],
                "confidence": round(first, 4),
                "error": round(min(errors[0]), 4) if here and errors else None,
                "correct": here and bool(errors) and min(errors[0]) < CORRECT,
                "copies": len(places) if here else 0,
                "aliases": sum(min(e) < CORRECT for e in aliases) if here else 0,
                "tiles": result["map"]["tiles"],
                "map_points": result["map"]["points"],
                "min_confidence": result["options"]["min_confidence"],
                "cpu_seconds": round(seconds / len(paths), 2),
                "peak_memory_mib": round(result["peak_memory_mib"]),
            }
            rows.append(row)
            print(row, flush=True)
            run.update(result["environment"])
            if arguments.output and not arguments.generated:
                lines = ",\n ".join(json.dumps(r) for r in rows)
                arguments.output.write_text(
                    f'{{"run": {json.dumps(run)},\n"rows": [\n {lines}\n]}}\n'
                )

    if arguments.generated:
        inside = names[: arguments.inside]
        for k, name in enumerate(inside):
            shifts[name, 0][:2, 3] = 30 * (k % 5), 30 * (k // 5)
        kind = arguments.name or f"{len(inside)} generated buildings" + (
            f", one of {arguments.thin} fragments" if arguments.thin > 1 else ""
        )
        those = {name: scenes[name] for name in inside}
        folder = map_folder(work / "generated", those, shifts, arguments.thin)
        gpureg(folder, "--save-map", work / "generated.gpureg")
        for name in names:
            ask(kind, work / "generated.gpureg", name, name in inside)
        path = arguments.output
        if path:
            old = json.loads(path.read_text())["maps"] if path.exists() else []
            content = {
                "command": "python3 bench/accuracy/locate.py --generated FOLDER --inside N --work WORK",
                "run": run,
                "maps": [m for m in old if m["map"] != kind] + [counts(rows)],
            }
            record.save(path, content)
    single = "single" in arguments.maps and not arguments.generated
    for k, name in enumerate(names if single else []):
        folder = map_folder(work / name, {name: scenes[name]}, shifts)
        gpureg(folder, "--save-map", work / f"{name}.gpureg")
        ask(name, work / f"{name}.gpureg", name, True)
        ask(name, work / f"{name}.gpureg", names[(k + 1) % len(names)], False)
    if "joint" in arguments.maps:
        places = [(name, 0) for name in names] + [(name, 1) for name in arguments.copies]
        for k, place in enumerate(places):
            shifts[place] = np.eye(4)
            shifts[place][0, 3] = GAP * k
        folder = map_folder(work / "joint", scenes, shifts)
        gpureg(folder, "--save-map", work / "joint.gpureg")
        kind = "all four" + "".join(f", {name} twice" for name in arguments.copies)
        for name in names:
            ask(kind, work / "joint.gpureg", name, True)
    here = [r for r in rows if r["here"]]
    found = [r for r in rows if r["status"] == "found"]
    print(
        f"{sum(r['correct'] for r in here)} of {len(here)} first poses correct, "
        f"{sum(r['correct'] for r in found)} of {len(found)} found correct, "
        f"{sum(r['status'] == 'found' for r in rows if not r['here'])} of "
        f"{sum(not r['here'] for r in rows)} strangers found"
    )


if __name__ == "__main__":
    main()
