#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Does the confidence of `gpureg.verify` separate correct poses from wrong ones?

For every pair of a scene's gt.log: the true pose, refined, and the true pose moved by 0.5 m and turned by 10 degrees about the centre of
the source, in a direction and about an axis drawn by the seed. Each is verified alone, without a search for alternatives: nothing but
the pose itself is asked. The record has the area under the ROC curve of each scene.

usage: verification.py [--scenes redkitchen/fragments ...] [--pairs 200] [--seed 1] [--data DIR] [-o FILE] Needs the package gpureg.
"""

import gpureg
import numpy as np
import record
from fit_confidence import blocks

METRES, DEGREES = 0.5, 10.0


def moved(pose, centre, random):
    """The pose, wrong by METRES and DEGREES."""
    shift, axis = random.normal(size=(2, 3))
    shift *= METRES / np.linalg.norm(shift)
    axis *= np.radians(DEGREES) / np.linalg.norm(axis)
    angle = np.linalg.norm(axis)
    x, y, z = axis / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(4)
    turn[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    turn[:3, 3] = centre - turn[:3, :3] @ centre + shift
    return turn @ pose


def area(correct, wrong):
    """Area under the ROC curve: how often a correct pose has the larger value."""
    correct, wrong = np.array(correct)[:, None], np.array(wrong)[None]
    return float(np.mean((correct > wrong) + 0.5 * (correct == wrong)))


def of_scene(scene, arguments, context):
    folder = record.data_folder(arguments, scene)
    options = gpureg.RegistrationOptions()
    truth = blocks(folder / "gt.log", 5)
    keys = sorted(truth)
    keys = [
        keys[k * len(keys) // min(arguments.pairs, len(keys))]
        for k in range(min(arguments.pairs, len(keys)))
    ]
    fragments = gpureg.FragmentSet.from_directory(folder)
    numbers = sorted({number for key in keys for number in key})
    loaded = [fragments.load(fragments.numbers.index(number), options) for number in numbers]
    clouds = dict(zip(numbers, gpureg._core.prepare_batch(context, loaded, options), strict=True))
    random = np.random.default_rng(arguments.seed)
    found = {"true": [], "moved": []}
    for i, j in keys:
        pose = truth[i, j]
        source = np.asarray(clouds[j].points)
        centre = source.mean(0) @ pose[:3, :3].T + pose[:3, 3]
        for name, asked, refine in (
            ("true", pose, True),
            ("moved", moved(pose, centre, random), False),
        ):
            (verified,) = gpureg.verify(
                clouds[j],
                clouds[i],
                asked,
                refine=refine,
                search_alternatives=False,
                context=context,
            )
            found[name].append(verified.confidence)
    row = {
        "scene": scene,
        "pairs": len(keys),
        "area_under_curve": area(found["true"], found["moved"]),
        "true_above_half": float(np.mean(np.array(found["true"]) > 0.5)),
        "moved_above_half": float(np.mean(np.array(found["moved"]) > 0.5)),
    }
    print(
        f"{scene}: {len(keys)} pairs, area {row['area_under_curve']:.4f}, confidence above .5: "
        f"{100 * row['true_above_half']:.1f} % of the true, {100 * row['moved_above_half']:.1f} % of the moved poses"
    )
    return row


def main():
    parser = record.parser(__doc__, "verification.json")
    parser.add_argument(
        "--scenes",
        nargs="+",
        default=["redkitchen/fragments", "house/A", "house/B", "hospital/E"],
    )
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    context = {
        "auto": gpureg.Context.best,
        "cpu": gpureg.Context.cpu,
        "cuda": gpureg.Context.cuda,
    }[arguments.backend]()
    rows = [of_scene(scene, arguments, context) for scene in arguments.scenes]
    record.write(
        arguments,
        "python3 bench/accuracy/verification.py --data DATA",
        {"metres": METRES, "degrees": DEGREES, "seed": arguments.seed, "scenes": rows},
    )


if __name__ == "__main__":
    main()
