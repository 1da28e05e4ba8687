#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Recall, precision and time of the default method at many settings of its effort: all pairs of each
scene, prepared once, through the Python package. Chooses the numbers of candidates of `quality` and
draws the Pareto front.

A scene is a folder in Redwood's layout with gt.log, gt.info, gt_all.log and gt_all.info, perhaps with
cameras.txt. With --moved every scene is also run with unknown viewpoints, each cloud moved by a random
rigid motion. Times are elapsed times of `align_batch`, the median of the seeds; say on which device.

first, any: share of the pairs of gt.log, not consecutive, whose most confident pose, or any mode, is
within Redwood's 0.2 m. Strict rule and geometric rule: `gpureg evaluate`.

usage: front.py SCENE... [--moved] [--seeds 1 2 3] [--settings NAME...] [--backend cuda] [-o FILE]
       front.py --plot FILE.png [-o FILE]
Needs numpy and the Python package gpureg; --plot: matplotlib."""

import json
import pathlib
import statistics
import sys
import time

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
import record
from fit_confidence import CALIBRATION_BINS, MAX_ERROR, MIN_SEPARATION, SURE, blocks, errors

PRECISIONS = (95, 99)
TICKS = (0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8)  # ms, of the plot
MOVED_SEED = 1


def setting(matches, seeds, modes, triangles=64, members=512, sample=512):
    return {
        "compatibility.max_matches": matches,
        "compatibility.seeds": seeds,
        "compatibility.triangles": triangles,
        "compatibility.max_members": members,
        "evidence.modes": modes,
        "evidence.sample": sample,
    }


# By name; besides, `quality 0` to `quality 10`. A change stands beside the default of quality 5.
SETTINGS = {
    "1536/192/12": setting(1536, 192, 12),
    "2048/512/16": setting(2048, 512, 16),
    "4096/512/16": setting(4096, 512, 16),
    "4096/2048/32": setting(4096, 2048, 32, 128),
    "8192/1024/24": setting(8192, 1024, 24),
    "128 members": {"compatibility.max_members": 128},
    "16 triangles": {"compatibility.triangles": 16},
    "sample 1024": {"evidence.sample": 1024},
    "10 iterations": {"refine.max_iterations": 10},
}
QUALITIES = {f"quality {k}": k for k in range(11)}


class Scene:
    """Prepared clouds and truth. moved: motions of the clouds, or None."""

    def __init__(self, gpureg, context, folder, options, moved):
        self.name = f"{folder.parent.name}/{folder.name}" + (", moved" if moved else "")
        fragments = gpureg.FragmentSet.from_directory(folder)
        self.numbers = fragments.numbers
        random = np.random.default_rng(MOVED_SEED)
        self.motions, clouds = [], []
        for position in range(len(fragments)):
            motion = np.eye(4)
            if moved:
                q, r = np.linalg.qr(random.normal(size=(3, 3)))
                q *= np.sign(np.diag(r))
                q[:, 0] *= np.sign(np.linalg.det(q))
                motion[:3, :3], motion[:3, 3] = q, random.uniform(-2, 2, 3)
                cloud = gpureg.read_point_cloud(fragments._sources[position])
                points = np.asarray(cloud.points) @ q.T + motion[:3, 3]
                clouds.append(points.astype(np.float32))
            else:
                clouds.append(fragments.load(position, options))
            self.motions.append(motion)
        if moved:
            clouds = [
                gpureg._arrays.core_cloud(c, None, None, None, options, "cloud", False)
                for c in clouds
            ]
        start = time.perf_counter()
        self.clouds = gpureg._core.prepare_batch(context, clouds, options)
        self.seconds = time.perf_counter() - start
        n = len(self.numbers)
        self.pairs = np.array([(j, i) for i in range(n) for j in range(i + 1, n)], np.uint32)
        self.truth = {
            name: (blocks(folder / f"{name}.log", 5), blocks(folder / f"{name}.info", 7))
            for name in ("gt", "gt_all")
        }

    def poses(self, pair, modes):
        """In the coordinates of the files, (n, 4, 4)."""
        j, i = pair
        poses = np.array([mode.target_from_source for mode in modes])
        return np.linalg.inv(self.motions[i]) @ poses @ self.motions[j]


def ranked(score, good, strict, total):
    order = np.argsort(-score, kind="stable")
    recall = np.cumsum(strict[order]) / total
    precision = np.cumsum(good[order]) / np.arange(1, len(order) + 1)
    out = {
        f"R@P{at}": max([r for r, p in zip(recall, precision) if p >= at / 100], default=0)
        for at in PRECISIONS
    }
    return {key: 100 * value for key, value in out.items()}


def figures(scene, results):
    confidence, overlapping, correct, strict, among = [], [], [], [], []
    total = 0
    for pair, result in zip(scene.pairs, results):
        i, j = scene.numbers[pair[1]], scene.numbers[pair[0]]
        if j - i < MIN_SEPARATION:
            continue
        modes = result.modes
        within = {}
        for name, (truth, information) in scene.truth.items():
            within[name] = (
                errors(truth[i, j], information[i, j], scene.poses(pair, modes)) <= MAX_ERROR
                if modes and (i, j) in truth
                else np.zeros(1, bool)
            )
        total += (i, j) in scene.truth["gt"][0]
        best = modes[0] if modes else None
        confidence.append(best.confidence if best else 0.0)
        overlapping.append(best.overlap_confidence if best else 0.0)
        correct.append(within["gt_all"][0])
        strict.append(within["gt"][0])
        among.append(within["gt"].any())
    confidence, overlapping = np.array(confidence), np.array(overlapping)
    correct, strict = np.array(correct), np.array(strict)
    bins = np.minimum((confidence * CALIBRATION_BINS).astype(int), CALIBRATION_BINS - 1)
    sure = confidence > SURE
    return {
        "true_pairs": total,
        "first": 100 * strict.sum() / total,
        "any": 100 * np.sum(among) / total,
        "geometric": ranked(confidence, correct, strict, total),
        "strict": ranked(overlapping, strict, strict, total),
        "ECE": sum(
            (bins == b).mean() * abs(confidence[bins == b].mean() - correct[bins == b].mean())
            for b in range(CALIBRATION_BINS)
            if (bins == b).any()
        ),
        "above": int(sure.sum()),
        "correct_above": 100 * correct[sure].mean() if sure.any() else None,
    }


def measure(arguments):
    import gpureg

    context = {"auto": gpureg.Context.best, "cpu": gpureg.Context.cpu, "cuda": gpureg.Context.cuda}[
        arguments.backend
    ]()
    names = [*QUALITIES, *SETTINGS]
    unknown = [name for name in arguments.settings if name not in names]
    if unknown:
        sys.exit(f"error: there is no setting {unknown[0]}; there are {', '.join(names)}")
    rows = []
    for folder in arguments.scenes:
        for moved in (False, True) if arguments.moved else (False,):
            options = gpureg.RegistrationOptions()
            scene = Scene(gpureg, context, folder, options, moved)
            align_all(gpureg, context, scene, options)  # the first call allocates
            for name in arguments.settings or names:
                for seed in arguments.seeds:
                    changes = SETTINGS.get(name, {})
                    options = gpureg.RegistrationOptions(
                        seed=seed,
                        quality=QUALITIES.get(name, 5),
                        tune=" ".join(f"{key}={value}" for key, value in changes.items()),
                    )
                    results, seconds = align_all(gpureg, context, scene, options)
                    rows.append(
                        {
                            "scene": scene.name,
                            "setting": name,
                            "seed": seed,
                            "pairs": len(scene.pairs),
                            "ms": 1000 * seconds / len(scene.pairs),
                            **figures(scene, results),
                        }
                    )
                print(summary(rows, scene.name, name), flush=True)
    record.write(
        arguments,
        "bench/pipeline/front.py SCENE... --moved",
        {
            "device": context.description,
            "settings": {
                **{name: {"quality": quality} for name, quality in QUALITIES.items()},
                **SETTINGS,
            },
            "rows": rows,
        },
    )


def align_all(gpureg, context, scene, options):
    start = time.perf_counter()
    results, error = gpureg._core.align_batch(context, scene.clouds, scene.pairs, options)
    if error is not None:
        raise error
    return results, time.perf_counter() - start


def mean(rows, *path):
    values = []
    for row in rows:
        for key in path:
            row = row[key]
        values.append(row)
    return statistics.mean(values)


def of(rows, scene, name):
    return [row for row in rows if row["scene"] == scene and row["setting"] == name]


def summary(rows, scene, name):
    chosen = of(rows, scene, name)
    return (
        f"{scene:28} {name:28} first {mean(chosen, 'first'):5.1f} any {mean(chosen, 'any'):5.1f} "
        f"geo P95 {mean(chosen, 'geometric', 'R@P95'):5.1f} P99 {mean(chosen, 'geometric', 'R@P99'):5.1f} "
        f"strict P95 {mean(chosen, 'strict', 'R@P95'):5.1f} ECE {mean(chosen, 'ECE'):.3f} "
        f"ms {statistics.median(row['ms'] for row in chosen):.4f}"
    )


def plot(arguments):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = json.loads(arguments.output.read_text())["rows"]
    names = list(dict.fromkeys(row["setting"] for row in rows))
    # Those that were run with every setting.
    scenes = [
        scene
        for scene in dict.fromkeys(row["scene"] for row in rows)
        if all(of(rows, scene, name) for name in names)
    ]
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5), sharex=True)
    for axis, path, label in zip(
        axes, (("first",), ("geometric", "R@P95")), ("first correct, %", "R@P95, geometric, %")
    ):
        for name in names:
            x = statistics.mean(
                statistics.median(row["ms"] for row in of(rows, scene, name)) for scene in scenes
            )
            y = statistics.mean(mean(of(rows, scene, name), *path) for scene in scenes)
            axis.plot(x, y, "o", color="C0")
            # The others stand close together.
            if name.startswith(("quality", "default", "8192")):
                text = name.split(",")[0].replace("quality ", "")
                axis.annotate(text, (x, y), fontsize=8, xytext=(4, 4), textcoords="offset points")
        axis.set_xscale("log")
        axis.set_xticks(TICKS, TICKS)
        axis.minorticks_off()
        axis.set_xlabel("ms a pair, mean of the scenes")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(arguments.plot, dpi=130)


if __name__ == "__main__":
    parser = record.parser(__doc__, "front.json")
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    parser.add_argument("--moved", action="store_true")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--settings", nargs="+", default=[], help="names; default: all")
    parser.add_argument("--plot", type=pathlib.Path)
    arguments = parser.parse_args()
    plot(arguments) if arguments.plot else measure(arguments)
