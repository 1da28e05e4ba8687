# SPDX-License-Identifier: BSD-3-Clause
"""Tables of slam_demo."""

from tables.records import load

ROWS = (
    "odometry",
    "+ image loops",
    "+ dense loops",
    "+ bundle adjustment",
    "without image loops",
    "in one run",
    "in one run, LoopSmart",
)


def millimetres(values):
    """One value for each seed."""
    return "; ".join(f"{1000 * value:.1f}" for value in values if value is not None) or "-"


def loops(rows, kind):
    return "; ".join(f"{r[f'{kind}_loops']} / {r[f'false_{kind}_loops']}" for r in rows)


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
            seeds = f" (seeds {', '.join(str(r['seed']) for r in rows)})" if len(rows) > 1 else ""
            surface = ", ".join(
                millimetres(row[f"surface_{kind}_m"] for row in rows) for kind in ("mean", "median")
            )
            about = f"{sequence['name']}: {sequence['frames']} frames"
            if sequence["path_m"]:
                about += f", {sequence['path_m']:.0f} m"
            if "--depth-noise" in (sequence["generated_by"] or ""):
                about += f", depth noise x {sequence['generated_by'].split('--depth-noise ')[1].split()[0]}"
            table.append(
                f"| {about} | {name}{seeds} | {rows[0]['poses']} | {millimetres(row['ate_m'] for row in rows)} | {surface} "
                f"| {loops(rows, 'dense')} | {loops(rows, 'image')} |"
            )
    return table


def slam_short():
    """Tracking alone beside everything; frames differ, so both are shown."""
    table = [
        "| sequence | tracking alone: frames, ATE RMSE | with loops and adjustment: frames, ATE RMSE | surface, mean: before, after |",
        "| --- | --- | --- | --- |",
    ]
    for sequence in load("slam_demo.json")["sequences"]:
        of = {name: [r for r in sequence["rows"] if r["row"] == name] for name in ROWS}
        alone, everything = of["odometry"], of["in one run"] or of["+ bundle adjustment"]
        cells = [
            f"{rows[0]['poses']} of {sequence['frames']}, {millimetres(r['ate_m'] for r in rows)} mm"
            for rows in (alone, everything)
        ]
        surface = [millimetres(r["surface_mean_m"] for r in rows) for rows in (alone, everything)]
        table.append(
            f"| {sequence['name']}, {sequence['path_m']:.0f} m | {cells[0]} | {cells[1]} | {surface[0]} mm, {surface[1]} mm |"
        )
    return table


TABLES = {"slam": slam, "slam_short": slam_short}
