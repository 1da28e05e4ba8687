#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Injected faults: does `gpureg audit` find where a map was broken on purpose?

    audit_faults.py --work WORK NAME=SCANS[:POSES[:PAIRS]] ...

Each argument is a right map: a folder of scans, its poses (without: SCANS/poses.txt, the truth) and the
pairs.json of `gpureg reconstruct`, from which false loops are taken that `align` really returned; they
need a truth. Faults: all scans behind a place moved (slips), a false loop whose error the odometry
between its ends takes up evenly, two scans exchanged, a scan of the next map in the place of one.

| figure | meaning |
| --- | --- |
| seen | clouds of both sides of the break come near each other: a fault that is not seen cannot be found |
| found | the audit contradicts the map; share of those that are seen |
| pair | the strongest pair that it names lies across the break; share of those that are found |
| cut | its least confident connection is the break, to within a tenth of the scans; share of those found |
| mended | `--mend` brings 95 % of the scans to within 5 cm (RMS) of the unharmed map; share of those found |
| alarms | contradicted connections among 100 of the unharmed maps |

Verdicts in WORK/audit_faults are used again. Needs numpy.
"""

import hashlib
import json
import os
import pathlib
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from map_rmse import angle, errors, read_poses, rms
from record import parser, write

SLIPS = [(m, 0) for m in (0.3, 0.5, 1, 2)] + [(0, d) for d in (2, 5, 10)]  # metres, degrees
NEAR = 0.3  # metres between surfaces that are near each other
SHARE = 0.05  # of a cloud's cells that have to be near the other cloud
WRONG_METRES, WRONG_DEGREES = 0.35, 8
PLACED, RESTORED = 0.95, 0.05  # share of the scans, metres


def read_points(path):
    """Every tenth point of a binary PLY of floats x y z."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    sizes = {"float": 4, "float32": 4, "uchar": 1, "uint8": 1, "double": 8}
    row = sum(sizes[line.split()[1]] for line in lines if line.startswith("property"))
    rows = np.frombuffer(body, np.uint8, count * row).reshape(count, row)[::10]
    return np.ascontiguousarray(rows[:, :12]).view(np.float32).reshape(-1, 3).astype(float)


def turn(axis, degrees):
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.radians(degrees)
    out = np.eye(4)
    out[:3, :3] = np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * k @ k
    return out


def shift(vector):
    out = np.eye(4)
    out[:3, 3] = vector
    return out


def part_of(motion, share):
    """A share of a rigid motion: of its angle about its axis, and of its translation."""
    degrees = angle(motion[:3, :3])
    skew = motion[:3, :3] - motion[:3, :3].T
    axis = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    out = turn(axis, share * degrees) if np.linalg.norm(axis) > 1e-9 else np.eye(4)
    out[:3, 3] = share * motion[:3, 3]
    return out


class Map:
    def __init__(self, text, work):
        self.name, rest = text.split("=", 1)
        scans, poses, pairs = (rest.split(":") + ["", ""])[:3]
        self.folder = pathlib.Path(scans)
        self.poses = read_poses(poses or self.folder / "poses.txt")
        self.pairs = pathlib.Path(pairs) if pairs else None
        self.work = work
        self.order = sorted(self.poses)
        self.cells = {}

    def cell_of(self, scan):
        """Cloud of a scan, thinned to cells of a third of NEAR."""
        if scan not in self.cells:
            points = read_points(self.folder / f"cloud_bin_{scan}.ply")
            cells = np.unique(np.floor(points / (NEAR / 3)).astype(int), axis=0)
            self.cells[scan] = (cells + 0.5) * (NEAR / 3)
        return self.cells[scan]

    def seen(self, poses, sides):
        """Whether clouds of both sides come near each other."""

        def boxes(scan, pad):
            at = self.cell_of(scan) @ poses[scan][:3, :3].T + poses[scan][:3, 3]
            base = np.floor(at / NEAR).astype(np.int64) + 2**20
            if not pad:
                return (base[:, 0] << 42) + (base[:, 1] << 21) + base[:, 2]
            out = []
            for d in np.ndindex(3, 3, 3):
                c = base + np.array(d) - 1
                out.append((c[:, 0] << 42) + (c[:, 1] << 21) + c[:, 2])
            return np.unique(np.concatenate(out))

        left, right = sides
        padded = {i: boxes(i, True) for i in left}
        for j in right:
            plain = boxes(j, False)
            for i in left:
                if np.isin(plain, padded[i]).mean() >= SHARE:
                    return True
        return False


def slips(chosen, random, places):
    n = len(chosen.order)
    for metres, degrees in SLIPS:
        for _ in range(places):
            at = int(random.integers(max(1, n // 5), n - n // 5))
            first = chosen.order[at]
            direction = random.normal(size=3) * (1, 1, 0.2)
            centre = chosen.poses[first][:3, 3]
            tilt = random.normal(size=2) * 0.1
            motion = shift(metres * direction / np.linalg.norm(direction))
            motion = shift(centre) @ turn([*tilt, 1], degrees) @ shift(-centre) @ motion
            poses = {k: motion @ p if k >= first else p for k, p in chosen.poses.items()}
            kind = f"slip of {metres} m" if metres else f"slip of {degrees} degrees"
            yield kind, poses, (chosen.order[:at], chosen.order[at:]), None


def false_loops(chosen, places):
    """The most confident wrong poses of pairs that are at least five scans apart."""
    if chosen.pairs is None or not chosen.pairs.exists():
        return
    wrong = []
    for pair in json.loads(chosen.pairs.read_text())["pairs"]:
        i, j = pair["i"], pair["j"]
        if j - i < 5 or not {i, j} <= chosen.poses.keys() or not pair.get("T_ij"):
            continue
        pose = np.reshape(pair["T_ij"], (4, 4))
        error = np.linalg.inv(chosen.poses[i]) @ chosen.poses[j] @ np.linalg.inv(pose)
        if np.linalg.norm(error[:3, 3]) > WRONG_METRES or angle(error[:3, :3]) > WRONG_DEGREES:
            wrong.append((pair["confidence"], i, j, pose))
    for _, i, j, pose in sorted(wrong, key=lambda w: -w[0])[:places]:
        between = [k for k in chosen.order if i <= k <= j]
        want = chosen.poses[i] @ pose @ np.linalg.inv(chosen.poses[j])  # of the world beyond j
        centre = chosen.poses[i][:3, 3]
        want = shift(-centre) @ want @ shift(centre)
        poses = dict(chosen.poses)
        for k in chosen.order:
            if k > i:
                share = (between.index(k) / (len(between) - 1)) if k < j else 1.0
                motion = shift(centre) @ part_of(want, share) @ shift(-centre)
                poses[k] = motion @ chosen.poses[k]
        before = [k for k in chosen.order if k <= i]
        yield "false loop", poses, (before, [k for k in chosen.order if k >= j]), None


def exchanged(chosen, random, places):
    for _ in range(places):
        for _ in range(50):
            a, b = random.choice(chosen.order, 2, replace=False)
            if np.linalg.norm(chosen.poses[a][:3, 3] - chosen.poses[b][:3, 3]) > 1:
                break
        poses = {**chosen.poses, a: chosen.poses[b], b: chosen.poses[a]}
        rest = [k for k in chosen.order if k not in (a, b)]
        yield "two scans exchanged", poses, ([int(a), int(b)], rest), None


def foreign(chosen, other, random, places):
    for _ in range(places):
        at = int(random.choice(chosen.order))
        rest = [k for k in chosen.order if k != at]
        yield "a foreign scan", chosen.poses, ([at], rest), (at, int(random.choice(other.order)))


def write_poses(path, poses):
    path.write_text(
        "".join(
            f"{k}\n" + "".join(" ".join(map(repr, map(float, row))) + "\n" for row in poses[k])
            for k in sorted(poses)
        )
    )


def folder_with(chosen, other, replaced, where):
    """The scans, one of them of another map."""
    at, its = replaced
    where.mkdir(parents=True, exist_ok=True)
    for k in chosen.order:
        source = (
            other.folder / f"cloud_bin_{its}.ply"
            if k == at
            else chosen.folder / f"cloud_bin_{k}.ply"
        )
        link = where / f"cloud_bin_{k}.ply"
        if not link.is_symlink():
            link.symlink_to(source.resolve())
    lines = []
    for scene, keep in ((chosen, lambda k: k != at), (other, lambda k: k == its)):
        cameras = scene.folder / "cameras.txt"
        for line in cameras.read_text().splitlines() if cameras.exists() else []:
            words = line.split()
            if words and words[0] != "#" and keep(int(words[0])):
                lines.append(" ".join([str(at) if scene is other else words[0], *words[1:]]))
    if lines:
        (where / "cameras.txt").write_text("\n".join(lines) + "\n")
    return where


def audit(arguments, folder, poses, key):
    """The verdict of `gpureg audit`, and the file of mended poses; WORK keeps both."""
    work = arguments.work / "audit_faults"
    work.mkdir(parents=True, exist_ok=True)
    path = work / f"{key}.txt"
    write_poses(path, poses)
    mark = hashlib.sha1(path.read_bytes() + arguments.gpureg.read_bytes()).hexdigest()[:12]
    out = work / f"{key}_{mark}.json"
    if not out.exists():
        command = [arguments.gpureg, "audit", folder, path, "--json", out, "--quiet"]
        command += ["--mend", out.with_suffix(".txt"), "--voxel-size", arguments.voxel_size]
        done = subprocess.run([*map(str, command), "--backend", arguments.backend])
        if done.returncode not in (0, 1):
            raise SystemExit(f"{key}: the audit failed")
    return json.loads(out.read_text()), out.with_suffix(".txt")


def restored(path, right, replaced):
    """Whether mended poses (TUM) are those of the unharmed map; a foreign scan has none there."""
    poses = {}
    for line in path.read_text().splitlines():
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        poses[round(float(words[0]))] = shift([float(word) for word in words[1:4]])
    foreign_scan = replaced[0] if replaced else None
    known = [k for k in poses if k in right and k != foreign_scan]
    if foreign_scan in poses or len(known) < PLACED * (len(right) - bool(replaced)):
        return False
    metres, _, _ = errors(poses, right, known)
    return bool(rms(metres) <= RESTORED)


def scans_of(connection):
    """Numbers of the smaller part, which the document has as ranges."""
    return {k for first, last in connection["scans"] for k in range(first, last + 1)}


def score(verdict, sides, n):
    """Found; the strongest pair crosses the break; the least confident connection is the break."""
    broken = [c for c in verdict["connections"] if c["verdict"] == "contradicted"]
    if not broken:
        return False, False, False
    left = set(sides[0])
    strongest = next((c["contradictions"][0] for c in broken if c["contradictions"]), None)
    pair = strongest is not None and (strongest[0] in left) != (strongest[1] in left)
    everyone = {*sides[0], *sides[1]}
    parts = [scans_of(c) & everyone for c in broken]
    allowed = max(1, n // 10)
    cut = min(min(len(p ^ left), len(p ^ (everyone - left))) for p in parts[:1]) <= allowed
    return True, pair, cut


def judged(work):
    """Kind of a fault, and what is said of it; none: it is not seen."""
    arguments, chosen, other, number, (kind, poses, sides, replaced) = work
    if not chosen.seen(poses, sides):
        return kind, None
    key = f"{chosen.name}_{arguments.seed}_{number}"
    folder = chosen.folder
    if replaced:
        folder = folder_with(chosen, other, replaced, arguments.work / "audit_scans" / key)
    verdict, mended = audit(arguments, folder, poses, key)
    found, *place = score(verdict, sides, len(chosen.order))
    names = ("found", "pair", "cut", "mended")
    answers = (found, *place, found and restored(mended, chosen.poses, replaced))
    print(key, kind, ", ".join(map("{} {}".format, names, answers)), flush=True)
    return kind, dict(zip(("seen", *names), (True, *answers)))


def main():
    options = parser(__doc__, "audit_faults.json")
    options.add_argument("maps", nargs="+", metavar="NAME=SCANS[:POSES[:PAIRS]]")
    options.add_argument("--work", type=pathlib.Path, required=True)
    options.add_argument("--places", type=int, default=2, help="of each fault in each map")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--voxel-size", default="0.05", help="metres, or auto")
    arguments = options.parse_args()
    maps = [Map(text, arguments.work) for text in arguments.maps]
    table, unharmed, connections, alarms = {}, {}, 0, 0
    pool = ThreadPoolExecutor(max(1, (os.cpu_count() or 1) // 2))
    for at, chosen in enumerate(maps):
        other = maps[(at + 1) % len(maps)]
        right, _ = audit(arguments, chosen.folder, chosen.poses, f"{chosen.name}_right")
        wrong = sum(c["verdict"] == "contradicted" for c in right["connections"])
        of_map = right["confirmed"] + len(right["connections"])
        connections += of_map
        alarms += wrong
        unharmed[chosen.name] = {
            "scans": len(chosen.order),
            "near_pairs": right["near_pairs"],
            "connections": of_map,
            "undecided": sum(c["verdict"] == "undecided" for c in right["connections"]),
            "alarms": wrong,
            "seconds": right["seconds"],
        }
        print(f"{chosen.name}, unharmed: {unharmed[chosen.name]}", flush=True)
        random = np.random.default_rng([arguments.seed, at])
        cases = [
            *slips(chosen, random, arguments.places),
            *false_loops(chosen, arguments.places),
            *exchanged(chosen, random, arguments.places),
        ]
        if other is not chosen:
            cases += foreign(chosen, other, random, arguments.places)
        work = [(arguments, chosen, other, k, case) for k, case in enumerate(cases)]
        for kind, answers in pool.map(judged, work):
            row = table.setdefault(
                kind, dict.fromkeys(("faults", "seen", "found", "pair", "cut", "mended"), 0)
            )
            row["faults"] += 1
            for name, answer in (answers or {}).items():
                row[name] += answer
    total = {name: sum(row[name] for row in table.values()) for name in next(iter(table.values()))}
    table["all"] = total
    print("\n| fault | faults | seen | found | pair | cut | mended |\n" + 7 * "| --- " + "|")
    for kind, row in table.items():
        print(f"| {kind} | " + " | ".join(str(value) for value in row.values()) + " |")
    per_100 = 100 * alarms / max(1, connections)
    print(f"false alarms: {alarms} of {connections} connections, {per_100:.2f} of 100")
    content = {"unharmed": unharmed, "faults": table, "alarms_per_100": per_100}
    write(arguments, "python3 bench/accuracy/audit_faults.py --work WORK NAME=SCANS ...", content)


if __name__ == "__main__":
    main()
