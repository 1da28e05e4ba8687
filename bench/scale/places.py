# SPDX-License-Identifier: BSD-3-Clause
"""Textured rooms and houses, their pictures and their laser scans. Needs numpy, open3d, and OpenCV for Python."""

import itertools

import cv2
import numpy as np
import open3d

SIZE, FOCAL, RADIAL = (800, 600), 560.0, -0.04  # the lens: pixels, and of r^2
TEXTURE = 2048  # texels of a side
TEXTURES = ["paint", "wallpaper", "wood", "carpet", "poster", "books", "brick", "tiles", "grass", "glass"]  # fmt: skip


class Place:
    """Triangles with an index of a texture, a turn about z and an offset in the texture."""

    def __init__(self, rng, texel):
        self.rng, self.texel, self.parts, self.cameras, self.scanners = rng, texel, [], [], []

    def add(self, triangles, texture, turn=0.0, at=(0, 0, 0)):
        c, s = np.cos(turn), np.sin(turn)
        moved = triangles @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + at
        self.parts.append((moved, TEXTURES.index(texture), turn, self.rng.uniform(0, 2048, 2)))

    def box(self, low, high, texture, turn=0.0, at=(0, 0, 0)):
        low, high = np.minimum(low, high), np.maximum(low, high)
        mesh = open3d.geometry.TriangleMesh.create_box(*(high - low))
        self.add(triangles_of(mesh) + low, texture, turn, at)

    def look(self, eye, at):
        """A camera: rows right, down, ahead."""
        ahead = np.asarray(at, float) - eye
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 0, 1])
        right /= np.linalg.norm(right)
        self.cameras.append(
            (np.stack([right, np.cross(ahead, right), ahead]), np.asarray(eye, float))
        )

    def scene(self):
        triangles = np.concatenate([p[0] for p in self.parts])
        scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(
            triangles.reshape(-1, 3).astype(np.float32),
            np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3),
        )
        self.part_of = np.repeat(np.arange(len(self.parts)), [len(p[0]) for p in self.parts])
        return scene


def triangles_of(mesh):
    return np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]


def textures(rng):
    """One picture for each of TEXTURES, that can be continued."""

    def fractal(shape, first, amplitude):
        out = np.zeros((TEXTURE, TEXTURE), np.float32)
        for k in range(first, 11):
            cells = [max(1, int(2**k * s)) for s in shape]
            out += cv2.resize(
                rng.normal(size=cells).astype(np.float32), (TEXTURE, TEXTURE)
            ) * 0.75 ** (k - first)
        return amplitude * out / out.std()

    def rectangles(count, least, most, image):
        for _ in range(count):
            x, y = rng.integers(0, TEXTURE, 2)
            w, h = rng.uniform(least, most, 2).astype(int)
            cv2.rectangle(image, (x, y), (x + w, y + h), float(rng.uniform(20, 240)), -1)
        return image

    def bricks(wide, high, tone):
        row, column = np.indices((TEXTURE, TEXTURE)) // np.array([[[high]], [[wide]]])
        tones = rng.normal(tone, 18, (TEXTURE // high + 1, TEXTURE // wide + 1))
        image = tones[row, column].astype(np.float32) + fractal((1, 1), 6, 8)
        image[::high] = image[1::high] = 200
        return image

    poster = rectangles(400, 20, 400, np.full((TEXTURE, TEXTURE), 200, np.uint8))
    for _ in range(400):
        at = tuple(map(int, rng.integers(0, TEXTURE, 2)))
        if rng.random() < 0.5:
            cv2.circle(poster, at, int(rng.integers(5, 90)), float(rng.uniform(20, 240)), -1)
        else:
            word = "".join(chr(c) for c in rng.integers(65, 91, 5))
            cv2.putText(
                poster, word, at, 0, float(rng.uniform(1, 4)), float(rng.uniform(0, 255)), 4
            )
    books = np.repeat(rng.uniform(30, 230, TEXTURE // 12 + 1), 12)[None, :TEXTURE] + fractal(
        (1, 1), 5, 14
    )
    motif = np.hypot(*(np.indices((TEXTURE, TEXTURE)) % 64 - 32)) < 14
    return np.stack(
        [
            205 + fractal((1, 1), 1, 1.5),
            170 + 18 * motif + fractal((1, 1), 4, 12),
            140 + fractal((1, 1 / 16), 5, 22),
            120 + fractal((1, 1), 7, 28),
            poster + fractal((1, 1), 8, 6),
            books.astype(np.float32),
            bricks(24, 8, 120),
            bricks(32, 36, 90),
            100 + fractal((1, 1), 4, 26),
            np.full((TEXTURE, TEXTURE), 60, np.float32),
        ]
    ).astype(np.float32)  # fmt: skip


def wall(place, a, b, height, normal):
    """Panels from a to b, some of them plain, and posters on it."""
    rng, thick = place.rng, 0.04
    a, b, normal = (np.asarray(v, float) for v in (a, b, normal))
    length = np.linalg.norm(b - a)
    along = (b - a) / length
    cuts = np.r_[0, np.sort(rng.uniform(0, length, int(length / 1.6))), length]
    for s, e in itertools.pairwise(cuts):
        low, high = a + along * s - normal * thick, a + along * e
        place.box([*low, 0], [*high, height], "paint" if rng.random() < 0.4 else "wallpaper")
    for _ in range(int(length / 1.5)):
        s, wide, z, tall = (
            rng.uniform(0.2, length - 1),
            rng.uniform(0.3, 0.8),
            rng.uniform(0.8, 1.5),
            rng.uniform(0.3, 0.8),
        )
        low, high = a + along * s, a + along * (s + wide) + normal * 0.02
        place.box([*low, z], [*high, z + tall], "poster")


def furnish(place, x0, length, width, height, sides):
    rng = place.rng
    place.box((x0, 0, -0.1), (x0 + length, width, 0), rng.choice(["wood", "carpet"]))
    place.box((x0, 0, height), (x0 + length, width, height + 0.1), "paint")
    centre = np.array([x0 + length / 2, width / 2])
    corner = rng.uniform([0.3, 0.3], [0.6, 0.6])
    place.box((x0, 0, 0), (x0 + corner[0], corner[1], height), "wallpaper")
    for _ in range(7):  # along the walls
        side = int(rng.choice(sides))
        run = length if side % 2 == 0 else width
        deep, wide, tall = (
            rng.uniform(0.3, 0.6),
            rng.uniform(0.5, 1.6),
            rng.choice([0.45, 0.8, 1.1, 1.9]) + rng.uniform(0, 0.1),
        )
        at = rng.uniform(-0.5, 0.5) * (run - wide)
        turn = side * np.pi / 2
        out = (width if side % 2 == 0 else length) / 2
        middle = [*centre, 0]
        place.box(
            (at - wide / 2, -out, 0),
            (at + wide / 2, deep - out, tall),
            rng.choice(["wood", "books", "poster"]),
            turn,
            middle,
        )
        if tall < 1.2:
            size = rng.uniform(0.1, 0.3, 3)
            place.box(
                (at, 0.1 - out, tall),
                (at + size[0], 0.1 + size[1] - out, tall + size[2]),
                "poster",
                turn,
                middle,
            )
    turn, half = rng.uniform(0, np.pi), rng.uniform([0.4, 0.3], [0.8, 0.5])
    middle = [*(centre + rng.uniform(-0.4, 0.4, 2)), 0]
    place.box((*-half, 0.68), (*half, 0.74), "wood", turn, middle)  # a table
    for x, y in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        leg = half * [x, y] * 0.9
        place.box((*(leg - 0.04), 0), (*(leg + 0.04), 0.68), "wood", turn, middle)
    for _ in range(3):
        at, size = rng.uniform(-0.7, 0.4, 2) * half, rng.uniform(0.1, 0.3, 3)
        place.box((*at, 0.74), (*(at + size[:2]), 0.74 + size[2]), "poster", turn, middle)
    ball = triangles_of(open3d.geometry.TriangleMesh.create_sphere(rng.uniform(0.15, 0.35)))
    place.add(
        ball, "poster", 0, [*(centre + rng.uniform(0.8, 1.2, 2) * rng.choice([-1, 1], 2)), 0.3]
    )
    return centre


def ring(place, centre, half, count, height):
    """Pictures from an ellipse, each across the room."""
    rng = place.rng
    for angle in np.arange(count) * 2 * np.pi / count:
        out = np.array([np.cos(angle), np.sin(angle)])
        eye = [*(centre + half * out + rng.normal(0, 0.03, 2)), 1.5 + rng.normal(0, 0.1)]
        place.look(eye, [*(centre - half * out), rng.uniform(0.8, 1.4) * height / 2.6])


def room(rng, rooms=1, pictures=36):
    place, x0, height = Place(rng, 0.003), 0.0, rng.uniform(2.4, 2.8)
    width, middles = rng.uniform(3.6, 5.0), []
    lengths = rng.uniform(4.2, 6.0, rooms)
    free = [[0, 1, 2, 3]] if rooms == 1 else [[0, 2, 3], [0, 1, 2]]  # sides without the doorway
    for k, length in enumerate(lengths):
        wall(place, (x0, 0), (x0 + length, 0), height, (0, 1))
        wall(place, (x0, width), (x0 + length, width), height, (0, -1))
        middles.append(furnish(place, x0, length, width, height, free[k]))
        x0 += length
    wall(place, (0, 0), (0, width), height, (1, 0))
    wall(place, (x0, 0), (x0, width), height, (-1, 0))
    gap = width * rng.uniform(0.4, 0.6)
    for x in np.cumsum(lengths)[:-1]:
        for a, b in ((0, gap - 0.7), (gap + 0.7, width)):
            wall(place, (x, a), (x, b), height, (1, 0))
            wall(place, (x - 0.1, a), (x - 0.1, b), height, (-1, 0))
        place.box((x - 0.1, gap - 0.7, 2.1), (x, gap + 0.7, height), "wallpaper")
    for middle, length in zip(middles, lengths):
        ring(place, middle, 0.3 * np.array([length, width]), pictures, height)
        place.scanners.append([*(middle + rng.uniform(-0.9, 0.9, 2)), 1.6])
    if rooms > 1:  # through the doorway, a little to the left and to the right
        for k, x in enumerate(np.linspace(lengths[0] / 2, lengths[0] + 0.6, 8)):
            place.look([x, gap + 0.25 * (-1) ** k, 1.5], [x + 3, gap, 1.2])
    return place


def flat(rng):
    return room(rng, 2, 26)


def corner(rng):
    place = room(rng, 2, 72)
    place.cameras = place.cameras[:25]  # an arc of 120 degrees in one room
    return place


def house(rng):
    place = Place(rng, 0.009)
    size = rng.uniform([6, 5, 3], [9, 7, 5])
    x, y, top = size[0] / 2, size[1] / 2, size[2]
    place.box((-30, -30, -0.1), (30, 30, 0), "grass")
    for k in range(4):  # sides, one of them plain
        turn, far, half = k * np.pi / 2, (y, x)[k % 2], (x, y)[k % 2]
        place.box((-half, -far, 0), (half, 0.1 - far, top), "paint" if k == 1 else "brick", turn)
        for at in np.arange(-half + 0.8, half - 1.2, rng.uniform(1.8, 2.6)):
            for z in np.arange(0.9, top - 1.2, 2.4):
                place.box((at, -far - 0.05, z), (at + 0.9, 0.1 - far, z + 1.2), "wood", turn)
                place.box(
                    (at + 0.1, -far - 0.06, z + 0.1), (at + 0.8, -far, z + 1.1), "glass", turn
                )
        place.box((half / 3, -far - 0.3, 0), (half / 3 + 1, -far, 2.1), "wood", turn)
    rise, over = rng.uniform(1.5, 2.5), 0.4
    a, b = [-x - over, -y - over, top], [x + over, -y - over, top]
    c, d = [-x - over, 0, top + rise], [x + over, 0, top + rise]
    roof = np.array([[a, b, d], [a, d, c]])
    place.add(roof, "tiles")
    place.add(roof, "tiles", np.pi)
    gable = np.array([[[s * x, -y, top], [s * x, y, top], [s * x, 0, top + rise]] for s in (-1, 1)])
    place.add(gable, "brick")
    at = rng.uniform(-0.5, 0.5) * x
    place.box((at, 0.5, top), (at + 0.7, 1.2, top + rise + 0.8), "brick")
    side = rng.choice([-1, 1])
    place.box(
        (side * x, -y + 0.5, 0), (side * (x + rng.uniform(2.5, 3.5)), y - 1, 2.5), "wood"
    )  # a garage
    for _ in range(9):
        turn = rng.uniform(0, 2 * np.pi)
        out, high = rng.uniform(1.2, 2) * max(x, y) + 1, rng.uniform(0.5, 1.5)
        at = [out * np.cos(turn), out * np.sin(turn), 0.6 * high]
        if rng.random() < 0.5:
            place.add(
                triangles_of(open3d.geometry.TriangleMesh.create_sphere(high, 12)),
                "carpet",
                turn,
                at,
            )
        else:
            place.box((-high, -0.4, -at[2]), (high, 0.4, high), "poster", turn, at)
    first = rng.uniform(0, 2 * np.pi)
    for k, turn in enumerate(first + np.linspace(0, 1.5 * np.pi, 44)):
        out = 9 + 0.6 * max(x, y) + rng.normal(0, 0.15)
        place.look([out * np.cos(turn), out * np.sin(turn), 3.5 + np.sin(k / 3)], [0, 0, 1.8])
    place.scanners = [[12 * np.cos(first + t), 12 * np.sin(first + t), 1.8] for t in (0.8, 3.5)]
    return place


def hits(scene, place, eyes, directions):
    """Distances along unit directions, with the part and the normal of what is met."""
    rays = np.concatenate([np.broadcast_to(eyes, directions.shape), directions], -1)
    answer = scene.cast_rays(open3d.core.Tensor(rays.astype(np.float32)), nthreads=1)
    triangle = answer["primitive_ids"].numpy()
    far = answer["t_hit"].numpy()
    part = place.part_of[np.where(np.isfinite(far), triangle, 0)]
    return far, part, answer["primitive_normals"].numpy()


def pictures(place, scene, rng):
    """Grey 8 bit, one for each camera."""
    images, (w, h) = textures(rng), SIZE
    turns = np.array([p[2] for p in place.parts])
    material = np.array([p[1] for p in place.parts])
    offset = np.array([p[3] for p in place.parts])
    u, v = np.meshgrid((np.arange(2 * w) - 0.5) / 2, (np.arange(2 * h) - 0.5) / 2)
    lens = np.array([[FOCAL, 0, w / 2 - 0.5], [0, FOCAL, h / 2 - 0.5], [0, 0, 1]])
    pixels = np.stack([u.ravel(), v.ravel()], -1)[:, None]
    plane = cv2.undistortPoints(pixels, lens, np.array([RADIAL, 0, 0, 0]))[:, 0]
    rays = np.c_[plane, np.ones(len(plane))]
    vignette = (1 - 0.25 * (plane**2).sum(1)) / np.linalg.norm(rays, axis=1) ** 0.5
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    sun = np.array([0.4, 0.25, 0.88])
    for turn, eye in place.cameras:
        directions = rays @ turn
        far, part, normal = hits(scene, place, eye, directions)
        seen = np.isfinite(far)
        at = eye + directions * np.where(seen, far, 0)[:, None]
        c, s = np.cos(turns[part]), np.sin(turns[part])
        x, y = c * at[:, 0] + s * at[:, 1], c * at[:, 1] - s * at[:, 0]
        across = np.abs(c * normal[:, 0] + s * normal[:, 1])
        flat, side = np.abs(normal[:, 2]) > 0.7, across > 0.7
        place_u = np.where(flat | ~side, x, y)
        place_v = np.where(flat, y, at[:, 2])
        texel = (np.c_[place_u, place_v] / place.texel + offset[part]).astype(int) % TEXTURE
        grey = images[material[part], texel[:, 1], texel[:, 0]]
        normal *= -np.sign((normal * directions).sum(1))[:, None]
        grey = grey * (0.6 + 0.4 * np.maximum(0, normal @ sun))
        grey = np.where(seen, grey, 230) * vignette * rng.uniform(0.92, 1.08)
        image = grey.reshape(h, 2, w, 2).mean((1, 3))
        image = cv2.GaussianBlur(image, (0, 0), 0.5)
        image += rng.normal(size=image.shape) * np.sqrt(4 + 0.05 * image)
        yield np.clip(image, 0, 255).astype(np.uint8)


def laser(place, scene, rng):
    """A cloud from all scanners, in one frame: steps of a quarter of a degree, 3 mm of noise, nothing from glass."""
    turn, rise = np.meshgrid(
        np.radians(np.arange(0, 360, 0.25)), np.radians(np.arange(-60, 90, 0.25))
    )
    directions = np.stack(
        [np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], -1
    ).reshape(-1, 3)
    clouds = []
    for eye in place.scanners:
        far, part, _ = hits(scene, place, eye, directions)
        material = np.array([p[1] for p in place.parts])[part]
        seen = (far < 60) & (material != TEXTURES.index("glass"))
        far = far + rng.normal(0, 0.003, len(far))
        clouds.append(eye + directions[seen] * far[seen, None])
    return np.concatenate(clouds)


KINDS = {"room": room, "flat": flat, "house": house, "corner": corner}
