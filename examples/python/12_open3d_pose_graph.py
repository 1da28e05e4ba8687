# SPDX-License-Identifier: BSD-3-Clause
"""The pairs of a folder as a pose graph of Open3D.

    pip install open3d
    python 12_open3d_pose_graph.py FOLDER [--voxel-size 0.05] [-o poses.json]

Each aligned pair becomes an edge with its information matrix. Open3D optimises, and drops edges that
contradict the others. gpureg.reconstruct does this with several poses for each pair.
"""

import argparse
from pathlib import Path

import gpureg
import numpy as np
import open3d


def main() -> int:
    parser = argparse.ArgumentParser(description="A pose graph of Open3D.")
    parser.add_argument("folder")
    parser.add_argument("--voxel-size", type=float, default=0.05)
    parser.add_argument("-o", "--output", default="poses.json")
    arguments = parser.parse_args()

    options = gpureg.RegistrationOptions(voxel_size=arguments.voxel_size)
    files = sorted(Path(arguments.folder).glob("*.ply"), key=lambda p: (len(p.name), p.name))
    clouds = gpureg.prepare_batch(list(map(gpureg.read_point_cloud, files)), options=options)
    pairs = [(j, i) for j in range(len(files)) for i in range(j)]  # source, target
    found = dict(zip(pairs, gpureg.align_batch(clouds, pairs, options=options)))
    aligned = {pair: result for pair, result in found.items() if result.aligned}

    reg = open3d.pipelines.registration
    graph = reg.PoseGraph()
    for j in range(len(files)):  # begins with the most confident pose relative to an earlier cloud
        known = [pair for pair in aligned if pair[0] == j]
        best = max(known, key=lambda pair: aligned[pair].confidence, default=None)
        pose = graph.nodes[best[1]].pose @ aligned[best].target_from_source if best else np.eye(4)
        graph.nodes.append(reg.PoseGraphNode(pose))
    for (j, i), result in aligned.items():
        information = result.target_moments.information_open3d()
        graph.edges.append(
            reg.PoseGraphEdge(j, i, result.target_from_source, information, uncertain=j - i > 1)
        )
    reg.global_optimization(
        graph,
        reg.GlobalOptimizationLevenbergMarquardt(),
        reg.GlobalOptimizationConvergenceCriteria(),
        reg.GlobalOptimizationOption(max_correspondence_distance=arguments.voxel_size),
    )
    open3d.io.write_pose_graph(arguments.output, graph)
    print(f"{len(graph.nodes)} clouds, {len(graph.edges)} edges in {arguments.output}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
