#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Are the confidences of the edges of a map true?

An edge is correct within 0.2 m (Redwood's measure). For each map: expected calibration error (ten
bins) and the share of correct edges above 0.9, of the pair alone (pair_confidence), after loop
consistency (confidence) and in view of the map and its audit (map_confidence). `without`: the error
of map_confidence if the constants for poses between islands (src/reconstruction/edge_confidence.cpp)
are those of the least mean error of the other buildings.

usage: map_confidence.py NAME=BUILDING=SCENE_FOLDER=RECONSTRUCTION.json ... [-o RECORD]
Maps of one building may be several. Needs numpy."""

import itertools
import json
import pathlib

import map_rmse
import numpy as np
import record
from calibrate import calibration_error

KINDS = ("pair_confidence", "confidence", "map_confidence")
SURE = 0.9
MOST = 0.9999  # of a confidence whose odds are taken
RATIOS = [1 / k for k in (2, 4, 6, 8, 12, 16, 24)]
GRID = list(
    itertools.product(RATIOS, (0.6, 0.75, 0.9), RATIOS, (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5))
)  # ratio and most where places are distinct, and where they look alike


class Map:
    def __init__(self, text):
        self.name, self.building, scene, document = text.split("=")
        document = json.loads(pathlib.Path(document).read_text())
        truth = map_rmse.read_truth(scene)
        edges = document["edges"]
        self.confidences = {kind: np.array([e[kind] for e in edges]) for kind in KINDS}
        self.correct = np.array(
            [
                map_rmse.edge_error(
                    (e["i"], e["j"]), np.reshape(e["T_ij"], (4, 4)), truth, {}, lambda _: 0
                )
                <= map_rmse.MAX_EDGE_METRES
                for e in edges
            ]
        )
        self.alike = document["places_look_alike"]
        islands = {s["id"]: s["island"] if s["placed"] else None for s in document["scans"]}
        self.between = np.array(
            [islands[e["i"]] is None or islands[e["i"]] != islands[e["j"]] for e in edges]
        )

    def mapped(self, constants):
        """map_confidence with other constants."""
        ratio, most = constants[2:] if self.alike else constants[:2]
        confidence = np.minimum(self.confidences["confidence"], MOST)
        odds = confidence / (1 - confidence) * ratio
        rejected = np.minimum(most, odds / (1 + odds))
        return np.where(self.between, rejected, self.confidences["map_confidence"])

    def error(self, confidences):
        return calibration_error(np.column_stack([confidences, self.correct]).astype(float))

    def figures(self):
        out = {"edges": len(self.correct), "correct": int(self.correct.sum())}
        for kind, values in self.confidences.items():
            sure = values > SURE
            out[kind] = {
                "ECE": round(float(self.error(values)), 4),
                "above": int(sure.sum()),
                "of_them_correct": int(self.correct[sure].sum()),
            }
        return {**out, "places_look_alike": self.alike}


def fitted(maps):
    """Constants of the least error, as a mean of all maps; of equal ones the first."""

    def loss(constants):
        return np.mean([m.error(m.mapped(constants)) for m in maps])

    return min(GRID, key=loss)


def main():
    parser = record.parser(__doc__, "map_confidence.json")
    parser.add_argument("maps", nargs="+", metavar="NAME=BUILDING=SCENE=MAP")
    arguments = parser.parse_args()
    maps = [Map(text) for text in arguments.maps]
    content = []
    for chosen in maps:
        constants = fitted([m for m in maps if m.building != chosen.building])
        error = round(float(chosen.error(chosen.mapped(constants))), 4)
        content.append(
            {"map": chosen.name, "building": chosen.building, **chosen.figures(), "without": error}
        )
        content[-1]["fitted"] = [round(value, 4) for value in constants]
        print(content[-1], flush=True)
    command = "bench/accuracy/map_confidence.py NAME=BUILDING=SCENE=MAP ..."
    record.write(arguments, command, {"maps": content})


if __name__ == "__main__":
    main()
