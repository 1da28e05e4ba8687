# SPDX-License-Identifier: BSD-3-Clause
"""ros/gpureg_localizer without ROS: messages, poses and covariances, and the node on stand-ins."""

import pathlib
import sys
import threading
import time
import types

import gpureg
import numpy as np
import pytest
from scenes import moved, pose, room

pytest.importorskip("rosbags")

from rosbags.typesys import Stores, get_typestore

PACKAGE = pathlib.Path(__file__).resolve().parents[3] / "ros/gpureg_localizer"
sys.path.insert(0, str(PACKAGE))

from gpureg_localizer.localizer import (
    Localizer,
    covariance_of,
    noise_of,
    points_of,
    quaternion_of,
)

STORE = get_typestore(Stores.ROS2_HUMBLE)
CLOUD, FIELD = "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/PointField"
TYPES = {"f4": 7, "f8": 8, "u1": 2, "i2": 3}


def message(points, kind="f4", names="xyz", height=1, before=0, after=1, padding=0, **changes):
    """A PointCloud2 that was written and read: so many bytes before and after the coordinates of a
    point, and after a row.
    """
    size = np.dtype(kind).itemsize
    step = before + size * len(names) + after
    width = len(points) // height
    data = np.full((height, width * step + padding), 0xA5, np.uint8)
    values = np.ascontiguousarray(points[:, : len(names)], "<" + kind).view(np.uint8)
    values = values.reshape(height, width, size * len(names))
    bodies = data[:, : width * step].reshape(height, width, step)
    bodies[:, :, before : step - after] = values
    data[:, : width * step] = bodies.reshape(height, -1)
    make = STORE.types
    stamp = make["builtin_interfaces/msg/Time"](sec=7, nanosec=5)
    fields = {
        "header": make["std_msgs/msg/Header"](stamp=stamp, frame_id="lidar"),
        "height": height,
        "width": width,
        "fields": [
            make[FIELD](name, before + k * size, TYPES[kind], 1) for k, name in enumerate(names)
        ],
        "is_bigendian": False,
        "point_step": step,
        "row_step": width * step + padding,
        "data": data.ravel(),
        "is_dense": True,
        **changes,
    }
    raw = STORE.serialize_cdr(make[CLOUD](**fields), CLOUD)
    return STORE.deserialize_cdr(raw, CLOUD)


def scan(seed, frame, thinned=0):
    return moved(room(seed, 24000)[thinned::2], frame)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "room.gpureg"
    gpureg.prepare_map(scan(1, np.eye(4))).save(path)
    return path


@pytest.mark.parametrize("kind", ["f4", "f8"])
@pytest.mark.parametrize("layout", [{}, {"height": 4, "before": 3, "after": 9, "padding": 5}])
def test_points_of_any_layout(kind, layout):
    points = room(1, 1200)
    points[7, 1], points[8, 2] = np.nan, np.inf
    kept = points[np.isfinite(points).all(axis=1)].astype(kind)
    assert len(kept) == 1198
    assert np.array_equal(points_of(message(points, kind, **layout)), kept)


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"names": "xy"}, "fields: z is missing, there are x, y"),
        ({"fields": []}, "fields: x is missing, there are none"),
        ({"kind": "i2"}, r"fields: datatype of x is 3, expected 7 \(FLOAT32\)"),
        ({"is_bigendian": True}, "is_bigendian"),
        ({"point_step": 11}, "fields: offset of z is 8, which does not fit point_step 11"),
        ({"row_step": 12}, r"row_step: 12, expected width \* point_step = 1560 or more"),
        ({"height": 2, "data": np.zeros(99, np.uint8)}, r"data: 99 bytes, expected .* = 1560"),
    ],
)
def test_the_error_names_the_field(file, changes, error):
    with pytest.raises(ValueError, match=error):
        Localizer(file).locate(message(room(1, 120), **changes))


def test_a_message_without_finite_points():
    with pytest.raises(ValueError, match="data: none of 5 points is finite"):
        points_of(message(np.full((5, 3), np.nan)))
    with pytest.raises(ValueError, match="data: none of 0 points"):
        points_of(message(np.zeros((0, 3))))


def test_found_and_not_there(file):
    localizer, frame = Localizer(file), pose()
    location = localizer.locate(message(scan(1, frame, 1)))
    assert location.found and location.text.startswith("found with confidence ")
    truth = np.linalg.inv(frame)
    assert np.abs(location.position - truth[:3, 3]).max() < 0.05
    # Both signs are one rotation. 0.02 is two degrees.
    assert 1 - abs(location.quaternion @ quaternion_of(truth[:3, :3])) < 0.02**2 / 2
    covariance = location.covariance.reshape(6, 6)
    assert np.linalg.eigvalsh(covariance).min() > 0 and np.allclose(covariance, covariance.T)
    foreign = localizer.locate(message(scan(9, frame)))
    assert not foreign.found and foreign.covariance is None
    assert foreign.text.startswith("not in this map with probability ")
    with pytest.raises(gpureg.InvalidArgument, match="millimetres"):
        localizer.locate(message(1000 * scan(1, frame)))


def test_quaternions():
    for seed in range(20):
        rotation = pose(seed)[:3, :3]
        x, y, z, w = quaternion_of(rotation)
        v = np.array([x, y, z])
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        back = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross
        assert np.abs(back - rotation).max() < 1e-12 and w >= 0
    assert np.array_equal(quaternion_of(np.diag([-1.0, -1, 1])), [0, 0, 1, 0])


def turned(v):
    """Rotation about a vector by its length."""
    angle = np.linalg.norm(v)
    x, y, z = v / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def stub(eigenvalues, direction, centre):
    evidence = types.SimpleNamespace(
        information_eigenvalues=eigenvalues, weakest_direction=direction
    )
    return evidence, types.SimpleNamespace(count=10, sum=10 * np.asarray(centre, float))


def test_covariance_is_that_of_finite_differences():
    """The errors of the model, applied to the pose: about the centre, in the axes of the map."""
    noise, unit, step = gpureg.EdgeNoiseOptions(), 1.0, 1e-6
    direction = np.array([0.1, -0.3, 0.2, 0.7, 0.4, 0.2])
    direction /= np.linalg.norm(direction)
    centre = np.array([2.0, -1, 0.5])
    evidence, moments = stub([1, 100, 200, 200, 300, 400], list(direction), centre)
    truth = pose(4)
    around = moved(centre[None], truth)[0]
    derivatives = []
    for k in range(6):  # a rotation, then a translation
        error = np.zeros(6)
        error[k] = step
        rotation = turned(error[:3]) if k < 3 else np.eye(3)
        position = rotation @ (truth[:3, 3] - around) + around + error[3:]
        # R' R^-1 = 1 + [w]x for rotations w about the fixed axes.
        turn = rotation @ truth[:3, :3] @ truth[:3, :3].T
        angles = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
        derivatives.append(np.concatenate([position - truth[:3, 3], angles]) / step)
    jacobian = np.array(derivatives).T
    sigma = np.repeat([np.radians(noise.rotation), noise.translation], 3)
    extra = noise.translation**2 * (min(200, (noise.max_translation / noise.translation) ** 2) - 1)
    # Two directions are weak: the second has half of the typical eigenvalue.
    model = 2 * np.diag(sigma**2) + extra * np.outer(direction, direction)
    expected = jacobian @ model @ jacobian.T
    covariance = covariance_of(truth, evidence, moments, noise, unit)
    # Differences of 1e-6 have errors of the second order, 1e-6 of a lever of some metres.
    assert np.abs(covariance - expected).max() < 1e-5 * np.abs(expected).max()


def test_covariance_is_that_of_a_map():
    """LoopCloser's information is of Log(pose^-1 truth), rotation first, in the source's frame."""
    frame = pose()
    options = gpureg.LoopClosureOptions()
    context = gpureg.Context.cpu(1)
    target, source = (
        gpureg.prepare(scan(1, at, k), options=options.registration, context=context)
        for k, at in enumerate((np.eye(4), frame))
    )
    result = gpureg.align(source, target, options=options.registration, context=context)
    closer = gpureg.LoopCloser(options=options, context=context)
    closer.add(0, target)
    closer.add(1, source)
    (loop,) = closer.process().changed
    assert np.array_equal(loop.target_from_source, result.target_from_source)
    rotation = loop.target_from_source[:3, :3]
    to_ros = np.zeros((6, 6))  # of right perturbations
    to_ros[:3, 3:] = to_ros[3:, :3] = rotation
    expected = to_ros @ np.linalg.inv(loop.information) @ to_ros.T
    covariance = covariance_of(
        result.target_from_source,
        result.modes[0].evidence,
        result.source_moments,
        *noise_of(options, float(np.float32(0.05))),  # as in C++
    )
    # The inverse of a matrix with a condition of some thousands.
    assert np.abs(covariance - expected).max() < 1e-9 * np.abs(expected).max()


class Stand:
    """Takes any arguments, and has any attribute: for what the node only passes on."""

    def __init__(self, *_, **values):
        self.__dict__.update(values)

    def __getattr__(self, name):
        self.__dict__[name] = Stand()
        return self.__dict__[name]

    def __call__(self, *_, **__):
        return Stand()


def stand_in(monkeypatch, parameters):
    """Modules of ROS that node.py imports, with the signatures of rclpy (ros2/rclpy@ba72a01, of
    December 2024). Returns the messages that it publishes.
    """
    published = []

    class Node:
        def __init__(self, node_name, *, context=None):
            self.name = node_name

        def declare_parameter(self, name, value=None, descriptor=None, ignore_override=False):
            return Stand(value=parameters.get(name, value))

        def create_publisher(self, msg_type, topic, qos_profile, *, callback_group=None):
            assert topic == "pose"
            return Stand(publish=published.append)

        def create_subscription(
            self, msg_type, topic, callback, qos_profile, *, callback_group=None
        ):
            assert topic == "points"

        def create_service(
            self, srv_type, srv_name, callback, *, qos_profile=None, callback_group=None
        ):
            assert srv_name == "relocalize"

        def get_logger(self):
            return Stand()

    def init(*, args=None, context=None, domain_id=None, signal_handler_options=None):
        published.append("init")

    def spin(node, executor=None):
        assert node.name == "gpureg_localizer"
        published.append("spin")
        raise KeyboardInterrupt

    def try_shutdown(*, context=None, uninstall_handlers=None):
        published.append("shutdown")

    def executor(num_threads=None, *, context=None):
        assert num_threads > 1  # the service waits in one of them

    names = {
        "rclpy": {"init": init, "spin": spin, "try_shutdown": try_shutdown},
        "rclpy.callback_groups": {"MutuallyExclusiveCallbackGroup": Stand},
        "rclpy.executors": {
            "ExternalShutdownException": Exception,
            "MultiThreadedExecutor": executor,
        },
        "rclpy.node": {"Node": Node},
        "rclpy.qos": {
            "QoSDurabilityPolicy": Stand(),
            "QoSProfile": Stand,
            "qos_profile_sensor_data": None,
        },
        "geometry_msgs.msg": {"PoseWithCovarianceStamped": Stand},
        "sensor_msgs.msg": {"PointCloud2": None},
        "std_srvs.srv": {"Trigger": None},
    }
    for package in {name.split(".")[0] for name in names} | set(names):
        module = types.ModuleType(package)
        module.__dict__.update(names.get(package, {}))
        monkeypatch.setitem(sys.modules, package, module)
    monkeypatch.delitem(sys.modules, "gpureg_localizer.node", raising=False)
    return published


def ask(node, cloud=None):
    """Calls the service; the cloud comes once the node waits for it."""

    def deliver():
        while node.wanted is None:
            time.sleep(0.001)
        node.on_points(cloud)

    if cloud is not None:
        threading.Thread(target=deliver, daemon=True).start()
    return node.relocalize(None, Stand())


def read_back(out):
    """A PoseWithCovarianceStamped that was serialised: its fields have the types of the message."""
    make, (position, orientation) = STORE.types, (out.pose.pose.position, out.pose.pose.orientation)
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    pose = make["geometry_msgs/msg/Pose"](
        make["geometry_msgs/msg/Point"](position.x, position.y, position.z),
        make["geometry_msgs/msg/Quaternion"](
            orientation.x, orientation.y, orientation.z, orientation.w
        ),
    )
    covariance = np.array(out.pose.covariance, np.float64)
    header = make["std_msgs/msg/Header"](out.header.stamp, out.header.frame_id)
    stamped = make[kind](header, make["geometry_msgs/msg/PoseWithCovariance"](pose, covariance))
    return STORE.deserialize_cdr(STORE.serialize_cdr(stamped, kind), kind)


def test_the_node_on_stand_ins(monkeypatch, file):
    published = stand_in(monkeypatch, {"map": str(file), "timeout": 0.05})
    from gpureg_localizer.node import LocalizerNode

    node, frame = LocalizerNode(), pose()
    cloud = message(scan(1, frame, 1))
    node.on_points(cloud)  # nobody asked
    answer = ask(node)
    assert (answer.success, answer.message) == (False, "no cloud within 0.05 s")
    node.timeout = 30
    answer = ask(node, cloud)
    assert answer.success and answer.message.startswith("found with confidence")
    (out,) = published
    assert out.header.stamp == cloud.header.stamp and out.header.frame_id == "map"
    position = out.pose.pose.position
    truth = np.linalg.inv(frame)[:3, 3]
    assert (
        np.abs([position.x - truth[0], position.y - truth[1], position.z - truth[2]]).max() < 0.05
    )
    assert np.array_equal(read_back(out).pose.covariance, out.pose.covariance)
    answer = ask(node, message(scan(1, frame), is_bigendian=True))
    assert not answer.success and "is_bigendian" in answer.message
    assert not ask(node, message(scan(9, frame))).success and len(published) == 1


def test_the_node_asks_for_a_map(monkeypatch):
    stand_in(monkeypatch, {})
    from gpureg_localizer.node import LocalizerNode

    with pytest.raises(ValueError, match="parameter map"):
        LocalizerNode()


def test_ctrl_c_ends_the_node(monkeypatch, file):
    called = stand_in(monkeypatch, {"map": str(file)})
    from gpureg_localizer.node import main

    main()
    assert called == ["init", "spin", "shutdown"]
