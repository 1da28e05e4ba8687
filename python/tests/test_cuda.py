# SPDX-License-Identifier: BSD-3-Clause
"""On a machine with a GPU: arrays that live there, and the same bits as on the CPU."""

import pickle
import subprocess
import sys

import gpureg
import numpy as np
import pytest
from gpureg._arrays import core_cloud
from scenes import error_of, few, room

try:
    GPU = gpureg.Context.cuda()
except gpureg.BackendUnavailable as error:
    pytest.skip(f"no CUDA: {error}", allow_module_level=True)

CPU = gpureg.Context.cpu()


def arrays_of(cloud):
    return [cloud.points.tobytes(), cloud.normals.tobytes(), cloud.features.tobytes()]


@pytest.fixture(scope="module")
def reference(source):
    return arrays_of(gpureg.prepare(source.astype(np.float32), context=CPU))


def stays(value, **keywords):
    parts = core_cloud(
        value,
        keywords.get("normals"),
        keywords.get("features"),
        None,
        gpureg.RegistrationOptions(),
        device=True,
    )
    return parts[5] is not None


def test_same_bits_as_the_cpu(source, target, tmp_path):
    results = []
    for context in (CPU, GPU, gpureg.Context.cuda([0], memory_budget=64 << 20)):
        state = gpureg.register(source, target, options=few(), context=context).to_dict()
        del state["timings"]
        results.append(pickle.dumps(state))
    assert len(set(results)) == 1
    clouds, keywords = (
        [room(k % 3, 1500) for k in range(8)],
        {"options": few(2000), "progress": False},
    )
    pytest.importorskip("pyarrow")
    runs = [
        gpureg.register_all(clouds, output=tmp_path / c.backend, contexts=[c], **keywords)
        for c in (CPU, GPU)
    ]
    assert runs[0].parquet.read_bytes() == runs[1].parquet.read_bytes()
    assert runs[0].log.read_bytes() == runs[1].log.read_bytes()


@pytest.fixture(scope="module")
def torch():
    torch = pytest.importorskip("torch")
    if not torch.cuda.is_available():
        pytest.skip("torch has no CUDA")
    return torch


class TestTorch:
    def test_layouts(self, torch, source, reference):
        tensor = torch.from_numpy(source.astype(np.float32)).cuda()
        wide = torch.full((len(source), 7), float("nan"), device="cuda")
        wide[:, 2:5] = tensor
        for given in (
            tensor,
            tensor.T.contiguous().T,
            wide[:, 2:5],
            tensor.clone().requires_grad_(),
        ):
            assert stays(given)
            assert arrays_of(gpureg.prepare(given, context=GPU)) == reference
        assert not stays(tensor.double())
        assert arrays_of(gpureg.prepare(tensor.double(), context=GPU)) == reference
        assert arrays_of(gpureg.prepare(tensor, context=CPU)) == reference

    def test_half_types(self, torch, source):
        for dtype in (torch.float16, torch.bfloat16):
            tensor = torch.from_numpy(source).to(dtype)
            expected = gpureg.prepare(tensor.float(), context=CPU)
            assert stays(tensor.cuda())
            assert arrays_of(gpureg.prepare(tensor.cuda(), context=GPU)) == arrays_of(expected)

    def test_companions(self, torch, source):
        rng = np.random.default_rng(1)
        normals, features = (
            rng.normal(size=source.shape).astype("f4"),
            rng.random((len(source), 16)).astype("f4"),
        )
        points = source.astype("f4")
        expected = arrays_of(
            gpureg.prepare(points, normals, features, viewpoints=[[1, 2, 3]], context=CPU)
        )
        there = [torch.from_numpy(a).cuda() for a in (points, normals, features)]
        assert stays(there[0], normals=there[1], features=there[2])
        for given in ((*there,), (there[0], normals, there[2]), (points, there[1], features)):
            assert (
                arrays_of(gpureg.prepare(*given, viewpoints=[[1, 2, 3]], context=GPU)) == expected
            )
        with pytest.raises(
            ValueError,
            match=r"normals: expected shape \(6000, 3\), one row per point, got \(5, 3\)",
        ):
            gpureg.prepare(there[0], there[1][:5], context=GPU)
        with pytest.raises(ValueError, match=r"points: expected shape \(N, 3\), got \(6000, 16\)"):
            gpureg.prepare(there[2], context=GPU)

    def test_waits_for_the_stream_that_makes_the_points(self, torch, source, reference):
        host = torch.from_numpy(source.astype(np.float32)).pin_memory()
        stream = torch.cuda.Stream()
        for _ in range(5):
            with torch.cuda.stream(stream):
                torch.cuda._sleep(20_000_000)
                tensor = host.to("cuda", non_blocking=True)
                cloud = gpureg.prepare(tensor, context=GPU)
                tensor.zero_()  # after the call the memory is the caller's again
            assert arrays_of(cloud) == reference

    def test_two_hundred_thousand_points_stay(self, torch):
        """Counts what the driver copies: nothing as large as the cloud comes to the host."""
        tensor = torch.rand(200_000, 3, device="cuda") * 10
        seen_from = [[5.0, 5.0, 5.0]]  # viewpoints that nobody gives are inferred on the host
        gpureg.prepare(tensor, viewpoints=seen_from, context=GPU)
        with torch.profiler.profile(activities=[torch.profiler.ProfilerActivity.CUDA]) as profile:
            gpureg.prepare(tensor.cpu(), context=GPU)  # this one goes there and back
            torch.cuda.synchronize()
        seen = copies(profile)
        if not any("DtoH" in name for name, _ in seen):
            pytest.skip("the profiler sees no copies on this machine")
        with torch.profiler.profile(activities=[torch.profiler.ProfilerActivity.CUDA]) as profile:
            cloud = gpureg.prepare(tensor, viewpoints=seen_from, context=GPU)
            torch.cuda.synchronize()
        seen = copies(profile)
        to_host = [size for name, size in seen if "DtoH" in name]
        to_device = [size for name, size in seen if "HtoD" in name]
        print(
            f"copies to the host: {len(to_host)}, {sum(to_host)} bytes; to the device: {len(to_device)}, {sum(to_device)} bytes"
        )
        assert len(cloud) > 1000 and sum(to_host) < 10_000 and sum(to_device) < 100_000

    def test_example(self, torch):
        import pathlib

        path = pathlib.Path(__file__).parents[2] / "examples" / "python" / "04_own_features.py"
        done = subprocess.run([sys.executable, path], capture_output=True, text=True)
        assert done.returncode == 0 and done.stdout.startswith(
            "cuda: <gpureg.RegistrationResult aligned"
        ), done.stderr


def copies(profile):
    """(name, bytes) of the copies between host and device."""
    import json
    import tempfile

    with tempfile.NamedTemporaryFile(suffix=".json") as file:
        profile.export_chrome_trace(file.name)
        events = json.load(open(file.name))["traceEvents"]
    return [(e["name"], int(e["args"]["bytes"])) for e in events if e.get("cat") == "gpu_memcpy"]


def test_cupy(source, reference, target, truth):
    cupy = pytest.importorskip("cupy")
    array = cupy.asarray(source.astype(np.float32))
    for given in (
        array,
        cupy.asfortranarray(array),
        cupy.asarray(np.ascontiguousarray(source.astype("f4")))[:],
    ):
        assert stays(given)
        assert arrays_of(gpureg.prepare(given, context=GPU)) == reference
    assert arrays_of(gpureg.prepare(array.astype("f8"), context=GPU)) == reference
    assert error_of(gpureg.register(array, target, options=few(), context=GPU), truth) < 0.02
    assert len(gpureg.prepare(cupy.zeros((0, 3), "f4"), context=GPU)) == 0
    dirty = array.copy()
    dirty[7] = np.nan
    assert gpureg.prepare(dirty, context=GPU).statistics.invalid_points == 1
