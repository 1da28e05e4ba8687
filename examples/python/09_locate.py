# SPDX-License-Identifier: BSD-3-Clause
"""Locates the scans of a session in the map of an earlier one: folders of cloud_bin_<i>.ply, no pose
known.

python 09_locate.py monday/ tuesday/ --save-map monday.gpureg
"""

from __future__ import annotations

import argparse

import gpureg


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("earlier")
    parser.add_argument("later")
    parser.add_argument("--voxel-size", type=float, default=0.05)
    parser.add_argument("--save-map")
    arguments = parser.parse_args()

    options = gpureg.RegistrationOptions(voxel_size=arguments.voxel_size)
    scene = gpureg.reconstruct(arguments.earlier, options=options)
    map = gpureg.prepare_map(  # of the largest island
        arguments.earlier, scene, options=gpureg.MapOptions(voxel_size=arguments.voxel_size)
    )
    if arguments.save_map:
        map.save(arguments.save_map)  # gpureg.load_map() reads it

    scans = gpureg.FragmentSet.from_directory(arguments.later)
    for number, result in zip(scans.numbers, gpureg.locate_batch(scans, map)):
        print(f"scan {number}: {result.status}, elsewhere with {result.absent_probability:.3f}")
        for pose in result.poses[:3]:
            print(f"  confidence {pose.confidence:.3f}, at {pose.map_from_scan[:3, 3].round(2)}")


if __name__ == "__main__":
    main()
