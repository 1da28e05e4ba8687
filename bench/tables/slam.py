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


def millimetres(values):
    shown = sorted({f"{1000 * value:.1f}" for value in values if value is not None}, key=float)
    return " to ".join(shown if len(shown) < 2 else [shown[0], shown[-1]]) or "-"


def loops(rows, kind):
    return ", ".join(sorted({f"{r[f'{kind}_loops']} / {r[f'false_{kind}_loops']}" for r in rows}))


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
            seeds = f" ({len(rows)} seeds)" if len(rows) > 1 else ""
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


TABLES = {"slam": slam}
