# SPDX-License-Identifier: BSD-3-Clause
"""Scans located in generated cities of known truth, and scans of another city, which are not there.

    python3 bench/localization/city.py --buildings 100 --work WORK --output bench/results/locate_city.json

The map (city_scene.py) is a folder of one cloud a plot: a jittered grid on all surfaces that somebody
on a street or in a room can see, with normals and sensor positions. Queries are sweeps of spinning
LiDARs on a street or in a room and depth cameras in rooms, by intersection of rays and boxes, turned
at random. A pose is correct if it is off by less than 0.5 m in streets and 0.3 m in rooms. A room of a
copied building may be found in any copy, or be ambiguous. Times of calls are those of
gpureg_locate_bench, in one process; the time of loading is that of a command with an empty scan.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import typing
from typing import Any

import city_scene
import numpy as np
from city_scene import City

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
from record import commit, plain_parser

SENSORS = {  # elevations, rings, azimuths, columns, reach in metres
    "street 16": (-15, 15, 16, 360, 1800, 80),
    "street 64": (-24.8, 2, 64, 360, 900, 80),
    "room 16": (-15, 15, 16, 360, 1800, 40),
    "room camera": (-40, 20, 160, 90, 240, 8),
}
CORRECT = {"street": 0.5, "room": 0.3}  # metres
EYE, RANGE_NOISE, POINT_NOISE = 1.8, 0.02, 0.01


def write_cloud(path: pathlib.Path, rows: np.ndarray) -> None:
    """Points, or points and normals."""
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n"
    names = ["x", "y", "z", "nx", "ny", "nz"][: rows.shape[1]]
    header += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    path.write_bytes(header.encode() + rows.astype("<f4").tobytes())


def extent(points: np.ndarray) -> float:
    """As gpureg measures it: less than ten voxels have no shape."""
    return float(np.ptp(np.quantile(points, [0.05, 0.95], axis=0), axis=0).max())


def free_places(boxes: np.ndarray, random: Any, draws: list[Any]) -> np.ndarray:
    """One of each draw; none where a room is full."""
    found = []
    for draw in draws:
        for place in (draw(random) for _ in range(20)):
            if city_scene.is_free(boxes, place, 0.3):
                found.append(place)
                break
    return np.array(found)


class Query(typing.NamedTuple):
    sensor: str
    seed: int
    path: pathlib.Path
    poses: list[np.ndarray]  # map_from_scan of all places that are the same
    extent: float


class Maker:
    """Writes pieces and queries; a process has its own."""

    def __init__(self, city: City, spacing: float, folder: pathlib.Path) -> None:
        self.city, self.spacing, self.folder = city, spacing, folder

    def on_street(self, k: int) -> Any:
        """Draws a place on a street at the plot, or at its corner."""
        piece = self.city.piece(k)
        gap = piece.plot[0] - piece.outer[0]

        def draw(random: Any) -> np.ndarray:
            axis = int(random.random() * gap.sum() < gap[0])  # along y where the gap is in x
            place = np.array([0, 0, EYE])
            place[axis] = random.uniform(piece.outer[0, axis], piece.plot[1, axis])
            across = piece.outer[0, 1 - axis] + gap[1 - axis] / 2
            place[1 - axis] = across + random.uniform(-1.5, 1.5)
            return place

        return draw if gap.any() else None

    def in_garden(self, k: int) -> Any:
        low, high = self.city.piece(k).plot

        def draw(random: Any) -> np.ndarray:
            place = np.array([*random.uniform(low + 1, high - 1), EYE])
            axis = random.integers(2)
            place[axis] = random.choice([low[axis] + 1, high[axis] - 1])
            return place

        return draw

    def in_room(self, k: int, number: int | None = None) -> Any:
        piece = self.city.piece(k)
        _, rooms = city_scene.building(piece.key)

        def draw(random: Any) -> np.ndarray:
            room = np.array(rooms[random.integers(len(rooms)) if number is None else number])
            local = random.uniform(room[:, 0], room[:, 1])
            local[2] = room[2, 0] + random.uniform(1.2, 1.7)
            return city_scene.moved(local[None], piece.frame)[0]

        return draw

    def piece(self, k: int) -> tuple[int, np.ndarray, np.ndarray, float]:
        """Number of points, corner of the plot, sensor positions relative to it, seconds."""
        begin = time.process_time()
        random = np.random.default_rng([self.city.seed, 4, k])
        piece = self.city.piece(k)
        points, normals = city_scene.sample(piece.boxes, self.spacing, random)
        corner = np.array([*piece.outer[0], 0])
        points += random.normal(0, POINT_NOISE, points.shape) - corner
        write_cloud(self.folder / f"cloud_bin_{k}.ply", np.concatenate([points, normals], 1))
        rooms = range(len(city_scene.building(piece.key)[1]))
        draws = [self.in_room(k, number) for number in rooms]
        draws += [self.on_street(k)] * 3 if self.on_street(k) else []
        draws += [self.in_garden(k)] * 4
        places = free_places(piece.boxes, random, draws)
        return len(points), corner, places - corner, time.process_time() - begin

    def query(self, sensor: str, seed: int, number: int, here: bool) -> Query:
        random = np.random.default_rng([seed, list(SENSORS).index(sensor), number, here])
        low, high, rings, around, columns, reach = SENSORS[sensor]
        while True:
            k = int(random.integers(self.city.buildings))
            draw = self.on_street(k) if sensor.startswith("street") else self.in_room(k)
            if not draw:
                continue
            place = draw(random)
            boxes = self.city.near(place, reach)
            if not city_scene.is_free(boxes, place, 0.5):
                continue
            up = np.radians(np.linspace(low, high, rings))
            turn = random.uniform(0, 7) + np.radians(np.arange(columns) * around / columns)
            ranges = city_scene.cast(boxes, place, turn, up, reach).ravel()
            flat, rise = np.cos(up)[:, None], np.sin(up)[:, None] + 0 * turn
            rays = np.stack([flat * np.cos(turn), flat * np.sin(turn), rise], -1).reshape(-1, 3)
            seen = np.isfinite(ranges)
            points = rays[seen] * (ranges + random.normal(0, RANGE_NOISE, len(rays)))[seen, None]
            if seen.mean() <= 0.2:  # into a cupboard, or into the sky
                continue
            if extent(points) > 3 and np.median(ranges[seen]) > 1.5:
                break
        q, _ = np.linalg.qr(random.normal(size=(3, 3)))
        q *= np.sign(np.linalg.det(q))
        points = points @ q.T
        path = self.folder / f"{sensor.replace(' ', '_')}_{seed}_{number}_{int(here)}.ply"
        write_cloud(path, points)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = q.T, place
        poses, frame = [pose], self.city.piece(k).frame
        for other in range(self.city.buildings) if sensor.startswith("room") else []:
            if self.city.key(other) == self.city.key(k) and other != k:
                to = self.city.piece(other).frame
                turned = to - frame
                copy = np.eye(4)
                copy[:3, :3] = city_scene.moved(pose[:3, :3].T, np.array([0, 0, 0, turned[3]])).T
                local = city_scene.moved(place[None], frame, back=True)
                copy[:3, 3] = city_scene.moved(local, to)[0]
                poses.append(copy)
        return Query(sensor, seed, path, poses if here else [], extent(points))


class Command:
    def __init__(self, arguments: argparse.Namespace) -> None:
        self.words = [arguments.command, "locate", "--voxel-size", str(arguments.voxel_size)]
        self.words += ["--backend", arguments.backend]

    def __call__(self, *words: str | pathlib.Path) -> dict[str, Any]:
        """The result, with the seconds of the call and of its processors, and its peak memory."""
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as error:
            file = pathlib.Path(folder) / "result.json"
            begin = time.monotonic()
            process = subprocess.Popen(
                [*self.words, *map(str, words), "--json", str(file)],
                stdout=subprocess.DEVNULL,
                stderr=error,
            )
            _, status, usage = os.wait4(process.pid, 0)
            wall = time.monotonic() - begin
            if os.waitstatus_to_exitcode(status) not in (0, 1):
                error.seek(0)
                raise SystemExit(error.read().decode())
            result = json.loads(file.read_text()) if file.exists() else {"seconds": 0}
        used = usage.ru_utime + usage.ru_stime
        return result | {"wall": wall, "cpu": used, "memory_mib": round(usage.ru_maxrss / 1024)}


def seconds_of_calls(
    o: argparse.Namespace, saved: pathlib.Path, scans: list[Any]
) -> dict[str, Any]:
    """Of the first call of a process, of one scan alone, and of one in a batch."""
    bench = pathlib.Path(o.command).with_name("gpureg_locate_bench")
    words = map(str, [bench, o.backend, saved, *scans])
    call = json.loads(subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout)
    return {key: call[key] for key in ("first_seconds", "alone_seconds", "batch_seconds")}


def make_map(maker: Maker, pool: Any) -> tuple[int, float]:
    """Raw points, and seconds of a processor a building."""
    poses, cameras, count, seconds = "", "", 0, 0.0
    pieces = pool.imap(maker.piece, range(maker.city.buildings), 4)
    for k, (points, corner, places, used) in enumerate(pieces):
        x, y, z = corner
        poses += f"{k}\n1 0 0 {x}\n0 1 0 {y}\n0 0 1 {z}\n0 0 0 1\n"
        for n, (x, y, z) in enumerate(places):
            cameras += f"{k} {n} {x:.3f} {y:.3f} {z:.3f} 0 0 0 1\n"
        count, seconds = count + points, seconds + used
    if maker.city.buildings == 1:  # a folder of one scan is refused
        (maker.folder / "cloud_bin_1.ply").symlink_to("cloud_bin_0.ply")
        poses += "1" + poses[1:]
    (maker.folder / "poses.txt").write_text(poses)
    (maker.folder / "cameras.txt").write_text(cameras)
    return count, seconds / maker.city.buildings


def row_of(query: Query, scan: dict[str, Any], name: str) -> dict[str, Any]:
    errors = [
        min(
            (float(np.linalg.norm(np.reshape(p["map_from_scan"], (4, 4))[:3, 3] - truth[:3, 3])))
            for truth in query.poses
        )
        for p in (scan["poses"] if query.poses else [])
    ]
    limit = CORRECT[query.sensor.split()[0]]
    first = scan["poses"][0]["confidence"] if scan["poses"] else 0.0
    right = [k for k, e in enumerate(errors) if e < limit]
    return {
        "map": name,
        "sensor": query.sensor,
        "seed": query.seed,
        "scan": query.path.stem,
        "here": bool(query.poses),
        "copies": len(query.poses),
        "points": scan["points"],
        "tiles": scan["tiles"],
        "status": scan["status"],
        "confidence": round(first, 4),
        "error": round(errors[0], 3) if errors else None,
        "correct": 0 in right,
        "rank": right[0] if right else None,  # of the first correct pose
    }


def save(path: pathlib.Path, run: dict[str, Any], rows: list[dict[str, Any]]) -> dict[str, Any]:
    """A row a line; those of other maps stay."""
    record = json.loads(path.read_text()) if path.exists() else {"runs": [], "rows": []}
    for name, new in (("runs", [run]), ("rows", rows)):
        record[name] = [old for old in record[name] if old["map"] != run["map"]] + new
    lists = {name: ",\n ".join(map(json.dumps, record[name])) for name in record}
    path.write_text(f'{{"runs": [\n {lists["runs"]}],\n"rows": [\n {lists["rows"]}]}}\n')
    return record


def placed(row: dict[str, Any]) -> bool:
    good = row["status"] == "found" or (row["status"] == "ambiguous" and row["copies"] > 1)
    return row["correct"] and good


def print_table(record: dict[str, Any]) -> None:
    print(
        "map | sensor | recall | first correct | precision | foreign found | ms alone | ms in batch"
    )
    for run in record["runs"]:
        for sensor in [*SENSORS, "all"]:
            rows = [r for r in record["rows"] if r["map"] == run["map"]]
            rows = [r for r in rows if sensor in (r["sensor"], "all")]
            here, away = ([r for r in rows if r["here"] is is_here] for is_here in (True, False))
            found = [r for r in here if r["status"] == "found"]
            figures = [
                f"{sum(map(placed, here))}/{len(here)}",
                f"{sum(r['correct'] for r in here)}/{len(here)}",
                f"{sum(r['correct'] for r in found)}/{len(found)}",
                f"{sum(r['status'] == 'found' for r in away)}/{len(away)}",
                f"{1e3 * run['alone_seconds']:.0f} | {1e3 * run['batch_seconds']:.0f}"
                if sensor == "all"
                else "",
            ]
            print(" | ".join([run["map"], sensor, *figures]))
        print({k: v for k, v in run.items() if k != "map"}, flush=True)


def main() -> None:
    parser = plain_parser(__doc__)
    parser.add_argument("--buildings", type=int, default=10)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="a folder")
    parser.add_argument(
        "--command", default="build/cpu/bin/gpureg", help="beside gpureg_locate_bench"
    )
    parser.add_argument("--backend", default="cpu", choices=["cpu", "cuda"])
    parser.add_argument("--voxel-size", type=float, default=0.2, help="metres")
    parser.add_argument("--spacing", type=float, default=0.15, help="of the map's points, metres")
    parser.add_argument("--copied", type=float, default=0.1, help="share of copied buildings")
    parser.add_argument("--sensors", nargs="+", default=list(SENSORS), choices=SENSORS)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="of the queries")
    parser.add_argument("--queries", type=int, default=4, help="of each seed and sensor")
    parser.add_argument("--foreign", type=int, default=1, help="of each seed and sensor")
    parser.add_argument(
        "--timed", type=int, default=3, help="queries of each sensor, for the times, >= 1"
    )
    parser.add_argument("--city", type=int, default=1, help="seed of the city")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--output", type=pathlib.Path, help="record; rows of other maps stay")
    o = parser.parse_args()
    gpureg = Command(o)
    city, elsewhere = (City(o.buildings, seed, o.copied) for seed in (o.city, o.city + 1000))
    folder = o.work / f"{o.buildings}_{o.city}_{o.spacing}"
    saved = o.work / f"{folder.name}_{o.voxel_size}.gpureg"
    (folder / "queries").mkdir(parents=True, exist_ok=True)
    notes = folder / "notes.json"
    maker = Maker(city, o.spacing, folder)
    with multiprocessing.Pool(o.jobs) as pool:
        if not notes.exists():
            raw, seconds = make_map(maker, pool)
            notes.write_text(json.dumps({"raw_points": raw, "generate_seconds": round(seconds, 3)}))
        makers = {here: Maker(c, 0, folder / "queries") for here, c in ((1, city), (0, elsewhere))}
        wanted = [
            (makers[here], sensor, seed, number, bool(here))
            for here, count in ((1, o.queries), (0, o.foreign))
            for sensor in o.sensors
            for seed in o.seeds
            for number in range(count)
        ]
        queries = pool.starmap(Maker.query, wanted, 1)
    name = f"{o.buildings} buildings, {o.voxel_size} m, {o.backend}"
    run = {"map": name, "buildings": o.buildings, **json.loads(notes.read_text())}
    built = folder / f"built_{o.voxel_size}.json"
    if not saved.exists() or not built.exists():
        made = gpureg(folder, "--save-map", saved)
        figures = {"build_seconds": round(made["wall"], 2), "build_cpu": round(made["cpu"], 2)}
        built.write_text(json.dumps(figures | {"build_memory_mib": made["memory_mib"]}))
    run |= json.loads(built.read_text()) | {"file_mib": round(saved.stat().st_size / 2**20, 1)}
    nothing = folder / "nothing.ply"
    write_cloud(nothing, np.zeros((1, 3)))
    call = gpureg(nothing, saved, "--near", "1e6,1e6,1e6,1")
    run |= {
        "load_seconds": round(call["wall"] - call["seconds"], 2),
        "load_memory_mib": call["memory_mib"],
    }
    run |= {"map_points": call["map"]["points"], "tiles": call["map"]["tiles"]}
    refused = [q for q in queries if q.extent < 10.2 * o.voxel_size]
    queries = [q for q in queries if q.extent >= 10.2 * o.voxel_size]
    asked = [
        q for sensor in o.sensors for q in [q for q in queries if q.sensor == sensor][: o.timed]
    ]
    if not queries:
        return print(run)
    call = gpureg(*[q.path for q in queries], saved, "--viewpoint", "0,0,0")
    run |= {
        "commit": commit(),
        "queries": len(queries),
        "memory_mib": call["memory_mib"],
        **call["environment"],
    }
    run |= seconds_of_calls(o, saved, [q.path for q in asked])
    rows = [row_of(query, scan, name) for query, scan in zip(queries, call["scans"])]
    small = {"poses": [], "points": 0, "tiles": 0, "status": "refused"}
    rows += [row_of(query, small, name) for query in refused]
    for row in rows:
        if placed(row) != row["here"] or (row["status"] == "found") != row["here"]:
            print(row)
    record = {"runs": [run], "rows": rows}
    print_table(save(o.output, run, rows) if o.output else record)


if __name__ == "__main__":
    main()
