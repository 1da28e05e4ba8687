#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes one mesh of a building in which places repeat, to be scanned by `gpureg generate --building`.

* `racks`: a hall of equal racks. One half is the other one, turned by 180 degrees.
* `corridors`: parallel equal corridors with equal doors, joined by a cross corridor.
* `garage`: a low ceiling on a grid of columns, beams between them, and some cars.

Sizes follow from the seed, and so do a few things that stand in one place alone: boxes, bins, posts.

usage: building_kinds.py racks|corridors|garage [--seed 1] -o BUILDING.ply
Needs numpy and trimesh."""

import argparse
import pathlib

import numpy as np
import trimesh

WALL = 0.15  # metres, as thick as floor and ceiling
CLUTTER = 0.04  # things per square metre
HALF_TURN = trimesh.transformations.rotation_matrix(np.pi, [0, 0, 1])


def block(x, y, z):
    """x, y, z: from and to, metres."""
    return trimesh.creation.box(bounds=np.transpose([x, y, z]))


def shell(length, width, height):
    """Floor, ceiling and four walls around a room whose corner is the origin."""
    x, y, z = (-WALL, length + WALL), (-WALL, width + WALL), (-WALL, height + WALL)
    return [
        block(x, y, (-WALL, 0)),
        block(x, y, (height, height + WALL)),
        block((-WALL, 0), y, z),
        block((length, length + WALL), y, z),
        block(x, (-WALL, 0), z),
        block(x, (width, width + WALL), z),
    ]


def clutter(rng, length, width):
    """Low boxes and bins, and posts."""
    parts = []
    for _ in range(rng.poisson(CLUTTER * length * width)):
        if rng.random() < 0.6:
            size = rng.uniform(0.2, [0.9, 0.7, 1.1])
            part = trimesh.creation.box(size)
        else:
            size = np.array([0, 0, rng.uniform(0.4, 1.8)])
            part = trimesh.creation.cylinder(rng.uniform(0.05, 0.3), size[2], sections=20)
        turn = trimesh.transformations.rotation_matrix(rng.uniform(0, np.pi), [0, 0, 1])
        part.apply_transform(turn)
        x, y = rng.uniform(0.3, [length - 0.3, width - 0.3])
        parts.append(part.apply_translation([x, y, size[2] / 2]))
    return parts


def rack(rng):
    """Of one bay, 0 to its length in x, with goods that differ from shelf to shelf."""
    length, depth, level = rng.uniform(2.0, 2.9), rng.uniform(0.8, 1.1), rng.uniform(0.9, 1.4)
    levels = int(rng.integers(2, 4))
    parts = [
        block((x, x + 0.09), (y, y + 0.09), (0, levels * level + 0.4))
        for x in (0, length - 0.09)
        for y in (0, depth - 0.09)
    ]
    for k in range(levels + 1):
        height = max(0.1, k * level)
        parts.append(block((0, length), (0, depth), (height, height + 0.06)))
        at = rng.uniform(0.1, 0.4)
        while k < levels and at < length - 0.5:
            wide = rng.uniform(0.4, 1.1)
            if rng.random() < 0.75:
                top = height + 0.06 + rng.uniform(0.3, 0.75) * level
                inside = rng.uniform(0.05, 0.2)
                end = min(at + wide, length - 0.1)
                parts.append(block((at, end), (inside, depth - 0.1), (height + 0.06, top)))
            at += wide + rng.uniform(0.05, 0.4)
    return trimesh.util.concatenate(parts), length, depth


def racks(rng):
    unit, bay, depth = rack(rng)
    bays, rows = int(rng.integers(2, 4)), 2 * int(rng.integers(2, 4))
    aisle, side = rng.uniform(1.7, 2.4), rng.uniform(1.6, 2.4)
    cross = rng.uniform(2.2, 3.2)  # between the halves
    length = 2 * (side + bays * bay) + cross
    width = rows * depth + (rows + 1) * aisle
    height = rng.uniform(4.5, 6.5)
    half = [
        unit.copy().apply_translation([side + i * bay, aisle + k * (depth + aisle), 0])
        for i in range(bays)
        for k in range(rows)
    ]
    for x in np.arange(1, length / 2, rng.uniform(2.5, 4)):  # columns in the walls
        half.append(block((x, x + 0.3), (0, 0.25), (0, height)))
    y = rng.uniform(0.2, 0.7) * width  # a gate in the short wall, with its frame
    half += [block((0, 0.12), (y + s, y + s + 0.2), (0, 3)) for s in (0, 3.2)]
    half.append(block((0, 0.12), (y, y + 3.4), (3, 3.2)))
    centre = np.array([length / 2, width / 2, 0])
    one = trimesh.util.concatenate(half).apply_translation(-centre)
    other = one.copy().apply_transform(HALF_TURN)
    both = [part.apply_translation(centre) for part in (one, other)]
    return [*shell(length, width, height), *both, *clutter(rng, length, width)]


def corridors(rng):
    count, width = int(rng.integers(3, 6)), rng.uniform(1.9, 2.5)
    room, height = rng.uniform(2.5, 3.5), rng.uniform(2.5, 2.9)
    doors, pitch = int(rng.integers(3, 6)), rng.uniform(2.4, 3.4)
    leaf, recess, frame = rng.uniform(0.8, 1.0), rng.uniform(0.08, 0.2), 0.06
    cross = rng.uniform(2.0, 2.6)
    arm = doors * pitch
    before = int(rng.integers(0, 2)) * arm  # the cross corridor at the end, or in the middle
    length, whole = before + cross + arm, count * width + (count - 1) * room
    parts = shell(length, whole, height)
    starts = [x for x, there in ((0, before > 0), (before + cross, True)) if there]
    for k in range(count - 1):
        low = width + k * (width + room)
        for start in starts:
            x, y = (start, start + arm), (low, low + room)
            parts.append(block(x, (y[0] + recess, y[1] - recess), (0, height)))
            for j in range(doors + 1):  # the wall between two doors
                end = [start + (j - 0.5) * pitch + leaf / 2, start + (j + 0.5) * pitch - leaf / 2]
                end = np.clip(end, *x)
                for side in ((y[0], y[0] + recess), (y[1] - recess, y[1])):
                    parts.append(block(end, side, (0, height)))
            for j in range(doors):
                a = start + (j + 0.5) * pitch - leaf / 2
                for face, out in ((y[0], -1), (y[1], 1)):
                    across = sorted((face, face + out * 0.03))
                    parts.append(
                        block((a, a + leaf), sorted((face, face - out * recess)), (2.05, height))
                    )
                    parts += [
                        block((b - frame, b), across, (0, 2.05)) for b in (a, a + leaf + frame)
                    ]
                    handle = sorted((face - out * recess, face - out * (recess - 0.06)))
                    parts.append(block((a + 0.08, a + 0.2), handle, (1.0, 1.05)))
    return [*parts, *clutter(rng, length, whole)]


def car(rng):
    length, width = rng.uniform(3.7, 4.8), rng.uniform(1.65, 1.9)
    height, bonnet = rng.uniform(1.4, 1.75), rng.uniform(0.75, 0.95)
    front, back = rng.uniform(0.9, 1.3), rng.uniform(0.1, 0.8)
    outline = [
        (0, 0.3), (0, bonnet - 0.1), (front, bonnet), (front + 0.7, height),
        (length - back - 0.4, height), (length - back, bonnet), (length, bonnet - 0.1), (length, 0.3),
    ]  # fmt: skip
    side = np.array([[x, y, z] for y in (0, width) for x, z in outline])
    body = trimesh.convex.convex_hull(side[[k for k in range(16) if k % 8 not in (3, 4)]])
    cabin = [
        (front, bonnet),
        (front + 0.7, height),
        (length - back - 0.4, height),
        (length - back, bonnet),
    ]
    roof = [
        [x, y, z] for x, z in cabin for y in ((0.08, width - 0.08) if z == height else (0, width))
    ]
    wheels = []
    for x in (0.75, length - 0.75):
        for y in (0.1, width - 0.1):
            wheel = trimesh.creation.cylinder(0.32, 0.2, sections=24)
            wheel.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
            wheels.append(wheel.apply_translation([x, y, 0.32]))
    whole = trimesh.util.concatenate([body, trimesh.convex.convex_hull(roof), *wheels])
    return whole.apply_translation([-length / 2, -width / 2, 0])


def garage(rng):
    height, slot = rng.uniform(2.25, 2.6), rng.uniform(2.5, 2.8)
    across = 2 if rng.random() < 0.5 else 3  # slots between two columns
    fields, lanes = int(rng.integers(3, 5)), int(rng.integers(1, 3))
    lane, deep, column = rng.uniform(5.0, 6.0), 5.0, rng.uniform(0.3, 0.5)
    length, width = fields * across * slot + column, lanes * (lane + 2 * deep)
    parts = shell(length, width, height)
    beam = rng.uniform(0.2, 0.35)
    cars = [car(rng) for _ in range(4)]
    rows = [
        (k * (lane + 2 * deep) + at, turn)
        for k in range(lanes)
        for at, turn in ((deep, 1), (deep + lane, -1))
    ]
    for i in range(fields + 1):
        x = (i * across * slot, i * across * slot + column)
        parts.append(block(x, (0, width), (height - beam, height)))
        for y, turn in rows:
            near = sorted((y - 0.6 * turn, y - (0.6 + column) * turn))
            parts.append(block(x, near, (0, height)))
    for y in rng.uniform(1, width - 1, 2):  # pipes
        pipe = trimesh.creation.cylinder(rng.uniform(0.05, 0.12), length, sections=16)
        pipe.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
        parts.append(pipe.apply_translation([length / 2, y, height - beam - 0.15]))
    occupied = rng.uniform(0.25, 0.6)
    for y, turn in rows:
        for i in range(fields * across):
            if rng.random() > occupied:
                continue
            one = cars[rng.integers(4)].copy()
            heading = np.pi / 2 * rng.choice([1, -1]) + rng.normal(0, 0.03)
            one.apply_transform(trimesh.transformations.rotation_matrix(heading, [0, 0, 1]))
            x = column / 2 + (i + 0.5) * slot + rng.normal(0, 0.08)
            parts.append(one.apply_translation([x, y - (2.5 + rng.normal(0, 0.1)) * turn, 0]))
    return [*parts, *clutter(rng, length, width)]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    kinds = {"racks": racks, "corridors": corridors, "garage": garage}
    parser.add_argument("kind", choices=kinds)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    mesh = trimesh.util.concatenate(kinds[arguments.kind](np.random.default_rng(arguments.seed)))
    mesh.export(arguments.output)
    low, high = mesh.bounds
    print(f"{len(mesh.faces)} triangles, from {low.round(2)} to {high.round(2)} m")


main()
