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


TABLES = {"loops_online": online, "loops_sessions": sessions}
