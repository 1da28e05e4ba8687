# SPDX-License-Identifier: BSD-3-Clause
"""bench/accuracy/buildings/gazebo_building.py: one mesh of a world, every part where the world has it."""

import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pytest

trimesh = pytest.importorskip("trimesh")
pytestmark = pytest.mark.skipif(shutil.which("assimp") is None, reason="needs the command assimp")

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "bench/accuracy/buildings/gazebo_building.py"

WORLD = """<sdf version="1.6"><world name="w">
<model name="plate"><link name="l"><visual name="v"><geometry><plane><normal>0 0 1</normal><size>50 50</size></plane></geometry></visual></link></model>
<model name="post"><pose>3 0 0 0 0 0</pose><link name="l"><pose>0 0 1 0 0 0</pose>
  <visual name="v"><geometry><cylinder><radius>0.1</radius><length>2</length></cylinder></geometry></visual></link></model>
<model name="fallen"><pose>0 0 -34000 0 0 0</pose><link name="l"><visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual></link></model>
<include><uri>model://crate</uri><pose>0 5 0 0 0 1.5707963</pose></include>
<include><uri>model://ghost</uri></include>
</world></sdf>"""

CRATE = """<sdf version="1.6"><model name="crate"><pose>9 9 9 0 0 0</pose><link name="l">
<collision name="c"><geometry><box><size>2 1 1</size></box></geometry></collision>
<visual name="v"><pose>0 0 0.5 0 0 0</pose><geometry><mesh><uri>{uri}</uri><scale>2 1 1</scale></mesh></geometry></visual></link></model></sdf>"""


def bake(folder, uri, *words):
    """The world around a crate, whose mesh is a unit cube."""
    crate = folder / "models/crate"
    crate.mkdir(parents=True)
    trimesh.creation.box([1, 1, 1]).export(crate / "cube.stl")
    (crate / "model.sdf").write_text(CRATE.format(uri=uri))
    (folder / "a.world").write_text(WORLD)
    done = subprocess.run(
        [
            sys.executable,
            SCRIPT,
            folder / "a.world",
            "--models",
            folder / "models",
            "-o",
            folder / "out.ply",
            *words,
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return trimesh.load(folder / "out.ply", force="mesh"), done.stderr


def bounds(points):
    return [points.min(0), points.max(0)]


def test_parts_stand_where_the_world_has_them(tmp_path):
    mesh, left_out = bake(tmp_path, "model://crate/cube.stl")
    crate, post = (mesh.vertices[mesh.vertices[:, 0] < 1], mesh.vertices[mesh.vertices[:, 0] > 1])
    # Twice as long, turned by a quarter, at the world's pose and not at its own.
    assert np.allclose(bounds(crate), [[-0.5, 4, 0], [0.5, 6, 1]], atol=1e-3)
    assert np.allclose(bounds(post), [[2.9, -0.1, 0], [3.1, 0.1, 2]], atol=1e-2)
    assert "model://ghost" in left_out and "fallen" in left_out


def test_a_mesh_that_cannot_be_read_is_replaced_by_what_collides(tmp_path):
    mesh, left_out = bake(tmp_path, "model://crate/none.stl")
    crate = mesh.vertices[mesh.vertices[:, 0] < 1]
    assert np.allclose(bounds(crate), [[-0.5, 4, -0.5], [0.5, 6, 0.5]], atol=1e-3)
    assert "none.stl" in left_out


def test_floor(tmp_path):
    mesh, _ = bake(tmp_path, "model://crate/cube.stl", "--floor")
    assert np.allclose(bounds(mesh.vertices), [[-0.5, -0.1, -0.1], [3.1, 6, 2]], atol=1e-2)
    assert np.allclose(mesh.vertices[mesh.vertices[:, 2] < -0.05][:, 2], -0.1)


def test_nothing_to_read(tmp_path):
    (tmp_path / "a.world").write_text("<sdf version='1.6'><world name='w'/></sdf>")
    done = subprocess.run(
        [sys.executable, SCRIPT, tmp_path / "a.world", "-o", tmp_path / "out.ply"],
        capture_output=True,
        text=True,
    )
    assert done.returncode != 0 and "a.world" in done.stderr
    assert not (tmp_path / "out.ply").exists()
