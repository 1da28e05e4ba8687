#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""bench/redwood: counts of pairs on cases counted by hand, layouts of scenes, Markdown tables."""

import json
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "bench/redwood"))
import analysis
import markdown_tables
from scenes import Scene

UNIT = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"


def pair(j, listed=True, known=True, tried=True, reported=True, error=0.1, degrees=1.0):
    right = error is not None and error <= 0.2
    return {
        "i": 0,
        "j": j,
        "listed": listed,
        "known": known,
        "tried": tried,
        "reported": reported,
        "error": error,
        "degrees": degrees,
        "strict": listed and right,
        "geometric": known and right,
    }


class Analysis(unittest.TestCase):
    pairs = [
        pair(2),
        pair(3, reported=False),
        pair(4, reported=False, error=3, degrees=90),
        pair(5, error=0.3, degrees=4),
        pair(6, error=2, degrees=180),
        pair(7, tried=False, reported=False, error=None, degrees=None),
        pair(8, reported=False, error=None, degrees=None),
        pair(9, listed=False),
        pair(10, listed=False, known=False, error=None, degrees=None),
        pair(11, listed=False, error=1),
    ]

    def test_every_miss_has_one_reason(self):
        self.assertEqual(
            analysis.misses(self.pairs),
            {
                "not_tried": 1,
                "no_candidate": 1,
                "right_but_not_reported": 1,
                "wrong_and_not_reported": 1,
                "reported_off_by_little": 1,
                "reported_wrong": 1,
            },
        )

    def test_false_reports(self):
        self.assertEqual(
            analysis.wrong_reports(self.pairs),
            {"right_but_little_overlap": 1, "wrong_pose": 3, "no_overlap": 1},
        )

    def test_rotation_errors(self):
        histogram = analysis.rotation_errors(self.pairs)
        self.assertEqual(sum(histogram["counts"]), 3)
        self.assertEqual(histogram["counts"][0], 1)  # 4 degrees
        self.assertEqual(histogram["counts"][4], 1)  # 90
        self.assertEqual(histogram["counts"][-1], 1)  # 180, which closes the last bin

    def test_recall_by_overlap(self):
        table = analysis.recall_by_overlap(
            self.pairs, {(0, j): 0.3 + 0.1 * (j - 2) for j in range(2, 9)}
        )
        self.assertEqual(sum(table["pairs"]), 7)
        self.assertEqual(table["reported_right"][0], 1)
        self.assertEqual(sum(table["reported_right"]), 1)
        self.assertEqual(sum(table["candidate_right"]), 2)
        self.assertIsNone(analysis.recall_by_overlap(self.pairs, {}))


class Tables(unittest.TestCase):
    def test_columns_have_one_width(self):
        self.assertEqual(
            markdown_tables.table(["a", "long"], [["wide cell", 1]]),
            "| a         | long |\n| --------- | ---- |\n| wide cell | 1    |\n",
        )

    def test_every_committed_record_has_its_tables(self):
        record = json.loads((ROOT / "bench/results/redwood.json").read_text())
        text = markdown_tables.text(record, record["command"])
        for method in record["methods"]:
            self.assertIn(f"| {method['label']}", text)
        for title in (
            "strict rule",
            "Recall by overlap",
            "Missed pairs",
            "False positives",
            "Time",
        ):
            self.assertIn(title, text)
        self.assertIn("*FGR (Zhou et al. 2016)*", text)
        self.assertTrue(text.endswith(f"Made by `{record['command']}`.\n"))

    def test_a_method_that_lacks_a_scene_is_no_row_of_the_mean(self):
        record = json.loads((ROOT / "bench/results/redwood.json").read_text())
        record["scenes"].append({"name": "another", "source": "another"})
        text = markdown_tables.text(record)
        self.assertNotIn("time per pair", text)
        self.assertIn("prepared pair", text)


class Scenes(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)
        self.folder = self.root / "room"
        self.folder.mkdir()
        for number in range(3):
            (self.folder / f"cloud_bin_{number}.ply").write_text("")

    def tearDown(self):
        self.temporary.cleanup()

    def expect_refused(self, *fragments):
        with self.assertRaises(SystemExit) as refused:
            Scene(self.folder, "room")
        for fragment in fragments:
            self.assertIn(fragment, str(refused.exception))

    def test_truth_beside_or_in_a_sibling(self):
        for place in (
            self.folder,
            self.root / "room-evaluation",
            self.root / "iclnuim-room-evaluation",
        ):
            place.mkdir(exist_ok=True)
            (place / "gt.log").write_text("0 2 3\n" + UNIT)
            self.assertEqual(Scene(self.folder, "room").truth, place)
            (place / "gt.log").unlink()

    def test_missing_things_are_named(self):
        self.expect_refused("no gt.log")
        (self.folder / "gt.log").write_text("0 2 4\n" + UNIT + "\n0 3 4\n" + UNIT)
        self.expect_refused("gt.log:7:", "pair 0 3", "cloud_bin_3.ply")
        (self.folder / "gt.log").write_text("0 x 4\n" + UNIT)
        self.expect_refused("gt.log:1:", "expected i j n")
        for path in self.folder.glob("*.ply"):
            path.unlink()
        self.expect_refused("no cloud_bin_")


if __name__ == "__main__":
    unittest.main()
