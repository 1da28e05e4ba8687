# SPDX-License-Identifier: BSD-3-Clause
"""Tables of slam_demo."""

from tables.records import load

ROWS = (
    "odometry",
    "+ image loops",
    "+ dense loops",
    "+ bundle adjustment",
    "without image loops",
)
IN_ONE_RUN = ("in one run", "in one run, LoopSmart", "beside tracking")


def millimetres(values):
    """One value for each seed."""
    return "; ".join(f"{1000 * value:.1f}" for value in values if value is not None) or "-"


def seeds(rows):
    return f" (seeds {', '.join(str(row['seed']) for row in rows)})" if len(rows) > 1 else ""


def loops(rows, kind):
    return "; ".join(f"{r[f'{kind}_loops']} / {r[f'false_{kind}_loops']}" for r in rows)


def about(sequence):
    text = f"{sequence['name']}: {sequence['frames']} frames"
    if sequence["path_m"]:
        text += f", {sequence['path_m']:.0f} m"
    if "--depth-noise" in (sequence["generated_by"] or ""):
        text += f", depth noise x {sequence['generated_by'].split('--depth-noise ')[1].split()[0]}"
    return text


def slam():
    table = [
        "| sequence | row | frames in one world | ATE RMSE in mm | surface: mean, median in mm | dense loops: accepted / false | image loops: accepted / false |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for sequence in load("slam_demo.json")["sequences"]:
        for name in ROWS:
            rows = [row for row in sequence["rows"] if row["row"] == name]
            if not rows:
                continue
            surface = ", ".join(
                millimetres(row[f"surface_{kind}_m"] for row in rows) for kind in ("mean", "median")
            )
            table.append(
                f"| {about(sequence)} | {name}{seeds(rows)} | {rows[0]['poses']} | {millimetres(row['ate_m'] for row in rows)} | {surface} "
                f"| {loops(rows, 'dense')} | {loops(rows, 'image')} |"
            )
    return table


def figures(rows, key, digits=0):
    values = [row.get(key) for row in rows]
    return "; ".join(f"{v:.{digits}f}" for v in values if v is not None) or "-"


def slam_one_run():
    """Tracking and loops together; tracking alone over the same frames."""
    table = [
        "| sequence | row | frames in one world | ATE RMSE in mm: tracking, final | surface: mean in mm | dense loops: accepted / false | keyframes a point | correlation of the offsets of depth | frames/s | longest wait, ms |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for sequence in load("slam_demo.json")["sequences"]:
        for name in IN_ONE_RUN:
            rows = [row for row in sequence["rows"] if row["row"] == name]
            if not rows:
                continue
            speed = "; ".join(f"{sequence['frames'] / row['seconds']:.1f}" for row in rows)
            wait = figures(rows, "longest_wait_ms") if name == "beside tracking" else "-"
            ate = [millimetres(row.get(key) for row in rows) for key in ("odometry_ate_m", "ate_m")]
            table.append(
                f"| {about(sequence)} | {name}{seeds(rows)} | {figures(rows, 'poses')} | {ate[0]}, {ate[1]} "
                f"| {millimetres(row['surface_mean_m'] for row in rows)} | {loops(rows, 'dense')} | {figures(rows, 'keyframes_per_point', 1)} "
                f"| {figures(rows, 'calibration_correlation', 3)} | {speed} | {wait} |"
            )
    return table


def slam_short():
    """In one run: tracking of that run beside its result, over the same frames."""
    table = [
        "| sequence | frames | tracking: ATE RMSE, mm | final | surface, mm |",
        "| --- | --- | --- | --- | --- |",
    ]
    for sequence in load("slam_demo.json")["sequences"]:
        rows = [row for row in sequence["rows"] if row["row"] == "in one run"]
        generated = sequence["generated_by"]
        if not rows or (generated and "--depth-noise" not in generated):
            continue  # nominal noise: in the notes
        ate = [millimetres(row[key] for row in rows) for key in ("odometry_ate_m", "ate_m")]
        table.append(
            f"| {sequence['name']} | {rows[0]['poses']} of {sequence['frames']} | {ate[0]} | {ate[1]} "
            f"| {millimetres(row['surface_mean_m'] for row in rows)} |"
        )
    return table


def slam_published():
    """Real sequences: errors of every run beside those that others publish."""
    table = [
        "| sequence | system | ATE RMSE in mm | input | figure given by | source |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    published = load("slam_published.json")["figures"]
    for sequence in load("slam_demo.json")["sequences"]:
        name = sequence["name"]
        if name.split("_focal")[0] not in {figure["sequence"] for figure in published}:
            continue
        for row_name in IN_ONE_RUN:
            rows = [row for row in sequence["rows"] if row["row"] == row_name]
            if rows:
                table.append(
                    f"| {name} | **slam_demo**, {row_name}{seeds(rows)} | {millimetres(row['ate_m'] for row in rows)} "
                    "| RGB-D | us | slam_demo.json |"
                )
        for figure in published:
            if figure["sequence"] != name:
                continue
            error, given, by = figure.get("state"), "", ""
            if figure["ate_m"] is not None:
                error = f"{1000 * figure['ate_m']:.0f}"
                given = figure["input"]
                if figure["alignment"] == "with scale":
                    given += ", scale aligned"
                by = "its authors" if figure["own_paper"] else "others"
            table.append(
                f"| {name} | {figure['system']} | {error} | {given} | {by} | {figure['paper']}, {figure['place']} |"
            )
    return table


def slam_published_papers():
    table = ["| source | paper | what was read |", "| --- | --- | --- |"]
    for name, paper in load("slam_published.json")["papers"].items():
        title = f"[{paper['title']}]({paper['address']})" if paper["address"] else paper["title"]
        words = [paper["authors"], title, paper["venue"], paper["year"] and str(paper["year"])]
        table.append(f"| {name} | {', '.join(filter(None, words))} | {paper['read']} |")
    return table


TABLES = {
    "slam": slam,
    "slam_one_run": slam_one_run,
    "slam_short": slam_short,
    "slam_published": slam_published,
    "slam_published_papers": slam_published_papers,
}
