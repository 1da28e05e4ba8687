# SPDX-License-Identifier: BSD-3-Clause
"""Tables of times."""

from tables.records import benchmarks, load, made_by


def speed():
    context, runs = benchmarks()
    batch, cpu = (
        runs["align_many/cuda_loopsmart/11"]["ms_per_pair"],
        runs["align_many/cpu_loopsmart/1"]["ms_per_pair"],
    )
    one, whole = (
        runs["align_one/cuda_loopsmart"]["ms_median"],
        runs["raw_to_pose/cuda_loopsmart"]["ms_median"],
    )
    fragment, on_cpu = (
        runs["prepare_batch_of_fragments/cuda"]["ms_per_fragment"],
        runs["prepare_batch_of_fragments/cpu"]["ms_per_fragment"],
    )
    naive = runs["paper_mode"]["ms_per_pair"]
    return [
        f"| | GPU, ms | naive on the GPU, ms | CPU, {context['num_cpus']} cores, ms |",
        "| --- | --- | --- | --- |",
        f"| a prepared pair, `loopsmart`, in a batch | {batch:.2f} | {naive:.1f} ({naive / batch:.0f} x) | {cpu:.1f} ({cpu / batch:.0f} x) |",
        f"| a fragment prepared ({runs['prepare_batch_of_fragments/cuda']['raw_points'] / 1000:.0f}k raw points), in a batch | {fragment:.2f} | | {on_cpu:.1f} ({on_cpu / fragment:.0f} x) |",
        f"| one prepared pair alone, median | {one:.2f} | {runs['paper_mode']['ms_median']:.1f} | |",
        f"| one pair alone, from raw points in host memory to the pose, median | {whole:.2f} | | |",
        "",
        made_by(context),
    ]


def pipeline():
    context, runs = benchmarks()
    rows = [
        (
            "a prepared pair, `loopsmart`, in a batch of 2,090",
            "align_many/cuda_loopsmart/11",
            "ms_per_pair",
            0.10,
        ),
        (
            "the same, every quadruple scored that passes the polygon test",
            "align_many/cuda_loopsmart_all/11",
            "ms_per_pair",
            None,
        ),
        ("a pair in the naive mode, one after the other", "paper_mode", "ms_per_pair", None),
        (
            "a prepared pair on the CPU of the host, in a batch of 190",
            "align_many/cpu_loopsmart/1",
            "ms_per_pair",
            None,
        ),
        (
            "a prepared pair, `default`, in a batch of 2,090",
            "align_many/cuda_default/11",
            "ms_per_pair",
            0.4,
        ),
        (
            "one prepared pair alone, `loopsmart`, median of 190",
            "align_one/cuda_loopsmart",
            "ms_median",
            0.4,
        ),
        (
            "one prepared pair alone, `default`, median of 190",
            "align_one/cuda_default",
            "ms_median",
            2.0,
        ),
        (
            "one pair alone, raw points in host memory to the pose, median of 100",
            "raw_to_pose/cuda_loopsmart",
            "ms_median",
            3.0,
        ),
        (
            "a fragment prepared, in a batch of 20",
            "prepare_batch_of_fragments/cuda",
            "ms_per_fragment",
            0.5,
        ),
        (
            "a fragment prepared for `default`, in a batch of 20",
            "prepare_batch_of_fragments/cuda_default",
            "ms_per_fragment",
            None,
        ),
        ("a fragment prepared alone", "prepare_one_fragment/cuda", "ms_per_fragment", 1.5),
        (
            "the same on the CPU, in a batch of 20",
            "prepare_batch_of_fragments/cpu",
            "ms_per_fragment",
            None,
        ),
        (
            "207 fragments and 5,280 pairs from raw points, cold",
            "redwood_sized/cuda",
            "real_time",
            1500.0,
        ),
    ]
    out = ["| | ms | goal | ms / goal |", "| --- | --- | --- | --- |"]
    for text, name, key, goal in rows:
        value = runs[name][key]
        out.append(
            f"| {text} | {value:.3g} | {'' if goal is None else f'{goal:g}'} | {'' if goal is None else f'{value / goal:.2f}'} |"
        )
    return out + ["", made_by(context)]


def pipeline_house():
    context, runs = benchmarks("pipeline_house_a.json")
    stages = ("match", "propose", "rank", "refine", "verify")
    out = ["| | ms | " + " | ".join(stages) + " |", "| --- | --- |" + " --- |" * len(stages)]
    for text, name, key in (
        (
            "a prepared pair, `default`, in a batch of 13,475",
            "align_many/cuda_default/11",
            "ms_per_pair",
        ),
        (
            "one prepared pair alone, `default`, median of 190",
            "align_one/cuda_default",
            "ms_median",
        ),
        (
            "a prepared pair, `loopsmart`, in a batch of 13,475",
            "align_many/cuda_loopsmart/11",
            "ms_per_pair",
        ),
        (
            "one prepared pair alone, `loopsmart`, median of 190",
            "align_one/cuda_loopsmart",
            "ms_median",
        ),
    ):
        run = runs[name]
        out.append(
            f"| {text} | {run[key]:.2f} | "
            + " | ".join(f"{run['ms_' + stage]:.3f}" for stage in stages)
            + " |"
        )
    out.append(
        f"| a fragment prepared for `default`, in a batch of 50 | {runs['prepare_batch_of_fragments/cuda_default']['ms_per_fragment']:.2f} | | | | | |"
    )
    return out + [
        "",
        f"{context['scene']}, {runs['align_many/cuda_default/11']['points']:,.0f} points a fragment. Made by `gpureg_pipeline_bench` with"
        f" `GPUREG_BENCH_SCENE` at commit {context['commit']} on an {context['gpu']} and {context['num_cpus']} cores of its host.",
    ]


def pipeline_steps():
    steps = load("pipeline_steps.json")["steps"]
    cell = lambda step, scene: f"{step[scene]:.2f}" if scene in step else ""  # noqa: E731
    return [
        "| | commit | red kitchen | house |",
        "| --- | --- | --- | --- |",
        *[
            f"| {s['step']} | {s['commit']} | {cell(s, 'red kitchen')} | {cell(s, 'house/A')} |"
            for s in steps
        ],
    ]


def large_maps():
    record = load("large_maps.json")
    rows = [
        "| points of the map | viewpoints given | preparation, s | of it its stages on the device, s | alignment, s | of it the match of features, s | device memory, GiB | confidence | error, m |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for run in record["maps"]:
        rows.append(
            f"| {run['points']:,} | {run['viewpoints'] or 'none'} | {run['prepare_s']:.1f} | {sum(run['prepare_ms'].values()) / 1e3:.2f} | {run['align_s']:.2f} "
            f"| {run['match_ms'] / 1e3:.2f} | {run['device_in_use_gib']:.1f} | {run['confidence']:.3f} | {run['error_m']:.2f} |"
        )
    return [
        *rows,
        "",
        f"Made by `{record['command']}` at commit {record['commit']} on an {record['gpu']} and {record['num_cpus']} cores of its host.",
    ]


def devices():
    context, runs = benchmarks("pipeline_two_devices.json")
    one = runs["redwood_sized/cuda"]
    out = [
        "| devices | cold, ms | speed-up | of it preparation, ms | warm, ms | speed-up | memory per device, GiB |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for run in [one] + (
        [runs["redwood_sized/cuda_all"]] if int(context.get("gpus", 1)) > 1 else []
    ):
        out.append(
            f"| {run['devices']:.0f} | {run['real_time']:.0f} | {one['real_time'] / run['real_time']:.2f} x | {run['ms_prepare']:.0f} | "
            f"{run['ms_warm']:.0f} | {one['ms_warm'] / run['ms_warm']:.2f} x | {run['GiB_per_device']:.1f} |"
        )
    return out + [
        "",
        f"Made by `scripts/gpu_check` at commit {context['commit']} on {context['gpu']}.",
    ]


def threads():
    """Single calls of several threads that share a context."""
    context, runs = benchmarks()
    rows = [runs[f"align_from_threads/cuda_default/{n}"] for n in (1, 2, 4, 8)]
    return [
        "| threads | ms per pair | gain |",
        "| --- | --- | --- |",
        *[
            f"| {n} | {run['ms_per_pair']:.2f} | {rows[0]['ms_per_pair'] / run['ms_per_pair']:.2f} x |"
            for n, run in zip((1, 2, 4, 8), rows, strict=True)
        ],
        "",
        made_by(context),
    ]


def scaling():
    """Measured times beside those predicted from the second row by the number of operations: feature
    products, and tests of points.
    """
    context, runs = benchmarks()
    sizes = [runs[f"points_per_cloud/{n}"] for n in (1000, 5000, 20000, 100000)]
    base = sizes[1]
    out = [
        "| points per cloud | hypotheses scored | match, ms | propose, ms | rank, ms | pair, ms | pair by the operations, ms |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for run in sizes:
        points, survivors = run["points"] / base["points"], run["survivors"] / base["survivors"]
        rest = base["ms_per_pair"] - base["ms_match"] - base["ms_rank"]
        predicted = base["ms_match"] * points**2 + base["ms_rank"] * survivors * points + rest
        out.append(
            f"| {run['points']:,.0f} | {run['survivors']:,.0f} | {run['ms_match']:.3f} | {run['ms_propose']:.3f} | {run['ms_rank']:.2f} | "
            f"{run['ms_per_pair']:.2f} | {predicted:.2f} |"
        )
    out += ["", "| raw points | prepared points | fragment, ms |", "| --- | --- | --- |"]
    out += [
        f"| {n:,} | {runs[f'raw_points/{n}']['points']:,.0f} | {runs[f'raw_points/{n}']['ms_per_fragment']:.2f} |"
        for n in (100000, 300000, 1000000)
    ]
    out += [
        "",
        "| fragments, each with four others | ms | ms per fragment | device memory, GiB |",
        "| --- | --- | --- | --- |",
    ]
    for n in (10, 50, 200, 500, 2000, 10000):
        run = runs[f"many_fragments/{n}"]
        out.append(
            f"| {n:,} | {run['real_time']:.0f} | {run['ms_per_fragment']:.2f} | {run['GiB_per_device']:.1f} |"
        )
    return out + ["", made_by(context)]


def pair_by_default():
    context, runs = benchmarks()
    out = [
        "| points per cloud | one pair, ms | match, ms | refine, ms | verify, ms | device memory, GiB |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for n in (1000, 5000, 20000, 100000):
        run = runs[f"pair_by_default/{n}"]
        out.append(
            f"| {run['points']:,.0f} | {run['ms_per_pair']:.2f} | {run['ms_match']:.2f} | {run['ms_refine']:.2f} | {run['ms_verify']:.2f} | {run['GiB_per_device']:.2f} |"
        )
    return out + ["", made_by(context)]


def floors():
    context, runs = benchmarks()
    run = runs["align_many/cuda_loopsmart/11"]
    points, survivors = run["points"], run["survivors"]
    instructions = 29.6e12
    floor = {
        "match": 1.25 * points**2 * 32 * 2 / 990e12 * 1e3,
        "propose": (4e6 * 100 + survivors * 2500) / instructions * 1e3,
        "rank": survivors * points * 0.75 * 36 / instructions * 1e3,
    }
    counted = {
        "match": "32-dimensional products of all pairs of features, and of a fourth of them again",
        "propose": "100 instructions per quadruple, 2,500 per survivor",
        "rank": "36 instructions for each of three quarters of the point tests",
    }
    out = [
        "| stage | ms per pair | floor, ms | ratio | operations of the floor |",
        "| --- | --- | --- | --- | --- |",
    ]
    for stage, least in floor.items():
        ms = run["ms_" + stage]
        out.append(f"| {stage} | {ms:.4f} | {least:.4f} | {ms / least:.1f} | {counted[stage]} |")
    rest = run["ms_verify"] + run["ms_refine"]
    return [*out, f"| refine, verify | {rest:.4f} | | | |"]


TABLES = {
    "speed": speed,
    "pipeline": pipeline,
    "pipeline_house": pipeline_house,
    "pipeline_steps": pipeline_steps,
    "devices": devices,
    "threads": threads,
    "large_maps": large_maps,
    "scaling": scaling,
    "pair_by_default": pair_by_default,
    "floors": floors,
}
