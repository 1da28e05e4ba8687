#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Maps of real and simulated scenes: complete, thinned, with foreign scans, of two houses at once, without cameras; each before
and after the audit and the joint refinement.

    maps.py --data DATA --work WORK [CASE ...]

Pairs are the costly part: each case looks for WORK/pairs/<set>.json, a pairs.json of `gpureg reconstruct` or a result of
`gpureg batch`, and aligns what no such file has. Figures of a peer that left its poses.txt and reconstruction.json in
WORK/<peer>/<scene> (bench/peers/open3d_multiway.py) enter the same record.
"""

import json
import pathlib
import shutil
import subprocess

from map_rmse import information_of, measure, read_blocks, read_truth
from record import parser, write

SCENES = {
    "redkitchen": "redkitchen/fragments",
    "house_A": "house/A",
    "house_B": "house/B",
    "hospital_E": "hospital/E",
}
# Houses of 120 fragments by `gpureg generate --fragments 120 --seed SEED`, in WORK/generated.
GENERATED = {f"generated_{seed}": seed for seed in (8101, 8102, 8103, 8104, 8105)}
# Buildings of repeated furniture by `gpureg generate --building KIND --fragments 50 --seed SEED`, there too.
REPEATED = {
    "office_1": ("office", 1),
    "office_2": ("office", 2),
    "warehouse_1": ("warehouse", 1),
    "warehouse_2": ("warehouse", 2),
}
# Buildings of docs/accuracy.md from meshes, which have to be there as well.
FROM_MESHES = ("bare_office1", "bare_office2", "bare_pal_home1", "bare_pal_home2")
PRUNE = 20  # partners that a scan of a generated house is aligned with
OFFSET = 100  # of the numbers of a second scene in the same folder
FOREIGN = (3, 13, 23, 33, 43)


class Set:
    """A folder of scans of one or two scenes, and the truth of all of them."""

    def __init__(self, name, parts, cameras=True, also=None, prune=None):
        """also: name of a set whose pairs serve, too. prune: as the option of `gpureg reconstruct`."""
        self.name, self.parts, self.cameras, self.also = name, parts, cameras, also
        self.prune = prune

    def write(self, arguments, folder):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        cameras = []
        for scene, numbers, offset in self.parts:
            source = folder_of(scene, arguments)
            for number in numbers:
                (folder / f"cloud_bin_{number + offset}.ply").symlink_to(
                    source / f"cloud_bin_{number}.ply"
                )
            for line in (source / "cameras.txt").read_text().splitlines():
                words = line.split()
                if words and words[0] != "#" and int(words[0]) in numbers:
                    cameras.append(" ".join([str(int(words[0]) + offset), *words[1:]]))
        if self.cameras:
            (folder / "cameras.txt").write_text("\n".join(cameras) + "\n")

    def truth(self, arguments):
        poses, log, info = {}, {}, {}
        for scene, _, offset in self.parts:
            folder = folder_of(scene, arguments)
            for known, more in zip((poses, log, info), read_truth(folder)):
                for key, value in more.items():
                    moved = (
                        key + offset if isinstance(key, int) else (key[0] + offset, key[1] + offset)
                    )
                    known[moved] = value
        return poses, log, info

    def scene_of(self, scan):
        return max(offset for _, _, offset in self.parts if offset <= scan)

    def sources(self):
        """Sets whose pairs serve this one, with the offset of their numbers."""
        suffix = "" if self.cameras else "_nocam"
        own = [self.name, *([self.also] if self.also else [])]
        return [
            *((name, 0) for name in own),
            *((scene + suffix, offset) for scene, _, offset in self.parts),
        ]


def folder_of(scene, arguments):
    if scene in SCENES:
        return arguments.data / SCENES[scene]
    folder = arguments.work / "generated" / scene
    if scene in FROM_MESHES and not folder.exists():
        raise SystemExit(f"{folder} is missing: scans of a public building, docs/accuracy.md")
    if not (folder / "poses.txt").exists():
        words = ["--fragments", "120", "--seed", str(GENERATED.get(scene))]
        if scene in REPEATED:
            building, seed = REPEATED[scene]
            words = ["--fragments", "50", "--seed", str(seed), "--building", building]
        subprocess.run([arguments.gpureg, "generate", folder, "--quiet", *words], check=True)
    return folder


def count_of(scene, data):
    if scene in REPEATED or scene in FROM_MESHES:
        return 50
    return len(list((data / SCENES[scene]).glob("cloud_bin_*.ply")))


def cases(data):
    out = {scene: Set(scene, [(scene, range(120), 0)], prune=PRUNE) for scene in GENERATED}
    for scene in (*SCENES, *REPEATED, *FROM_MESHES):
        every = range(count_of(scene, data))
        for suffix, cameras in (("", True), ("_nocam", False)):
            for thinned, step in (("", 1), ("_half", 2), ("_third", 3)):
                name = scene + thinned + suffix
                out[name] = Set(name, [(scene, every[::step], 0)], cameras)
    out["foreign"] = Set(
        "foreign",
        [("house_A", range(count_of("house_A", data)), 0), ("hospital_E", FOREIGN, OFFSET)],
    )
    out["two_buildings"] = Set(
        "two_buildings",
        [
            ("house_A", range(count_of("house_A", data)), 0),
            ("hospital_E", range(count_of("hospital_E", data)), OFFSET),
        ],
        also="foreign",
    )
    return out


def known_pairs(chosen, pairs):
    """Records of pairs that are there already, by numbers of this set."""
    records, options = {}, None
    for name, offset in chosen.sources():
        path = pairs / f"{name}.json"
        if not path.exists():
            continue
        document = json.loads(path.read_text())
        options = document.get("options", options)
        for pair in document["pairs"]:
            key = (pair["i"] + offset, pair["j"] + offset)
            records.setdefault(key, {**pair, "i": key[0], "j": key[1]})
    return records, options


def run(command, folder, chosen, arguments, out, more):
    """The record of one map; aligns the pairs that no file has."""
    numbers = sorted(int(path.stem.split("_")[-1]) for path in folder.glob("cloud_bin_*.ply"))
    wanted = [(i, j) for i in numbers for j in numbers if i < j]
    pairs = arguments.work / "pairs"
    pairs.mkdir(exist_ok=True)
    records, options = known_pairs(chosen, pairs)
    # Which pairs pruning chooses is known afterwards.
    missing = [] if chosen.prune and records else [pair for pair in wanted if pair not in records]
    if missing:
        if arguments.no_align:
            return None
        listed = folder.parent / f"{chosen.name}_missing.txt"
        listed.write_text("".join(f"{i} {j}\n" for i, j in missing))
        aligned = folder.parent / f"{chosen.name}_aligned"
        limits = ["--prune", chosen.prune] if chosen.prune else ["--pairs", listed]
        base = [command, "reconstruct", folder, *limits, "--no-refine", "--no-map"]
        base += ["--voxel-size", "0.05"]
        done = subprocess.run([*map(str, base), "-o", str(aligned), "--resume", "--quiet"])
        if done.returncode not in (0, 1):
            raise SystemExit(f"{chosen.name}: the alignment failed")
        new = json.loads((aligned / "pairs.json").read_text())
        options = new["options"]
        merged = {**new, "pairs": [*new["pairs"]]}
        (pairs / f"{chosen.name}.json").write_text(json.dumps(merged))
        records.update({(p["i"], p["j"]): p for p in new["pairs"]})
    if chosen.prune:
        wanted = sorted(records)
    results = folder.parent / f"{chosen.name}_results.json"
    results.write_text(
        json.dumps({"options": options, "pairs": [records[pair] for pair in wanted]})
    )
    subprocess.run(
        [str(command), "reconstruct", str(folder), "--results", str(results), "-o", str(out)]
        + ["--quiet", "--no-map", *more],
        check=False,
    )
    document = json.loads((out / "reconstruction.json").read_text())
    truth, information = chosen.truth(arguments), information_of(records.values())
    figures = measure(out, truth, information, chosen.scene_of)
    figures["seconds"] = document["seconds"]
    figures["peak_memory_mib"] = document["peak_memory_mib"]
    figures["weakest"] = min(
        (link["confidence"] for link in document["weakest_links"]), default=None
    )
    figures["pairs"] = len(wanted)
    figures["left_out"] = {s["id"]: s["reason"] for s in document["scans"] if not s["placed"]}
    return figures


def overlapping_islands(chosen, truth, figures):
    """Scans of the largest set that pairs of the truth with overlap of 30 % connect."""
    parent = {}

    def find(k):
        while parent.setdefault(k, k) != k:
            k = parent[k]
        return k

    numbers = {n + offset for _, part, offset in chosen.parts for n in part}
    for i, j in truth:
        if i in numbers and j in numbers:
            parent[find(i)] = find(j)
    sizes = {}
    for k in numbers:
        sizes[find(k)] = sizes.get(find(k), 0) + 1
    figures["connected_by_truth"] = max(sizes.values())


def short(name, figures):
    if figures is None:
        return f"{name}: pairs are missing"
    islands = ", ".join(
        f"{len(i['scans'])} scans"
        + (f" {i['rmse_cm']:.2f} cm {i['rmse_degrees_own']:.2f} deg" if "rmse_cm" in i else "")
        for i in figures["islands"]
    )
    return f"{name}: {figures['placed']}/{figures['scans']} placed; {islands}; {figures['accepted']} edges, {len(figures['wrong'])} wrong, {len(figures['far_off'])} far off; above .9 by pairs and in the map {', '.join('{right} of {edges} right'.format(**s) for s in figures['sure'].values())}"


BRIEF = ("scans", "placed", "islands", "accepted", "wrong", "far_off", "sure")  # before the end


def summary(figures):
    """Counts instead of lists of scans and edges, rounded."""
    if isinstance(figures, dict):
        counted = ("scans", "wrong", "far_off", "left_out")
        return {
            k: len(v) if k in counted and isinstance(v, list | dict) else summary(v)
            for k, v in figures.items()
        }
    if isinstance(figures, list):
        return [summary(value) for value in figures]
    return round(figures, 4) if isinstance(figures, float) else figures


def main():
    options = parser(__doc__, "maps.json")
    options.add_argument("cases", nargs="*", help="default: all; others of the record stay")
    options.add_argument("--work", type=pathlib.Path, required=True)
    options.add_argument("--no-align", action="store_true", help="skip cases with missing pairs")
    arguments = options.parse_args()
    arguments.data = pathlib.Path(arguments.data)
    known = cases(arguments.data)
    for name in arguments.cases:
        if name not in known:
            options.error(f"no case {name}, the cases are {', '.join(known)}")
    old = json.loads(arguments.output.read_text()) if arguments.output.exists() else {}
    maps, peers = old.get("maps", {}), old.get("peers", {})
    for name in arguments.cases or known:
        chosen = known[name]
        folder = arguments.work / "sets" / name
        chosen.write(arguments, folder)
        out = arguments.work / "maps" / name
        plain = ["--no-refine", "--no-audit"]
        unaudited = run(arguments.gpureg, folder, chosen, arguments, out / "unaudited", plain)
        if unaudited is None:
            print(short(name, None))
            continue
        before = run(arguments.gpureg, folder, chosen, arguments, out / "before", ["--no-refine"])
        after = run(arguments.gpureg, folder, chosen, arguments, out / "after", [])
        strong = [
            (i + offset, j + offset)
            for scene, _, offset in chosen.parts
            for i, j in read_blocks(folder_of(scene, arguments) / "gt.log", 4)
        ]
        overlapping_islands(chosen, strong, after)
        maps[name] = {
            "before_audit": summary({key: unaudited[key] for key in BRIEF}),
            "before_refinement": summary({key: before[key] for key in BRIEF}),
            "after_refinement": summary(after),
        }
        stages = (("not audited", unaudited), ("audited", before), ("refined", after))
        print(name, *(short(stage, figures) for stage, figures in stages), sep=" | ", flush=True)
    for peer in ("open3d",):
        for out in sorted((arguments.work / peer).glob("*/reconstruction.json")):
            name = out.parent.name
            figures = measure(out.parent, known[name].truth(arguments), {}, known[name].scene_of)
            figures["seconds"] = json.loads(out.read_text())["seconds"]
            figures["peak_memory_mib"] = json.loads(out.read_text())["peak_memory_mib"]
            peers.setdefault(peer, {})[name] = summary(figures)
            print(short(f"{peer} {name}", figures))
    command = "python3 bench/accuracy/maps.py --data DATA --work WORK"
    write(arguments, command, {"maps": maps, "peers": peers})


if __name__ == "__main__":
    main()
