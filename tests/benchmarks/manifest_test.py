#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The manifest of the confidence's inputs: every run can be made, and it has the runs of the record."""

import copy
import json
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "bench/accuracy"))
import rebuild_confidence as rebuild

SMALL = pathlib.Path(__file__).with_name("small_confidence_manifest.json")


def inputs_of(manifest, work):
    gpureg = work / "gpureg"
    gpureg.write_text("")
    arguments = types.SimpleNamespace(
        work=work, data=work / "data", gpureg=gpureg, backend="cpu", reuse_results=False
    )
    return rebuild.Inputs(arguments, manifest)


class Manifest(unittest.TestCase):
    def setUp(self):
        self.manifest = json.loads(rebuild.MANIFEST.read_text())
        self.runs = rebuild.runs_of(self.manifest)
        self.temporary = tempfile.TemporaryDirectory()
        self.inputs = inputs_of(self.manifest, pathlib.Path(self.temporary.name))

    def tearDown(self):
        self.temporary.cleanup()

    def test_no_complaints(self):
        self.assertEqual(rebuild.check(self.manifest), [])
        self.assertEqual(rebuild.check(json.loads(SMALL.read_text())), [])

    def test_names_and_files_are_unique(self):
        self.assertEqual(len({run.name for run in self.runs}), len(self.runs))
        self.assertEqual(len({run.file for run in self.runs}), len(self.runs))

    def test_every_entry_has_a_command(self):
        for name in self.manifest["scenes"]:
            command = self.inputs.scene_command(name, pathlib.Path("out"))
            self.assertEqual(command is None, "data" in self.manifest["scenes"][name])
        for name, mesh in self.manifest["meshes"].items():
            script = mesh.get("script", "gazebo_building.py")
            self.assertIn(script, str(self.inputs.mesh_command(name, "out")))
        for run in self.runs:
            self.assertIn("--voxel-size", self.inputs.batch_command(run))

    def test_sources_come_before_scenes(self):
        order = self.inputs.needed(self.runs)
        self.assertEqual(set(order), set(self.manifest["scenes"]), "a scene without a run")
        for k, name in enumerate(order):
            source = self.manifest["scenes"][name].get("from")
            self.assertTrue(source is None or source in order[:k])

    def test_the_kinds_of_the_record(self):
        kinds = {run["kind"] for run in json.loads(rebuild.RECORD.read_text())["runs"]}
        buildings = {of["building"] for of in self.manifest["scenes"].values()}
        self.assertEqual(kinds, buildings | {"street", "hall", "objects"})

    def test_complaints_name_the_entry(self):
        for change, expected in (
            (lambda m: m["runs"][0]["scenes"].append("moon"), "moon"),
            (lambda m: m["runs"].append(m["runs"][0]), "twice"),
            (lambda m: m["runs"][0].update(role="moon"), "role"),
            (lambda m: m["scenes"]["house/A"].pop("data"), "scene house/A"),
            (lambda m: m["scenes"]["bookstore/1"].update(mesh="moon"), "no mesh moon"),
            (
                lambda m: m["scenes"]["unknown/house/A"].update(script="moon.py"),
                "no script moon.py",
            ),
            (lambda m: m["meshes"]["house"].pop("commit"), "mesh house: no commit"),
            (lambda m: m["meshes"]["racks1"].update(script="moon.py"), "no script moon.py"),
            (lambda m: m["meshes"]["racks1"].pop("options"), "mesh racks1: no options"),
        ):
            manifest = copy.deepcopy(self.manifest)
            change(manifest)
            self.assertIn(expected, "\n".join(rebuild.check(manifest)))

    def test_a_mesh_of_a_script_is_never_missing(self):
        runs = [run for run in self.runs if run.scene == "racks/1"]
        self.assertEqual(rebuild.missing(self.inputs, runs), {})

    def test_missing_data_is_named(self):
        runs = [run for run in self.runs if run.scene in ("house/A", "unknown/house/A", "gen401")]
        absent = rebuild.missing(self.inputs, runs)
        self.assertEqual(set(absent), {"house/A", "unknown/house/A"})
        self.assertIn("gt.log", absent["house/A"])

    def test_a_result_of_another_recipe_or_build_is_made_again(self):
        run = next(run for run in self.runs if run.scene == "unknown/house/A")
        result = self.inputs.result(run)
        result.parent.mkdir()
        result.write_text("{}")
        self.assertFalse(rebuild.done(self.inputs, run), "not finished")
        rebuild.stamp(result, rebuild.origin_of(self.inputs, run))
        self.assertTrue(rebuild.done(self.inputs, run))
        changed = copy.deepcopy(self.manifest)
        changed["scenes"]["unknown/house/A"]["options"] = ["--origin"]
        self.assertFalse(rebuild.done(inputs_of(changed, self.inputs.work), run))
        self.inputs.arguments.gpureg.write_text("another")
        again = rebuild.Inputs(self.inputs.arguments, self.manifest)
        self.assertFalse(rebuild.done(again, run))
        again.arguments.reuse_results = True
        self.assertTrue(rebuild.done(again, run))


class Command(unittest.TestCase):
    def run_script(self, *words):
        script = ROOT / "bench/accuracy/rebuild_confidence.py"
        return subprocess.run([sys.executable, script, *words], capture_output=True, text=True)

    def test_dry_run(self):
        done = self.run_script(
            "--dry-run", "--only", "gen40[12], voxels of 0.05 m*", "--data", "nowhere"
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(done.stdout.splitlines()), 4)
        self.assertIn("generate", done.stdout)
        self.assertIn("--seed 402", done.stdout)

    def test_a_pattern_without_a_run(self):
        done = self.run_script("--dry-run", "--only", "moon*")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("moon*", done.stderr)


if __name__ == "__main__":
    unittest.main()
