# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps of a simulated spinning LiDAR located in a large outdoor map, and foreign scans, which are not there.

    python3 bench/accuracy/locate_sweeps.py --name gomentum --map MAP --voxel 0.5 --work WORK \
        --foreign SCAN.ply... --output bench/results/locate_sweeps.json

MAP is a PLY of float32, a folder of ASCII PCD files, or a folder of Entwine's binary tiles in feet. A sweep
is seen from 1.8 m above the ground: the range at which each ray meets the first occupied voxel of the map,
with noise. A piece, for maps that were seen from the air, is half of the points within --reach of a place.
All scans are turned at random. A pose is correct if it is off by less than --correct
metres at the origin of the scan.
"""

from __future__ import annotations

import json
import pathlib
import resource
import subprocess
import time
import typing
from typing import Any

import locate
import numpy as np
from record import commit, plain_parser

RINGS = {16: (-15.0, 15.0), 64: (-24.8, 2.0)}
COLUMNS, HEIGHT, NOISE, FOOT = 1800, 1.8, 0.02, 0.3048


def read_map(path: pathlib.Path) -> np.ndarray:
    if path.is_file():
        return locate.read_points(path)
    if (path / "ept.json").exists():
        return read_entwine(path)
    parts = []
    for file in sorted(path.glob("*.pcd")):
        head, _, body = file.read_bytes().partition(b"\nDATA ascii\n")
        if body.strip():
            width = len(head.split(b"\nFIELDS ")[1].split(b"\n")[0].split())
            parts.append(np.array(body.split(), float).reshape(-1, width)[:, :3])
    return np.concatenate(parts)


def read_entwine(path: pathlib.Path) -> np.ndarray:
    fields = json.loads((path / "ept.json").read_text())["schema"]
    letter = {"signed": "i", "unsigned": "u", "float": "f"}
    row = np.dtype([(f["name"], f"<{letter[f['type']]}{f['size']}") for f in fields])
    parts = [np.fromfile(f, row) for f in sorted((path / "ept-data").glob("*.bin"))]
    rows = np.concatenate(parts)
    xyz = {f["name"]: rows[f["name"]] * f["scale"] for f in fields if f["name"] in "XYZ"}
    return np.stack([xyz["X"], xyz["Y"], xyz["Z"]], 1) * FOOT


class World:
    """A map as occupied cells, which rays meet."""

    def __init__(self, points: np.ndarray, cell: float, reach: float) -> None:
        self.points, self.cell, self.reach = points, cell, reach
        self.low = points.min(0)
        column = self.column(points)
        order = np.lexsort((points[:, 2], column))
        first = np.unique(column[order], return_index=True)[1]
        self.ground = points[order[first]]

    def column(self, points: np.ndarray) -> np.ndarray:
        x, y = np.floor((points[:, :2] - self.low[:2]) / 1.0).astype(np.int64).T
        return x << 32 | y

    def near(self, place: np.ndarray) -> np.ndarray:
        box = (np.abs(self.points[:, :2] - place[:2]) < self.reach).all(1)
        return self.points[box]

    def sweep(self, place: np.ndarray, rings: int, random: np.random.Generator) -> np.ndarray:
        """What the sensor sees, relative to it and unturned; fewer points than rays."""
        near = self.near(place)
        corner = np.floor((near.min(0) - place) / self.cell) - 1
        index = (np.floor((near - place) / self.cell) - corner).astype(np.int64)
        shape = index.max(0) + 2
        flat = (index[:, 0] * shape[1] + index[:, 1]) * shape[2] + index[:, 2]
        full = np.zeros(int(shape.prod()), bool)
        full[flat] = True
        up = np.radians(np.linspace(*RINGS[rings], rings))[:, None]
        turn = np.linspace(0, 2 * np.pi, COLUMNS, endpoint=False)[None]
        rays = np.stack(
            [np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up) + 0 * turn], -1
        ).reshape(-1, 3)
        ranges = np.full(len(rays), np.nan)
        alive = np.arange(len(rays))
        for distance in np.arange(1.0, self.reach, self.cell / 2):
            at = np.floor(rays[alive] * (distance / self.cell)) - corner
            inside = ((at >= 0) & (at < shape)).all(1)
            alive, at = alive[inside], at[inside].astype(np.int64)
            hit = full[(at[:, 0] * shape[1] + at[:, 1]) * shape[2] + at[:, 2]]
            ranges[alive[hit]] = distance
            alive = alive[~hit]
        seen = np.isfinite(ranges)
        ranges += random.uniform(0, self.cell / 2, len(rays)) + random.normal(0, NOISE, len(rays))
        return rays[seen] * ranges[seen][:, None]

    def piece(self, place: np.ndarray, random: np.random.Generator) -> np.ndarray:
        near = self.near(place)
        near = near[((near - place) ** 2).sum(1) < self.reach**2]
        half = near[random.random(len(near)) < 0.5]
        return half + random.normal(0, NOISE, half.shape) - place


class Query(typing.NamedTuple):
    kind: str
    seed: int
    path: pathlib.Path
    pose: np.ndarray | None  # map_from_scan


class Queries:
    def __init__(self, world: World, work: pathlib.Path, name: str, least: int) -> None:
        self.world, self.work, self.name, self.least = world, work, name, least

    def turned(self, points: np.ndarray, path: pathlib.Path, random: Any) -> np.ndarray:
        q, _ = np.linalg.qr(random.normal(size=(3, 3)))
        q *= np.sign(np.linalg.det(q))
        locate.write_points(path, points @ q.T)
        return q

    def make(self, rings: int, seed: int, number: int) -> Query:
        """rings 0: a piece."""
        random = np.random.default_rng([seed, rings, number])
        while True:
            place = random.choice(self.world.ground) + [0, 0, HEIGHT if rings else 0]
            if rings and (((self.world.near(place) - place) ** 2).sum(1) < 1).any():
                continue
            points = (
                self.world.sweep(place, rings, random) if rings else self.world.piece(place, random)
            )
            if len(points) >= self.least * max(rings, 1):
                break
        path = self.work / f"{self.name}_{rings}_{seed}_{number}.ply"
        q = self.turned(points, path, random)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = q.T, place
        return Query(f"{rings} rings" if rings else "piece", seed, path, pose)

    def foreign(self, source: pathlib.Path, seed: int) -> Query:
        path = self.work / f"foreign_{seed}_{source.stem}.ply"
        self.turned(locate.read_points(source), path, np.random.default_rng(seed))
        return Query("foreign", seed, path, None)


def save(path: pathlib.Path, run: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """A row a line; those of other maps stay."""
    old = json.loads(path.read_text()) if path.exists() else {"runs": [], "rows": []}
    lists = {"runs": [run | {"commit": commit()}], "rows": rows}
    for name, new in lists.items():
        new = [row for row in old[name] if row["map"] != run["map"]] + new
        lists[name] = ",\n ".join(map(json.dumps, new))
    path.write_text(f'{{"runs": [\n {lists["runs"]}],\n"rows": [\n {lists["rows"]}]}}\n')


def main() -> None:
    parser = plain_parser(__doc__)
    parser.add_argument("--name", required=True, help="of the map, in the record")
    parser.add_argument("--map", type=pathlib.Path, required=True)
    parser.add_argument("--voxel", default="0.5", help="of the search, metres")
    parser.add_argument("--cell", type=float, default=0.2, help="that stops a ray, metres")
    parser.add_argument("--reach", type=float, default=100, help="of a sweep or piece, metres")
    parser.add_argument("--least", type=int, default=180, help="points a ring, or of a piece")
    parser.add_argument("--correct", type=float, default=0.5, help="metres")
    parser.add_argument("--rings", type=int, nargs="+", default=[16, 64], help="0: pieces")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--queries", type=int, default=10, help="of each seed and kind")
    parser.add_argument("--foreign", type=pathlib.Path, nargs="*", default=[])
    parser.add_argument("--work", type=pathlib.Path, required=True, help="a folder")
    parser.add_argument("--command", default="build/cpu/bin/gpureg")
    parser.add_argument("--output", type=pathlib.Path, help="record; rows of other maps stay")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    world = World(read_map(arguments.map), arguments.cell, arguments.reach)
    saved = arguments.work / f"{arguments.name}.gpureg"
    result_file = arguments.work / "result.json"
    rows: list[dict[str, Any]] = []

    def gpureg(*words: str | pathlib.Path) -> tuple[float, float]:
        """Seconds of the clock and of the processors."""
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        command = [arguments.command, "locate", *map(str, words), "--voxel-size", arguments.voxel]
        done = subprocess.run(command, capture_output=True)
        if done.returncode not in (0, 1):
            raise SystemExit(done.stderr.decode())
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return time.monotonic() - begin, cpu

    def ask(queries: list[Query]) -> None:
        """Sweeps and pieces apart: nobody knows from where a piece was seen."""
        if not queries:
            return
        paths, known = [q.path for q in queries], queries[0].kind != "piece"
        viewpoint = ["--viewpoint", "0,0,0"] if known else []
        wall, cpu = gpureg(*paths, saved, *viewpoint, "--json", result_file)
        result = json.loads(result_file.read_text())
        for query, scan in zip(queries, result["scans"]):
            first = scan["poses"][0] if scan["poses"] else None
            error = None
            if first and query.pose is not None:
                pose = np.reshape(first["map_from_scan"], (4, 4))
                error = float(np.linalg.norm((pose - query.pose)[:3, 3]))
            row = {
                "map": arguments.name,
                "kind": query.kind,
                "seed": query.seed,
                "scan": query.path.stem,
                "here": query.pose is not None,
                "points": scan["points"],
                "status": scan["status"],
                "confidence": round(first["confidence"], 4) if first else 0.0,
                "error": None if error is None else round(error, 3),
                "correct": error is not None and error < arguments.correct,
                "tiles": scan["tiles"],
                "cpu_seconds": round(cpu / len(queries), 1),
                "peak_memory_mib": round(result["peak_memory_mib"]),
            }
            rows.append(row)
            print(row, flush=True)
        print(f"{wall:.1f} s, {cpu:.1f} s of processors, {len(queries)} scans", flush=True)
        if arguments.output:
            head = {"map": arguments.name, "map_points": result["map"]["points"]}
            head |= {"voxel": float(arguments.voxel), **result["environment"]}
            save(arguments.output, head, rows)

    if not saved.exists():
        cloud = arguments.work / "map.ply"
        origin = world.points.min(0)
        locate.write_points(cloud, world.points - origin)
        wall, cpu = gpureg(cloud, "--save-map", saved)
        print(f"prepared in {wall:.1f} s, {cpu:.1f} s of processors")
        np.savetxt(arguments.work / "origin.txt", origin)
    origin = np.loadtxt(arguments.work / "origin.txt")
    queries = Queries(world, arguments.work, arguments.name, arguments.least)
    made = [
        queries.make(rings, seed, k)
        for seed in arguments.seeds
        for rings in arguments.rings
        for k in range(arguments.queries)
    ]
    for query in made:
        query.pose[:3, 3] -= origin
    for is_piece in (False, True):
        ask([q for q in made if (q.kind == "piece") == is_piece])
    ask([queries.foreign(f, seed) for seed in arguments.seeds for f in arguments.foreign])
    true = [r for r in rows if r["here"]]
    found = [r for r in rows if r["status"] == "found"]
    strangers = [r for r in rows if not r["here"]]
    print(
        f"{sum(r['correct'] for r in true)} of {len(true)} first poses correct, "
        f"{sum(r['correct'] and r['status'] == 'found' for r in true)} found; "
        f"{sum(r['correct'] for r in found)} of {len(found)} found correct; "
        f"{sum(r['status'] == 'found' for r in strangers)} of {len(strangers)} strangers found"
    )


if __name__ == "__main__":
    main()
