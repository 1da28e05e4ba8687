# SPDX-License-Identifier: BSD-3-Clause
"""Draws point clouds as a doll's house: parallel projection from above, surfaces hidden from behind,
edges of depth darkened (eye-dome lighting, Boucheny 2009). Needs numpy, scipy and Pillow.
"""

import pathlib

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial import cKDTree

BACKGROUND = (255, 255, 255)
INK, GREY = (34, 40, 49), (120, 128, 140)
FONTS = ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf")
OVERSAMPLING = 2


def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """DejaVu Sans as matplotlib ships it, or the system's."""
    try:
        import matplotlib

        folder = pathlib.Path(matplotlib.get_data_path()) / "fonts/ttf"
        return ImageFont.truetype(str(folder / FONTS[bold]), size)
    except ImportError:
        return ImageFont.truetype(FONTS[bold], size)


def read_ply(path: pathlib.Path) -> np.ndarray:
    """Vertices of a binary little-endian file, as a structured array."""
    raw = path.read_bytes()
    begin = raw.index(b"end_header\n") + len(b"end_header\n")
    kinds = {"float": "<f4", "float32": "<f4", "double": "<f8", "uchar": "u1", "uint8": "u1"}
    count, fields, of_vertices = 0, [], False
    for line in raw[:begin].decode().splitlines():
        words = line.split()
        if words[0] == "element":
            of_vertices = words[1] == "vertex"
            count = int(words[2]) if of_vertices else count
        elif words[0] == "property" and of_vertices:
            fields.append((words[2], kinds[words[1]]))
    return np.frombuffer(raw, np.dtype(fields), count, begin)


def columns(vertices: np.ndarray, names: str) -> np.ndarray:
    return np.stack([vertices[name] for name in names.split()], -1).astype(float)


def numbered_poses(path: pathlib.Path) -> dict[int, np.ndarray]:
    """Blocks of a number and four rows."""
    rows = [line.split() for line in path.read_text().splitlines()]
    rows = [row for row in rows if row and not row[0].startswith("#")]
    return {int(rows[k][0]): np.array(rows[k + 1 : k + 5], float) for k in range(0, len(rows), 5)}


def normals_of(
    points: np.ndarray, sensors: np.ndarray, neighbours: int = 16
) -> tuple[np.ndarray, np.ndarray]:
    """By PCA, towards the nearest sensor; and the distances of the farthest neighbours."""
    distances, near = cKDTree(points).query(points, neighbours)
    around = points[near] - points[near].mean(1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
    normals = vectors[:, :, 0]
    _, nearest = cKDTree(sensors).query(points)
    away = np.einsum("ni,ni->n", normals, sensors[nearest] - points) < 0
    normals[away] *= -1
    return normals, distances[:, -1]


def palette(count: int) -> np.ndarray:
    """Soft colours; successive ones differ (golden angle in hue)."""
    hue = 2 * np.pi * (np.arange(count) * 0.381966 % 1)
    turn = np.stack([hue, hue - 2 * np.pi / 3, hue + 2 * np.pi / 3], -1)
    return np.clip(165 + 78 * np.cos(turn), 0, 255)


class View:
    """Parallel projection; azimuth and elevation in degrees, pixels for each metre."""

    def __init__(self, azimuth: float, elevation: float, scale: float) -> None:
        a, e = np.radians([azimuth, elevation])
        self.towards = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0])
        self.axes = np.stack([right, -np.cross(self.towards, right), self.towards])
        self.scale = scale

    def project(self, points: np.ndarray) -> np.ndarray:
        """Columns: pixels to the right, pixels down, metres towards the viewer."""
        seen = points @ self.axes.T
        seen[:, :2] *= self.scale
        return seen

    def extent(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest pixel, without the outermost points."""
        seen = self.project(points)[:, :2]
        return np.quantile(seen, 2e-4, axis=0), np.quantile(seen, 1 - 2e-4, axis=0)


def faces_viewer(view: View, normals: np.ndarray) -> np.ndarray:
    return normals @ view.towards > 0.02


def shaded(depth: np.ndarray, colour: np.ndarray, reach: int, strength: float) -> np.ndarray:
    """Eye-dome lighting: a pixel is darker the farther it is behind its neighbours."""
    filled = np.isfinite(depth)
    behind = np.zeros(depth.shape)
    for dy, dx in ((reach, 0), (-reach, 0), (0, reach), (0, -reach)):
        other = np.roll(depth, (dy, dx), (0, 1))
        both = np.isfinite(other) & filled
        step = np.subtract(other, depth, out=np.zeros(depth.shape), where=both)
        behind += np.clip(step, 0, 0.3)
    light = np.exp(-strength * behind)[..., None]
    return np.where(filled[..., None], colour * light, colour)


def draw(
    view: View,
    points: np.ndarray,
    normals: np.ndarray,
    colours: np.ndarray,
    size: tuple[int, int],
    centre: np.ndarray,
    radius: float = 0.02,
    cull: bool = True,
) -> Image.Image:
    """The points that face the viewer; centre: the pixel of the projection in the middle."""
    if cull:
        kept = faces_viewer(view, normals)
        points, normals, colours = points[kept], normals[kept], colours[kept]
    width, height = size[0] * OVERSAMPLING, size[1] * OVERSAMPLING
    seen = view.project(points)
    order = np.argsort(seen[:, 2])
    at = (seen[order, :2] - centre) * OVERSAMPLING + np.array([width, height]) / 2
    x, y = np.round(at).astype(int).T
    light = 0.62 + 0.38 * np.clip(normals[order] @ _lamp(view), 0, 1)
    paint = colours[order] * light[:, None]
    depth, image = np.full((height, width), -np.inf), np.full((height, width, 3), 255.0)
    pixels = max(2, round(radius * view.scale * OVERSAMPLING))
    for dy in range(-pixels, pixels + 1):
        for dx in range(-pixels, pixels + 1):
            if dx * dx + dy * dy > (pixels + 0.3) ** 2:
                continue
            _splat(depth, image, x + dx, y + dy, seen[order, 2], paint)
    image = shaded(depth, image, OVERSAMPLING, 1.3)
    small = Image.fromarray(np.clip(image, 0, 255).astype(np.uint8))
    return small.resize(size, Image.Resampling.LANCZOS)


def _lamp(view: View) -> np.ndarray:
    """Above the viewer's left shoulder."""
    lamp = view.towards + 0.6 * view.axes[0] * -1 + np.array([0, 0, 0.8])
    return lamp / np.linalg.norm(lamp)


def _splat(depth, image, x, y, z, paint) -> None:
    inside = (x >= 0) & (x < depth.shape[1]) & (y >= 0) & (y < depth.shape[0])
    x, y, z, paint = x[inside], y[inside], z[inside], paint[inside]
    # Ascending in z: the last point of a pixel is the nearest one.
    index = y * depth.shape[1] + x
    last = len(index) - 1 - np.unique(index[::-1], return_index=True)[1]
    nearer = z[last] > depth.flat[index[last]]
    last = last[nearer]
    depth.flat[index[last]] = z[last]
    image.reshape(-1, 3)[index[last]] = paint[last]


def write(image: Image.Image, at: tuple[float, float], text: str, size: int, **options) -> None:
    bold, ink, anchor = (
        options.get("bold", False),
        options.get("ink", INK),
        options.get("anchor", "la"),
    )
    ImageDraw.Draw(image).text(at, text, ink, font(size, bold), anchor)
