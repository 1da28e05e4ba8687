# SPDX-License-Identifier: BSD-3-Clause
"""Finds parts in generated bins and scores the poses: bench/find/run.py --help. Needs numpy and the package gpureg.

A pose is correct if 98 % of the part's surface lies within 5 % of its diameter of the true one, whatever symmetry the
part has. An instance counts as visible if 40 % or more of the pixels that it would have alone are seen.
"""

import argparse
import json
import pathlib
import sys
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import parts as shapes
import scenes

CLOSE, INLIERS, VISIBLE = 0.05, 0.98, 0.4
COUNTS = (0, 1, 5, 20)
CLUTTER = 6
PRECISION = 0.95


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
    surface, normals = shapes.sample(triangles, 20000, np.random.default_rng(1))
    options = gpureg.FindOptions(min_confidence=0, quality=arguments.quality, seed=seed)
    begin = time.perf_counter()
    result = gpureg.find(
        surface,
        points,
        part_normals=normals,
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
        "seconds": seconds,
        "device": context.description,
        "quality": arguments.quality,
        "visible": [round(float(s), 4) for _, s in truth],
        "found": found,
    }


def opencv_row(arguments, kind, seed, count):
    """Point pair features of OpenCV (surface_matching, Drost et al. 2010), refined by its ICP."""
    import cv2

    triangles, diameter, points, truth = scene_of(kind, seed, count, arguments.data)
    surface, normals = shapes.sample(triangles, 4000, np.random.default_rng(1))
    ppf = cv2.ppf_match_3d
    begin = time.perf_counter()
    detector = ppf.PPF3DDetector(0.05, 0.05)
    detector.trainModel(np.c_[surface, normals].astype(np.float32))
    thin = points[scenes.thin(points, diameter / 20)]
    _, scene = ppf.computeNormalsPC3d(thin.astype(np.float32), 12, True, np.zeros(3))
    poses = detector.match(scene, 1 / 5, 0.05)[:100]
    ppf.ICP(100, 0.005, 2.5, 8).registerModelToScene(
        np.c_[surface, normals].astype(np.float32), scene, poses
    )
    seconds = time.perf_counter() - begin
    scorer, taken, found, kept = Truth(triangles, diameter, truth), set(), [], []
    for pose in poses:
        if any(np.linalg.norm(pose.pose[:3, 3] - k) < diameter / 4 for k in kept):
            continue  # one pose for each instance
        kept.append(pose.pose[:3, 3])
        at = scorer.instance_at(pose.pose)
        correct = at is not None and at not in taken
        taken |= {at} if correct else set()
        found.append({"confidence": float(pose.numVotes), "instance": at if correct else -1})
    return {
        "kind": kind,
        "seed": seed,
        "count": count,
        "view": True,
        "seconds": seconds,
        "device": "opencv",
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
        "visible": visible,
        "recall_at_p95": float(seen[precise[-1]] / visible) if precise and visible else 0.0,
        "recall": sum(v for _, _, v in reported) / visible if visible else float("nan"),
        "precision": sum(c for _, c, _ in reported) / len(reported) if reported else float("nan"),
        "candidates": float(seen[-1] / visible) if len(poses) and visible else 0.0,
        "without": sum(
            any(f["confidence"] >= threshold for f in r["found"]) for r in rows if r["count"] == 0
        ),
        "seconds": float(np.median([r["seconds"] for r in rows])),
    }


def print_table(rows):
    print(
        "scenes | recall at 95 % precision | recall, precision at .5 | among the poses | reported where there is none | s"
    )
    groups = [
        (f"{count} instances", [r for r in rows if r["count"] == count])
        for count in COUNTS
        if count
    ]
    groups += [
        (kind, [r for r in rows if r["kind"] == kind])
        for kind in dict.fromkeys(r["kind"] for r in rows)
    ]
    groups += [
        (f"seed {seed}", [r for r in rows if r["seed"] == seed])
        for seed in dict.fromkeys(r["seed"] for r in rows)
    ]
    for name, of in [*groups, ("all", rows)]:
        if of:
            f = figures(of)
            none = sum(r["count"] == 0 for r in of)
            print(
                f"{name}: {f['visible']} visible | {f['recall_at_p95']:.3f} | {f['recall']:.3f} {f['precision']:.3f} | "
                f"{f['candidates']:.3f} | {f['without']} of {none} | {f['seconds']:.2f}"
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--kinds", default="all", help="of parts, with commas; all; cad: those of the data folder"
    )
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--counts", default=",".join(map(str, COUNTS)))
    parser.add_argument("--quality", type=int, default=5)
    parser.add_argument("--backend", default="cpu", choices=("cpu", "cuda"))
    parser.add_argument("--threads", type=int, default=0, help="of the CPU backend; 0: all")
    parser.add_argument("--unseen", action="store_true", help="without the viewpoint of the scene")
    parser.add_argument(
        "--peer", choices=("opencv",), help="needs opencv-contrib-python; its scores are votes"
    )
    parser.add_argument("--data", default="shared/data", help="folder with cad")
    parser.add_argument("--output", help="record, a row a line; rows that it has are not run again")
    arguments = parser.parse_args()
    if arguments.peer:
        run = opencv_row
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
