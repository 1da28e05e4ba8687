# SPDX-License-Identifier: BSD-3-Clause
"""Tables beside other methods."""

from tables.records import benchmarks, load, mean, percent, source

PEER_SCENES = {"peers_redkitchen.json": "red kitchen", "peers_house_a.json": "house A"}


def peer_label(entry):
    """Name and version; a record names KISS-Matcher with its voxel size."""
    label, version = entry["label"], entry["version"]
    if label.startswith("gpureg"):
        return label
    if label == "SC2-PCR's scheme":
        return "SC2-PCR, our NumPy version"
    if label.startswith("KISS-Matcher, "):
        program, voxel = label.split(", ")
        return f"{program} {version}, voxel {voxel}"
    return f"{label} {version}"


def made_with(record):
    """A record whose parts were measured at several commits names them all."""
    commits = sorted({entry["commit"].rstrip("+") for entry in record["methods"].values()})
    return f"Made by `{record['command']}` at commit {', '.join(commits)} on {record['processor']}."


def peers():
    """Both scenes side by side; methods of global registration only."""
    records = [load(name) for name in PEER_SCENES]
    rows = [
        "| method | "
        + " | ".join(f"{scene}: correct, % | R@P95, % | ms" for scene in PEER_SCENES.values())
        + " |",
        "| --- |" + " --- | --- | --- |" * len(records),
    ]
    for name, entry in records[0]["methods"].items():
        if entry["refines"]:
            continue
        cells = []
        for record in records:
            own = record["methods"].get(name)
            if own is None:
                cells += ["", "", ""]
                continue
            cells += [
                percent(own["strict"]["raw_recall"]),
                percent(own["geometric"]["recall_at_precision"]["95"]),
                f"{own['processor_ms_per_pair']:.0f}",
            ]
        rows.append(f"| {peer_label(entry)} | " + " | ".join(cells) + " |")
    for preset, times in device_times():
        cells = " | ".join(f"same | same | {ms:.2f}" for ms in times)
        rows.append(f"| gpureg `{preset}`, NVIDIA H200 | {cells} |")
    return rows


def device_times():
    """Preset, and ms per pair in a batch on each scene."""
    devices = [benchmarks(), benchmarks("pipeline_h200_house_a.json")]
    return [
        (preset, [runs[f"align_many/cuda_{preset}/11"]["ms_per_pair"] for _, runs in devices])
        for preset in ("default", "loopsmart")
    ]


def peers_device():
    """Times of gpureg on a device, on the same scenes."""
    devices = [benchmarks(), benchmarks("pipeline_h200_house_a.json")]
    scenes = list(PEER_SCENES.values())
    rows = [
        f"| method | {' | '.join(f'{scene}: ms per pair in a batch' for scene in scenes)} |",
        "| --- |" + " --- |" * len(scenes),
    ]
    for preset, times in device_times():
        rows.append(f"| gpureg `{preset}` | {' | '.join(f'{ms:.2f}' for ms in times)} |")
    commits = ", ".join(sorted({context["commit"] for context, _ in devices}))
    gpu = devices[0][0]["gpu"]
    return [*rows, "", f"Made by `gpureg_pipeline_bench` at commit {commits} on an {gpu}."]


def peers_of(file):
    record = load(file)
    base = record["methods"]["gpureg_default"]["processor_ms_per_pair"]
    rows = [
        "| method | correct, % | recall / precision, % | R@P95, % | AP, % | geometric R@P95, % | ms per fragment | ms per pair | CPU ms per pair | relative | peak MiB |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for entry in record["methods"].values():
        strict = entry["strict"]
        prepared = f"{entry['ms_per_fragment']:.0f}" if entry["ms_per_fragment"] >= 0.5 else "-"
        rows.append(
            f"| {peer_label(entry)} | {percent(strict['raw_recall'])} | {percent(strict['recall'])} / {percent(strict['precision'])} | "
            f"{percent(strict['recall_at_precision']['95'])} | {percent(strict['average_precision'])} | {percent(entry['geometric']['recall_at_precision']['95'])} | "
            f"{prepared} | {entry['ms_per_pair']:.0f} | {entry['processor_ms_per_pair']:.0f} | {entry['processor_ms_per_pair'] / base:.2f} | {entry['peak_memory_mib']} |"
        )
    return rows + ["", f"{record['chosen'][0].upper()}{record['chosen'][1:]}.", made_with(record)]


def peers_redkitchen():
    return peers_of("peers_redkitchen.json")


def peers_house():
    return peers_of("peers_house_a.json")


def peer_parameters():
    record = load("peers_redkitchen.json")
    return ["| method | parameters | reported from |", "| --- | --- | --- |"] + [
        f"| {peer_label(e)} | {e['parameters']} | {'its own confidence' if e['threshold'] is None and not e['refines'] else '' if e['threshold'] is None else format(e['threshold'], 'g')} |"
        for e in record["methods"].values()
    ]


def fgr():
    record = load("fgr.json")
    rows = ["| method | RMSE, mean / max | pairs below .01 / .02 / .05 |", "| --- | --- | --- |"]
    for entry in record["methods"].values():
        lost = f"; {entry['without_pose']} without a pose" if entry["without_pose"] else ""
        rows.append(
            f"| {peer_label(entry)} | {entry['rmse_mean']:.4f} / {entry['rmse_max']:.4f} | "
            + " / ".join(f"{entry[f'below_{b}']:.2f}" for b in ("0.01", "0.02", "0.05"))
            + f"{lost} |"
        )
    for row in record["published"]:
        shares = " / ".join("-" if share is None else f"{share:.2f}" for share in row["below"])
        rows.append(
            f"| *{row['label']}* | {row['rmse_mean']:.4f} / {row['rmse_max']:.4f} | {shares} |"
        )
    return rows + [
        f"| *(the ground truth itself)* | {record['rmse_of_truth']:.4f} | |",
        "",
        source(record) + ".",
    ]


def redwood():
    """The paper's table of the committed record."""
    record = load("redwood.json")
    names = [scene["name"] for scene in record["scenes"]]
    rows = [
        "| method | "
        + " | ".join(f"{name}: recall / precision, %" for name in names)
        + " | geometric precision, % | registration recall, 3DMatch / 3DLoMatch, % |",
        "| --- |" + " --- |" * (len(names) + 2),
    ]
    for method in record["methods"]:
        means = [method["scenes"][name]["mean"] for name in names]

        def pm(entry):
            return percent(entry["mean"]) + (
                f" ± {100 * entry['stdev']:.1f}" if entry["stdev"] else ""
            )

        recalls = {log: value for m in means for log, value in m["registration_recall"].items()}
        registration = " / ".join(
            percent(recalls[log]["mean"]) if log in recalls else "-"
            for log in ("official_3dmatch_gt.log", "official_3dlomatch_gt.log")
        )
        rows.append(
            f"| {method['label']} | "
            + " | ".join(
                f"{pm(m['strict']['recall'])} / {pm(m['strict']['precision'])}" for m in means
            )
            + f" | {percent(mean(m['geometric']['precision']['mean'] for m in means))} | {registration} |"
        )
    return rows + ["", source(record) + f"; seeds {', '.join(map(str, record['seeds']))}."]


TABLES = {
    "peers": peers,
    "peers_device": peers_device,
    "peers_redkitchen": peers_redkitchen,
    "peers_house": peers_house,
    "peer_parameters": peer_parameters,
    "fgr": fgr,
    "redwood": redwood,
}
