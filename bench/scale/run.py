#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Clouds whose scales differ by an unknown factor: what the search of the scale finds, and what it costs.

Every cloud is moved by a random pose, and the source is divided by a factor, at random from 0.05 to 20
(`free`) or 1 (`one`). `known`: the same pair at its true scale. One entry for each set and seed: pairs;
`correct`: the first pose is correct by the rule of viewpoints.py; `reported`, `reported_wrong`: at a
confidence of 0.5; `recall_at_95`: share of the pairs with a correct pose among the most confident ones of
which 95 % are correct; `scale_error`: median of |scale / factor - 1| of the correct pairs, and the share
below 0.01; `times`: seconds of all pairs with an unknown scale / with the known one, preparation included.
`scale_errors` has the signed errors, log(scale / factor). With --voxel auto sets take the voxel size that both clouds suggest at their true scale, as `known` does.
--peer teaser: TEASER++ instead, with the mutual nearest neighbours of gpureg's features, which are computed with known viewpoints: correct
`with_known` and `with_free` scale by features at the true scale, and `with_own` by features at the voxel size that each cloud suggests alone.

usage: run.py DATA [--sets kitchen,lidar] [--pairs 8] [--seeds 1 2 3] [--conditions free,one] [--backend cpu]
       [--json OUT | --copy FOLDER] [--peer teaser]
--copy: what these arguments read of DATA, points alone, to measure on another machine.
Needs numpy and the Python package gpureg; the peer, scipy and a build of teaserpp_python."""

import json
import pathlib
import shutil
import sys
import time

import gpureg
import numpy as np

BENCH = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(BENCH / "accuracy"), str(BENCH / "peers")]
import viewpoints
from record import commit, plain_parser, save

FACTORS = (0.05, 20)
SETS = ("kitchen", "house_a", "lidar", "kitti", "dragon", "cad", "fgr")


def rigid_at(points, similarity):
    """The rigid motion that turns like the similarity, and moves the points' centre to the same place."""
    centre, pose = points.mean(0), similarity.copy()
    pose[:3, :3] /= np.cbrt(np.linalg.det(similarity[:3, :3]))
    pose[:3, 3] = similarity[:3, :3] @ centre + similarity[:3, 3] - pose[:3, :3] @ centre
    return pose


def scenes_of(name, data, limit):
    options = {"only_chosen": True} if name in ("kitchen", "house_a") else {}
    return getattr(viewpoints, name)(data, limit, np.random.default_rng(0), **options)


def copy(data, folder, sets, limit):
    """What these sets read of data."""
    opened, clouds, read = set(), set(), viewpoints.rows_of
    # The package reads clouds, Python everything else.
    sys.addaudithook(lambda event, a: opened.add(str(a[0])) if event == "open" else None)

    def rows_of(path):
        clouds.add(path)
        return read(path)

    viewpoints.rows_of = rows_of
    for name in sets:
        scenes_of(name, data, limit)
    for path in {p for p in map(pathlib.Path, opened) if data in p.parents and p.is_file()}:
        (folder / path.relative_to(data)).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, folder / path.relative_to(data))
    for path in clouds:
        (folder / path.relative_to(data)).parent.mkdir(parents=True, exist_ok=True)
        gpureg.write_point_cloud(folder / path.relative_to(data), read(path).astype(np.float32))


def recall_at(precision, outcomes):
    """Share of all pairs that are correct among the most confident ones of that precision."""
    best = right = 0
    for count, (_, correct) in enumerate(sorted(outcomes, key=lambda o: -o[0]), 1):
        right += correct
        if right >= precision * count:
            best = right
    return best / max(1, len(outcomes))


def counts(outcomes):
    """(confidence, correct, reported) of each pair to counts."""
    return {
        "correct": sum(o[1] for o in outcomes),
        "reported": sum(o[1] and o[2] for o in outcomes),
        "reported_wrong": sum(o[2] and not o[1] for o in outcomes),
        "recall_at_95": round(recall_at(0.95, [o[:2] for o in outcomes]), 4),
    }


def moved_pairs(scenes, limit, seed, condition):
    """Names, clouds at random poses and their viewpoints, factor of the source, options, and what tells whether a
    similarity of the clouds is correct."""
    rng = np.random.default_rng(seed)
    for scene in scenes:
        for s, t, truths in scene.pairs[:limit]:
            if not truths:
                continue
            clouds = [scene.clouds[k] for k in (s, t)]
            poses = [viewpoints.random_pose(rng, cloud.reach) for cloud in clouds]
            factor = float(np.exp(rng.uniform(*np.log(FACTORS)))) if condition == "free" else 1.0
            source, target = (viewpoints.moved(p, c.points) for p, c in zip(poses, clouds))
            voxel = (
                gpureg.suggest_voxel_size([source, target]).voxel_size
                if scene.voxel == "auto"
                else float(scene.voxel)
            )
            options = gpureg.RegistrationOptions(voxel_size=voxel)
            options.seed = seed

            def correct(similarity, scene=scene, clouds=clouds, poses=poses, truths=truths):
                found = np.linalg.inv(poses[1]) @ similarity @ poses[0]
                points = clouds[0].points[::50]
                return bool(scene.right(points, rigid_at(points, found), truths))

            views = [
                "auto" if c.viewpoints is None else viewpoints.moved(p, c.viewpoints)
                for p, c in zip(poses, clouds)
            ]
            yield f"{s} {t}", (source, target), views, factor, options, correct


def within_scale(similarity, scale, factor, correct):
    """Whether a similarity from the divided source is correct, and its scale within a tenth."""
    to_source = np.diag([1 / factor, 1 / factor, 1 / factor, 1])
    return correct(similarity @ to_source) and abs(scale / factor - 1) < 0.1


def run(name, scenes, limit, seed, condition, context):
    known, searched, errors, statuses, seconds = [], [], [], {}, [0.0, 0.0]
    pairs = moved_pairs(scenes, limit, seed, condition)
    for pair, (source, target), _, factor, options, correct in pairs:
        begin = time.perf_counter()
        a = gpureg.register(source, target, options=options, context=context)
        middle = time.perf_counter()
        b = gpureg.register(source / factor, target, scale="free", options=options, context=context)
        seconds[0] += middle - begin
        seconds[1] += time.perf_counter() - middle
        of_known = correct(np.asarray(a.target_from_source)) if a.has_pose else False
        known.append((a.confidence, of_known, a.aligned))
        found = b.result.has_pose and within_scale(b.target_from_source, b.scale, factor, correct)
        searched.append((b.confidence, found, b.aligned))
        statuses[b.scale_status] = statuses.get(b.scale_status, 0) + 1
        if found:
            errors.append(float(np.log(b.scale / factor)))
        print(
            f"{name} {condition} {seed}: {pair} factor {factor:.3g}, known {of_known} {a.confidence:.3f}, "
            f"searched {found} {b.confidence:.3f} {b.scale_status}, error {abs(b.scale / factor - 1):.4f}, "
            f"{middle - begin:.2f} s and {time.perf_counter() - middle:.2f} s",
            flush=True,
        )
    return {
        "seed": seed,
        "pairs": len(known),
        "known": counts(known),
        "searched": counts(searched),
        "lost": sum(k[1] and not s[1] for k, s in zip(known, searched)),
        "won": sum(s[1] and not k[1] for k, s in zip(known, searched)),
        "statuses": statuses,
        "scale_error": round(float(np.median(np.abs(errors))), 5) if errors else None,
        "scale_within_1_percent": round(float(np.mean(np.abs(errors) < 0.01)), 4)
        if errors
        else None,
        "scale_errors": [round(e, 5) for e in errors],
        "times": round(seconds[1] / max(1e-9, seconds[0]), 2),
    }


def teaser(p, q, noise, free):
    """Similarity, scale, seconds of TEASER++ with matches from p to q."""
    from methods.teaser import solve

    begin = time.perf_counter()
    found, pose = solve(p, q, noise, free).getSolution(), np.eye(4)
    scale = found.scale if free else 1.0
    pose[:3, :3], pose[:3, 3] = scale * found.rotation, np.ravel(found.translation)
    return pose, scale, time.perf_counter() - begin


def mutual_matches(clouds, views, voxels, context):
    """Points of two clouds, at the scale in which they are given, whose features match."""
    from scipy.spatial import cKDTree

    a, b = (
        gpureg.prepare(
            c, viewpoints=v, options=gpureg.RegistrationOptions(voxel_size=voxel), context=context
        )
        for c, v, voxel in zip(clouds, views, voxels)
    )
    forward = cKDTree(b.features).query(a.features)[1]
    back = cKDTree(a.features).query(b.features)[1]
    rows = np.flatnonzero(back[forward] == np.arange(len(forward)))
    return a.points[rows] + a.origin, b.points[forward[rows]] + b.origin


def run_teaser(name, scenes, limit, seed, context):
    known, free, own, errors, seconds, matches = [], [], [], [], [], []
    pairs = moved_pairs(scenes, limit, seed, "free")
    for pair, clouds, views, factor, options, correct in pairs:
        voxel = options.voxel_size
        p, q = mutual_matches(clouds, views, (voxel, voxel), context)
        matches.append(len(p))
        pose, _, _ = teaser(p, q, voxel, False)
        known.append(correct(pose))
        pose, scale, of_free = teaser(p / factor, q, voxel, True)
        seconds.append(of_free)
        free.append(within_scale(pose, scale, factor, correct))
        if free[-1]:
            errors.append(float(np.log(scale / factor)))
        voxels = [gpureg.suggest_voxel_size([c]).voxel_size for c in clouds]
        p, q = mutual_matches(clouds, views, voxels, context)
        pose, scale, _ = teaser(p / factor, q, voxels[1], True)
        own.append(within_scale(pose, scale, factor, correct))
        print(
            f"{name} {seed}: {pair} factor {factor:.3g}, {matches[-1]} matches, known {known[-1]}, "
            f"free {free[-1]}, own {own[-1]}",
            flush=True,
        )
    return {
        "seed": seed,
        "pairs": len(known),
        "with_known": sum(known),
        "with_free": sum(free),
        "with_own": sum(own),
        "scale_errors": [round(e, 5) for e in errors],
        "matches": int(np.median(matches)),
        "seconds": round(float(np.median(seconds)), 3),
    }


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--sets", default=",".join(SETS))
    parser.add_argument("--pairs", type=int, default=8, help="of a scene, at most")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--conditions", default="free")
    parser.add_argument("--backend", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("--peer", choices=("teaser",))
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--copy", type=pathlib.Path)
    arguments = parser.parse_args()
    if arguments.copy:
        return copy(arguments.data, arguments.copy, arguments.sets.split(","), arguments.pairs)
    context = getattr(gpureg.Context, arguments.backend)()
    record = {"sets": {}}
    if arguments.json and arguments.json.exists():
        record = json.loads(arguments.json.read_text())
    for name in arguments.sets.split(","):
        scenes = scenes_of(name, arguments.data, arguments.pairs)
        if arguments.peer:
            record["sets"].setdefault(name, {})["teaser"] = [
                run_teaser(name, scenes, arguments.pairs, seed, context) for seed in arguments.seeds
            ]
            if arguments.json:
                save(arguments.json, record)
            continue
        entry = {
            "command": f"bench/scale/run.py --sets {name} --pairs {arguments.pairs} "
            f"--seeds {' '.join(map(str, arguments.seeds))} --conditions {arguments.conditions}",
            "commit": commit(),
            "backend": arguments.backend,
            "device": context.description,
        }
        for condition in arguments.conditions.split(","):
            entry[condition] = []
            for seed in arguments.seeds:
                entry[condition].append(
                    run(name, scenes, arguments.pairs, seed, condition, context)
                )
                print(name, condition, entry[condition][-1], flush=True)
                record["sets"].setdefault(name, {}).update(entry)
                if arguments.json:
                    save(arguments.json, record)


if __name__ == "__main__":
    main()
