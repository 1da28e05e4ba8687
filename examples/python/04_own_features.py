# SPDX-License-Identifier: BSD-3-Clause
"""Features of your own: gpureg matches a torch tensor instead of FPFH.

    python 04_own_features.py

A small random network stands for a learned one. It makes 32 numbers of each point's sorted
distances to its neighbours, which do not change under rigid motions. Tensors on the GPU stay there.
"""

from __future__ import annotations

import gpureg
import torch


def features_of(
    points: torch.Tensor, network: torch.nn.Module, neighbors: int = 24
) -> torch.Tensor:
    """(N, 3) to (N, 32)."""
    distances = torch.cdist(points, points).topk(neighbors + 1, largest=False).values[:, 1:]
    features: torch.Tensor = network(distances)
    return features


def main() -> None:
    device = (
        "cuda"
        if torch.cuda.is_available() and gpureg.default_context().backend == "cuda"
        else "cpu"
    )
    generator = torch.Generator().manual_seed(1)
    source = torch.rand(1500, 3, generator=generator).to(device)
    angle = torch.tensor(1.0)
    turn = torch.tensor(
        [[angle.cos(), -angle.sin(), 0.0], [angle.sin(), angle.cos(), 0.0], [0.0, 0.0, 1.0]],
        device=device,
    )
    target = source @ turn.T + torch.tensor([0.3, -0.2, 0.5], device=device)

    torch.manual_seed(1)
    network = torch.nn.Sequential(
        torch.nn.Linear(24, 64), torch.nn.ReLU(), torch.nn.Linear(64, 32)
    ).to(device)
    options = gpureg.RegistrationOptions(voxel_size=0.05)
    options.prepare.downsample = False  # the network has chosen the points
    clouds = [
        gpureg.prepare(points, features=features_of(points, network), options=options)
        for points in (source, target)
    ]
    result = gpureg.align(clouds[0], clouds[1], options=options)
    print(f"{device}: {result}")
    print(result.target_from_source.round(3))


if __name__ == "__main__":
    main()
