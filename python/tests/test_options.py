# SPDX-License-Identifier: BSD-3-Clause
"""Options: keywords, defaults of the C++ objects, no silent typos."""

import copy
import pickle

import gpureg
import numpy as np
import pytest

CLASSES = [
    gpureg.PrepareOptions,
    gpureg.RegistrationOptions,
    gpureg.LoopConsistencyOptions,
    gpureg.ReconstructionOptions,
    gpureg.LoopClosureOptions,
    gpureg.PoseGraphOptions,
]


@pytest.mark.parametrize("cls", CLASSES)
def test_common_face(cls):
    options = cls()
    options.validate()
    assert eval(repr(options), vars(gpureg)) == options
    for other in (copy.copy(options), pickle.loads(pickle.dumps(options)), options.replace()):
        assert other == options and other is not options
    with pytest.raises(TypeError, match=f"{cls.__name__} has no option 'voxel_sise'; it has "):
        cls(voxel_sise=1)
    with pytest.raises(TypeError, match="has no option 'x'"):
        options.replace(x=1)
    with pytest.raises(AttributeError):
        options.voxel_sise = 1
    assert options != "text"


@pytest.mark.parametrize(
    ("cls", "field", "value", "message"),
    [
        (
            gpureg.PrepareOptions,
            "normal_radius",
            "a",
            "PrepareOptions.normal_radius: expected a number, got 'a'",
        ),
        (gpureg.RegistrationOptions, "voxel_size", True, "expected a number, got True"),
        (gpureg.RegistrationOptions, "tune", 5, "tune: expected a text, got 5"),
        (
            gpureg.RegistrationOptions,
            "method",
            "luck",
            "method: expected 'compatibility' or 'quadruples', got 'luck'",
        ),
        (
            gpureg.RegistrationOptions,
            "quadruples",
            -1,
            "quadruples: expected a whole number from 0 to 4294967295, got -1",
        ),
        (gpureg.RegistrationOptions, "quadruples", 2.5, "whole number"),
        (gpureg.RegistrationOptions, "seed", 2**64, "whole number from 0 to 18446744073709551615"),
        (
            gpureg.PrepareOptions,
            "downsample",
            "yes",
            "downsample: expected True or False, got 'yes'",
        ),
        (
            gpureg.RegistrationOptions,
            "prepare",
            {},
            "RegistrationOptions.prepare: expected PrepareOptions, got {}",
        ),
    ],
)
def test_wrong_values_are_named(cls, field, value, message):
    with pytest.raises(TypeError, match=message):
        cls(**{field: value})
    with pytest.raises(TypeError, match=message):
        setattr(cls(), field, value)


POINTS = [[0, 0, 0]]


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (
            lambda: gpureg.RegistrationOptions.loopsmart("5"),
            TypeError,
            "voxel_size: expected a number, got '5'",
        ),
        (
            lambda: gpureg.RegistrationOptions(0.05),
            TypeError,
            r"RegistrationOptions: expected keywords, such as RegistrationOptions\(voxel_size=...\), got 0.05",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, quality=-1),
            ValueError,
            "quality is -1, expected 0 or more",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, [0.05]),
            TypeError,
            r"voxel_size: expected a number, got \[0.05\]",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, np.ones(2)),
            TypeError,
            r"voxel_size: expected a number, got array\(\[1., 1.\]\)",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, quality=2.5),
            TypeError,
            "quality: expected a whole number, got 2.5",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, True),
            TypeError,
            "voxel_size: expected a number, got True",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, time_budget_ms="5"),
            TypeError,
            "time_budget_ms: expected milliseconds, a number, got '5'",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, time_budget_ms=-5),
            ValueError,
            "time_budget_ms is -5, expected a number > 0",
        ),
        (
            lambda: gpureg.register(POINTS, POINTS, time_budget_ms=float("nan")),
            ValueError,
            "time_budget_ms is nan",
        ),
        (
            lambda: gpureg.Context.cpu(-1),
            ValueError,
            "threads: expected a whole number, 0 or more, got -1",
        ),
        (
            lambda: gpureg.Context.cpu(threads=1.5),
            TypeError,
            "threads: expected a whole number, 0 or more, got 1.5",
        ),
        (
            lambda: gpureg.Context.cuda("0"),
            TypeError,
            "device: expected a whole number, or a list of them, got '0'",
        ),
        (
            lambda: gpureg.Context.cuda(devices=["a"]),
            TypeError,
            r"devices: expected a list of whole numbers, got \['a'\]",
        ),
        (
            lambda: gpureg.Context.cuda(devices=[0], memory_budget=-1),
            ValueError,
            "memory_budget: expected bytes, 0 or more, got -1",
        ),
        (
            lambda: gpureg.Context.cuda([0], -1),
            ValueError,
            "memory_budget: expected bytes, 0 or more, got -1",
        ),
        (
            lambda: gpureg.Context.cuda(gpu=0),
            TypeError,
            "Context.cuda has no argument 'gpu'; it has device, or devices",
        ),
        (
            lambda: gpureg.RegistrationPrior(up=[0, 0, 1]),
            TypeError,
            "RegistrationPrior has no argument 'up'; it has source_up, target_up",
        ),
        (
            lambda: gpureg.RegistrationPrior(np.eye(4)),
            TypeError,
            "RegistrationPrior: expected keywords, such as",
        ),
        (
            lambda: gpureg.RegistrationPrior(source_up="up", target_up=[0, 0, 1]),
            TypeError,
            "source_up: expected an array of numbers, got 'up'",
        ),
        (
            lambda: gpureg.RegistrationPrior(max_angle="5"),
            TypeError,
            "max_angle: expected a number, got '5'",
        ),
    ],
)
def test_wrong_arguments_are_named_in_one_line(call, error, message):
    with pytest.raises(error, match=f"^{message}") as raised:
        call()
    assert "\n" not in str(raised.value) and len(str(raised.value)) < 200


def test_numbers_are_as_written():
    assert gpureg.RegistrationOptions(voxel_size=0.1).voxel_size == 0.1
    assert gpureg.RegistrationOptions(seed=2**64 - 1).seed == 2**64 - 1
    numpy = pytest.importorskip("numpy")
    assert gpureg.RegistrationOptions(quadruples=numpy.int32(7)).quadruples == 7
    assert gpureg.RegistrationOptions(voxel_size=numpy.float32(0.1)).voxel_size == 0.1


def test_nested_options_are_the_same_object():
    options = gpureg.RegistrationOptions()
    options.prepare.depth_maps = 7
    assert options.prepare.depth_maps == 7
    assert options != gpureg.RegistrationOptions()
    options.prepare = gpureg.PrepareOptions(depth_maps=9)
    assert options.prepare.depth_maps == 9


def test_presets():
    paper = gpureg.RegistrationOptions.loopsmart(0.1)
    assert paper.voxel_size == 0.1
    assert paper.prepare.normal_radius == 2 and paper.prepare.max_correspondence_distance == 1.5
    assert paper.method == "quadruples" and paper.refine_iterations == 0
    assert gpureg.RegistrationOptions().method == "compatibility"


def test_options_of_maps_and_loops():
    loops = gpureg.LoopClosureOptions(registration=gpureg.RegistrationOptions(voxel_size=0.1))
    assert loops.proposals.coarse_voxel_size == 10
    loops.graph.drift.translation_per_metre = 0.5
    assert loops.graph.drift == gpureg.DriftOptions(translation_per_metre=0.5)
    assert gpureg.LoopClosureOptions.loopsmart().graph.robust == "line_process"
    with pytest.raises(TypeError, match="robust: expected 'none', 'gnc' or 'line_process'"):
        gpureg.PoseGraphOptions(robust="luck")
    with pytest.raises(ValueError, match=r"acceptance.alone is 2, expected \(0, 1\]"):
        gpureg.LoopClosureOptions(acceptance=gpureg.LoopAcceptanceOptions(alone=2)).validate()
    with pytest.raises(TypeError, match="options: expected a LoopClosureOptions"):
        gpureg.LoopCloser(options=gpureg.RegistrationOptions())
    assert gpureg.PoseEvidence.source_overlap.__doc__.startswith("Share of the source's points")
    assert gpureg.PrepareOptions.normal_radius.__doc__.endswith("feature_radius. Voxels.")


def test_out_of_range_is_a_value_error():
    with pytest.raises(ValueError, match="prepare.normal_radius is nan"):
        gpureg.PrepareOptions(normal_radius=float("nan")).validate()
    with pytest.raises(ValueError, match="quality is 11, expected at most 10"):
        gpureg.RegistrationOptions(quality=11).validate()
    with pytest.raises(gpureg.InvalidArgument, match="voxel_size"):
        gpureg.register([[0, 0, 0]], [[0, 0, 0]], voxel_size=-1)
    with pytest.raises(gpureg.Error):
        gpureg.Context.cpu(5000)


def test_contexts():
    context = gpureg.Context.cpu(3)
    assert (context.backend, context.threads, context.description) == ("cpu", 3, "cpu, 3 threads")
    assert repr(context) == "<gpureg.Context cpu, 3 threads>"
    assert gpureg.default_context() is gpureg.default_context()
    assert any(line.startswith("cpu") for line in gpureg.describe_backends())
    with pytest.raises(gpureg.BackendUnavailable):
        gpureg.Context.cuda(123)
