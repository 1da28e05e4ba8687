#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Clouds whose viewpoints nobody says: what gpureg decides, and what it costs.

Every cloud is moved by a random pose. `said`: its true viewpoints move along and are given.
`nothing`: points alone. `still`: points alone of clouds that were not moved, whose sensor is at the
origin (red kitchen: each fragment in the frame of its middle camera). A seed is that of the random
poses and of gpureg. One line for each set, condition and seed: pairs, right, reported at 0.5, reported
and wrong; the same of reports up to a symmetry (--set accept_symmetry=true); and the decisions about the clouds,
models apart. Where nobody says a viewpoint, `decided` counts the clouds whose sensor is known, and
`decided_right` those of them with the right decision: `none` for a moved scan, `origin` for a scan that
was not moved, `model` for a model. `decided_none` counts scans that were not moved and got `none`: no
free space is invented, but it is not the right decision. The last line has the shares over all sets.

Sets: kitchen, dragon, cad, cad_mesh, kitti, lidar, fgr of DATA (its README.md has origins and
licences). cad: scans on points of their models; cad_mesh: on the models as STL files. The thresholds
of the decisions were chosen on these. On house_a, hospital_e (fused fragments), frames
(single depth images of the red kitchen) and clutter (scans of parts with clutter) nothing was chosen.

The record keeps what other runs wrote about other sets; each set has the command and the commit that
made it.

usage: viewpoints.py DATA [--gpureg COMMAND] [--sets kitchen,cad] [--pairs 40] [--seeds 1 2 3] [--json OUT]
Needs numpy, Pillow for frames, and the Python package gpureg, which reads and writes the clouds."""

import collections
import json
import pathlib
import subprocess
import sys
import tempfile

import gpureg
import numpy as np
from record import cameras, commit, plain_parser, save

# triangles: of a model that is written as an STL file, or None.
Cloud = collections.namedtuple("Cloud", "points viewpoints reach triangles", defaults=(None,))
Set = collections.namedtuple("Set", "clouds pairs voxel right")
FGR_REACH = 2.0


def rotation(rng):
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def random_pose(rng, reach):
    pose = np.eye(4)
    pose[:3, :3] = rotation(rng)
    direction = rng.normal(size=3)
    pose[:3, 3] = direction / np.linalg.norm(direction) * reach * rng.uniform(0.3, 1)
    return pose


def moved(pose, rows):
    return rows @ pose[:3, :3].T + pose[:3, 3]


def rows_of(path):
    return np.asarray(gpureg.read_point_cloud(path).points, np.float64)


def matrices(path):
    """Blocks of a line of numbers and four rows."""
    lines = [line.split() for line in path.read_text().splitlines() if line.strip()]
    lines = [line for line in lines if not line[0].startswith("#")]
    for at in range(0, len(lines), 5):
        head = [int(field) for field in lines[at]]
        yield head, np.array(lines[at + 1 : at + 5], np.float64)


def displacement(points, a, b):
    return float(np.sqrt(((moved(a, points) - moved(b, points)) ** 2).sum(1).mean()))


def angle(a, b):
    cosine = (np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def chosen(items, count, rng):
    items = list(items)
    if len(items) <= count:
        return items
    return [items[k] for k in sorted(rng.choice(len(items), count, replace=False))]


def near(limit):
    """Right: the points are displaced by less than limit (RMS)."""
    return lambda points, pose, truths: any(displacement(points, pose, t) < limit for t in truths)


def fused(folder, fragments, count, rng, only_chosen=False):
    """Fragments of a moving camera, each in the frame of its middle camera. only_chosen: those of no pair are None,
    and not read.
    """
    views = cameras(folder / "cameras.txt")
    frames = {}
    for line in (folder / "cameras.txt").read_text().splitlines():
        if line.startswith("#") or not line.strip():
            continue
        f = line.split()
        frames.setdefault(int(f[0]), []).append([float(x) for x in f[2:9]])
    clouds, into = [], []
    for k in range(fragments):
        t = np.eye(4)  # into the frame of the middle camera
        x, y, z, qx, qy, qz, qw = frames[k][len(frames[k]) // 2]
        v = np.array([qx, qy, qz])
        cross = np.array([[0, -qz, qy], [qz, 0, -qx], [-qy, qx, 0]])
        r = np.eye(3) * (qw * qw - v @ v) + 2 * np.outer(v, v) + 2 * qw * cross
        t[:3, :3], t[:3, 3] = r.T, -r.T @ np.array([x, y, z])
        into.append(t)
    pairs = [
        (j, i, [into[i] @ t @ np.linalg.inv(into[j])])
        for (i, j, _), t in matrices(folder / "gt.log")
        if j - i > 1
    ]
    pairs = chosen(pairs, count, rng)
    for k in range(fragments):
        if only_chosen and not any(k in pair[:2] for pair in pairs):
            clouds.append(None)
            continue
        points = rows_of(folder / f"cloud_bin_{k}.ply")
        clouds.append(Cloud(moved(into[k], points), moved(into[k], np.array(views[k])), 3.0))
    return [Set(clouds, pairs, "0.05", near(0.2))]


def kitchen(data, count, rng, only_chosen=False):
    return fused(data / "redkitchen/fragments", 20, count, rng, only_chosen)


def house_a(data, count, rng, only_chosen=False):
    return fused(data / "house/A", 50, count, rng, only_chosen)


def hospital_e(data, count, rng):
    return fused(data / "hospital/E", 50, count, rng)


def frames(data, count, rng):
    """Every 20th depth image, in the frame of its camera; pixels 2 apart, nearer than 3.5 m."""
    from PIL import Image

    focal, centre = 585.0, (320, 240)
    clouds, poses = [], []
    for k in range(0, 1000, 20):
        name = data / f"redkitchen/rgbd/frame-{k:06d}"
        depth = np.asarray(Image.open(f"{name}.depth.png"), np.float64)[::2, ::2] / 1000
        y, x = np.mgrid[0:480:2, 0:640:2]
        rays = np.stack([(x - centre[0]) / focal, (y - centre[1]) / focal, np.ones(x.shape)], -1)
        points = (rays * depth[..., None])[(depth > 0) & (depth < 3.5)]
        clouds.append(Cloud(points, np.zeros((1, 3)), 3.0))
        poses.append(np.loadtxt(f"{name}.pose.txt"))
    pairs = [(k + 1, k, [np.linalg.inv(poses[k]) @ poses[k + 1]]) for k in range(len(clouds) - 1)]
    return [Set(clouds, chosen(pairs, count, rng), "0.05", near(0.2))]


def dragon(data, count, rng):
    folder = data / "dragon"
    view = np.array([[float(x) for x in (folder / "viewpoint.txt").read_text().split()]])
    world = np.loadtxt(folder / "poses.txt").reshape(-1, 4, 4)
    # The sensor becomes the origin, as of a scanner.
    clouds = [
        Cloud(rows_of(folder / f"cloud_bin_{k}.ply") - view, np.zeros((1, 3)), 0.4)
        for k in range(15)
    ]
    shift = np.eye(4)
    shift[:3, 3] = view[0]
    pairs = []
    for i in range(15):
        for j in range(i + 1, 15):
            truth = np.linalg.inv(world[i] @ shift) @ world[j] @ shift
            # Turntable scans with directions less than 50 degrees apart overlap well.
            if angle(truth, np.eye(4)) < 50:
                pairs.append((j, i, [truth]))
    return [Set(clouds, chosen(pairs, count, rng), "auto", near(0.008))]


def stl(path):
    raw = path.read_bytes()
    count = int(np.frombuffer(raw, "<u4", 1, 80)[0])
    kind = np.dtype([("f", "<f4", 12), ("a", "<u2")])
    return np.frombuffer(raw, kind, count, 84)["f"][:, 3:].reshape(-1, 3, 3).astype(np.float64)


def sampled(triangles, rng, count=20000):
    """Points of the faces by area, and the centroid of the area."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(cross, axis=1)
    centre = (triangles.mean(1) * area[:, None]).sum(0) / area.sum()
    face = rng.choice(len(area), count, p=area / area.sum())
    s, u = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    t = triangles[face]
    return t[:, 0] * (1 - s) + t[:, 1] * s * (1 - u) + t[:, 2] * s * u, centre


def on_model(points, pose, truths):
    # The published poses are up to 4.6 degrees and 6 mm off.
    return any(
        angle(pose, t) < 10 and np.linalg.norm(pose[:3, 3] - t[:3, 3]) < 0.012 for t in truths
    )


def cad(data, count, rng, as_mesh=False, scanned="filtered"):
    sets = []
    for path in sorted((data / "cad/model").glob("*.stl")):
        scans = sorted((data / "cad" / scanned).glob(f"{path.stem}_*.ply"))
        if not scans:
            continue
        facts = [json.loads(scan.with_suffix(".json").read_text()) for scan in scans]
        triangles = stl(path)
        points, centre = sampled(triangles, rng)
        model = (points - centre) / facts[0]["scale"]
        triangles = (triangles - centre) / facts[0]["scale"]
        reach = 3 * float(np.ptp(model, axis=0).max())
        clouds = [Cloud(model, None, reach, triangles if as_mesh else None)]
        clouds += [Cloud(rows_of(scan), np.zeros((1, 3)), reach) for scan in scans]
        pairs = [(0, k + 1, [np.array(t) for t in f["truths"]]) for k, f in enumerate(facts)]
        sets.append(Set(clouds, pairs, "auto", on_model))
    return sets


def cad_mesh(data, count, rng):
    return cad(data, count, rng, as_mesh=True)


def clutter(data, count, rng):
    return cad(data, count, rng, as_mesh=True, scanned="BB_1.4")


def kitti(data, count, rng):
    pairs = json.loads((data / "kitti/pairs.json").read_text())
    names = sorted({p[side] for p in pairs for side in ("source", "target")})
    clouds = [Cloud(rows_of(data / f"kitti/{n}.ply"), np.zeros((1, 3)), 15.0) for n in names]
    known = [p for p in pairs if p["kind"] != "negative"]

    def right(points, pose, truths):
        return any(
            angle(pose, t) < 5 and np.linalg.norm(pose[:3, 3] - t[:3, 3]) < 2 for t in truths
        )

    listed = [
        (names.index(p["source"]), names.index(p["target"]), [np.array(p["truth"]).reshape(4, 4)])
        for p in known
    ]
    listed += [
        (names.index(p["source"]), names.index(p["target"]), [])
        for p in pairs
        if p["kind"] == "negative"
    ]
    return [Set(clouds, chosen(listed, count, rng), "auto", right)]


def lidar(data, count, rng):
    truth = np.array((data / "lidar/T_target_source.txt").read_text().split(), np.float64)
    clouds = [
        Cloud(rows_of(data / f"lidar/{n}.ply"), np.zeros((1, 3)), 15.0)
        for n in ("source", "target")
    ]
    return [Set(clouds, [(0, 1, [truth.reshape(4, 4)])], "auto", near(1.0))]


def fgr(data, count, rng):
    sets = []
    for k in chosen(range(1, 26), count // 4, rng):
        folder = data / f"fgr/{k:02d}"
        # The sensor is not known: `said` says nothing.
        clouds = [Cloud(rows_of(folder / f"Depth_000{i}.ply"), None, FGR_REACH) for i in (0, 1)]
        _, truth = next(iter(matrices(folder / "gt.log")))
        sets.append(Set(clouds, [(1, 0, [truth])], "auto", near(0.05)))
    return sets


def write_stl(path, vertices):
    faces = np.zeros(len(vertices) // 3, np.dtype([("f", "<f4", 12), ("a", "<u2")]))
    faces["f"][:, 3:] = vertices.reshape(-1, 9)
    path.write_bytes(bytes(80) + np.uint32(len(faces)).tobytes() + faces.tobytes())


def write(folder, clouds, poses, say):
    lines = []
    for k, (cloud, pose) in enumerate(zip(clouds, poses)):
        if cloud.triangles is not None:
            write_stl(folder / f"cloud_bin_{k}.stl", moved(pose, cloud.triangles.reshape(-1, 3)))
            continue
        points = moved(pose, cloud.points).astype(np.float32)
        gpureg.write_point_cloud(folder / f"cloud_bin_{k}.ply", points)
        if say and cloud.viewpoints is not None:
            for n, view in enumerate(moved(pose, cloud.viewpoints)):
                lines.append(f"{k} {n} {view[0]:.6f} {view[1]:.6f} {view[2]:.6f} 0 0 0 1\n")
    if lines:
        (folder / "cameras.txt").write_text("".join(lines))


def turned(rng, axis=None):
    """A pose that turns a cloud about its sensor, by any rotation or about an axis."""
    pose = np.eye(4)
    pose[:3, :3] = rotation(rng)
    if axis is not None:
        x, y, z = axis
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = rng.uniform(-np.pi, np.pi)
        pose[:3, :3] = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return pose


def poses_of(condition, clouds, rng):
    """What every cloud is moved by; `turned` and `upright` keep the sensor at the origin."""
    if condition == "still":
        return [np.eye(4) for _ in clouds]
    if condition in ("turned", "turned_said"):
        return [turned(rng) for _ in clouds]
    if condition == "upright":
        return [turned(rng, (0, 0, 1)) for _ in clouds]
    return [random_pose(rng, cloud.reach) for cloud in clouds]


def count_decision(condition, kind, sensor_is_known, decision, total):
    """Counts a decision about a cloud whose viewpoint nobody said."""
    if condition.endswith("said") and kind == "scan":
        return
    stays = condition in ("still", "turned", "upright")
    if kind == "scan" and stays and not sensor_is_known:
        return
    right = "model" if kind == "model" else "origin" if stays else "none"
    total["decided"] += 1
    total["decided_right"] += decision == right
    total["decided_none"] += decision == "none" and right == "origin"


def run(command, scene, seed, rng, condition, total, extra):
    """Adds the counts of a set to total. Returns the voxel size and, for each pair, the pose as of clouds that were not
    moved, whether it is correct, and its score.
    """
    poses = poses_of(condition, scene.clouds, rng)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write(folder, scene.clouds, poses, condition in ("said", "turned_said"))
        listed = "".join(f"{t} {s}\n" for s, t, _ in scene.pairs)
        (folder / "pairs.txt").write_text(listed)
        out = folder / "out.json"
        result = subprocess.run(
            [command, "batch", name, "--pairs", folder / "pairs.txt", "-o", folder / "out.log"]
            + ["--json", out, "--voxel-size", scene.voxel, "--backend", "cpu", "--threads", "1"]
            + ["--seed", str(seed), "--quiet", *extra],
            capture_output=True,
            text=True,
        )
        if result.returncode not in (0, 1) or not out.exists():
            sys.exit(f"error: {command}: {result.stderr}")
        document = json.loads(out.read_text())
    for fragment, cloud in zip(document["fragments"], scene.clouds):
        kind = "scan" if cloud.reach == FGR_REACH or cloud.viewpoints is not None else "model"
        decision = fragment["viewpoint"]
        total[f"{kind}: {decision}"] += 1
        count_decision(condition, kind, cloud.viewpoints is not None, decision, total)
    found = {(p["i"], p["j"]): p for p in document["pairs"]}
    outcomes = []
    for source, target, truths in scene.pairs:
        i, j = min(source, target), max(source, target)
        record = found[i, j]
        reported = record["status"] == "aligned"
        up_to_symmetry = reported or record["reason"] == "symmetric"
        flat = record.get("T_ij") or record.get("transform")
        good, pose = False, None
        if flat is not None:
            pose = np.array(flat, np.float64).reshape(4, 4)  # j into i
            if source < target:
                pose = np.linalg.inv(pose)
            pose = np.linalg.inv(poses[target]) @ pose @ poses[source]
            points = scene.clouds[source].points[::50]
            good = bool(truths) and bool(scene.right(points, pose, truths))
        total["negatives" if not truths else "pairs"] += 1
        total["right"] += good
        total["reported"] += reported and good
        total["reported_wrong"] += reported and not good
        total["reported_up_to_symmetry"] += up_to_symmetry and good
        total["reported_up_to_symmetry_wrong"] += up_to_symmetry and not good
        outcomes.append((pose, good, record["confidence"]))
    return document["options"]["voxel_size"], outcomes


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--gpureg", default="gpureg", help="the command")
    parser.add_argument("--sets", default="kitchen,dragon,cad,kitti,lidar,fgr")
    parser.add_argument("--conditions", default="said,nothing,still")
    parser.add_argument("--pairs", type=int, default=40, help="at most so many pairs of a set")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--extra", default="", help="more options of gpureg batch")
    arguments = parser.parse_args()
    chosen_by = (kitchen, dragon, cad, cad_mesh, kitti, lidar, fgr)
    makers = {f.__name__: f for f in (*chosen_by, house_a, hospital_e, frames, clutter)}
    record = {"sets": {}}
    if arguments.json and arguments.json.exists():
        known = json.loads(arguments.json.read_text())["sets"]
        record["sets"] = {name: entry for name, entry in known.items() if "command" in entry}
    every = collections.Counter()
    for name in arguments.sets.split(","):
        scenes = makers[name](arguments.data, arguments.pairs, np.random.default_rng(0))
        entry = {
            "command": f"bench/accuracy/viewpoints.py --sets {name} --conditions {arguments.conditions} "
            f"--pairs {arguments.pairs} --seeds {' '.join(map(str, arguments.seeds))}"
            + (f" --extra '{arguments.extra}'" if arguments.extra else ""),
            "commit": commit(),
            "seeds": arguments.seeds,
            "conditions": {},
        }
        for condition in arguments.conditions.split(","):
            entry["conditions"][condition] = []
            for seed in arguments.seeds:
                total, rng = collections.Counter(), np.random.default_rng(seed)
                for scene in scenes:
                    run(
                        arguments.gpureg,
                        scene,
                        seed,
                        rng,
                        condition,
                        total,
                        arguments.extra.split(),
                    )
                print(name, condition, seed, dict(total), flush=True)
                every += total
                entry["conditions"][condition].append({"seed": seed, **total})
        record["sets"][name] = entry
        if arguments.json:
            save(arguments.json, record)
    if every["decided"]:
        share = 100 * every["decided_right"] / every["decided"]
        print(
            f"decided right: {every['decided_right']} of {every['decided']} clouds, {share:.1f} %"
        )


if __name__ == "__main__":
    main()
