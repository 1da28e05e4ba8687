# SPDX-License-Identifier: BSD-3-Clause
"""Published figures of Redwood's four scenes (strict rule, mean of the scenes): recall and
precision in %, time of a pair.
"""

SCENES = ["livingroom1", "livingroom2", "office1", "office2"]
# label, recall, precision, time of a pair, right of all pairs per scene where they were published
ROWS = [
    ("4PCS (Aiger et al. 2008)", 20.0, 8.9, "", None),
    ("PCL prerejective, unmodified", 44.9, 14.0, "3 s", None),
    ("FGR (Zhou et al. 2016)", 51.1, 23.2, "0.2 s", None),
    (
        "CZK (Choi et al. 2015)",
        59.2,
        19.6,
        "7512 ms, in the run of LoopSmart's authors",
        [(166, 271), (76, 153), (116, 180), (83, 135)],
    ),
    (
        "LoopSmart, the paper",
        62.9,
        20.0,
        "20.5 ms, Titan X Pascal",
        [(169, 271), (77, 153), (122, 180), (96, 135)],
    ),
    ("Open3D RANSAC, 2017", 63.2, 19.7, "341 ms", None),
    ("3DMatch descriptor + RANSAC", 65.1, 25.2, "", None),
]
