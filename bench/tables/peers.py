# SPDX-License-Identifier: BSD-3-Clause
"""Tables beside other methods."""

import statistics

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


# Global registration; benchmarks.md has the others, too.
SHORT = (
    "gpureg_default",
    "gpureg_loopsmart",
    "open3d_ransac",
    "kiss_matcher_005",
    "kiss_matcher_010",
)


def peers():
    """Both scenes side by side, a selection of methods."""
    records = [load(name) for name in PEER_SCENES]
    rows = [
        "| method | "
        + " | ".join(f"{scene}: correct, % | R@P95, % | ms" for scene in PEER_SCENES.values())
        + " |",
        "| --- |" + " --- | --- | --- |" * len(records),
    ]
    for name, entry in records[0]["methods"].items():
        if name not in SHORT:
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
    gpu = " ".join(benchmarks()[0]["gpu"].split()[:2])
    for preset, times in device_times():
        if preset != "default":
            continue
        cells = " | ".join(f"same | same | {ms:.2f}" for ms in times)
        rows.append(f"| gpureg `{preset}`, {gpu} | {cells} |")
    return rows


# Kinds of data whose places do not repeat.
DISTINCT = ("bookstore", "generated house", "hall", "hospital", "house", "kitchen", "objects")
DISTINCT += ("street",)


def headline():
    """The sentences of the README's first screen."""
    rooms, runs = load("peers_redkitchen.json")["methods"], load("confidence.json")["runs"]

    def found(name):
        own = rooms[name]
        return (
            f"{100 * own['strict']['raw_recall']:.0f} %",
            f"{own['processor_ms_per_pair']:.0f} ms",
        )

    (share, time), (ransac, slow), (kiss, slower) = map(
        found, ("gpureg_default", "open3d_ransac", "kiss_matcher_005")
    )
    pairs = rooms["gpureg_default"]["strict"]["ground_truth"]
    distinct = [run for run in runs if run["kind"] in DISTINCT and run["viewpoints"] == "known"]
    sure, right = (
        sum(run[key] for run in distinct) for key in ("above_0.9", "right_above_0.9_count")
    )
    return [
        f"Of {pairs} pairs of a real room (7-Scenes red kitchen) it registers **{share}** if the camera positions are given, in **{time}** of CPU time per pair",
        f"after a preparation of each cloud; Open3D's RANSAC registers {ransac} in {slow}, KISS-Matcher {kiss} in {slower}, preparation included. **It says when it is wrong:**",
        f"of {sure:,} poses with a confidence above 0.9 in kinds of places that it was not fitted on, most of them simulated, {100 * right / sure:.1f} % are correct ([kinds](docs/accuracy.md#kinds-of-places-that-the-confidence-was-not-fitted-on); the exception are [copies of a place](#limits)).",
    ]


def device_times():
    """Preset, and ms per pair in a batch on each scene. `default` on house A is of the front, which
    was measured on the device of the kitchen.
    """
    devices = [benchmarks(), benchmarks("pipeline_house_a.json")]
    times = {
        preset: [runs[f"align_many/cuda_{preset}/11"]["ms_per_pair"] for _, runs in devices]
        for preset in ("default", "loopsmart")
    }
    times["default"][1] = statistics.median(
        row["ms"]
        for row in load("front.json")["rows"]
        if (row["scene"], row["setting"]) == ("house/A", "quality 5")
    )
    return list(times.items())


def peers_device():
    """Times of gpureg on a device, on the same scenes."""
    devices = [benchmarks(), benchmarks("pipeline_house_a.json")]
    scenes = list(PEER_SCENES.values())
    rows = [
        f"| method | {' | '.join(f'{scene}: ms per pair in a batch' for scene in scenes)} |",
        "| --- |" + " --- |" * len(scenes),
    ]
    for preset, times in device_times():
        rows.append(f"| gpureg `{preset}` | {' | '.join(f'{ms:.2f}' for ms in times)} |")
    kitchen, house = (context for context, _ in devices)
    return [
        *rows,
        "",
        f"Made by `gpureg_pipeline_bench` at commit {kitchen['commit']} on an {kitchen['gpu']}; house A by `default`: "
        f"bench/pipeline/front.py, the same device; by `loopsmart`: at commit {house['commit']} on an {house['gpu']}.",
    ]


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


SENSOR_SETS = {
    "street16": "LiDAR of 16 rings, streets, simulated",
    "street32": "LiDAR of 32 rings, streets, simulated",
    "street64": "LiDAR of 64 rings, streets, simulated",
    "kitti": "LiDAR of 64 rings, KITTI",
    "lidar": "LiDAR, sample of small_gicp",
    "street16_thinned": "16 rings, a quarter of the points",
    "street32_thinned": "32 rings, a quarter of the points",
    "street64_thinned": "64 rings, a quarter of the points",
    "kitti_thinned": "KITTI, a quarter of the points",
    "hall": "terrestrial scanner in halls, simulated",
    "dragon": "range scans, Stanford dragon",
    "cad_mesh": "CAD: scans on the models as meshes",
}
SENSOR_METHODS = {
    "gpureg": "gpureg, `auto`",
    "gpureg_up": "gpureg, `auto`, `--up`",
    "gpureg_viewpoints": "gpureg, `auto`, viewpoints given",
    "gpureg_coarse": "gpureg, 0.8 m",
    "kiss_matcher_005_auto": "KISS-Matcher, gpureg's size",
    "kiss_matcher_005_fine": "KISS-Matcher, 0.3 m",
    "kiss_matcher_005_coarse": "KISS-Matcher, 0.8 m",
    "kiss_matcher_005_double": "KISS-Matcher, twice that size",
    "open3d_ransac_auto": "Open3D RANSAC, gpureg's size",
    "open3d_ransac_fine": "Open3D RANSAC, 0.3 m",
    "open3d_ransac_coarse": "Open3D RANSAC, 0.8 m",
    "open3d_ransac_double": "Open3D RANSAC, twice that size",
}


def span(values, digits=0):
    """A value, or the range of several."""
    low, high = (f"{pick(values):.{digits}f}" for pick in (min, max))
    return low if low == high else f"{low} to {high}"


def reported_of(run):
    """Correct and false reports; symmetric poses count as with --set accept_symmetry=true."""
    return (
        run.get("reported_up_to_symmetry", run["reported"]),
        run.get("reported_up_to_symmetry_wrong", run["reported_wrong"]),
    )


def beside_peers(wanted, flips):
    """A row for each set and method; ranges are of the seeds."""
    record = load("sensor_peers.json")
    rows = [
        f"| data | true pairs, others | method | voxel size | correct |{' upside down |' if flips else ''} reported | false reports | reported before a false one | ms |",
        "| --- | --- | --- | --- | --- |"
        + (" --- |" if flips else "")
        + " --- | --- | --- | --- |",
    ]
    for name, text in SENSOR_SETS.items():
        of = record["sets"].get(name)
        if of is None or wanted(name) is False:
            continue
        first = True
        for method, label in SENSOR_METHODS.items():
            runs = of["methods"].get(method)
            if runs is None:
                continue
            which = method.rsplit("_", 1)[-1]
            sizes = of["voxel_sizes"].get(which, of["voxel_sizes"]["auto"])
            if method == "gpureg_coarse":
                sizes = [0.8]
            low, high = f"{min(sizes):g}", f"{max(sizes):g}"
            cells = [text if first else "", ""]
            if first:
                cells[1] = f"{runs[0]['pairs']}, {runs[0].get('negatives', 0)}"
            cells += [label, low if low == high else f"{low} to {high}"]
            cells.append(span([run["right"] for run in runs]))
            if flips:
                cells.append(span([run["flips"] for run in runs]) if "flips" in runs[0] else "")
            cells += [span([reported_of(run)[k] for run in runs]) for k in (0, 1)]
            cells.append(span([run["before_false"] for run in runs]))
            cells.append(f"{mean(run['ms'] for run in runs):.0f}")
            rows.append("| " + " | ".join(cells) + " |")
            first = False
    made = sorted({of["commit"].rstrip("+") for of in record["sets"].values()})
    versions = next(of["versions"] for of in record["sets"].values() if of["versions"])
    return [
        *rows,
        "",
        f"Made by `{record['command']}` at commit {', '.join(made)} on {record['processor']}; KISS-Matcher {versions['kiss_matcher_005']}, "
        f"Open3D {versions['open3d_ransac']}.",
    ]


def lidar_peers():
    return beside_peers(lambda name: name.startswith(("street", "kitti", "lidar")), True)


def object_peers():
    return beside_peers(lambda name: name in ("hall", "dragon", "cad_mesh"), False)


# kind of data: (sets, gpureg's recommended run, the recipe)
KINDS = {
    "LiDAR": (
        ("street16", "street32", "street64", "kitti", "lidar"),
        "gpureg_up",
        "`--up 0,0,1`",
    ),
    "terrestrial scanner": (("hall",), "gpureg", "none"),
    "objects, range scanner": (
        ("dragon",),
        "gpureg_viewpoints",
        "the viewpoints",
    ),
    "CAD parts and scans": (
        ("cad_mesh",),
        "gpureg_viewpoints",
        "the mesh as TARGET, `--set accept_symmetry=true`",
    ),
}


def kinds():
    """One row for each kind of data: shares of correct poses, of the peers at the voxel size that is better for them."""
    rooms, record = load("peers_redkitchen.json")["methods"], load("sensor_peers.json")["sets"]
    alone = load("viewpoints.json")["sets"]["kitchen"]["conditions"]["nothing"]
    alone = alone if isinstance(alone, list) else [alone]
    share = 100 * mean(run["right"] / run["pairs"] for run in alone)
    cells = [f"{share:.0f}"] + [
        f"{100 * rooms[name]['strict']['raw_recall']:.0f}"
        for name in ("gpureg_default", "kiss_matcher_005", "open3d_ransac")
    ]
    rows = [
        "| data | true pairs | gpureg, points alone: correct, % | gpureg, by the recipe | KISS-Matcher | Open3D RANSAC | recipe |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        f"| rooms, depth camera | {alone[0]['pairs']} | {' | '.join(cells)} | `--voxel-size 0.05`, the camera positions |",
    ]
    for kind, (sets, recipe, words) in KINDS.items():
        known = [record[name] for name in sets if name in record]
        if len(known) < len(sets):
            continue
        pairs = sum(of["methods"]["gpureg"][0]["pairs"] for of in known)

        def correct(method, known=known, pairs=pairs):
            return (
                100 * sum(mean(r["right"] for r in of["methods"][method]) for of in known) / pairs
            )

        cells = [correct("gpureg"), correct(recipe)]
        for peer in ("kiss_matcher_005", "open3d_ransac"):
            every = set.intersection(*(set(of["methods"]) for of in known))
            cells.append(max(correct(m) for m in every if m.startswith(peer)))
        rows.append(
            f"| {kind} | {pairs} | " + " | ".join(f"{c:.0f}" for c in cells) + f" | {words} |"
        )
    return rows


TABLES = {
    "headline": headline,
    "peers": peers,
    "kinds": kinds,
    "lidar_peers": lidar_peers,
    "object_peers": object_peers,
    "peers_device": peers_device,
    "peers_redkitchen": peers_redkitchen,
    "peers_house": peers_house,
    "peer_parameters": peer_parameters,
    "fgr": fgr,
    "redwood": redwood,
}
