# SPDX-License-Identifier: BSD-3-Clause
"""PCL's SampleConsensusPrerejective (Buch et al. 2013), which CZK and the paper modified; the
program gpureg_pcl_peer does the work.
"""

import os
import pathlib
import struct
import subprocess

import numpy as np

from methods import VOXEL

ROOT = pathlib.Path(__file__).resolve().parents[3]


class Prerejective:
    label = "PCL prerejective"
    parameters = "50,000 iterations, 3 samples, 5 matches a point, similarity 0.9, 2.5 voxels, inlier fraction 0.25 (its tutorial's)"
    threshold = 0.25
    refines = False

    def __init__(self):
        program = pathlib.Path(
            os.environ.get("GPUREG_PCL_PEER", ROOT / "build/cpu/bin/gpureg_pcl_peer")
        )
        if not program.exists():
            raise FileNotFoundError(
                f"there is no program {program}: build the target gpureg_pcl_peer (needs PCL), or set GPUREG_PCL_PEER"
            )
        self.child = subprocess.Popen(
            [program, str(VOXEL)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self.known = 0
        self.own_version = self.child.stdout.readline().decode().strip()

    def version(self):
        return self.own_version

    def ask(self, command, *arrays):
        self.child.stdin.write(
            command + b"".join(np.ascontiguousarray(a, np.float32).tobytes() for a in arrays)
        )
        self.child.stdin.flush()
        answer = self.child.stdout.readline().split()
        if not answer:
            raise RuntimeError(f"gpureg_pcl_peer ended with status {self.child.wait()}")
        return [float(v) for v in answer]

    def prepare(self, cloud):
        seconds = self.ask(b"c" + struct.pack("<I", len(cloud.points)), cloud.points, cloud.normals)
        self.known += 1
        return {"index": self.known - 1, "processor": seconds[0]}

    def align(self, source, target, initial, seed):
        answer = self.ask(b"a" + struct.pack("<III", source["index"], target["index"], seed))
        found = {"score": answer[0], "processor_ms": 1e3 * answer[1], "memory_mib": answer[2]}
        return {"pose": answer[3:19] if answer[0] > 0 else None, **found}
