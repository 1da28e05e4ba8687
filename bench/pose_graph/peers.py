# SPDX-License-Identifier: BSD-3-Clause
"""One optimisation by another library, in a process of its own: GRAPH.npz METHOD OUT.npz."""

from __future__ import annotations

import sys
import time

import numpy as np

CHI_SQUARE_99 = 16.811893829770927  # quantile 0.99 with 6 degrees of freedom


def gtsam_graph(data):
    import gtsam

    graph, initial = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Gaussian.Information(data["information"])
    graph.add(gtsam.PriorFactorPose3(0, gtsam.Pose3(), gtsam.noiseModel.Isotropic.Sigma(6, 1e-4)))
    for (i, j), pose in zip(data["ends"], data["poses"]):
        graph.add(gtsam.BetweenFactorPose3(int(i), int(j), gtsam.Pose3(pose), noise))
    for k, pose in enumerate(data["initial"]):
        initial.insert(k, gtsam.Pose3(pose))
    return graph, initial


def gtsam_lm(data):
    import gtsam

    graph, initial = gtsam_graph(data)
    begin = time.perf_counter()
    values = gtsam.LevenbergMarquardtOptimizer(graph, initial).optimize()
    seconds = time.perf_counter() - begin
    return values, np.ones(len(data["ends"]), bool), seconds


def gtsam_gnc(data):
    """Truncated least squares, odometry as known inliers, everything else as it comes."""
    import gtsam

    graph, initial = gtsam_graph(data)
    parameters = gtsam.GncLMParams()
    parameters.setKnownInliers([0] + [1 + int(k) for k in np.flatnonzero(data["odometry"])])
    begin = time.perf_counter()
    optimizer = gtsam.GncLMOptimizer(graph, initial, parameters)
    values = optimizer.optimize()
    seconds = time.perf_counter() - begin
    return values, np.asarray(optimizer.getWeights())[1:] > 0.5, seconds


def open3d(data):
    """The line process, its weight set so that a loop is pruned beyond the same squared error."""
    import open3d

    o = open3d.pipelines.registration
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    graph = o.PoseGraph()
    for pose in data["initial"]:
        graph.nodes.append(o.PoseGraphNode(pose))
    for (i, j), pose, odometry in zip(data["ends"], data["poses"], data["odometry"]):
        graph.edges.append(
            o.PoseGraphEdge(int(j), int(i), pose, data["information"], not odometry, 1.0)
        )
    distance = float(np.sqrt(CHI_SQUARE_99 / data["information"][5, 5]))
    option = o.GlobalOptimizationOption(
        max_correspondence_distance=distance, edge_prune_threshold=0.25, reference_node=0
    )
    begin = time.perf_counter()
    o.global_optimization(
        graph,
        o.GlobalOptimizationLevenbergMarquardt(),
        o.GlobalOptimizationConvergenceCriteria(),
        option,
    )
    seconds = time.perf_counter() - begin
    poses = np.array([node.pose for node in graph.nodes])
    kept = {(e.target_node_id, e.source_node_id) for e in graph.edges}
    return poses, np.array([(int(i), int(j)) in kept for i, j in data["ends"]]), seconds


def main() -> None:
    data = np.load(sys.argv[1])
    poses, accepted, seconds = globals()[sys.argv[2]](data)
    if not isinstance(poses, np.ndarray):
        poses = np.array([poses.atPose3(k).matrix() for k in range(len(data["initial"]))])
    np.savez(sys.argv[3], poses=poses, accepted=accepted, seconds=seconds)


if __name__ == "__main__":
    main()
