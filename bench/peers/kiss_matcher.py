#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""gpureg beside KISS-Matcher: the same pairs from the same raw points, the same machine, one run.

KISS-Matcher gets its defaults for voxels of 5 cm. A pair of it is all that it does from the raw points on, preparation of both clouds
included, because its interface offers nothing to keep; pairs with at least --inliers final inliers are reported (its examples take fewer
for a failure). gpureg prepares every fragment once and then aligns the pairs, so its time is that of one preparation of all
fragments and of all pairs. Reading files is not counted on either side. The two take turns in blocks of pairs, so that a busy machine
slows both; both use all processors. Processor seconds are counted beside.
usage: kiss_matcher.py [--blocks 5] [--inliers 5] [--backend cpu] [--scene redkitchen/fragments] [--data DIR] [-o FILE]
Needs Python 3 with kiss-matcher 1.0.2, meshio and numpy (PyPI).
"""
import importlib.metadata
import json
import pathlib
import resource
import sys
import tempfile
import time

# In the place of this script's own folder, where `import kiss_matcher` would find this script.
sys.path[0] = str(pathlib.Path(__file__).resolve().parents[1] / "accuracy")
import kiss_matcher  # noqa: E402
import meshio  # noqa: E402
import numpy as np  # noqa: E402
import record  # noqa: E402

VOXEL = 0.05


def register(source, target):
    """4 x 4 from source to target, final inliers, seconds, processor seconds."""
    wall, processor = time.perf_counter(), time.process_time()
    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(VOXEL))
    solution = matcher.prune_and_solve(*matcher.match(source, target))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = solution.rotation, np.asarray(solution.translation).reshape(3)
    inliers = matcher.get_num_final_inliers() if solution.valid else 0
    return pose, inliers, time.perf_counter() - wall, time.process_time() - processor


def batch(arguments, folder, temporary, part):
    """gpureg's report on some pairs of the folder (None: all), and the processor seconds of the command."""
    words = []
    if part is not None:
        (temporary / "pairs.txt").write_text("".join(f"{i} {j}\n" for i, j in part))
        words = ["--pairs", temporary / "pairs.txt"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    record.gpureg(arguments, "batch", folder, "--backend", arguments.backend, "--quiet", *words,
                  "-o", temporary / "result.log", "--json", temporary / "result.json")
    return json.loads((temporary / "result.json").read_text()), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def scores(arguments, folder, temporary, result):
    output = temporary / "scores.json"
    record.gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", output)
    strict = json.loads(output.read_text())["scenes"][0]["strict"]
    return {key: strict[key] for key in ("good", "ground_truth", "reported", "recall", "precision")}


def log_entry(i, j, count, pose):
    rows = "\n".join("\t".join(f"{v:.10f}" for v in row) for row in pose)
    return f"{i}\t{j}\t{count}\n{rows}\n"


def main():
    parser = record.parser(__doc__, "kiss_matcher.json")
    parser.set_defaults(backend="cpu")
    parser.add_argument("--scene", default="redkitchen/fragments", help="a folder of the data with fragments and their ground truth")
    parser.add_argument("--blocks", type=int, default=5)
    parser.add_argument("--inliers", type=int, default=5, help="final inliers from which on a pair of KISS-Matcher's is reported")
    arguments = parser.parse_args()
    folder = record.data_folder(arguments, arguments.scene)

    count = len(list(folder.glob("cloud_bin_*.ply")))
    clouds = [np.asfortranarray(meshio.read(folder / f"cloud_bin_{i}.ply").points.T.astype(np.float64)) for i in range(count)]
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    found, seconds, processor, prepare, align = [], 0.0, 0.0, [], 0.0
    with tempfile.TemporaryDirectory() as temporary:
        temporary = pathlib.Path(temporary)
        for block in np.array_split(np.arange(len(pairs)), arguments.blocks):
            part = [pairs[k] for k in block]
            for i, j in part:
                pose, inliers, wall, used = register(clouds[j], clouds[i])
                seconds, processor = seconds + wall, processor + used
                found.append((i, j, pose, inliers))
            report, _ = batch(arguments, folder, temporary, part)
            prepare.append(report["seconds"]["prepare"])
            align += report["seconds"]["align"]
        report, used = batch(arguments, folder, temporary, None)
        own = float(np.mean(prepare)) + align
        for name, least in (("kiss", arguments.inliers), ("every", 0)):
            (temporary / f"{name}.log").write_text("".join(log_entry(i, j, count, pose) for i, j, pose, n in found if n >= least))
        stages = report["pairs"][0]["ms"]
        content = {
            "environment": report["environment"], "scene": arguments.scene, "pairs": len(pairs), "fragments": count,
            "ratio_of_seconds": own / seconds, "ratio_of_processor_seconds": used / processor,
            "gpureg": {"seconds": own, "prepare_seconds": float(np.mean(prepare)), "processor_seconds": used,
                       "ms_mean": {stage: float(np.mean([pair["ms"][stage] for pair in report["pairs"]])) for stage in stages},
                       **scores(arguments, folder, temporary, temporary / "result.json")},
            "kiss_matcher": {"version": importlib.metadata.version("kiss-matcher"), "seconds": seconds, "processor_seconds": processor,
                             "least_inliers": arguments.inliers, **scores(arguments, folder, temporary, temporary / "kiss.log"),
                             "every_pair_reported": scores(arguments, folder, temporary, temporary / "every.log")},
        }
    for name in ("kiss_matcher", "gpureg"):
        side = content[name]
        print(f"{name}: {side['seconds']:.1f} s ({side['processor_seconds']:.1f} processor seconds) for {len(pairs)} pairs of {count} raw clouds, "
              f"recall {100 * side['recall']:.1f} % at precision {100 * side['precision']:.1f} %")
    print(f"gpureg takes {content['ratio_of_seconds']:.3f} of KISS-Matcher's time, {content['ratio_of_processor_seconds']:.3f} of its processor time")
    record.write(arguments, f"bench/peers/kiss_matcher.py --blocks {arguments.blocks} --inliers {arguments.inliers} "
                 f"--backend {report['environment']['backend']} --scene {arguments.scene}", content)


main()
