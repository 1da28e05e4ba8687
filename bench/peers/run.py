#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""gpureg beside its peers on the same pairs of a scene, in one run on one machine.

Every method gets the same clouds (gpureg's 5 cm voxel centroids with normals; gpureg itself begins
with the raw points), the same threads and the parameters that its own documentation recommends,
runs in a process of its own, prepares each fragment once and then aligns pair by pair. A peer that
is not installed is skipped with a message; one that crashes or hangs on a pair loses that pair.
`gpureg evaluate` scores the poses. Pairs: those with j - i > 1, as in Redwood's protocol; with --others N,
all pairs of the ground truth and N others, drawn by --seed. Times of a pair are wall clock and
processor seconds: the second say more where other programs run beside. usage: run.py [--scene
redkitchen/fragments] [--methods open3d_ransac ...] [--others N] [--list] [-o FILE] Needs Python 3
with numpy and gpureg (pip install .), and what the peers need: bench/peers/requirements.txt; PCL:
the target gpureg_pcl_peer."""

import json
import os
import pathlib
import random
import statistics
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[1:1] = [str(HERE.parent / "accuracy"), str(HERE.parent / "redwood")]
import analysis
import methods
import record
from runner import check, work


def choose_pairs(folder, fragments, others, seed):
    """(pairs, how they were chosen)."""
    listed = set()
    lines = [line.split() for line in (folder / "gt.log").read_text().splitlines() if line.strip()]
    for line in lines[::5]:
        listed.add((int(line[0]), int(line[1])))
    pairs = [(i, j) for i in fragments for j in fragments if j - i > 1]
    if others is None:
        return pairs, f"all {len(pairs)} pairs with j - i > 1"
    rest = [pair for pair in pairs if pair not in listed]
    chosen = set(random.Random(seed).sample(rest, min(others, len(rest))))
    kept = [pair for pair in pairs if pair in listed or pair in chosen]
    return kept, (
        f"all {len(kept) - len(chosen)} pairs of the ground truth with j - i > 1 and {len(chosen)} of the {len(rest)} others, "
        f"drawn at random (Python's random.Random({seed}).sample)"
    )


def document(name, about, results, fragments, lost):
    """Input of `gpureg evaluate`."""
    pairs = []
    for line in sorted(results, key=lambda line: (line["i"], line["j"])):
        aligned = line["pose"] is not None and line.get(
            "aligned", about["threshold"] is not None and line["score"] >= about["threshold"]
        )
        pair = {
            "i": line["i"],
            "j": line["j"],
            "status": "aligned" if aligned else "not_aligned",
            "reason": "none" if aligned else "score",
            "score": line["score"],
            "T_ij": line["pose"],
            "ms": {"total": line["ms"]},
        }
        if line.get("strict_score") is not None:
            pair["modes"] = [{"overlap_confidence": line["strict_score"]}]
        pairs.append(pair)
    for i, j in lost:
        pairs.append(
            {
                "i": i,
                "j": j,
                "status": "not_aligned",
                "reason": "gave up",
                "score": 0.0,
                "T_ij": None,
                "ms": {"total": 0.0},
            }
        )
    return {
        "method": name,
        "fragments": [{"number": f["fragment"], "ms": {"total": f["ms"]}} for f in fragments],
        "pairs": pairs,
    }


def summary(about, results, fragments, memory, lost, scene, overlap):
    strict, geometric = analysis.rounded(scene["strict"]), analysis.rounded(scene.get("geometric"))
    right = [pair["error"] for pair in scene["pairs"] if pair["strict"]]
    return {
        **about,
        "commit": record.commit(),
        "strict": strict,
        "geometric": geometric,
        "lost_pairs": lost,
        **analysis.all_of(scene["pairs"], overlap),
        "fragments": len(fragments),
        "tried": len(results),
        "error_of_right_m": statistics.median(right) if right else None,
        "ms_per_pair": statistics.fmean(line["ms"] for line in results),
        "ms_per_pair_median": statistics.median(line["ms"] for line in results),
        "processor_ms_per_pair": statistics.fmean(line["processor_ms"] for line in results),
        "ms_per_fragment": statistics.fmean(line["ms"] for line in fragments),
        "peak_memory_mib": round(memory["peak_memory_mib"]) if memory else None,
    }


def table(entries):
    base = entries.get("gpureg_default", {})
    print(
        f"{'method':28}{'right':>7}{'recall':>8}{'prec.':>7}{'R@P95':>7}{'AP':>7}{'geo.P95':>9}{'ms/fragment':>13}{'ms/pair':>10}{'cpu ms':>9}{'x gpureg':>10}{'MiB':>7}"
    )
    for entry in entries.values():
        strict, geometric = entry["strict"], entry["geometric"]
        ratio = (
            f"{entry['processor_ms_per_pair'] / base['processor_ms_per_pair']:.2f}" if base else ""
        )
        wide = f"{100 * geometric['recall_at_precision']['95']:.1f}" if geometric else ""
        print(
            f"{entry['label'].replace('`', ''):28}{100 * strict['raw_recall']:7.1f}{100 * strict['recall']:8.1f}{100 * strict['precision']:7.1f}"
            f"{100 * strict['recall_at_precision']['95']:7.1f}{100 * strict['average_precision']:7.1f}{wide:>9}{entry['ms_per_fragment']:13.1f}"
            f"{entry['ms_per_pair']:10.1f}{entry['processor_ms_per_pair']:9.1f}{ratio:>10}{entry['peak_memory_mib'] or 0:7}",
            flush=True,
        )


def kept_entries(arguments, pairs):
    """With --update, entries of an earlier run on the same pairs, of methods that this one does not
    run.
    """
    if not arguments.update:
        return {}
    old = json.loads(arguments.output.read_text())
    if (old["scene"], old["pairs"], old["threads"], old["seed"]) != (
        arguments.scene,
        len(pairs),
        arguments.threads,
        arguments.seed,
    ):
        sys.exit(
            f"error: {arguments.output} holds other pairs, threads or seeds, it cannot be updated"
        )
    return old["methods"]


def main():
    parser = record.parser(__doc__, "peers.json")
    parser.add_argument(
        "--scene",
        default="redkitchen/fragments",
        help="a folder of the data with fragments and their ground truth, or a path",
    )
    parser.add_argument(
        "--methods", nargs="+", choices=list(methods.METHODS), default=list(methods.METHODS)
    )
    parser.add_argument(
        "--others", type=int, help="so many pairs beside those of the ground truth, instead of all"
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="of the sample of pairs and of the methods"
    )
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument(
        "--pair-timeout", type=float, default=120, help="seconds after which a pair is given up"
    )
    parser.add_argument(
        "--update",
        action="store_true",
        help="keep the entries of the record for methods that are not named",
    )
    parser.add_argument(
        "--results",
        type=pathlib.Path,
        help="folder to keep each method's RESULT.json in, for `gpureg report`",
    )
    parser.add_argument(
        "--list", action="store_true", help="say which methods are installed, and end"
    )
    arguments = parser.parse_args()
    about = {}
    for name in arguments.methods:
        said, why = check(name)
        if said is None:
            print(f"skipped: {name}: {why}")
        else:
            about[name] = said
            if arguments.list:
                print(
                    f"{name}: {said['label'].replace('`', '')} {said['version']}: {said['parameters']}"
                )
    if arguments.list:
        return
    folder = (
        pathlib.Path(arguments.scene)
        if pathlib.Path(arguments.scene).is_dir()
        else record.data_folder(arguments, arguments.scene)
    )
    with tempfile.TemporaryDirectory() as temporary:
        temporary = pathlib.Path(temporary)
        import clouds  # needs gpureg

        fragments = clouds.write(folder, temporary)
        pairs, chosen = choose_pairs(folder, fragments, arguments.others, arguments.seed)
        print(f"{arguments.scene}: {chosen}; {arguments.threads} threads", flush=True)
        initial, overlap = {}, analysis.overlaps(folder)
        entries = kept_entries(arguments, pairs)
        for name, said in about.items():
            if said["refines"] and not initial:
                print(
                    f"skipped: {name}: it starts from the poses of {methods.REFINED}, which did not run"
                )
                continue
            starts = (
                {pair: line["pose"] for pair, line in initial.items()} if said["refines"] else {}
            )
            begin = time.monotonic()
            results, prepared, memory, lost = work(
                name,
                pairs,
                starts,
                temporary,
                temporary,
                arguments.seed,
                arguments.threads,
                arguments.pair_timeout,
            )
            if results is None:
                print(f"skipped: {name}: {lost}")
                continue
            if said["refines"]:
                for line in results:
                    start = initial[line["i"], line["j"]]
                    line.update(score=start["score"], aligned=start["aligned"])
            if name == methods.REFINED:
                initial = {(line["i"], line["j"]): line for line in results}
            kept = arguments.results or temporary
            kept.mkdir(parents=True, exist_ok=True)
            result, scores = kept / f"{name}.json", temporary / f"{name}.scores.json"
            result.write_text(json.dumps(document(name, said, results, prepared, lost)))
            record.gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", scores)
            scene = json.loads(scores.read_text())["scenes"][0]
            entries[name] = summary(said, results, prepared, memory, lost, scene, overlap)
            print(f"{name}: {time.monotonic() - begin:.0f} s", flush=True)
    entries = {name: entries[name] for name in methods.METHODS if name in entries}
    table(entries)
    words = [
        "bench/peers/run.py",
        "--scene",
        arguments.scene,
        "--seed",
        arguments.seed,
        "--threads",
        arguments.threads,
    ]
    if arguments.others is not None:
        words += ["--others", arguments.others]
    record.write(
        arguments,
        " ".join(map(str, words)),
        {
            "kind": "peers",
            "scene": arguments.scene,
            "pairs": len(pairs),
            "fragments": len(fragments),
            "chosen": chosen,
            "seed": arguments.seed,
            "threads": arguments.threads,
            "methods": entries,
        },
    )


if __name__ == "__main__":
    main()
