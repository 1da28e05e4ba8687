# SPDX-License-Identifier: BSD-3-Clause
"""bench/peers: adapters of modules that nobody can install from an index, on stand-ins for them."""

import importlib
import pathlib
import sys
import types

import numpy as np
import pytest

PEERS = pathlib.Path(__file__).resolve().parents[2] / "bench/peers"


class Tensor(np.ndarray):
    """What the adapter uses of a tensor. The module accepts those of the device alone."""

    device = "cpu"

    def __array_finalize__(self, other):
        self.device = getattr(other, "device", "cpu")

    def cuda(self):
        out = self.copy()
        out.device = "cuda"
        return out

    def cpu(self):
        out = self.copy()
        out.device = "cpu"
        return out

    def numpy(self):
        assert self.device == "cpu"
        return np.asarray(self)


class Solver:
    """The motion of most matches, from three at a time."""

    def __init__(self, most, length, pivots, suppression, inlier, measure):
        assert measure == "IN"
        self.most, self.inlier = most, inlier

    def run_reg(self, p, q):
        assert p.device == q.device == "cuda"
        assert p.shape == q.shape and p.dtype == q.dtype == np.float32
        assert len(p) <= self.most
        p, q = np.asarray(p, float), np.asarray(q, float)
        a, b = p - p.mean(0), q - q.mean(0)
        u, _, vt = np.linalg.svd(a.T @ b)
        pose = np.eye(4)
        pose[:3, :3] = vt.T @ np.diag([1, 1, np.linalg.det(vt.T @ u.T)]) @ u.T
        pose[:3, 3] = q.mean(0) - pose[:3, :3] @ p.mean(0)
        out = pose.astype(np.float32).view(Tensor)
        out.device = "cuda"
        return out


def open3d():
    """Clouds keep their points; a feature is a row of powers of the distance from the middle."""

    def features(cloud, search):
        far = np.linalg.norm(cloud.points - cloud.points.mean(0), axis=1)
        return types.SimpleNamespace(data=np.stack([np.cos(k * far) for k in range(33)]))

    class Cloud:
        def __init__(self, points):
            self.points = points

        def estimate_normals(self, search):
            pass

    module = types.ModuleType("open3d")
    module.utility = types.SimpleNamespace(
        Vector3dVector=np.asarray,
        set_verbosity_level=lambda level: None,
        VerbosityLevel=types.SimpleNamespace(Error=0),
    )
    module.geometry = types.SimpleNamespace(
        PointCloud=Cloud, KDTreeSearchParamHybrid=lambda radius, most: None
    )
    module.pipelines = types.SimpleNamespace(
        registration=types.SimpleNamespace(compute_fpfh_feature=features)
    )
    return module


@pytest.fixture
def methods(monkeypatch):
    torch = types.ModuleType("torch")
    torch.from_numpy = lambda array: array.view(Tensor)
    torch.cuda = types.SimpleNamespace(is_available=lambda: True)
    turboreg = types.ModuleType("turboreg_gpu")
    turboreg.TurboRegGPU = Solver
    for module in (torch, turboreg, open3d()):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.syspath_prepend(str(PEERS))
    yield importlib.import_module("methods")
    for name in [n for n in sys.modules if n.split(".")[0] == "methods"]:
        del sys.modules[name]


@pytest.mark.parametrize("points", [500, 7000])
def test_turboreg_finds_the_pose_from_source_to_target(methods, points):
    random = np.random.default_rng(1)
    source = random.uniform(-1, 1, (points, 3)) * [1, 2, 3]
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    target = source @ turn.T + [1, -2, 0.5]
    method = methods.load("turboreg")()
    clouds = [
        method.prepare(types.SimpleNamespace(points=rows, normals=np.zeros_like(rows)))
        for rows in (source, target[random.permutation(points)])
    ]
    found = method.align(*clouds, None, 1)
    assert found["pose"].shape == (4, 4)
    assert np.abs(found["pose"][:3, :3] - turn).max() < 1e-2
    assert np.abs(found["pose"][:3, 3] - [1, -2, 0.5]).max() < 2e-2
    assert found["score"] > 0.9


def test_turboreg_is_left_out_where_it_is_not_installed(methods, monkeypatch):
    monkeypatch.setitem(sys.modules, "turboreg_gpu", None)
    with pytest.raises(ImportError):
        methods.load("turboreg")()


def test_turboreg_is_left_out_without_a_device(methods):
    sys.modules["torch"].cuda.is_available = lambda: False
    with pytest.raises(ImportError, match="CUDA device"):
        methods.load("turboreg")()
