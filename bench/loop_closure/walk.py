# SPDX-License-Identifier: BSD-3-Clause
"""Scenes as a SLAM system walks through them: prepared fragments, true poses, odometry that drifts."""

import itertools

import gpureg
import numpy as np

SCENES = {"house_A": "house/A", "house_B": "house/B", "hospital_E": "hospital/E"}


def read_poses(path):
    rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
    return {int(rows[k][0]): np.array(rows[k + 1 : k + 5], float) for k in range(0, len(rows), 5)}


def prepare(context, folder, numbers):
    fragments = gpureg.FragmentSet.from_directory(folder)
    options = gpureg.RegistrationOptions()
    loaded = [fragments.load(fragments.numbers.index(number), options) for number in numbers]
    return gpureg._core.prepare_batch(context, loaded, options)


def about_up(pose, degrees):
    """Turn about the vertical direction of the world, in the frame of the pose."""
    x, y, z = pose[:3, :3].T @ [0, 0, 1]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle, turn = np.radians(degrees), np.eye(4)
    turn[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn


def drifting_steps(truth, numbers, drift):
    """previous_from_here of consecutive fragments, too long by `drift` and turned by ten times as many degrees per metre."""
    steps = []
    for last, number in itertools.pairwise(numbers):
        step = np.linalg.inv(truth[last]) @ truth[number]
        length = np.linalg.norm(step[:3, 3])
        step[:3, 3] *= 1 + drift
        steps.append(step @ about_up(truth[number], 10 * drift * length))
    return steps


def rmse(poses, truth):
    """Of positions, after the best rigid alignment, metres (Horn 1987). Both: lists of 4 x 4 matrices."""
    a, b = (np.array([pose[:3, 3] for pose in each]) for each in (poses, truth))
    u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    error = (a - a.mean(0)) @ turn.T + b.mean(0) - b
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def correct(truth, pose):
    """Within 0.35 m and 8 degrees."""
    error = np.linalg.inv(truth) @ pose
    angle = np.degrees(np.arccos(np.clip((np.trace(error[:3, :3]) - 1) / 2, -1, 1)))
    return bool(np.linalg.norm(error[:3, 3]) < 0.35 and angle < 8)
