# SPDX-License-Identifier: BSD-3-Clause
"""Tables of loops that the closer finds by itself."""

from tables.records import load

NAMES = {"house_A": "house A", "house_B": "house B", "hospital_E": "hospital E"}


def online():
    rows = [
        "| scene | way | drift per metre | RMSE of odometry | of the closer | accepted | correct | retracted on the way |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    return rows + [
        f"| {NAMES[row['scene']]} | {row['metres'] / (1 + row['drift']):.0f} m | {100 * row['drift']:.0f} %, {10 * row['drift']:g}° | "
        f"{100 * row['odometry_rmse']:.1f} cm | {100 * row['rmse']:.1f} cm | {row['accepted']} | {row['correct']} | {row['retracted']} |"
        for row in load("loop_closure_online.json")["rows"]
    ]


def sessions():
    rows = [
        "| first session | second session | registered | confident between them | accepted | one frame | RMSE |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in load("sessions.json")["rows"]:
        first, second = (NAMES[scene] for scene in row["sessions"])
        if first == second:
            first, second = first + ", even fragments", second + ", odd fragments"
        rmse = f"{100 * row['rmse']:.1f} cm" if "rmse" in row else ""
        rows.append(
            f"| {first} | {second} | {row['registered']} | {row['confident_between']} | {row['accepted_between']} | "
            f"{'yes' if row['merged'] else 'no'} | {rmse} |"
        )
    return rows


METHODS = {
    "default": "default",
    "drift_stated": "default, drift stated",
    "loopsmart": "`loopsmart()`",
    "kiss_slam_rule": "KISS-SLAM's rule",
    "none": "none",
}


def drift():
    """Half of the loops false, confidences as registered."""
    rows = [
        "| scene | loops | drift, m | per metre | method | precision | recall | RMSE, m | true loops alone, m |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    return rows + [
        f"| {row['scene'].replace('_', ' ')} | {row['loops']} | {row['drift']:g} | {100 * row['per_metre']:.0f} % | "
        f"{METHODS[row['method']]} | {100 * row['precision']:.1f} % | {100 * row['recall']:.1f} % | {row['rmse']:.2f} | "
        f"{row['rmse_true_loops']:.2f} |"
        for row in load("loop_closure.json")["rows"]
    ]


def pose_graphs():
    """Largest ATE of the seeds, metres, for each kind and share of false loops and each method."""
    runs = list(load("pose_graph.json")["runs"].values())
    methods = sorted({run["method"] for run in runs})
    table = [
        f"| nodes | kind | false | {' | '.join(methods)} |",
        "|---" * (3 + len(methods)) + "|",
    ]
    for nodes, kind, percent in sorted({(r["nodes"], r["kind"], r["percent"]) for r in runs}):
        cells = []
        for method in methods:
            key = (nodes, kind, percent, method)
            of = [r for r in runs if (r["nodes"], r["kind"], r["percent"], r["method"]) == key]
            done = [run for run in of if "ate" in run]
            cell = f"{max(run['ate'] for run in done):.3f}" if done else "-"
            false = sum(run["false_accepted"] for run in done)
            cell += f", {false} false" if false else ""
            if of and len(done) < len(of):
                cell += f" ({len(of) - len(done)} of {len(of)} failed)"
            cells.append(cell)
        table.append(f"| {nodes} | {kind} | {percent} % | {' | '.join(cells)} |")
    return table


def noise():
    rows = [
        "| scene | noise of a step | odometry | closer | told the covariance | accepted | wrong |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    groups = {}
    for row in load("loop_closure_noise.json")["rows"]:
        groups.setdefault((row["scene"], *row["noise"]), []).append(row)
    for (scene, share, degrees), group in groups.items():
        odometry, own, told = (
            f"{100 * sum(row[key] for row in group) / len(group):.1f} cm"
            for key in ("odometry_rmse", "rmse", "rmse_with_covariance")
        )
        accepted = sum(row["accepted"] for row in group) / len(group)
        wrong = sum(row["wrong"] for row in group)
        rows.append(
            f"| {NAMES.get(scene, scene.replace('_', ' '))} | {100 * share:g} %, {degrees:g}° | {odometry} | {own} | {told} | "
            f"{accepted:.0f} | {wrong} |"
        )
    return rows


TABLES = {
    "loops_noise": noise,
    "loops_online": online,
    "loops_sessions": sessions,
    "loops_drift": drift,
    "pose_graphs": pose_graphs,
}
