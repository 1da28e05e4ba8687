#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes one mesh of a Gazebo world, to be scanned by `gpureg generate --building`.

Visual meshes, boxes, cylinders and spheres of all models at their poses; planes are left out. A
visual mesh whose file cannot be read is replaced by the model's collision geometry. Prints the
files that it left out.

usage: gazebo_building.py FILE.world|FILE.sdf|MESH.dae --models FOLDER... [--floor] -o BUILDING.ply
FOLDER holds one folder for each model, with its model.sdf; model://, file:// and package://
addresses are looked for in it. Needs numpy, trimesh and the command assimp (Debian's assimp-utils).
"""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

import numpy as np
import trimesh

FLOOR = 0.1  # metres, thickness of the ground plane of --floor
# Metres from the origin. A model beyond fell through the floor before the world was saved.
MAX_DISTANCE = 1000


def matrix(text):
    """An SDF pose: x y z roll pitch yaw, metres and radians."""
    x, y, z, *turn = map(float, text.split()) if text and text.strip() else [0.0] * 6
    out = trimesh.transformations.euler_matrix(*turn, "sxyz")
    out[:3, 3] = x, y, z
    return out


class Baker:
    def __init__(self, folders):
        self.folders, self.files, self.parts, self.missing = folders, {}, [], set()

    def find(self, uri):
        name = re.sub(r"^(model|file|package)://", "", uri)
        # Packages and folders of models have other names on the machine where the world was made.
        parts = pathlib.PurePosixPath(name).parts
        for folder in self.folders:
            for k in range(len(parts)):
                path = folder.joinpath(*parts[k:])
                if path.exists():
                    return path
        return None

    def mesh(self, path):
        """Of a file, metres."""
        if path not in self.files:
            with tempfile.TemporaryDirectory() as folder:
                converted = pathlib.Path(folder) / "mesh.stl"
                done = subprocess.run(
                    ["assimp", "export", path, converted, "-ptv"], capture_output=True, text=True
                )
                whole = (
                    trimesh.load(converted, force="mesh")
                    if done.returncode == 0 and converted.exists()
                    else None
                )
            # Gazebo takes coordinates as they are; assimp turns z up into y up.
            if (
                whole is not None
                and path.suffix.lower() == ".dae"
                and "<up_axis>Z_UP" in path.read_text(errors="replace")
            ):
                whole.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
            self.files[path] = whole if whole is not None and len(whole.faces) else None
        return self.files[path]

    def shape(self, geometry):
        """None: not there, not readable. Empty: a plane."""
        node = geometry[0] if len(geometry) else None
        if node is None or node.tag in ("plane", "empty"):
            return trimesh.Trimesh()
        numbers = lambda tag: [float(v) for v in node.findtext(tag).split()]  # noqa: E731
        if node.tag == "box":
            return trimesh.creation.box(numbers("size"))
        if node.tag == "cylinder":
            return trimesh.creation.cylinder(numbers("radius")[0], numbers("length")[0])
        if node.tag == "sphere":
            return trimesh.creation.icosphere(2, numbers("radius")[0])
        if node.tag != "mesh":
            return trimesh.Trimesh()
        path = self.find(node.findtext("uri").strip())
        found = self.mesh(path) if path else None
        if found is None:
            self.missing.add(node.findtext("uri").strip())
            return None
        return found.copy().apply_scale(
            numbers("scale") if node.find("scale") is not None else [1, 1, 1]
        )

    def model(self, node, world_from_parent):
        world_from_model = world_from_parent @ matrix(node.findtext("pose"))
        if np.abs(world_from_model[:3, 3]).max() > MAX_DISTANCE:
            self.missing.add(f"{node.get('name')} at {world_from_model[:3, 3]}")
            return
        for include in node.findall("include"):
            self.include(include, world_from_model)
        for inner in node.findall("model"):
            self.model(inner, world_from_model)
        for link in node.findall("link"):
            world_from_link = world_from_model @ matrix(link.findtext("pose"))
            shapes = [(v, self.shape(v.find("geometry"))) for v in link.findall("visual")]
            if any(shape is None for _, shape in shapes):
                shapes = [(c, self.shape(c.find("geometry"))) for c in link.findall("collision")]
            for of, shape in shapes:
                if shape is not None and len(shape.faces):
                    self.parts.append(
                        shape.apply_transform(world_from_link @ matrix(of.findtext("pose")))
                    )

    def include(self, node, world_from_parent):
        folder = self.find(node.findtext("uri").strip())
        if folder is None or not (folder / "model.sdf").exists():
            self.missing.add(node.findtext("uri").strip())
            return
        model = xml.parse(folder / "model.sdf").getroot().find("model")
        if node.find("pose") is not None:  # takes the place of the model's own
            for pose in model.findall("pose"):
                model.remove(pose)
            model.append(node.find("pose"))
        self.model(model, world_from_parent)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("world", type=pathlib.Path)
    parser.add_argument("--models", nargs="+", type=pathlib.Path, default=[])
    parser.add_argument(
        "--floor",
        action="store_true",
        help="with a floor at z = 0 under all of it: where it is Gazebo's ground plane",
    )
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    baker = Baker(arguments.models)
    if arguments.world.suffix.lower() in (".world", ".sdf"):
        root = xml.parse(arguments.world).getroot()
        baker.model(root.find("world") if root.find("world") is not None else root, np.eye(4))
    elif baker.mesh(arguments.world) is not None:
        baker.parts.append(baker.mesh(arguments.world))
    for uri in sorted(baker.missing):
        print(f"left out: {uri}", file=sys.stderr)
    if not baker.parts:
        sys.exit(f"{arguments.world} holds no geometry that could be read")
    if arguments.floor:
        low, high = (
            np.min([p.bounds[0] for p in baker.parts], 0),
            np.max([p.bounds[1] for p in baker.parts], 0),
        )
        baker.parts.append(
            trimesh.creation.box(bounds=[[low[0], low[1], -FLOOR], [high[0], high[1], 0]])
        )
    whole = trimesh.util.concatenate(
        [trimesh.Trimesh(p.vertices, p.faces, process=False) for p in baker.parts]
    )
    whole.export(arguments.output)
    low, high = whole.bounds
    print(
        f"{len(baker.parts)} parts, {len(whole.faces)} triangles, from {low.round(2)} to {high.round(2)} m: {arguments.output}"
    )


main()
