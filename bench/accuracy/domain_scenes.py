# SPDX-License-Identifier: BSD-3-Clause
"""Scenes of sensors other than a depth camera in rooms, for bench/accuracy/domains.py: shapes, and sensors
that see them by ray casting. Every scene is a list of clouds with their poses and of pairs to try.

* `parts`: machined parts (boxes, cylinders, holes), range scans of them, and their models.
* `figures`: rounded shapes, range scans of them, and their models.
* `objects`: rounded shapes, scanned from around them; pairs of scans.
* `street`: a spinning LiDAR of 16 to 128 rings on a vehicle: ground, buildings, cars, trees, poles.
* `blocks`: the same sensor in such a street, and the block model of it (boxes, Level of Detail 1) or of
  another one.
* `hall`: the same sensor, or a terrestrial scanner, in halls with columns, shelves and machines.

Everything follows from a seed. Needs numpy, scipy, trimesh, embreex and manifold3d."""

from typing import NamedTuple

import numpy as np
import trimesh
from scipy.ndimage import gaussian_filter
from trimesh.ray.ray_pyembree import RayMeshIntersector


class Scan(NamedTuple):
    points: np.ndarray  # (n, 3) in the frame of the sensor, or of the model
    world_from_scan: np.ndarray
    model: trimesh.Trimesh | None = None  # this cloud is the surface of a model
    place: int = 0  # clouds of different places have no true pose
    symmetries: tuple = ()  # motions of the model onto itself, in its frame


class Scene(NamedTuple):
    scans: list
    pairs: list  # (source, target)
    voxel_size: str
    degrees: float  # a pose is correct within this angle ...
    distance: float  # ... and this distance of the middle of the source
    model_points: int = 20000  # of a model that is given as points


def truths(scene, source, target):
    """Every correct pose of the source in the frame of the target, by the symmetries of the model; none for different
    places.
    """
    s, t = scene.scans[source], scene.scans[target]
    if s.place != t.place:
        return []
    motion = np.linalg.inv(t.world_from_scan) @ s.world_from_scan
    if t.model is not None:
        return [symmetry @ motion for symmetry in t.symmetries or (np.eye(4),)]
    return [motion @ symmetry for symmetry in s.symmetries or (np.eye(4),)]


def rotation_about(axis, angle):
    return trimesh.transformations.rotation_matrix(angle, axis)


def translation(x, y, z):
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


def random_rotation(rng):
    return trimesh.transformations.quaternion_matrix((q := rng.normal(size=4)) / np.linalg.norm(q))


def cast(mesh, origin, directions):
    """Ranges of the rays, infinite where nothing is hit; and the cosines of incidence."""
    caster = RayMeshIntersector(mesh)
    triangles = caster.intersects_first(np.broadcast_to(origin, directions.shape), directions)
    ranges, cosines = np.full(len(directions), np.inf), np.zeros(len(directions))
    hit = np.flatnonzero(triangles >= 0)
    normals = mesh.face_normals[triangles[hit]]
    on_face = mesh.triangles[triangles[hit]][:, 0]
    slope = (normals * directions[hit]).sum(1)
    ok = np.abs(slope) > 1e-9
    ranges[hit[ok]] = ((on_face[ok] - origin) * normals[ok]).sum(1) / slope[ok]
    cosines[hit] = np.abs(slope)
    return ranges, cosines


# ---- parts and objects: metres

SCAN_PIXELS = 220  # of a range image along each side
SMOOTH_PIXELS = 4.0  # width of its smooth errors
CLUTTERED = 0.5  # share of the scans of parts that see something else, too


def range_scan(mesh, world_from_sensor, rng, noise, field=0.6):
    """A range image; the sensor looks along its z axis. Its errors are white and smooth noise of equal size and a few
    points between the edges of objects; points that are seen at more than 80 degrees are lost.
    """
    grid = np.linspace(-field / 2, field / 2, SCAN_PIXELS)
    x, y = np.meshgrid(grid, grid)
    local = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], 1)
    local /= np.linalg.norm(local, axis=1)[:, None]
    ranges, cosines = cast(mesh, world_from_sensor[:3, 3], local @ world_from_sensor[:3, :3].T)
    image = ranges.reshape(x.shape)
    flying = (rng.random(image.shape) < 0.3) & np.isfinite(image)
    left = np.roll(image, 1, 1)
    with np.errstate(invalid="ignore"):
        edge = flying & np.isfinite(left) & (np.abs(image - left) > 4 * noise)
    image[edge] += rng.random(edge.sum()) * (left[edge] - image[edge])
    bumps = gaussian_filter(rng.normal(size=image.shape), SMOOTH_PIXELS)
    bumps *= noise / bumps.std()
    ranges = (image + bumps).ravel()
    seen = np.isfinite(ranges) & (cosines > 0.17) & (rng.random(len(ranges)) > 0.02)
    ranges = ranges[seen] + rng.normal(0, noise, seen.sum())
    return local[seen] * ranges[:, None]


def looking_at_origin(direction, distance, roll):
    z = -direction / np.linalg.norm(direction)
    x = np.cross([0.3, 0.2, 0.9], z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], 1)
    pose[:3, 3] = -z * distance
    return pose @ rotation_about([0, 0, 1], roll)


def part(rng, size, symmetric):
    """A machined part about the origin, and its symmetries."""
    base = rng.uniform(0.5, 1, 3) * size
    if rng.random() < 0.3:
        solid = trimesh.creation.cylinder(base[0] / 2, base[2], sections=64)
    else:
        solid = trimesh.creation.box(base)
    if symmetric:  # of n equal sides about z
        sides = int(rng.integers(2, 5))
        radius, height = rng.uniform(0.1, 0.25) * size, rng.uniform(0.3, 0.9) * size
        distance = rng.uniform(0.25, 0.45) * size
        solid = trimesh.creation.cylinder(base[0] / 2, base[2] / 2, sections=120)
        turns = [rotation_about([0, 0, 1], 2 * np.pi * k / sides) for k in range(sides)]
        for turn in turns:
            piece = trimesh.creation.cylinder(radius, height, sections=48)
            piece.apply_transform(turn @ translation(distance, 0, height / 3))
            solid = trimesh.boolean.union([solid, piece])
        return solid, tuple(turns)
    for _ in range(int(rng.integers(2, 6))):
        if rng.random() < 0.5:
            piece = trimesh.creation.box(rng.uniform(0.15, 0.6, 3) * size)
        else:
            piece = trimesh.creation.cylinder(
                rng.uniform(0.06, 0.22) * size, rng.uniform(0.2, 1.2) * size, sections=48
            )
        if rng.random() < 0.6:  # machined parts have right angles
            quarter = rng.integers(3)
            piece.apply_transform(rotation_about(np.eye(3)[quarter], np.pi / 2))
        else:
            piece.apply_transform(random_rotation(rng))
        piece.apply_transform(translation(*(rng.uniform(-0.45, 0.45, 3) * base)))
        made = (trimesh.boolean.union if rng.random() < 0.55 else trimesh.boolean.difference)(
            [solid, piece]
        )
        if made.volume > 0.2 * solid.volume:
            solid = max(made.split(only_watertight=False), key=lambda m: m.area)
    solid.apply_translation(-solid.bounds.mean(0))
    return solid, (np.eye(4),)


def scans_and_models(rng, size, solids):
    """Models, and scans from around them: each scan against each model."""
    scans, pairs = [], []
    noise = size * 10 ** rng.uniform(-3.0, -1.8)
    for k, (solid, symmetries) in enumerate(solids):
        scans.append(Scan(None, np.eye(4), solid, k, symmetries))
    for k, (solid, symmetries) in enumerate(solids):
        for _ in range(4):
            pose = looking_at_origin(rng.normal(size=3), 4 * size, rng.uniform(0, 2 * np.pi))
            seen = solid
            if rng.random() < CLUTTERED:  # a piece of a fixture or of the table
                left = trimesh.creation.box(rng.uniform(0.05, 0.7, 3) * size)
                left.apply_transform(random_rotation(rng))
                left.apply_translation(rng.normal(0, 0.45 * size, 3))
                seen = trimesh.util.concatenate([solid, left])
            points = range_scan(seen, pose, rng, noise, 0.5)
            if len(points) > 400:
                scans.append(Scan(points, pose, None, k, symmetries))
                pairs += [(len(scans) - 1, model) for model in range(len(solids))]
    return Scene(scans, pairs, "auto", 10.0, 0.07 * size)


def parts(seed):
    """Three parts and their models."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.05, 0.4)
    kinds = rng.random(3) < 0.25
    return scans_and_models(rng, size, [part(rng, size, kind) for kind in kinds])


def blob(rng, size):
    """A rounded shape with limbs."""
    body = trimesh.creation.icosphere(4)
    direction = body.vertices / np.linalg.norm(body.vertices, axis=1)[:, None]
    radius = np.ones(len(direction))
    for _ in range(int(rng.integers(5, 14))):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        width, height = rng.uniform(0.15, 0.7), rng.uniform(-0.35, 0.9)
        radius += height * np.exp((direction @ axis - 1) / width**2)
    body.vertices = direction * np.maximum(radius, 0.25)[:, None] * rng.uniform(0.6, 1.2, 3)
    body.vertices *= size / np.ptp(body.vertices, axis=0).max()
    body.apply_translation(-body.bounds.mean(0))
    return body


def figures(seed):
    """Three rounded shapes and their models."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.05, 0.4)
    return scans_and_models(rng, size, [(blob(rng, size), (np.eye(4),)) for _ in range(3)])


def objects(seed):
    """Two shapes on turntables: pairs of scans of one shape, and of both."""
    rng = np.random.default_rng(seed)
    size, scans, pairs = rng.uniform(0.1, 0.5), [], []
    noise = size * 10 ** rng.uniform(-3.3, -2.0)
    for place in range(2):
        solid = blob(rng, size) if rng.random() < 0.6 else part(rng, size, False)[0]
        step, tilt = rng.uniform(20, 50), rng.uniform(-0.3, 0.8)
        for k in range(6):
            turn = np.radians(k * step)
            pose = looking_at_origin(
                np.array([np.cos(turn), np.sin(turn), tilt]), 3 * size, rng.normal(0, 0.1)
            )
            scans.append(Scan(range_scan(solid, pose, rng, noise), pose, None, place, (np.eye(4),)))
    for i in range(len(scans)):
        for j in range(i + 1, len(scans)):
            same = scans[i].place == scans[j].place
            if (same and j - i <= 3) or (not same and (i + j) % 4 == 0):
                pairs.append((j, i))
    return Scene(scans, pairs, "auto", 10.0, 0.07 * size)


# ---- LiDAR: metres

RINGS = {16: (-15, 15), 32: (-30, 10), 64: (-24.8, 2), 128: (-22.5, 22.5)}  # degrees


def spin(mesh, world_from_sensor, rings, rng, noise=0.02, most=90.0, columns=1200):
    """One turn of a spinning LiDAR, in its frame."""
    low, high = np.radians(RINGS[rings])
    elevation, azimuth = np.meshgrid(
        np.linspace(low, high, rings), np.arange(columns) * 2 * np.pi / columns, indexing="ij"
    )
    local = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        -1,
    ).reshape(-1, 3)
    ranges, cosines = cast(mesh, world_from_sensor[:3, 3], local @ world_from_sensor[:3, :3].T)
    seen = np.isfinite(ranges) & (ranges < most) & (ranges > 1.0)
    seen &= rng.random(len(ranges)) < np.minimum(0.97, 8 * cosines)
    return local[seen] * (ranges[seen] + rng.normal(0, noise, seen.sum()))[:, None]


def panorama(mesh, world_from_sensor, rng, noise=0.004, most=60.0):
    """A scan of a terrestrial scanner on a tripod."""
    elevation, azimuth = np.meshgrid(
        np.radians(np.linspace(-60, 85, 260)), np.linspace(0, 2 * np.pi, 640), indexing="ij"
    )
    local = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        -1,
    ).reshape(-1, 3)
    ranges, cosines = cast(mesh, world_from_sensor[:3, 3], local @ world_from_sensor[:3, :3].T)
    seen = np.isfinite(ranges) & (ranges < most) & (cosines > 0.05)
    return local[seen] * (ranges[seen] + rng.normal(0, noise, seen.sum()))[:, None]


def box(size, centre, turn=0.0):
    out = trimesh.creation.box(size)
    out.apply_transform(translation(*centre) @ rotation_about([0, 0, 1], turn))
    return out


def car(rng):
    length, width, height = rng.uniform(3.6, 5), rng.uniform(1.6, 1.9), rng.uniform(0.7, 1.1)
    roof = box(
        [length * rng.uniform(0.4, 0.7), width * 0.9, 0.6],
        [rng.uniform(-0.3, 0.3), 0, 0.3 + height],
    )
    return [box([length, width, height], [0, 0, 0.25 + height / 2]), roof]


def tree(rng):
    height = rng.uniform(3, 8)
    trunk = trimesh.creation.cylinder(rng.uniform(0.1, 0.3), height * 0.6, sections=10)
    trunk.apply_translation([0, 0, height * 0.3])
    middle, spread = np.array([0, 0, height * 0.75]), rng.uniform(0.8, 2.2)
    leaves = rng.normal(size=(260, 3)) * [spread, spread, height * 0.18] * 0.6 + middle
    corners = leaves[:, None] + rng.normal(size=(260, 3, 3)) * 0.25
    crown = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(780).reshape(-1, 3), process=False)
    return [trunk, crown]


def facade(rng, length, depth, height):
    """A house along x with recesses and a step of its front."""
    out = [box([length, depth, height], [0, depth / 2, height / 2])]
    for _ in range(int(rng.integers(1, 5))):
        out.append(
            box(
                [rng.uniform(0.8, 3), rng.uniform(0.3, 1.5), rng.uniform(2, height)],
                [rng.uniform(-0.45, 0.45) * length, 0, rng.uniform(0, 1) * height / 2],
            )
        )
    return out


def town(rng, extent=160.0):
    """A street along x, mostly with a crossing: its mesh, its width, and the ground and the bodies of its houses."""
    grid = trimesh.creation.box([extent, extent, 0.2])
    grid.apply_translation([0, 0, -0.1])
    pieces, bodies = [grid], [grid]
    width, built = rng.uniform(7, 14), rng.uniform(0.3, 0.95)
    crossing = rng.uniform(-20, 20) if rng.random() < 0.7 else np.inf
    for side in (-1, 1):
        x = -extent / 2
        while x < extent / 2 - 8:
            length = rng.uniform(7, 25)
            middle = x + length / 2
            x += length + (rng.uniform(2, 10) if rng.random() < 0.4 else 0.0)
            if abs(middle - crossing) < length / 2 + 6:
                continue
            if rng.random() < built:
                back = rng.uniform(0, 5)
                house = facade(rng, length, rng.uniform(6, 12), rng.uniform(4, 15))
                for piece in house:
                    if side < 0:
                        piece.apply_transform(rotation_about([0, 0, 1], np.pi))
                    piece.apply_translation([middle, side * (width / 2 + 2 + back), 0])
                    pieces.append(piece)
                bodies.append(house[0])
            else:
                for _ in range(int(rng.integers(0, 4))):
                    place = [
                        middle + rng.uniform(-0.5, 0.5) * length,
                        side * (width / 2 + rng.uniform(1, 12)),
                        0,
                    ]
                    for piece in tree(rng):
                        pieces.append(piece.apply_translation(place))
        for _ in range(int(rng.integers(4, 22))):
            at = [rng.uniform(-0.45, 0.45) * extent, side * (width / 2 - 1.2), 0]
            if abs(at[0] - crossing) < 6:
                continue
            for piece in car(rng):
                piece.apply_transform(
                    translation(*at) @ rotation_about([0, 0, 1], rng.normal(0, 0.05))
                )
                pieces.append(piece)
        for _ in range(int(rng.integers(3, 12))):
            pole = trimesh.creation.cylinder(
                rng.uniform(0.05, 0.2), (tall := rng.uniform(2, 8)), sections=8
            )
            pieces.append(
                pole.apply_translation(
                    [rng.uniform(-0.45, 0.45) * extent, side * (width / 2 + 0.6), tall / 2]
                )
            )
    return trimesh.util.concatenate(pieces), width, bodies


def spread_pairs(scans, rng, positives, negatives, most):
    """Pairs of one place up to a distance, and of different places."""
    near, far = [], []
    for i in range(len(scans)):
        for j in range(i + 1, len(scans)):
            distance = np.linalg.norm(
                scans[i].world_from_scan[:3, 3] - scans[j].world_from_scan[:3, 3]
            )
            if scans[i].place != scans[j].place:
                far.append((j, i))
            elif distance < most:
                near.append((j, i))
    rng.shuffle(near)
    rng.shuffle(far)
    return [tuple(map(int, p)) for p in near[:positives] + far[:negatives]]


def on_the_street(rng, width):
    """Pose of a sensor on a vehicle."""
    heading = rng.choice([0, np.pi]) + rng.normal(0, 0.15)
    if rng.random() < 0.25:
        heading += rng.uniform(-np.pi, np.pi)
    pose = translation(
        rng.uniform(-25, 25), rng.uniform(-0.3, 0.3) * (width - 4), rng.uniform(1.6, 2.1)
    )
    pose = pose @ rotation_about([0, 0, 1], heading)
    return pose @ rotation_about(rng.normal(size=3), rng.normal(0, 0.02))


def street(seed, rings=None):
    """rings: of the LiDAR; drawn where it is not given."""
    rng = np.random.default_rng(seed)
    drawn = int(rng.choice([16, 16, 32, 64, 128]))
    rings = rings or drawn
    scans = []
    for place in range(2):
        mesh, width, _ = town(rng)
        for _ in range(6):
            pose = on_the_street(rng, width)
            scans.append(Scan(spin(mesh, pose, rings, rng), pose, None, place, (np.eye(4),)))
    return Scene(scans, spread_pairs(scans, rng, 16, 8, 30), "auto", 5.0, 1.0)


def block_model(rng, bodies):
    """The bodies as a city model has them: heights and fronts are off, and here and there a house is missing."""
    kept = [bodies[0]]
    for body in bodies[1:]:
        if rng.random() < 0.07:
            continue
        kept.append(body.copy())
        low, high = body.bounds
        size = high - low
        kept[-1].apply_translation(-low)
        kept[-1].apply_scale((size + rng.normal(0, [0.2, 0.2, 0.5])).clip(1) / size)
        kept[-1].apply_translation(low + [*rng.normal(0, 0.1, 2), 0])
    return trimesh.util.concatenate(kept)


def blocks(seed):
    rng = np.random.default_rng(seed)
    rings = int(rng.choice([16, 16, 32, 64]))
    scans, models = [], []
    for place in range(2):
        mesh, width, bodies = town(rng)
        for _ in range(3):
            pose = on_the_street(rng, width)
            scans.append(Scan(spin(mesh, pose, rings, rng), pose, None, place))
        models.append(Scan(None, np.eye(4), block_model(rng, bodies), place))
    pairs = [(k, len(scans) + m) for k in range(len(scans)) for m in range(len(models))]
    return Scene(scans + models, pairs, str(rng.choice(["auto", "0.5"])), 5.0, 1.0, 400000)


def hall_mesh(rng):
    length, width, height = rng.uniform(20, 60), rng.uniform(12, 30), rng.uniform(4, 10)
    room = trimesh.creation.box([length, width, height])
    room.apply_translation([0, 0, height / 2])
    room.invert()
    pieces = [room]
    pitch = rng.uniform(4, 9)
    if rng.random() < 0.7:
        for x in np.arange(-length / 2 + pitch, length / 2 - 1, pitch):
            for y in (-width / 4, width / 4):
                pieces.append(box([0.4, 0.4, height], [x, y, height / 2]))
    for _ in range(int(rng.integers(8, 40))):
        size = rng.uniform([0.4, 0.4, 0.5], [4, 1.5, min(3.5, height - 0.5)])
        place = [
            rng.uniform(-0.47, 0.47) * length,
            rng.uniform(-0.47, 0.47) * width,
            size[2] / 2,
        ]
        turn = rng.choice([0, np.pi / 2]) if rng.random() < 0.7 else rng.uniform(0, np.pi)
        pieces.append(box(size, place, turn))
    for _ in range(int(rng.integers(0, 12))):
        pipe = trimesh.creation.cylinder(rng.uniform(0.05, 0.5), rng.uniform(1, 6), sections=16)
        if rng.random() < 0.5:
            pipe.apply_transform(rotation_about([0, 1, 0], np.pi / 2))
        pipe.apply_translation(
            [
                rng.uniform(-0.4, 0.4) * length,
                rng.uniform(-0.45, 0.45) * width,
                rng.uniform(1, height),
            ]
        )
        pieces.append(pipe)
    return trimesh.util.concatenate(pieces), length, width


def hall(seed, scanner=None):
    """scanner: a terrestrial scanner, not a spinning LiDAR; drawn where it is not given."""
    rng = np.random.default_rng(seed)
    drawn = rng.random() < 0.5
    scanner = drawn if scanner is None else scanner
    rings = int(rng.choice([16, 32, 64]))
    scans = []
    for place in range(2):
        mesh, length, width = hall_mesh(rng)
        for _ in range(6):
            pose = translation(
                rng.uniform(-0.4, 0.4) * length,
                rng.uniform(-0.4, 0.4) * width,
                rng.uniform(1.2, 1.9),
            )
            pose = pose @ rotation_about([0, 0, 1], rng.uniform(0, 2 * np.pi))
            points = panorama(mesh, pose, rng) if scanner else spin(mesh, pose, rings, rng, most=60)
            if len(points) > 3000:
                scans.append(Scan(points, pose, None, place, (np.eye(4),)))
    return Scene(scans, spread_pairs(scans, rng, 16, 8, 20), "auto", 5.0, 0.5)


SCENES = {
    "parts": parts,
    "figures": figures,
    "objects": objects,
    "street": street,
    "blocks": blocks,
    "hall": hall,
}
