# SPDX-License-Identifier: BSD-3-Clause
"""A method with every tile of a map, for the sweeps of bench/accuracy/locate_sweeps.py.

    python3 bench/peers/locate_tiles.py --method open3d --name gomentum --map MAP --work WORK -o RECORD.json

Tiles are those of `gpureg locate`: 400 voxels wide, with 80 more at each side. A sweep is where the tile with the
most inliers places it. Open3D: FPFH and RANSAC with its tutorial's settings, a million samples. Queries, seeds and the measure are those of locate_sweeps.py.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import pathlib
import sys
import time
from typing import Any

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
import locate
import locate_sweeps

TILE, HALO = 400, 80  # voxels


def downsampled(points: np.ndarray, voxel: float) -> np.ndarray:
    keys = np.floor(points / voxel).astype(np.int64)
    order = np.lexsort(keys.T)
    points, keys = points[order], keys[order]
    first = np.flatnonzero(np.r_[True, (np.diff(keys, axis=0) != 0).any(1)])
    return np.add.reduceat(points, first) / np.diff(np.r_[first, len(points)])[:, None]


def tiles_of(points: np.ndarray, voxel: float) -> list[np.ndarray]:
    low, edge, halo = points.min(0), TILE * voxel, HALO * voxel
    index = np.floor((points - low)[:, :2] / edge).astype(int)
    out = []
    for tile in np.unique(index, axis=0):
        corner = low[:2] + tile * edge
        here = ((points[:, :2] > corner - halo) & (points[:, :2] < corner + edge + halo)).all(1)
        out.append(points[here])
    return out


class KissMatcher:
    package = "kiss-matcher"

    def __init__(self, tiles: list[np.ndarray], voxel: float) -> None:
        import kiss_matcher

        self.kiss, self.tiles, self.voxel = kiss_matcher, tiles, voxel

    def poses(self, scan: np.ndarray) -> Any:
        """Pose of the scan in each tile, and inliers."""
        for tile in self.tiles:
            middle = tile.mean(0)
            matcher = self.kiss.KISSMatcher(self.kiss.KISSMatcherConfig(self.voxel))
            match = matcher.match(np.asfortranarray(scan.T), np.asfortranarray((tile - middle).T))
            found = matcher.prune_and_solve(*match)
            pose = np.eye(4)
            pose[:3, :3] = found.rotation
            pose[:3, 3] = np.ravel(found.translation) + middle
            yield pose, matcher.get_num_final_inliers() if found.valid else 0


class Open3D:
    package = "open3d"

    def __init__(self, tiles: list[np.ndarray], voxel: float) -> None:
        import open3d

        self.o3d, self.voxel = open3d, voxel
        self.tiles = [self.described(tile) for tile in tiles]

    def described(self, points: np.ndarray) -> tuple[Any, Any]:
        cloud = self.o3d.geometry.PointCloud(self.o3d.utility.Vector3dVector(points))
        cloud = cloud.voxel_down_sample(self.voxel)
        near = self.o3d.geometry.KDTreeSearchParamHybrid
        cloud.estimate_normals(near(2 * self.voxel, 30))
        fpfh = self.o3d.pipelines.registration.compute_fpfh_feature
        return cloud, fpfh(cloud, near(5 * self.voxel, 100))

    def poses(self, scan: np.ndarray) -> Any:
        of = self.o3d.pipelines.registration
        source, features = self.described(scan)
        distance = 1.5 * self.voxel
        for tile, of_tile in self.tiles:
            found = of.registration_ransac_based_on_feature_matching(
                source,
                tile,
                features,
                of_tile,
                True,
                distance,
                of.TransformationEstimationPointToPoint(False),
                3,
                [
                    of.CorrespondenceCheckerBasedOnEdgeLength(0.9),
                    of.CorrespondenceCheckerBasedOnDistance(distance),
                ],
                of.RANSACConvergenceCriteria(1_000_000, 0.999),
            )
            yield found.transformation, len(found.correspondence_set)


METHODS = {"kiss-matcher": KissMatcher, "open3d": Open3D}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--method", choices=METHODS, default="kiss-matcher")
    parser.add_argument("--name", required=True)
    parser.add_argument("--map", type=pathlib.Path, required=True)
    parser.add_argument("--voxel", type=float, default=0.5)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--rings", type=int, nargs="+", default=[16, 64])
    parser.add_argument("--queries", type=int, default=3, help="of each seed and kind")
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    world = locate_sweeps.World(locate_sweeps.read_map(arguments.map), 0.2, 100)
    tiles = tiles_of(downsampled(world.points, arguments.voxel), arguments.voxel)
    method = METHODS[arguments.method](tiles, arguments.voxel)
    queries = locate_sweeps.Queries(world, arguments.work, arguments.name, 180)
    rows = []
    for seed in arguments.seeds:
        for rings in arguments.rings:
            for k in range(arguments.queries):
                query = queries.make(rings, seed, k)
                scan = locate.read_points(query.path)
                begin = time.monotonic()
                pose, inliers = max(method.poses(scan), key=lambda found: found[1])
                seconds = time.monotonic() - begin
                error = float(np.linalg.norm(pose[:3, 3] - query.pose[:3, 3]))
                rows.append(
                    {
                        "map": arguments.name,
                        "kind": query.kind,
                        "seed": seed,
                        "scan": query.path.stem,
                    }
                    | {"inliers": inliers, "error": round(error, 3), "correct": error < 0.5}
                    | {"seconds": round(seconds, 1)}
                )
                print(rows[-1], flush=True)
    version = importlib.metadata.version(method.package)
    head = {"method": f"{arguments.method} {version}"}
    head |= {"voxel": arguments.voxel, "tiles": len(tiles)}
    lines = ",\n ".join(map(json.dumps, rows))
    arguments.output.write_text(f'{{"run": {json.dumps(head)},\n"rows": [\n {lines}]}}\n')


if __name__ == "__main__":
    main()
