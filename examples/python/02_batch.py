# SPDX-License-Identifier: BSD-3-Clause
"""Many clouds: aligns all pairs of a folder of fragments cloud_bin_<i>.ply.

    python 02_batch.py scans/ --output run/

An interrupted run goes on where it stopped. Needs pyarrow.
"""

from __future__ import annotations

import argparse

import gpureg


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder")
    parser.add_argument("--output", required=True)
    parser.add_argument("--voxel-size", type=float, default=0.05)
    parser.add_argument("--quality", type=int, default=5)
    arguments = parser.parse_args()

    options = gpureg.RegistrationOptions(voxel_size=arguments.voxel_size, quality=arguments.quality)
    run = gpureg.register_all(arguments.folder, output=arguments.output, options=options)
    print(run)
    best = run.table().sort_by([("confidence", "descending")]).slice(0, 5)
    for row in best.to_pylist():
        print(
            f"{row['j']:4d} into {row['i']:4d}: {row['status']}, confidence {row['confidence']:.3f}"
        )


if __name__ == "__main__":
    main()
