#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What two scans say about a pose that a map implies: the log likelihood ratio of the audit.

Evidence at correct poses of pairs that are near each other (moved by the error of a good map), at poses
that false joins imply (the most confident false pose of a pair puts the scans around one end beside those
around the other end), and at poses of slips (correct poses moved by 0.3 to 1 m, turned by 3 to 10
degrees, or both). An additive model, piecewise linear and monotone, tells them apart; correct and wrong
have the same weight, and so has every place. It prints the loss (nats) at each place of a fit on the
others, and in sample.

    fit_audit.py --gather ROWS.json PLACE=SCENE_FOLDER=RESULT.json[=NOISE] ...
    fit_audit.py ROWS.json [--write]    (src/reconstruction/audit/pair_model_table.hpp)

SCENE_FOLDER has poses.txt, RESULT.json is that of `gpureg batch` on all of its pairs, at voxels of 5 cm. NOISE
(metres, standard deviation) is added to all ranges.
Needs the package gpureg, numpy and scipy.
"""

import argparse
import itertools
import json
import pathlib
import re

import gpureg
import numpy as np
from scipy.optimize import minimize

AUDIT = pathlib.Path(__file__).resolve().parents[2] / "src/reconstruction/audit"
VOXEL = 0.05
TRUE, SLIPS, JOINS, AROUND = 230, 100, 20, 6  # of a scene; scans around each end of a join
MAP_METRES, MAP_DEGREES = 0.015, 0.3  # error of a good map
WRONG = 0.35  # metres
# The constants of the features are those of the library.
CONSTANT = {
    name: float(value)
    for file in ("pair_model.cpp", "pair_verdicts.cpp")
    for name, value in re.findall(r"(k[A-Z]\w+) = ([\d.e-]+)", (AUDIT / file).read_text())
}
SHARE_OF = {"true": 0.5, "join": 0.35, "slip": 0.15}
PENALTY = 0.003
KNOTS = {
    "coincide": (0, 1, 2, 4, 6),
    "doubt": (-9, -5, -3, -1.5, 0),
    "no_violation": (0.6, 1.6, 2.6, 3.5, 4.5, 5.8),
    "none_violating": (2.3, 3.5, 4.5, 5.7, 6.9),
}


def worse_side(evidence):
    """Shares in free space, of the points in view and of all points."""
    sides = [
        (getattr(evidence, f"{side}_free_space_violation"), getattr(evidence, f"{side}_observed"))
        for side in ("source", "target")
    ]
    share, observed = max((s for s in sides if s[1] >= CONSTANT["kLeastObserved"]), default=(0, 0))
    return share, share * observed


def terms(source, target, pose, margin):
    """Confidence, share at the other's surfaces, shares in free space; as judge_pair()."""
    given, after = (
        gpureg.verify(source, target, pose, refine=refine, search_alternatives=False)[0]
        for refine in (False, True)
    )
    confidence, violation = given.confidence, worse_side(given.evidence)
    centre = np.asarray(source.points).mean(0)
    moved = np.asarray(after.target_from_source) - pose
    if np.linalg.norm(moved[:3, :3] @ centre + moved[:3, 3]) <= margin:
        confidence = max(confidence, after.confidence)
        violation = min(violation, worse_side(after.evidence))
    e = given.evidence
    shared = max(e.source_overlap_any_normal, e.target_overlap_any_normal)
    return [round(float(v), 5) for v in (confidence, shared, *violation)]


def features(rows):
    confidence, shared, violation, violating = np.array(rows).T
    least = CONSTANT["kLeastPairConfidence"]
    confidence = np.clip(confidence, least, 1 - least)
    log_odds = np.log(confidence / (1 - confidence))
    return np.stack(
        [
            np.maximum(log_odds, 0),
            np.minimum(log_odds, 0) * np.minimum(shared / CONSTANT["kEnoughShared"], 1),
            -np.log(np.maximum(violation, CONSTANT["kLeastViolation"])),
            -np.log(np.maximum(violating, CONSTANT["kLeastViolating"])),
        ],
        1,
    )


def turn(random, degrees):
    x, y, z = axis = random.normal(size=3)
    length = np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / length
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def motion(random, metres, degrees, centre):
    out = np.eye(4)
    out[:3, :3] = turn(random, degrees)
    shift = random.normal(size=3)
    out[:3, 3] = centre - out[:3, :3] @ centre + shift * metres / np.linalg.norm(shift)
    return out


class Scene:
    def __init__(self, folder, seed, noise):
        self.random = np.random.default_rng(seed)
        lines = [row.split() for row in (folder / "poses.txt").read_text().splitlines() if row]
        self.poses = {
            int(lines[k][0]): np.array(lines[k + 1 : k + 5], float) for k in range(0, len(lines), 5)
        }
        options = gpureg.RegistrationOptions(voxel_size=VOXEL)
        fragments = gpureg.FragmentSet.from_directory(folder)
        self.numbers = list(fragments.numbers)
        self.clouds = {
            number: self.prepared(fragments.load(k, options), noise, options)
            for k, number in enumerate(self.numbers)
        }
        self.points = {n: np.asarray(self.clouds[n].points) for n in self.numbers}
        self.boxes = {n: self.box(n, self.poses[n]) for n in self.numbers}

    def prepared(self, cloud, noise, options):
        points, viewpoints = np.asarray(cloud[0]), np.asarray(cloud[3])
        rays = points - viewpoints.mean(0)
        rays /= np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-6)
        points = points + noise * self.random.normal(size=(len(points), 1)) * rays
        return gpureg.prepare(points, viewpoints=viewpoints, options=options)

    def box(self, number, pose):
        world = self.points[number] @ pose[:3, :3].T + pose[:3, 3]
        return np.percentile(world, (2, 98), axis=0)

    def meet(self, a, b):
        return (a[0] < b[1]).all() and (b[0] < a[1]).all()

    def ask(self, a, b, pose):
        """@param pose: from the frame of scan b into that of scan a."""
        audit = gpureg.AuditOptions()
        margin = VOXEL * audit.max_shift  # in voxels
        margin += audit.max_shift_per_metre * np.linalg.norm(pose[:3, 3])
        return terms(self.clouds[b], self.clouds[a], pose, margin)

    def near_pairs(self):
        pairs = [(a, b) for a in self.numbers for b in self.numbers if a < b]
        self.random.shuffle(pairs)
        return [(a, b) for a, b in pairs if self.meet(self.boxes[a], self.boxes[b])]

    def moved(self, a, b, metres, degrees):
        centre = self.points[b].mean(0)
        pose = np.linalg.inv(self.poses[a]) @ self.poses[b]
        return self.ask(a, b, pose @ motion(self.random, metres, degrees, centre))

    def true(self):
        return [self.moved(a, b, MAP_METRES, MAP_DEGREES) for a, b in self.near_pairs()[:TRUE]]

    def slips(self):
        out = []
        for a, b in self.near_pairs()[:SLIPS]:
            far, turned = self.random.choice([(1, 0), (0, 1), (1, 1)])
            metres, degrees = 0.3 * (1 / 0.3) ** self.random.random(2) * (1, 10)
            out.append(self.moved(a, b, metres if far else 0.02, degrees if turned else 0))
        return out

    def error(self, a, b, pose):
        off = np.linalg.inv(np.linalg.inv(self.poses[a]) @ self.poses[b]) @ pose
        centre = self.points[b].mean(0)
        return np.linalg.norm(off[:3, :3] @ centre + off[:3, 3] - centre)

    def around(self, number):
        middles = {n: self.boxes[n].mean(0) for n in self.numbers}
        return sorted(self.numbers, key=lambda n: np.linalg.norm(middles[n] - middles[number]))

    def joins(self, result):
        false = []
        for pair in json.loads(result.read_text())["pairs"]:
            for mode in pair.get("modes", [])[:3]:
                pose = np.reshape(mode["T_ij"], (4, 4))
                if self.error(pair["i"], pair["j"], pose) > WRONG:
                    false.append((mode["confidence"], pair["i"], pair["j"], pose))
                    break
        out = []
        for _, i, j, pose in sorted(false, key=lambda f: -f[0])[:JOINS]:
            join = self.poses[i] @ pose @ np.linalg.inv(self.poses[j])  # of the part of j
            for a in self.around(i)[:AROUND]:
                for b in self.around(j)[:AROUND]:
                    implied = np.linalg.inv(self.poses[a]) @ join @ self.poses[b]
                    if a == b or (a, b) == (i, j) or self.error(a, b, implied) < WRONG:
                        continue
                    if self.meet(self.boxes[a], self.box(b, join @ self.poses[b])):
                        out.append(self.ask(a, b, implied))
        return out


def gather(file, places):
    rows = json.loads(file.read_text()) if file.exists() else {}
    for seed, place in enumerate(places, 1):
        name, folder, result, noise = [*place.split("="), 0][:4]
        scene = Scene(pathlib.Path(folder), seed, float(noise))
        rows[name] = {
            "true": scene.true(),
            "join": scene.joins(pathlib.Path(result)),
            "slip": scene.slips(),
        }
        print(name, {kind: len(of_kind) for kind, of_kind in rows[name].items()}, flush=True)
        file.write_text(json.dumps(rows, separators=(",", ":")))


def expand(x):
    columns = [
        np.clip((x[:, k] - a) / (b - a), 0, 1)
        for k, knots in enumerate(KNOTS.values())
        for a, b in itertools.pairwise(knots)
    ]
    return np.stack(columns, 1)


def samples(rows, places):
    """Steps, sign and weight of each row."""
    z, sign, weight = [], [], []
    for place in places:
        for kind, share in SHARE_OF.items():
            of_kind = rows[place][kind]
            z.append(expand(features(of_kind)))
            sign += [1 if kind == "true" else -1] * len(of_kind)
            weight += [share / len(of_kind) / len(places)] * len(of_kind)
    return np.concatenate(z), np.array(sign), np.array(weight)


def fit(rows, places):
    z, sign, weight = samples(rows, places)

    def loss(p):
        margin = sign * (z @ p[1:] + p[0])
        slope = -weight * sign / (1 + np.exp(margin))
        value = (weight * np.logaddexp(0, -margin)).sum() + PENALTY * (p[1:] ** 2).sum()
        return value, np.r_[slope.sum(), z.T @ slope + 2 * PENALTY * p[1:]]

    bounds = [(None, None)] + [(0, None)] * z.shape[1]
    start = np.zeros(z.shape[1] + 1)
    return minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds).x


def loss_of(rows, places, p):
    z, sign, weight = samples(rows, places)
    return float((weight * np.logaddexp(0, -sign * (z @ p[1:] + p[0]))).sum())


def write(p, file):
    steps, k = [], 1
    for name, knots in KNOTS.items():
        for a, b in itertools.pairwise(knots):
            if p[k] > 5e-3:
                steps.append(f"    {{PairFeature::{name}, {a}, {b}, {p[k]:.3g}}}")
            k += 1
    names = ", ".join(KNOTS)
    file.write_text(f"""// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/accuracy/fit_audit.py.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gpureg::reconstruction {{

enum class PairFeature : std::uint8_t {{ {names} }};
constexpr std::size_t kPairFeatures = {len(KNOTS)};

/// What a feature adds on its way from one value to another one.
struct PairStep {{
  PairFeature feature;
  double from, to, rise;
}};

constexpr PairStep kPairSteps[] = {{
{(","+chr(10)).join(steps)}}};
constexpr double kPairBias = {p[0]:.5g};

}}  // namespace gpureg::reconstruction
""")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("rows", type=pathlib.Path, nargs="?")
    parser.add_argument("places", nargs="*", metavar="PLACE=SCENE_FOLDER=RESULT.json[=NOISE]")
    parser.add_argument("--gather", action="store_true")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    if arguments.gather:
        return gather(arguments.rows, arguments.places)
    rows = json.loads(arguments.rows.read_text())
    for place in rows:
        others = [p for p in rows if p != place]
        print(f"{place:16} {loss_of(rows, [place], fit(rows, others)):.3f}")
    p = fit(rows, list(rows))
    print(f"{'in sample':16} {loss_of(rows, list(rows), p):.3f}")
    if arguments.write:
        write(p, AUDIT / "pair_model_table.hpp")


if __name__ == "__main__":
    main()
