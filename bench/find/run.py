# SPDX-License-Identifier: BSD-3-Clause
"""Finds parts in generated bins and scores the poses: bench/find/run.py --help. Needs numpy and the package gpureg.

A pose is correct if 98 % of the part's surface lies within 5 % of its diameter of the true one, whatever symmetry the
part has. An instance counts as visible if 40 % or more of the pixels that it would have alone are seen.
"""

import argparse
import json
import pathlib
import struct
import sys
import time
import types

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(pathlib.Path(__file__).parent), str(ROOT / "bench/accuracy")]
import parts as shapes
import scenes
from record import commit, save

RECORD = ROOT / "bench/results/find.json"

CLOSE, INLIERS, VISIBLE = 0.05, 0.98, 0.4
COUNTS = (0, 1, 5, 20)
CLUTTER = 6
PRECISION = 0.95
PART_POINTS = 20000
PEERS = {"opencv", "pcl"}


def read_stl(path):
    data = np.fromfile(path, np.uint8)[84:]
    return data.reshape(-1, 50)[:, 12:48].copy().view("<f4").reshape(-1, 3, 3).astype(float)


def part_of(kind, seed, data):
    """Triangles around the origin, and their diameter."""
    if kind in shapes.KINDS:
        diameter = 0.1
        return shapes.make(kind, seed, diameter), diameter
    mesh = read_stl(pathlib.Path(data) / "cad/model" / f"{kind}.stl") / 1000
    low, high = mesh.min((0, 1)), mesh.max((0, 1))
    return mesh - (low + high) / 2, float(np.linalg.norm(high - low))


class Nearest:
    """Distances to a dense sample of a surface, by a grid."""

    def __init__(self, points, edge):
        self.points, self.edge = points, edge
        self.cells = {}
        for k, cell in enumerate(map(tuple, np.floor(points / edge).astype(int))):
            self.cells.setdefault(cell, []).append(k)

    def within(self, queries):
        out = np.zeros(len(queries), bool)
        for k, q in enumerate(queries):
            c = np.floor(q / self.edge).astype(int)
            near = [
                i
                for x in (-1, 0, 1)
                for y in (-1, 0, 1)
                for z in (-1, 0, 1)
                for i in self.cells.get((c[0] + x, c[1] + y, c[2] + z), ())
            ]
            out[k] = bool(near) and ((self.points[near] - q) ** 2).sum(1).min() <= self.edge**2
        return out


class Truth:
    def __init__(self, triangles, diameter, poses):
        rng = np.random.default_rng(0)
        self.query, _ = shapes.sample(triangles, 300, rng)
        self.diameter, self.poses = diameter, poses
        self.surface = Nearest(shapes.sample(triangles, 8000, rng)[0], CLOSE * diameter)

    def instance_at(self, pose):
        """Number of the instance whose surface the pose meets, or None."""
        for k, (truth, _) in enumerate(self.poses):
            if np.linalg.norm(truth[:3, 3] - pose[:3, 3]) > 0.5 * self.diameter:
                continue
            m = np.linalg.inv(truth) @ pose
            if self.surface.within(self.query @ m[:3, :3].T + m[:3, 3]).mean() >= INLIERS:
                return k
        return None


def scene_of(kind, seed, count, data):
    """Part, diameter, points, poses with visible shares."""
    triangles, diameter = part_of(kind, seed, data)
    rng = np.random.default_rng([seed, count, *kind.encode()])
    others = [
        shapes.make(k, int(rng.integers(1000, 2000)), diameter * rng.uniform(0.7, 1.2))
        for k in rng.choice([k for k in shapes.KINDS if k != kind], 4, replace=False)
    ]
    clutter = CLUTTER if count else int(rng.integers(6, 20))
    points, truth = scenes.scene(triangles, others, count, clutter, rng, diameter)
    return triangles, diameter, points, truth


def row_of(gpureg, context, arguments, kind, seed, count):
    triangles, diameter, points, truth = scene_of(kind, seed, count, arguments.data)
    surface, normals = shapes.sample(triangles, arguments.part_points, np.random.default_rng(1))
    options = gpureg.FindOptions(
        min_confidence=0,
        quality=arguments.quality,
        seed=seed,
        voxel_size=arguments.voxel * diameter,
    )
    begin = time.perf_counter()
    result = gpureg.find(
        surface,
        points,
        part_normals=None if arguments.scan else normals,
        options=options,
        context=context,
        scene_viewpoints="none" if arguments.unseen else np.zeros(3),
    )
    seconds = time.perf_counter() - begin
    scorer, taken, found = Truth(triangles, diameter, truth), set(), []
    for part in [*result.instances, *result.doubtful]:
        at = scorer.instance_at(part.scene_from_part)
        correct = at is not None and at not in taken
        taken |= {at} if correct else set()
        e = part.evidence
        found.append(
            {
                "confidence": part.confidence,
                "instance": at if correct else -1,
                "evidence": {name: getattr(e, name) for name in e._fields},
            }
        )
    return {
        "kind": kind,
        "seed": seed,
        "count": count,
        "view": not arguments.unseen,
        "part_points": arguments.part_points,
        "scan": arguments.scan,
        "voxel": result.voxel_size / result.diameter,
        "seconds": seconds,
        "device": context.description,
        "commit": commit(),
        "quality": arguments.quality,
        "visible": [round(float(s), 4) for _, s in truth],
        "found": found,
    }


def opencv_row(arguments, kind, seed, count):
    """Point pair features of OpenCV (surface_matching, Drost et al. 2010). Without its ICP, which moves right poses away in
    a bin: it draws every side of the part to the scene."""
    import cv2

    triangles, diameter, points, truth = scene_of(kind, seed, count, arguments.data)
    surface, normals = shapes.sample(triangles, 4000, np.random.default_rng(1))
    # In diameters: the detector joins poses closer than its relative step as if it were a length. It thins the scene by a
    # share of the scene's box, not of the part.
    model = np.c_[surface / diameter, normals].astype(np.float32)
    ppf = cv2.ppf_match_3d
    begin = time.perf_counter()
    detector = ppf.PPF3DDetector(0.05, 0.05)
    detector.trainModel(model)
    thin = points[scenes.thin(points, diameter / 20)] / diameter
    _, scene = ppf.computeNormalsPC3d(thin.astype(np.float32), 12, True, np.zeros(3))
    poses = detector.match(scene, 1 / 5, 0.05 / np.ptp(thin, axis=0).max())[:100]
    seconds = time.perf_counter() - begin
    scorer, taken, found, kept = Truth(triangles, diameter, truth), set(), [], []
    for pose in poses:
        at_scene = np.array(pose.pose)
        at_scene[:3, 3] *= diameter
        if any(np.linalg.norm(at_scene[:3, 3] - k) < diameter / 4 for k in kept):
            continue  # one pose for each instance
        kept.append(at_scene[:3, 3])
        at = scorer.instance_at(at_scene)
        correct = at is not None and at not in taken
        taken |= {at} if correct else set()
        found.append({"confidence": float(pose.numVotes), "instance": at if correct else -1})
    return peer_row("opencv", kind, seed, count, seconds, truth, found)


def pcl_row(arguments, kind, seed, count):
    """PCL's template alignment (SampleConsensusInitialAlignment), one pose for each scene, in voxels of a fiftieth
    of the diameter as in its tutorial: the part's points with exact normals, PCL's own for the scene."""
    sys.path.append(str(ROOT / "bench/peers"))
    from methods import pcl_prerejective

    triangles, diameter, points, truth = scene_of(kind, seed, count, arguments.data)
    surface, normals = shapes.sample(triangles, PART_POINTS, np.random.default_rng(1))
    pcl_prerejective.VOXEL = diameter / 50
    kept = scenes.thin(surface, diameter / 50)
    thin = points[scenes.thin(points, diameter / 50)]
    begin = time.perf_counter()
    peer = pcl_prerejective.Prerejective()
    clouds = [
        peer.prepare(types.SimpleNamespace(points=p, normals=n))
        for p, n in ((surface[kept], normals[kept]), (thin, np.zeros_like(thin)))
    ]
    answer = peer.ask(b"t" + struct.pack("<III", clouds[0]["index"], clouds[1]["index"], seed))
    seconds = time.perf_counter() - begin
    peer.child.stdin.close()
    peer.child.wait()
    at = Truth(triangles, diameter, truth).instance_at(np.reshape(answer[3:19], (4, 4)))
    found = [{"confidence": answer[0] / diameter**2, "instance": -1 if at is None else at}]
    return peer_row("pcl", kind, seed, count, seconds, truth, found)


def peer_row(peer, kind, seed, count, seconds, truth, found):
    return {
        "kind": kind,
        "seed": seed,
        "count": count,
        "view": True,
        "seconds": seconds,
        "device": peer,
        "commit": commit(),
        "visible": [round(float(s), 4) for _, s in truth],
        "found": found,
    }


def ranked(rows):
    """(confidence, correct, is of a visible instance) of all poses, the most confident first, and the number of
    visible instances."""
    out = [
        (
            f["confidence"],
            f["instance"] >= 0,
            f["instance"] >= 0 and r["visible"][f["instance"]] >= VISIBLE,
        )
        for r in rows
        for f in r["found"]
    ]
    return sorted(out, reverse=True), sum(s >= VISIBLE for r in rows for s in r["visible"])


def figures(rows, threshold=0.5):
    poses, visible = ranked(rows)
    correct = np.cumsum([c for _, c, _ in poses]) if poses else np.zeros(0)
    seen = np.cumsum([v for _, _, v in poses]) if poses else np.zeros(0)
    precise = [k for k in range(len(poses)) if correct[k] >= PRECISION * (k + 1)]
    reported = [p for p in poses if p[0] >= threshold]
    return {
        "scenes": len(rows),
        "scenes_with": sum(any(s >= VISIBLE for s in r["visible"]) for r in rows),
        "visible": visible,
        "recall_at_p95": float(seen[precise[-1]] / visible) if precise and visible else 0.0,
        "recall": sum(v for _, _, v in reported) / visible if visible else float("nan"),
        "precision": sum(c for _, c, _ in reported) / len(reported) if reported else float("nan"),
        "first": sum(
            max(r["found"], key=lambda f: f["confidence"])["instance"] >= 0
            for r in rows
            if r["found"] and any(s >= VISIBLE for s in r["visible"])
        ),
        "candidates": float(seen[-1] / visible) if len(poses) and visible else 0.0,
        "without": sum(
            any(f["confidence"] >= threshold for f in r["found"]) for r in rows if r["count"] == 0
        ),
        "seconds": float(np.median([r["seconds"] for r in rows])),
    }


def groups(rows):
    """(name of the grouping, name of the group, its rows); the last one is all."""
    for key in ("count", "part_points", "kind", "seed"):
        values = dict.fromkeys(r.get(key) for r in rows)
        for value in values if key == "kind" else sorted(values):
            of = [r for r in rows if r.get(key) == value]
            if len(of) < len(rows) and any(r["visible"] for r in of):
                yield key, f"{key} {value}".removeprefix("kind "), of
    yield "all", "all", rows


def print_table(rows):
    print(
        "scenes | recall at 95 % precision | recall, precision at .5 | among the poses | reported where there is none | s"
    )
    for _, name, of in groups(rows):
        f = figures(of)
        none = sum(r["count"] == 0 for r in of)
        print(
            f"{name}: {f['visible']} visible | {f['recall_at_p95']:.3f} | {f['recall']:.3f} {f['precision']:.3f} | "
            f"{f['candidates']:.3f} | {f['without']} of {none} | {f['seconds']:.2f}"
        )


def record_of(paths):
    """The figures of records of rows, by set: generated and CAD parts, parts of few points, peers."""
    sets = {}
    for path in paths:
        for r in map(json.loads, path.read_text().splitlines()):
            name = "generated" if r["kind"] in shapes.KINDS else "cad"
            if r.get("part_points", PART_POINTS) < PART_POINTS:
                name = "scan of few points" if r["scan"] else "model of few points"
            name = r["device"] if r["device"] in PEERS else name
            sets.setdefault(name, []).append(r)
    for peer in sets.keys() & PEERS:  # the same scenes by gpureg
        scenes_of_peer = {(r["kind"], r["seed"], r["count"]) for r in sets[peer]}
        sets[f"beside {peer}"] = [
            r
            for name in ("generated", "cad")
            for r in sets.get(name, ())
            if (r["kind"], r["seed"], r["count"]) in scenes_of_peer
        ]
    out = {
        "command": "bench/find/run.py --record",
        "commit": ", ".join(sorted({r["commit"] for of in sets.values() for r in of})),
        "devices": sorted({r["device"] for of in sets.values() for r in of} - PEERS),
        "confidences": sorted(
            {r.get("fit", "of the library") for of in sets.values() for r in of if "fit" in r}
        ),
        "sets": {},
    }
    for name, rows in sets.items():
        entry = out["sets"][name] = {}
        for key, group, of in groups(rows):
            f = {
                k: (round(v, 4) if np.isfinite(v) else None) if isinstance(v, float) else v
                for k, v in figures(of).items()
            }
            none = sum(r["count"] == 0 for r in of)
            entry.setdefault(key, []).append({"name": group, **f, "scenes_without": none})
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--kinds", default="all", help="of parts, with commas; all; cad: those of the data folder"
    )
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--counts", default=",".join(map(str, COUNTS)))
    parser.add_argument("--part-points", type=int, default=PART_POINTS, help="sampled on the part")
    parser.add_argument("--scan", action="store_true", help="the part's points have no normals")
    parser.add_argument(
        "--voxel", type=float, default=0, help="of the search, over the diameter; 0: chosen"
    )
    parser.add_argument("--quality", type=int, default=5)
    parser.add_argument("--backend", default="cpu", choices=("cpu", "cuda"))
    parser.add_argument("--threads", type=int, default=0, help="of the CPU backend; 0: all")
    parser.add_argument("--unseen", action="store_true", help="without the viewpoint of the scene")
    parser.add_argument(
        "--peer",
        choices=sorted(PEERS),
        help="opencv: needs opencv-contrib-python; its scores are votes. pcl: needs the target gpureg_pcl_peer",
    )
    parser.add_argument("--data", default="shared/data", help="folder with cad")
    parser.add_argument("--output", help="record, a row a line; rows that it has are not run again")
    parser.add_argument(
        "--record",
        nargs="+",
        type=pathlib.Path,
        metavar="ROWS",
        help=f"write {RECORD.relative_to(ROOT)} from such records; nothing is run",
    )
    arguments = parser.parse_args()
    if arguments.record:
        return save(RECORD, record_of(arguments.record))
    if arguments.peer:
        run = {"opencv": opencv_row, "pcl": pcl_row}[arguments.peer]
    else:
        import gpureg

        context = (
            gpureg.Context.cuda()
            if arguments.backend == "cuda"
            else gpureg.Context.cpu(arguments.threads)
        )

        def run(*of):
            return row_of(gpureg, context, *of)

    cad = ["Base-Top_Plate", "Guitar", "Range_Hood", "Round-Peg"]
    kinds = {"all": list(shapes.KINDS), "cad": cad}.get(arguments.kinds) or arguments.kinds.split(
        ","
    )
    path = pathlib.Path(arguments.output) if arguments.output else None
    rows = (
        [json.loads(line) for line in path.read_text().splitlines()]
        if path and path.exists()
        else []
    )
    done = {(r["kind"], r["seed"], r["count"], r["view"]) for r in rows}
    for seed in map(int, filter(None, arguments.seeds.split(","))):
        for kind in kinds:
            for count in map(int, arguments.counts.split(",")):
                if (kind, seed, count, not arguments.unseen) in done:
                    continue
                row = run(arguments, kind, seed, count)
                rows.append(row)
                if path:
                    with path.open("a") as file:
                        file.write(json.dumps(row) + "\n")
                good = sum(f["instance"] >= 0 for f in row["found"])
                print(
                    f"{kind} {seed} {count}: {good} correct of {len(row['found'])}, {row['seconds']:.1f} s",
                    file=sys.stderr,
                    flush=True,
                )
    print_table(rows)


if __name__ == "__main__":
    main()
