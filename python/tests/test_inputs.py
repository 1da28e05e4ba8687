# SPDX-License-Identifier: BSD-3-Clause
"""What goes in as a cloud gives the right answer; test_wrong_inputs.py has what is refused."""

import gc
import pathlib
import resource
import subprocess
import sys
import types
import warnings

import gpureg
import numpy as np
import pytest
from gpureg._arrays import core_cloud, float_rows, to_numpy
from scenes import few, moved, room


def same_points(cloud, expected):
    return np.array_equal(cloud.points, expected.points)


@pytest.fixture(scope="module")
def reference(source):
    return gpureg.prepare(source.astype(np.float32))


@pytest.mark.parametrize("dtype", ["float32", ">f4", "float64", ">f8", "longdouble"])
def test_float_types_give_the_same_cloud(source, reference, dtype):
    exact = source.astype(np.float32).astype(dtype)
    assert same_points(gpureg.prepare(exact), reference)


@pytest.mark.parametrize("dtype", ["float16", "int8", "uint16", "int64"])
def test_coarse_types_are_converted(source, dtype):
    points = (source * 8).astype(dtype)
    options = gpureg.RegistrationOptions(voxel_size=0.4)
    assert same_points(
        gpureg.prepare(points, options=options),
        gpureg.prepare(points.astype("f4"), options=options),
    )


def layouts(points):
    read_only = points.copy()
    read_only.flags.writeable = False
    wide = np.full((len(points), 7), np.nan, np.float32)
    wide[:, 2:5] = points
    spread = np.zeros((2 * len(points), 6), np.float32)
    spread[::2, ::2] = points
    raw = np.zeros(points.nbytes + 1, np.uint8)
    unaligned = raw[1:].view(np.float32).reshape(points.shape)
    unaligned[:] = points
    backwards = points[::-1].copy()[::-1]
    return {
        "fortran": np.asfortranarray(points),
        "read-only": read_only,
        "columns of a wide matrix": wide[:, 2:5],
        "every other row and column": spread[::2, ::2],
        "not aligned": unaligned,
        "backwards": backwards,
        "list": points.tolist(),
        "buffer": memoryview(points),
    }


@pytest.mark.parametrize("layout", list(layouts(np.zeros((2, 3), np.float32))))
def test_layouts_give_the_same_cloud(source, reference, layout):
    given = layouts(source.astype(np.float32))[layout]
    assert same_points(gpureg.prepare(given), reference)


def test_one_copy_at_most():
    wide = np.zeros((10, 4), np.float32)
    assert float_rows(wide, "x") is wide
    assert np.shares_memory(float_rows(wide[:, :3], "x"), wide)  # rows as PCL has them
    assert np.shares_memory(float_rows(wide[2:7:2, 1:], "x"), wide)
    assert not np.shares_memory(float_rows(wide.T, "x"), wide)
    assert to_numpy(wide, "x") is wide


def test_map_coordinates_lose_nothing(source, truth):
    offset_a, offset_b = np.array([455_000.25, 5_410_000.5, 310.0]), np.array([-7e6, 12.0, 3e5])
    a, b = gpureg.prepare(source + offset_a), gpureg.prepare(moved(source, truth) + offset_b)
    assert a.origin.any() and a.points.dtype == np.float64
    assert np.abs(a.points.mean(axis=0) - source.mean(axis=0) - offset_a).max() < 0.05
    assert np.array_equal(a.viewpoints, np.zeros((1, 3)))  # where the caller's frame has its origin
    result = gpureg.align(a, b, options=few())
    where = moved(source + offset_a, result.target_from_source) - (moved(source, truth) + offset_b)
    # As without offsets: a fraction of the voxel. float32 at 7e6 would be off by 0.5.
    assert result.aligned and np.abs(where).max() < 0.03
    again = gpureg.align_batch([a, b], [(0, 1)], options=few())[0]
    assert np.array_equal(again.target_from_source, result.target_from_source)
    moments = result.source_moments
    assert np.abs(moments.sum / moments.count - (source + offset_a).mean(axis=0)).max() < 0.2


def test_normals_in_map_coordinates_need_no_viewpoint():
    # A floor, and a wall of a twelfth of the points that turns its back on where the map has its
    # origin: what of a cloud may be turned towards a viewpoint.
    rng = np.random.default_rng(1)
    floor, wall = (
        rng.random((5500, 3)) * [4, 4, 0],
        rng.random((500, 3)) * [0, 4, 1.5] + [2, 0, 0.5],
    )
    points, normals = (
        np.concatenate([floor, wall]),
        np.repeat([[0.0, 0, 1], [1.0, 0, 0]], [5500, 500], axis=0),
    )
    there = gpureg.prepare(points + [5e6, 5e6, -5e6], normals=normals)
    here = gpureg.prepare(points, normals=normals)
    assert there.origin.any() and not here.origin.any()
    for cloud in (here, there):
        upright = cloud.points[:, 2] - cloud.points[:, 2].min() > 0.6
        assert np.median(cloud.normals[upright, 0]) > 0.99
        evidence = gpureg.align(cloud, cloud).modes[0].evidence
        assert (
            evidence.source_observed == evidence.target_observed == 0
        )  # nothing is known about free space
    seen = gpureg.prepare(
        points + [5e6, 5e6, -5e6], normals=normals, viewpoints=[[5e6 + 4, 5e6 + 2, 1 - 5e6]]
    )
    assert np.abs(seen.viewpoints - [5e6 + 4, 5e6 + 2, 1 - 5e6]).max() < 1e-6
    assert gpureg.align(seen, seen).modes[0].evidence.source_observed > 0


def test_small_float64_coordinates_are_only_cast(source, reference):
    assert not gpureg.prepare(source + 100.0).origin.any()
    assert same_points(gpureg.prepare(source), reference)


def test_nan_and_infinite_rows_are_dropped_and_counted(source, reference):
    dirty = np.insert(source.astype(np.float32), [0, 5, len(source)], np.nan, axis=0)
    dirty[0] = [np.inf, 0, 0]
    cloud = gpureg.prepare(dirty)
    assert cloud.statistics.invalid_points == 3 and same_points(cloud, reference)
    assert len(gpureg.prepare(np.full((4, 3), np.nan))) == 0


def test_masked_entries_are_refused(source):
    mask = np.zeros(source.shape, bool)
    whole = np.ma.masked_array(source, mask)
    assert same_points(gpureg.prepare(whole), gpureg.prepare(source))
    mask[7, 1] = mask[9] = True
    masked = np.ma.masked_array(source, mask)
    eyes = np.ma.masked_array(
        np.tile(np.eye(4), (2, 1, 1)), mask=np.arange(32).reshape(2, 4, 4) > 15
    )
    cloud = gpureg.prepare(source)
    for call, name in [
        (lambda: gpureg.prepare(masked), "points"),
        (lambda: gpureg.prepare(source, masked), "normals"),
        (lambda: gpureg.prepare(source, features=masked), "features"),
        (lambda: gpureg.prepare(source, viewpoints=masked[:10]), "viewpoints"),
        (lambda: gpureg.register(source, masked), "target"),
        (lambda: gpureg.prepare_batch([source, masked]), r"clouds\[1\]"),
        (lambda: gpureg.suggest_voxel_size([masked]), r"clouds\[0\]"),
        (lambda: gpureg.PointCloud(masked), "points"),
    ]:
        with pytest.raises(ValueError, match=rf"^{name}: row 7 is masked, as are 4 entries"):
            call()
    with pytest.raises(ValueError, match=r"^poses: row 1 is masked, as are 16 entries"):
        gpureg.verify(cloud, cloud, eyes)


def test_empty_clouds_have_a_reason(source):
    for empty in (np.zeros((0, 3)), np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int64)):
        assert gpureg.register(empty, source).reason == "too_few_source_points"
    assert gpureg.register(source, source[:3], quality=0).reason == "too_few_target_points"
    assert (
        len(gpureg.prepare(np.zeros((0, 3)), features=np.zeros((0, 8)), normals=np.zeros((0, 3))))
        == 0
    )
    assert gpureg.align_batch([], []) == [] and gpureg.prepare_batch([]) == []


def test_intensities_of_a_lidar_are_left_out(source, reference):
    scan = np.column_stack([source, np.linspace(0, 1, len(source))]).astype(np.float32)
    assert same_points(gpureg.prepare(scan), reference)
    assert np.array_equal(gpureg.PointCloud(scan).points, scan[:, :3])
    with pytest.raises(ValueError, match=r"points: expected shape \(N, 3\), got \(9, 5\)"):
        gpureg.prepare(np.zeros((9, 5)))


def test_numpy_takes_a_point_cloud(source):
    cloud = gpureg.PointCloud(source.astype(np.float32), viewpoints=[0, 0, 0])
    assert cloud.viewpoints.tolist() == [[0, 0, 0]]
    assert np.array_equal(np.asarray(cloud), cloud.points)
    assert np.asarray(cloud, np.float64).dtype == np.float64


def test_a_loop_closer_prepares_with_viewpoints(source):
    closer = gpureg.LoopCloser(voxel_size=0.05)
    closer.add(0, source, viewpoints=[0, 0, 1])
    with pytest.raises(ValueError, match="viewpoints"):
        closer.add(1, source, viewpoints="nobody")
    with pytest.raises(TypeError, match="viewpoints: only for points"):
        closer.add(1, gpureg.prepare(source), viewpoints=[0, 0, 1])


def test_what_is_loaded_late_is_listed():
    assert {"register_all", "BatchRun", "read_cameras"} <= set(dir(gpureg))
    assert set(gpureg.__all__) <= set(dir(gpureg))


def test_names_of_scans_are_sorted_by_number():
    file = pathlib.Path(__file__).parents[2] / "examples" / "python" / "08_kiss_icp.py"
    text = file.read_text()
    found = {"re": __import__("re"), "Path": pathlib.Path}
    exec(text[text.index("def in_order") : text.index("def main")], found)
    names = ["scan_10.ply", "scan_2.ply", "scan_1.pcd", "000007.ply", "b1.ply"]
    paths = sorted(map(pathlib.Path, names), key=found["in_order"])
    assert [path.name for path in paths] == [
        "000007.ply",
        "b1.ply",
        "scan_1.pcd",
        "scan_2.ply",
        "scan_10.ply",
    ]


def test_normals_are_used(source):
    # They choose the side: all against all, but for those at a right angle to what was given.
    side = np.tile([0.3, 0.5, 2.0], (len(source), 1))
    one, other = gpureg.prepare(source, normals=side), gpureg.prepare(source, normals=-side)
    assert (np.einsum("ij,j->i", one.normals, side[0]) >= 0).all() and one.normals.any()
    turned = np.einsum("ij,ij->i", one.normals, other.normals)
    assert np.mean(turned < -0.99) > 0.95


def test_dlpack(source, reference):
    class OnlyDlpack:
        def __init__(self, array):
            self.array = array

        def __dlpack__(self, **keywords):
            return self.array.__dlpack__(**keywords)

        def __dlpack_device__(self):
            return self.array.__dlpack_device__()

    assert same_points(gpureg.prepare(OnlyDlpack(source.astype(np.float32))), reference)


def test_torch(source, reference):
    torch = pytest.importorskip("torch")
    tensor = torch.from_numpy(source.astype(np.float32))
    assert same_points(gpureg.prepare(tensor), reference)
    assert same_points(gpureg.prepare(tensor.clone().requires_grad_()), reference)
    assert same_points(gpureg.prepare(tensor.T.contiguous().T), reference)
    assert same_points(gpureg.prepare(tensor.double()), reference)
    with pytest.raises(TypeError, match="points: .*bfloat16"):
        gpureg.prepare(tensor.to(torch.bfloat16))


def test_open3d_by_its_looks(source, reference):
    cloud = types.SimpleNamespace(points=source, normals=source, has_normals=lambda: False)
    assert same_points(gpureg.prepare(cloud), reference)
    cloud.has_normals = lambda: True
    cloud.normals = np.tile([0.3, 0.5, 2.0], (len(source), 1))
    assert np.array_equal(
        gpureg.prepare(cloud).normals, gpureg.prepare(source, normals=cloud.normals).normals
    )


def test_files(source, tmp_path, reference):
    path = tmp_path / "room.ply"
    gpureg.write_point_cloud(path, source)
    cloud = gpureg.read_point_cloud(path)
    assert len(cloud) == len(source) and cloud.normals.shape == (0, 3)
    for given in (path, str(path), cloud):
        assert same_points(gpureg.prepare(given), reference)
    with pytest.raises(OSError, match="nowhere.ply"):
        gpureg.prepare(tmp_path / "nowhere.ply")


def test_only_ply_is_written(source, tmp_path):
    for name in ("room.pcd", "room.xyz", "room.ply.gz"):
        with pytest.raises(
            ValueError,
            match=rf"path: '.*{name}' ends in '.*', but what is written is PLY: let it end in '.ply'",
        ):
            gpureg.write_point_cloud(tmp_path / name, source)
    assert not list(tmp_path.iterdir())
    for name in ("room.ply", "room.PLY", "room"):
        gpureg.write_point_cloud(tmp_path / name, source)
        assert len(gpureg.read_point_cloud(tmp_path / name)) == len(source)


def test_clouds_that_float32_would_round_have_an_origin(source, tmp_path):
    there = source + 5e6
    there[3] = 0  # a stray point
    cloud = gpureg.PointCloud(there, viewpoints=[[5e6 + 1, 5e6, 5e6]])
    gpureg.write_point_cloud(tmp_path / "there.ply", there)
    for points in (cloud.points, gpureg.read_point_cloud(tmp_path / "there.ply").points):
        # float32 resolves a millionth of the room, and half a metre at 5e6.
        assert points.dtype == np.float64 and np.abs(points - there)[4:].max() < 1e-5
    assert np.array_equal(cloud.viewpoints, [[5e6 + 1, 5e6, 5e6]])
    prepared = gpureg.prepare(gpureg.PointCloud(np.delete(there, 3, axis=0))).points[:, 0]
    assert np.abs(np.median(prepared) - np.median(there[:, 0])) < 0.5
    # What float32 can tell apart, whatever the unit, and what was rounded before, stays float32.
    rounded = there.astype(np.float32)
    for good in (
        source + 1000,
        source * 1000 + 3000,
        rounded,
        rounded.astype(float),
        np.full((3, 3), np.nan),
        np.zeros((0, 3)),
    ):
        assert np.array_equal(
            gpureg.PointCloud(good).points, good.astype(np.float32), equal_nan=True
        )
    nothing = np.zeros((0, 3))
    assert len(gpureg.PointCloud(source, nothing, nothing)) == len(source)


def test_files_with_large_coordinates_warn(source, tmp_path):
    path = tmp_path / "there.ply"
    gpureg.write_point_cloud(path, (source + 5e6).astype(np.float32))
    for read in (gpureg.read_point_cloud, gpureg.prepare):
        with pytest.warns(
            UserWarning,
            match=r"there.ply: coordinates up to 500000[12].* resolve 0.5 in float32, which the file holds",
        ):
            read(path)
    gpureg.write_point_cloud(path, source * 1e5)  # large, but not too large for its extent
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gpureg.read_point_cloud(path)


def growth():
    """Of resident memory over two thousand calls of each kind, bytes."""
    context = gpureg.Context.cpu(1)
    small = np.ascontiguousarray(room()[:60])
    cloud = gpureg.prepare(small, context=context)
    options = few(4)

    def work(calls):
        for _ in range(calls):
            gpureg.prepare(small, context=context)
            gpureg.align(cloud, cloud, options=options, context=context).to_dict()
            try:
                gpureg.prepare(small.T)
            except ValueError:
                pass

    def resident():
        gc.collect()
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * resource.getpagesize()

    work(400)
    before = resident()
    work(2000)
    return resident() - before


def test_no_leak():
    """In a process of its own: what other tests brought along, Ray's threads, say, needs memory
    when it likes.
    """
    code = "import test_inputs; print(test_inputs.growth())"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=pathlib.Path(__file__).parent,
        capture_output=True,
        text=True,
        check=True,
    )
    # One leaked result or cloud per call would be 1 MB and more; what is allowed is the
    # allocator's.
    assert int(done.stdout) < 400_000


def test_viewpoints_that_cannot_be_what_a_cloud_was_seen_from():
    x, y = np.meshgrid(np.arange(40) * 0.1, np.arange(40) * 0.1)
    floor = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1)
    up = np.tile([0.0, 0.0, 1.0], (len(floor), 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gpureg.prepare(floor, normals=up, viewpoints=[[2, 2, 2]])
        gpureg.prepare(floor, viewpoints=[[2, 2, -2]])  # estimated normals turn to the viewpoints
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nobody asks them
        gpureg.prepare(
            floor,
            normals=up,
            viewpoints=[[2, 2, -2]],
            options=gpureg.RegistrationOptions(prepare=gpureg.PrepareOptions(depth_maps=0)),
        )
    with pytest.warns(
        UserWarning,
        match=r"^viewpoints: 100.0 % of the normals show all of them their back: are they in the frame",
    ):
        gpureg.prepare(floor, normals=up, viewpoints=[[2, 2, -2]])
    # Map coordinates: the points are moved before the library sees them, and so are the viewpoints.
    far = np.array([5e5, 4e6, 100.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gpureg.prepare(floor + far, normals=up, viewpoints=[[2, 2, 2] + far])
    with pytest.warns(UserWarning, match=r"^clouds\[1\]: viewpoints: 100.0 %"):
        gpureg.prepare_batch(
            [gpureg.PointCloud(floor, normals=up, viewpoints=[[2, 2, side]]) for side in (2, -2)]
        )


class OnDevice:
    """An array as cupy has it: its interface names the stream that wrote it."""

    def __init__(self, shape, stream, address=4096):
        self.shape, self.dtype = shape, np.dtype("float32")
        self._stream, self._address = stream, address

    @property
    def __cuda_array_interface__(self):
        interface = {
            "shape": self.shape,
            "typestr": "<f4",
            "data": (self._address, False),
            "version": 3,
        }
        return interface if self._stream is None else {**interface, "stream": self._stream}


def test_every_array_on_the_device_has_its_own_stream():
    points, normals = OnDevice((5, 3), 11), OnDevice((5, 3), 22, 8192)
    features = OnDevice((5, 7), None, 16384)
    options = gpureg.RegistrationOptions()
    whole = core_cloud(points, normals, features, None, options, device=True)
    assert [rows[0] for rows in whole[:3]] == [4096, 8192, 16384]
    assert whole[5] == (11, 22, 0), "without a stream it is the default stream"
    alone = core_cloud(points, None, None, None, options, device=True)
    assert alone[5] == (11, 11, 11)
