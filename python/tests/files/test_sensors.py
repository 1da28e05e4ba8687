# SPDX-License-Identifier: BSD-3-Clause
"""Files of other sensors, meshes, and what is known of the clouds."""

import pathlib
import pickle
import types
import warnings

import gpureg
import numpy as np
import pytest

VERTICES = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)], float)
FACES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]]
    + [[2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
)


def mesh(vertices=VERTICES, faces=FACES):
    """What trimesh's and Open3D's meshes have in common."""
    return types.SimpleNamespace(vertices=vertices, faces=faces)


def obj(path, vertices=VERTICES, faces=FACES):
    lines = ["v {} {} {}".format(*v) for v in vertices] + [
        "f {} {} {}".format(*f + 1) for f in faces
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


class TestLas:
    @pytest.fixture
    def laspy(self):
        return pytest.importorskip("laspy")

    def write(self, laspy, path, points):
        file = laspy.create(point_format=3, file_version="1.2")
        file.header.offsets, file.header.scales = points.min(axis=0), [0.001] * 3
        file.x, file.y, file.z = points.T
        file.write(path)
        return path

    @pytest.mark.parametrize("name", ["scan.las", "scan.LAZ"])
    def test_map_coordinates_keep_their_digits(self, laspy, tmp_path, name):
        points = np.random.default_rng(1).random((3000, 3)) * 10
        utm = points + [500000, 5400000, 300]
        path = self.write(laspy, str(tmp_path / name), utm)
        cloud = gpureg.prepare(path, options=gpureg.RegistrationOptions(voxel_size=0.5))
        assert cloud.statistics.input_points == 3000
        result = gpureg.register(path, points, voxel_size=0.5)
        assert result.aligned
        # Of the moved points, not of the translation: a microradian turns by metres so far away.
        pose = result.target_from_source
        assert np.abs(utm @ pose[:3, :3].T + pose[:3, 3] - points).max() < 0.5

    def test_wrong_files_are_named(self, laspy, tmp_path):
        missing = str(tmp_path / "none.las")
        with pytest.raises(gpureg.IoError, match=r"none\.las"):
            gpureg.prepare(missing)
        whole = self.write(laspy, str(tmp_path / "a.las"), np.random.default_rng(1).random((99, 3)))
        content = open(whole, "rb").read()
        for name, wrong in (
            ("text.las", b"no points at all"),
            ("empty.laz", b""),
            ("short.las", content[:100]),
        ):
            (tmp_path / name).write_bytes(wrong)
            with pytest.raises(gpureg.IoError, match=name.replace(".", r"\.")):
                gpureg.register(str(tmp_path / name), whole)

    def test_numbers_of_a_damaged_file_take_no_memory(self, laspy, tmp_path):
        points = np.random.default_rng(1).random((500, 3))
        for name in ("a.las", "a.laz"):
            whole = open(self.write(laspy, str(tmp_path / name), points), "rb").read()
            start = int.from_bytes(whole[96:100], "little")
            table = int.from_bytes(whole[start : start + 8], "little")
            # Records before the points, points, and the chunks of LAZ. lazrs aborts the process
            # where their table does not fit into memory.
            places = [(100, "records"), (107, "")] + [(table + 4, "chunks")] * (name == "a.laz")
            for at, word in places:
                path = tmp_path / f"wrong_{name}"
                path.write_bytes(whole[:at] + b"\xff\xff\xff\xff" + whole[at + 4 :])
                with pytest.raises(gpureg.IoError, match=rf"wrong_{name}: .*{word}"):
                    gpureg.prepare(path)

    @pytest.mark.parametrize("layer", [0, 8])
    def test_layers_of_a_damaged_file_take_no_memory(self, laspy, tmp_path, layer):
        file = laspy.create(point_format=6, file_version="1.4")
        file.x, file.y, file.z = np.random.default_rng(1).random((3, 500))
        path = str(tmp_path / "layers.laz")
        file.write(path)
        assert gpureg.prepare(path).statistics.input_points == 500
        content = bytearray(open(path, "rb").read())
        # A chunk is a whole point, the number of its points, the sizes of its layers, and these.
        start, size = int.from_bytes(content[96:100], "little"), 30
        at = start + 8 + size + 4 + 4 * layer
        content[at : at + 4] = (0xF0000000).to_bytes(4, "little")
        pathlib.Path(path).write_bytes(content)
        # lazrs takes 4 GB for it before it finds that the file ends.
        with pytest.raises(gpureg.IoError, match=r"layers\.laz: .*4026531840 bytes announced"):
            gpureg.prepare(path)

    def test_without_laspy_the_error_says_what_to_install(self, tmp_path, monkeypatch):
        monkeypatch.setitem(__import__("sys").modules, "laspy", None)
        with pytest.raises(ImportError, match=r"a\.las.*gpureg\[formats\]"):
            gpureg.prepare(str(tmp_path / "a.las"))


class TestKitti:
    def test_rows(self, tmp_path):
        path = tmp_path / "000000.bin"
        np.array([[1, 2, 3, 0.5], [np.nan, 0, 0, 0], [4, 5, 6, 0.1]], "<f4").tofile(path)
        points = gpureg.read_point_cloud(path).points
        assert points.shape == (3, 3) and points[2].tolist() == [4, 5, 6]

    def test_what_is_no_scan_is_named(self, tmp_path):
        path = tmp_path / "scan.bin"
        path.write_bytes(bytes(17))
        with pytest.raises(gpureg.IoError, match=r"scan\.bin.*17 bytes"):
            gpureg.read_point_cloud(path)


class TestMesh:
    def test_faces_are_sampled(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            cloud = gpureg.prepare(mesh(), options=gpureg.RegistrationOptions(voxel_size=0.05))
        assert cloud.statistics.input_points == 20000
        outwards = (cloud.normals * (cloud.points - 0.5)).sum(axis=1)
        assert (outwards > 0).all()

    def test_half_a_voxel_apart(self):
        cloud = gpureg.prepare(mesh(), options=gpureg.RegistrationOptions(voxel_size=0.02))
        assert cloud.statistics.input_points == pytest.approx(60000, abs=1)

    def test_open3d_names_them_triangles(self):
        like_open3d = types.SimpleNamespace(vertices=VERTICES, triangles=FACES)
        assert gpureg.prepare(like_open3d).statistics.input_points == 20000

    def test_trimesh(self):
        trimesh = pytest.importorskip("trimesh")
        box = trimesh.creation.box((1, 2, 3))
        assert gpureg.prepare(box).statistics.input_points == pytest.approx(35200, abs=1)

    def test_flipped_and_non_manifold_faces_are_said(self):
        faces = np.vstack([FACES, [[0, 1, 7]]])
        faces[0, :2] = faces[0, 1::-1]
        with pytest.warns(UserWarning, match=r"1 faces pointed the wrong way.*1 edges belong"):
            gpureg.prepare(mesh(faces=faces))

    def test_wrong_meshes_are_named(self):
        vertices = VERTICES.copy()
        vertices[3, 1] = np.nan
        with pytest.raises(ValueError, match=r"source: vertices\[3\] is .*nan.*finite"):
            gpureg.register(mesh(vertices), mesh())
        with pytest.raises(ValueError, match=r"target\.faces\[1\] is \[0, 1, 8\].*8 vertices"):
            gpureg.register(mesh(), mesh(faces=np.array([[0, 1, 2], [0, 1, 8]])))
        with pytest.raises(ValueError, match=r"source: faces: none of 0 has an area"):
            gpureg.register(mesh(faces=np.zeros((0, 3), int)), mesh())
        with pytest.raises(ValueError, match=r"points\.faces: expected shape \(N, 3\).*\(2, 4\)"):
            gpureg.prepare(mesh(faces=np.zeros((2, 4), int)))

    def test_files(self, tmp_path):
        path = obj(tmp_path / "cube.obj")
        cloud = gpureg.read_point_cloud(path)
        assert len(cloud) == 20000 and len(cloud.normals) == 20000
        assert len(gpureg.read_point_cloud(path, spacing=0.01)) == 60000
        assert gpureg.prepare(path).statistics.input_points == 20000
        fragments = gpureg.FragmentSet.from_directory(obj(tmp_path / "cloud_bin_0.obj").parent)
        assert fragments.numbers == (0,)

    def test_wrong_files_are_named(self, tmp_path):
        path = obj(tmp_path / "flat.obj", faces=np.array([[0, 0, 1]]))
        with pytest.raises(gpureg.IoError, match=r"flat\.obj"):
            gpureg.prepare(path)
        faces = FACES.copy()
        faces[0, :2] = faces[0, 1::-1]
        with pytest.warns(UserWarning, match=r"turned\.obj: 1 faces pointed the wrong way"):
            gpureg.prepare(obj(tmp_path / "turned.obj", faces=faces))


class TestViewpoints:
    CLOUD = np.random.default_rng(1).random((2000, 3))

    def test_what_is_said_is_taken(self):
        said = gpureg.register(self.CLOUD, self.CLOUD, source_viewpoint=[0, 0, 3])
        assert said.source_viewpoint == "given"
        none = gpureg.register(
            self.CLOUD, self.CLOUD, source_viewpoint="none", target_viewpoint="none"
        )
        assert (none.source_viewpoint, none.target_viewpoint) == ("none", "none")

    @pytest.mark.parametrize(
        ("value", "message"),
        [
            ("here", r"source\.viewpoints: expected .*'none', 'model' or 'auto', got 'here'"),
            ([0, 0], r"source\.viewpoints: expected shape \(N, 3\), got \(2,\)"),
            ([[0, 0]], r"source\.viewpoints: expected shape \(N, 3\), got \(1, 2\)"),
            ([0, 0, np.nan], r"source.*viewpoint.*nan"),
            ([0, np.inf, 0], r"source.*viewpoint.*inf"),
        ],
    )
    def test_wrong_ones_are_named(self, value, message):
        with pytest.raises(ValueError, match=message):
            gpureg.register(self.CLOUD, self.CLOUD, source_viewpoint=value)

    @pytest.mark.parametrize("up", [[0, 0, 0], [0, 0, np.nan], [0, np.inf, 1]])
    def test_no_direction_is_named(self, up):
        with pytest.raises(ValueError, match=r"source_up"):
            prior = gpureg.RegistrationPrior(source_up=up, target_up=[0, 0, 1])
            gpureg.register(self.CLOUD, self.CLOUD, prior=prior)


def test_equivalent_poses_of_a_cube():
    result = gpureg.register(mesh(), mesh(), voxel_size=0.04)
    assert result.equivalent_poses == 1 + sum(mode.equivalent for mode in result.modes)
    assert result.symmetry_confidence >= result.confidence
    assert gpureg.RegistrationOptions(accept_symmetry=True).accept_symmetry


WALLS = [
    (-5, -3, 5, -3),
    (5, -3, 5, 3),
    (5, 3, -5, 3),
    (-5, 3, -5, -3),
    (1, 0.2, 1, 3),
    (-2, -3, -2, -1),
    (2.6, -2.3, 3.4, -2),
    (3.4, -2, 3.2, -1.5),
    (3.2, -1.5, 2.4, -1.8),
    (-4.2, 1.65, -2.8, 1.65),
    (-2.8, 1.65, -2.8, 2.35),
]


def flat_scan(x, y, turn, seed):
    """(N, 3) points of a scanner in a flat, z = 0."""
    angles = np.linspace(-np.pi, np.pi, 1440, endpoint=False)
    ray = np.c_[np.cos(angles + turn), np.sin(angles + turn)]
    ranges = np.full(len(angles), np.inf)
    for ax, ay, bx, by in WALLS:
        along, to = np.array([bx - ax, by - ay]), np.array([ax - x, ay - y])
        cross = ray[:, 0] * along[1] - ray[:, 1] * along[0]
        with np.errstate(divide="ignore"):
            t = (to[0] * along[1] - to[1] * along[0]) / cross
            u = (to[0] * ray[:, 1] - to[1] * ray[:, 0]) / cross
        hit = (t > 0.05) & (u >= 0) & (u <= 1)
        ranges[hit] = np.minimum(ranges, t)[hit]
    ranges += np.random.default_rng(seed).normal(size=len(ranges)) * 0.006
    return np.c_[ranges * np.cos(angles), ranges * np.sin(angles), 0 * angles]


def flat_pose(x, y, turn):
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]])


FIRST, SECOND = (-1.2, 0.8, 0.2), (-0.2, -1.0, 2.6)


@pytest.mark.parametrize("voxel_size", [0.1, None])
def test_pose_of_flat_scans_is_planar(voxel_size):
    source, target = flat_scan(*FIRST, 1), flat_scan(*SECOND, 2)
    assert gpureg.suggest_voxel_size([source, target]).flat
    result = gpureg.register(source, target, voxel_size=voxel_size)
    assert result.aligned and result.flat
    assert result.inlier_ratio > 0.7
    truth = np.linalg.inv(flat_pose(*SECOND)) @ flat_pose(*FIRST)
    np.testing.assert_allclose(result.target_from_source, truth, atol=0.02)
    for mode in result.modes:
        assert mode.target_from_source[2].tolist() == [0, 0, 1, 0]
        assert mode.target_from_source[:2, 2].tolist() == [0, 0]
    information = result.source_moments.information_open3d()
    assert (information[np.ix_([2, 3, 4], [0, 1, 5])] == 0).all()
    assert pickle.loads(pickle.dumps(result)).flat


def test_prepared_flat_scans_say_so():
    cloud = gpureg.prepare(flat_scan(*FIRST, 1))
    assert cloud.statistics.flat
    assert cloud.statistics.input_points == 1440


def test_a_flat_scan_with_another_cloud_is_refused():
    room = np.random.default_rng(1).random((5000, 3)) * [4, 3, 2]
    room[:, 2] *= np.arange(5000) % 2
    result = gpureg.register(flat_scan(*FIRST, 1), room, voxel_size=0.1)
    assert result.reason == "flat_with_solid"
    assert "2-D scanner" in result.explanation
    assert not result.flat
