#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Rules of the guard, without a command: worse figures are noticed, others pass."""

import unittest

import guard

BASE = {"default": {"pairs": 36, "found": 34, "right": 35, "false": 2}}


class Accuracy(unittest.TestCase):
    def complaints(self, **changed):
        return guard.worse_accuracy(BASE, {"default": {**BASE["default"], **changed}})

    def test_the_same_and_better_pass(self):
        self.assertEqual(self.complaints(), [])
        self.assertEqual(self.complaints(found=36, right=36, false=0), [])

    def test_the_margin_is_one_pair(self):
        self.assertEqual(self.complaints(found=33, right=34, false=3), [])
        self.assertEqual(len(self.complaints(found=32)), 1)
        self.assertEqual(len(self.complaints(right=33)), 1)
        self.assertEqual(len(self.complaints(false=4)), 1)
        self.assertEqual(len(self.complaints(found=0, right=0, false=50)), 3)

    def test_another_scene_is_no_comparison(self):
        self.assertIn("generator changed", self.complaints(pairs=37)[0])


class Instructions(unittest.TestCase):
    def test_five_per_cent(self):
        self.assertEqual(guard.worse_instructions({"default": 1000}, {"default": 1050}), [])
        self.assertEqual(guard.worse_instructions({"default": 1000}, {"default": 10}), [])
        self.assertIn("1.051", guard.worse_instructions({"default": 1000}, {"default": 1051})[0])


if __name__ == "__main__":
    unittest.main()
