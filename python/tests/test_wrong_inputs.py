# SPDX-License-Identifier: BSD-3-Clause
"""What is no cloud, or no pair: an exception that names argument, shape and value."""

import gpureg
import numpy as np
import pytest
from scenes import few


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        (np.zeros((3, 100)), ValueError, r"points: expected shape \(N, 3\), got \(3, 100\)"),
        (np.zeros(3), ValueError, r"points: expected shape \(N, 3\), got \(3,\)"),
        (np.zeros((2, 3, 3)), ValueError, r"got \(2, 3, 3\)"),
        (np.zeros(()), ValueError, r"got \(\)"),
        ([], ValueError, r"points: expected shape \(N, 3\), got \(0,\)"),
        (
            np.zeros((5, 3), complex),
            TypeError,
            r"points: expected numbers, got dtype complex128 \(shape \(5, 3\)\)",
        ),
        (np.zeros((5, 3), bool), TypeError, "points: expected numbers, got dtype bool"),
        (np.full((5, 3), "1"), TypeError, "points: expected numbers, got dtype <U1"),
        (np.full((5, 3), None), TypeError, "points: expected numbers, got dtype object"),
        (np.zeros((5, 3), "M8[s]"), TypeError, "points: expected numbers, got dtype datetime64"),
        ([[1, 2, 3], [4, 5]], TypeError, "points: no array can be made of this list"),
        (None, TypeError, "points: expected an array of numbers, got NoneType"),
        ({"points": []}, TypeError, "points: expected an array of numbers, got dict"),
        (
            (row for row in [[0, 0, 0]]),
            TypeError,
            "points: expected an array of numbers, got generator",
        ),
        (
            np.array([[0, 0, 0], [1e300, 0, 0]]),
            ValueError,
            r"points: row 1 is \[1e\+300.*too large for float32",
        ),
    ],
)
def test_wrong_points_are_named(value, error, message):
    with pytest.raises(error, match=message):
        gpureg.prepare(value)


def test_wrong_companions_are_named(source):
    with pytest.raises(
        ValueError, match=r"normals: expected shape \(6000, 3\), one row per point, got \(4, 3\)"
    ):
        gpureg.prepare(source, normals=np.zeros((4, 3)))
    with pytest.raises(ValueError, match=r"features: expected shape \(6000, D\), got \(6000,\)"):
        gpureg.prepare(source, features=np.zeros(len(source)))
    with pytest.raises(gpureg.InvalidArgument, match="feature_dimension is 0"):
        gpureg.prepare(source, features=np.zeros((len(source), 0)))
    with pytest.raises(ValueError, match=r"viewpoints: expected shape \(N, 3\), got \(4,\)"):
        gpureg.prepare(source, viewpoints=[0, 0, 0, 0])
    with pytest.raises(ValueError, match=r"viewpoints: row 0 is \[.*nan.*\], expected finite"):
        gpureg.prepare(source, viewpoints=[[0, np.nan, 0]])
    with pytest.raises(gpureg.InvalidArgument, match=r"viewpoints is 1e\+30, expected coordinates"):
        gpureg.prepare(source, viewpoints=[[1e30, 0, 0]])
    with pytest.raises(ValueError, match=r"target: expected shape \(N, 3\), got \(5, 2\)"):
        gpureg.register(source, np.zeros((5, 2)))
    with pytest.raises(ValueError, match=r"clouds\[1\]: expected shape"):
        gpureg.prepare_batch([source, np.zeros((5, 2))])
    with pytest.raises(
        TypeError, match=r"source: expected a PreparedCloud, got ndarray of shape \(6000, 3\)"
    ):
        gpureg.align(source, source)
    with pytest.raises(TypeError, match="options: expected a RegistrationOptions"):
        gpureg.register(source, source, options={"voxel_size": 1})
    with pytest.raises(TypeError, match="either options, or"):
        gpureg.register(source, source, 0.1, options=few())


def test_wrong_sequences_of_clouds_are_named(source):
    with pytest.raises(TypeError, match="^source: expected an array of numbers, got NoneType$"):
        gpureg.register(None, source)
    calls = [
        ("clouds", gpureg.prepare_batch),
        ("clouds", gpureg.FragmentSet.from_clouds),
        ("fragments", lambda clouds: gpureg.align_batch(clouds, [])),
    ]
    for name, call in calls:
        with pytest.raises(
            TypeError, match=f"^{name}: expected a sequence of clouds, got one: '/a/b.ply'$"
        ):
            call("/a/b.ply")
        with pytest.raises(
            TypeError,
            match=rf"^{name}: expected a sequence of clouds, got one: ndarray of float64, shape \(6000, 3\)$",
        ):
            call(source)
        with pytest.raises(
            TypeError, match=f"^{name}: expected a sequence of clouds, got one: PointCloud$"
        ):
            call(gpureg.PointCloud(source))
        with pytest.raises(
            TypeError, match=f"^{name}: expected a sequence of clouds, got NoneType$"
        ):
            call(None)
    assert [
        len(cloud) > 0 for cloud in gpureg.prepare_batch(cloud for cloud in (source, source))
    ] == [True, True]
    held = np.empty(2, object)
    held[:] = [source, source]
    assert len(gpureg.prepare_batch(held)) == 2
    with pytest.raises(
        TypeError, match=r"^clouds\[0\]: expected an array of numbers, got NoneType"
    ):
        gpureg.prepare_batch([None])
    with pytest.raises(
        TypeError, match=r"^fragments\[1\]: expected an array of numbers, got NoneType"
    ):
        gpureg.align_batch([source, None], [(0, 1)])
    with pytest.raises(
        ValueError, match=r"^pairs\[0\] is \(-1, 0\), expected indices from 0 to 4294967295 \(shape"
    ):
        gpureg.loop_consistency([(-1, 0)], [])


def test_wrong_parts_of_a_cloud_are_named(source):
    with pytest.raises(
        ValueError, match=r"^normals: expected shape \(6000, 3\), one row per point, got \(5, 3\)"
    ):
        gpureg.PointCloud(source, source[:5])
    with pytest.raises(
        ValueError, match=r"^viewpoints: row 1 is \[0.0, nan, 0.0\], expected finite coordinates"
    ):
        gpureg.PointCloud(source, viewpoints=[[1, 2, 3], [0, np.nan, 0]])
    with pytest.raises(TypeError, match="^points: expected an array of numbers, got NoneType"):
        gpureg.PointCloud(None)


@pytest.mark.parametrize(
    ("pairs", "error", "message"),
    [
        ([(0, 2)], ValueError, r"pairs\[0\] is \(0, 2\), but there are 2"),
        ([(0, 1), (-1, 0)], ValueError, r"pairs\[1\] is \(-1, 0\)"),
        ([(0, 1, 2)], ValueError, r"pairs: expected shape \(M, 2\), got \(1, 3\)"),
        ([(0.0, 1.0)], TypeError, "pairs: expected whole numbers, got dtype float64"),
        ("all", TypeError, "pairs: expected whole numbers"),
    ],
)
def test_wrong_pairs_are_named(source, pairs, error, message):
    with pytest.raises(error, match=message):
        gpureg.align_batch([source, source], pairs)


def test_errors_say_which_cloud(source):
    lonely = (
        np.random.default_rng(1).random((30000, 3)) * 4000
    )  # millimetres with a voxel in metres
    alone = "nearly all of 30000 points are isolated"
    with pytest.raises(gpureg.InvalidArgument, match=f"^{alone}"):
        gpureg.prepare(lonely)
    with pytest.raises(gpureg.InvalidArgument, match=rf"^clouds\[1\]: {alone}"):
        gpureg.prepare_batch([source, lonely, source])
    for clouds, name in (((lonely, source), "source"), ((source, lonely), "target")):
        with pytest.raises(gpureg.InvalidArgument, match=f"^{name}: {alone}"):
            gpureg.register(*clouds, voxel_size=0.05)
    with pytest.raises(gpureg.InvalidArgument, match=rf"^fragments\[1\]: {alone}"):
        gpureg.align_batch([source, lonely], [[0, 1]])
