# SPDX-License-Identifier: BSD-3-Clause
"""The plots of the report, as SVG inside an <img>: one file, nothing to fetch."""

import base64
import io

import matplotlib

matplotlib.use("Agg")
import itertools

import matplotlib.pyplot as plt

# gpureg in strong colours, peers in paler ones, each always in its own.
OWN = {"gpureg_default": "#1464c0", "gpureg_loopsmart": "#e08a00"}
PEERS = {
    "open3d_ransac": "#6aa66a",
    "open3d_fgr": "#a3c585",
    "pcl_prerejective": "#b07aa1",
    "kiss_matcher_005": "#d1605e",
    "kiss_matcher_010": "#eba3a0",
    "sc2_pcr": "#7f7f7f",
    "teaser": "#8c6d4f",
    "loopsmart_open3d_icp": "#f2cf7a",
    "loopsmart_small_gicp": "#c9a83f",
}
GREY = "#555555"
plt.rcParams.update(
    {
        "font.size": 11,
        "font.family": "DejaVu Sans",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": "#999999",
        "axes.grid": True,
        "grid.color": "#e6e6e0",
        "grid.linewidth": 0.8,
        "axes.axisbelow": True,
        "svg.fonttype": "path",
        "svg.hashsalt": "gpureg",
        "axes.titlesize": 12,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
    }
)


def color(name):
    for own, value in OWN.items():
        if name.startswith(own):
            return value
    return PEERS.get(name, GREY)


def drawn(figure, alt):
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", bbox_inches="tight", metadata={"Date": None})
    plt.close(figure)
    return f'<img class="plot" alt="{alt}" src="data:image/svg+xml;base64,{base64.b64encode(stream.getvalue()).decode()}">'


def curves(entries, rule, title):
    """entries: (name, label, scores by rule, with curve)."""
    figure, axes = plt.subplots(figsize=(6.2, 4.4))
    shown, lowest = False, 100
    for name, label, scores in entries:
        if not scores.get(rule) or not scores[rule].get("curve"):
            continue
        shown = True
        points = scores[rule]["curve"]
        own = name.startswith("gpureg")
        lowest = min([lowest] + [100 * p for r, p in points if r > 0])
        axes.plot(
            [100 * r for r, _ in points],
            [100 * p for _, p in points],
            color=color(name),
            linewidth=2.6 if own else 1.5,
            label=label,
            zorder=3 if own else 2,
        )
        axes.plot(
            [100 * scores[rule]["recall"]],
            [100 * scores[rule]["precision"]],
            "o",
            color=color(name),
            markersize=6,
            zorder=4,
        )
    lowest = max(0, 10 * int(lowest // 10) - 20)  # room for the legend
    axes.set(
        xlim=(0, 101),
        ylim=(lowest, 100 + (100 - lowest) * 0.02),
        xlabel="recall, %",
        ylabel="precision, %",
        title=title,
    )
    axes.legend(loc="lower left", fontsize=8.5, framealpha=0.9)
    if not shown:
        plt.close(figure)
        return ""
    return drawn(figure, title)


def time_bars(entries, title):
    """entries: (name, label, [(part, milliseconds)]): one bar each, on a log scale."""
    figure, axes = plt.subplots(figsize=(6.2, 0.42 * len(entries) + 1.1))
    for k, (name, _label, value) in enumerate(entries):
        axes.barh(k, value, color=color(name), height=0.66)
        axes.text(
            value * 1.08,
            k,
            f"{value:,.0f} ms" if value >= 100 else f"{value:.3g} ms",
            va="center",
            fontsize=9.5,
            color="#333333",
        )
    axes.set_yticks(range(len(entries)), [label for _, label, _ in entries])
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlim(min(v for *_, v in entries) / 2, max(v for *_, v in entries) * 6)
    axes.set(xlabel="milliseconds, log scale", title=title)
    axes.grid(axis="y", visible=False)
    return drawn(figure, title)


def recall_by_overlap(entries, title):
    figure, axes = plt.subplots(figsize=(6.2, 4.0))
    counts = None
    for name, label, table in entries:
        if not table:
            continue
        edges, pairs = table["edges"], table["pairs"]
        known = [k for k in range(len(pairs)) if pairs[k]]
        own = name.startswith("gpureg")
        axes.plot(
            known,
            [100 * table["reported_right"][k] / pairs[k] for k in known],
            "o-",
            color=color(name),
            linewidth=2.6 if own else 1.5,
            markersize=5,
            label=label,
            zorder=3 if own else 2,
        )
        counts = [
            (k, f"{100 * edges[k]:.0f}-{100 * edges[k + 1]:.0f}\n{pairs[k]} pairs") for k in known
        ]
    if counts is None:
        plt.close(figure)
        return ""
    axes.set_xticks([x for x, _ in counts], [words for _, words in counts], fontsize=9)
    axes.set(ylim=(0, 103), xlabel="overlap of the pair, %", ylabel="recall, %", title=title)
    axes.legend(loc="lower right", fontsize=8.5, framealpha=0.9)
    return drawn(figure, title)


def rotation_histogram(entries, title):
    entries = [
        (name, label, table) for name, label, table in entries if table and sum(table["counts"])
    ]
    if not entries:
        return ""
    figure, axes = plt.subplots(figsize=(6.2, 3.4))
    edges = entries[0][2]["edges"]
    width = 0.8 / len(entries)
    for k, (name, label, table) in enumerate(entries):
        axes.bar(
            [b + (k - (len(entries) - 1) / 2) * width for b in range(len(edges) - 1)],
            table["counts"],
            width,
            color=color(name),
            label=label,
        )
    axes.set_xticks(
        range(len(edges) - 1), [f"{a}-{b}" for a, b in itertools.pairwise(edges)], fontsize=9
    )
    axes.set(
        xlabel="rotation error of the wrong best candidates of true pairs, degrees",
        ylabel="pairs",
        title=title,
    )
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.set_ylim(
        top=1.3 * max(max(table["counts"]) for *_, table in entries)
    )  # room for the legend
    axes.grid(axis="x", visible=False)
    axes.legend(fontsize=8.5)
    return drawn(figure, title)


def cost(entries, title):
    """entries: (name, label, [(points of both clouds, ms)])."""
    figure, axes = plt.subplots(figsize=(6.2, 3.8))
    for name, label, points in entries:
        axes.plot(
            [p for p, _ in points],
            [t for _, t in points],
            ".",
            color=color(name),
            markersize=4,
            alpha=0.7,
            label=label,
        )
    axes.set(
        xlabel="points of both clouds, after preparation", ylabel="milliseconds a pair", title=title
    )
    axes.set_ylim(bottom=0)
    axes.legend(fontsize=8.5)
    return drawn(figure, title)


def gpu_cost(rows, title):
    """rows: (points a cloud, milliseconds)."""
    figure, axes = plt.subplots(figsize=(6.2, 3.8))
    axes.plot(
        [n for n, _ in rows], [t for _, t in rows], "o-", color=OWN["gpureg_loopsmart"], linewidth=2
    )
    for n, t in rows:
        axes.annotate(
            f"{t:.3g} ms", (n, t), textcoords="offset points", xytext=(6, -12), fontsize=9
        )
    axes.set(
        xlabel="points a cloud",
        ylabel="milliseconds a pair",
        title=title,
        xscale="log",
        yscale="log",
    )
    return drawn(figure, title)
