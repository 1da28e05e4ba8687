#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Open3D's multiway registration of a folder of fragments, as its tutorials "Global registration" and "Multiway
registration" have it: FPFH and RANSAC for every pair, point-to-plane ICP, a pose graph, global_optimization.

    open3d_multiway.py FRAGMENTS OUT

The tutorial knows the order of its scans, and gives the graph consecutive pairs as certain edges. Nothing is known here:
the certain edges are those of the maximum spanning tree by the number of corresponding points, all others are uncertain.
As in Open3D's reconstruction system, a pair needs correspondences of 30 % of the smaller cloud. Writes poses.txt and
reconstruction.json as `gpureg reconstruct` does, for bench/accuracy/maps.py.
"""

import json
import pathlib
import resource
import sys
import time

import numpy as np
import open3d as o3d

VOXEL = 0.05
LEAST_SHARE = 0.3
registration = o3d.pipelines.registration


def prepare(path):
    cloud = o3d.io.read_point_cloud(str(path)).voxel_down_sample(VOXEL)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * VOXEL, 30))
    feature = registration.compute_fpfh_feature(
        cloud, o3d.geometry.KDTreeSearchParamHybrid(5 * VOXEL, 100)
    )
    return cloud, feature


def align(source, target):
    """Pose, information and share of corresponding points of a pair."""
    distance = 1.5 * VOXEL
    coarse = registration.registration_ransac_based_on_feature_matching(
        source[0],
        target[0],
        source[1],
        target[1],
        True,
        distance,
        registration.TransformationEstimationPointToPoint(False),
        3,
        [
            registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            registration.CorrespondenceCheckerBasedOnDistance(distance),
        ],
        registration.RANSACConvergenceCriteria(100_000, 0.999),
    )
    pose = coarse.transformation
    plane = registration.TransformationEstimationPointToPlane()
    for radius in (3 * VOXEL, distance):
        pose = registration.registration_icp(
            source[0], target[0], radius, pose, plane
        ).transformation
    information = registration.get_information_matrix_from_point_clouds(
        source[0], target[0], distance, pose
    )
    share = information[5, 5] / max(1, min(len(source[0].points), len(target[0].points)))
    return pose, information, share


def spanning_tree(edges, count):
    """Certain edges, and world_from_scan along them; scans without an edge to the largest part are left out."""
    parent = list(range(count))

    def find(k):
        while parent[k] != k:
            k = parent[k]
        return k

    chosen = []
    for edge in sorted(edges, key=lambda e: -e[3][5, 5]):
        if find(edge[0]) != find(edge[1]):
            parent[find(edge[0])] = find(edge[1])
            chosen.append(edge)
    parts = {}
    for k in range(count):
        parts.setdefault(find(k), []).append(k)
    largest = max(parts.values(), key=len)
    poses = {largest[0]: np.eye(4)}
    while len(poses) < len(largest):
        for source, target, pose, _ in chosen:  # pose: source into target
            if source in poses and target not in poses:
                poses[target] = poses[source] @ np.linalg.inv(pose)
            elif target in poses and source not in poses:
                poses[source] = poses[target] @ pose
    return {(e[0], e[1]) for e in chosen}, poses


def main():
    folder, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    o3d.utility.random.seed(1)
    files = sorted(folder.glob("cloud_bin_*.ply"), key=lambda p: int(p.stem.split("_")[-1]))
    numbers = [int(path.stem.split("_")[-1]) for path in files]
    begin = time.monotonic()
    clouds = [prepare(path) for path in files]
    prepared = time.monotonic()
    edges = []
    for i in range(len(clouds)):
        for j in range(i + 1, len(clouds)):
            pose, information, share = align(clouds[j], clouds[i])
            if share >= LEAST_SHARE:
                edges.append((j, i, pose, information))
        print(f"{i + 1} of {len(clouds)}, {time.monotonic() - prepared:.0f} s", flush=True)
    aligned = time.monotonic()
    certain, poses = spanning_tree(edges, len(clouds))
    order = sorted(poses)
    place = {k: n for n, k in enumerate(order)}
    graph = registration.PoseGraph()
    for k in order:
        graph.nodes.append(registration.PoseGraphNode(poses[k]))
    for source, target, pose, information in edges:
        if source in place and target in place:
            graph.edges.append(
                registration.PoseGraphEdge(
                    place[source], place[target], pose, information, (source, target) not in certain
                )
            )
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        registration.GlobalOptimizationOption(
            max_correspondence_distance=1.5 * VOXEL, edge_prune_threshold=0.25, reference_node=0
        ),
    )
    finished = time.monotonic()
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "poses.txt", "w") as file:
        for k, node in zip(order, graph.nodes):
            file.write(f"{numbers[k]}\n")
            np.savetxt(file, node.pose, "%.9g")
    document = {
        "islands": [[numbers[k] for k in order]],
        "scans": [{"id": n, "placed": k in place} for k, n in enumerate(numbers)],
        # global_optimization leaves the edges that it keeps.
        "edges": [
            {
                "i": numbers[order[e.target_node_id]],
                "j": numbers[order[e.source_node_id]],
                "T_ij": np.asarray(e.transformation).ravel().tolist(),
                "confidence": e.confidence,
                "state": "accepted",
            }
            for e in graph.edges
        ],
        "pairs_kept": len(edges),
        "version": o3d.__version__,
        "seconds": {
            "prepare": prepared - begin,
            "align": aligned - prepared,
            "graph": finished - aligned,
        },
        "peak_memory_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    (out / "reconstruction.json").write_text(json.dumps(document))


if __name__ == "__main__":
    main()
