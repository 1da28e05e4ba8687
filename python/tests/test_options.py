# SPDX-License-Identifier: BSD-3-Clause
"""Options: keywords, defaults of the C++ objects, no silent typos."""

import copy
import pickle

import pytest

import gpureg

CLASSES = [
    gpureg.PrepareOptions,
    gpureg.HypothesisOptions,
    gpureg.ScoreOptions,
    gpureg.RefineOptions,
    gpureg.RegistrationOptions,
]


@pytest.mark.parametrize("cls", CLASSES)
def test_common_face(cls):
    options = cls()
    options.validate()
    assert eval(repr(options), vars(gpureg)) == options
    for twin in (copy.copy(options), pickle.loads(pickle.dumps(options)), options.replace()):
        assert twin == options and twin is not options
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
        (gpureg.PrepareOptions, "voxel_size", "a", "PrepareOptions.voxel_size: expected a number, got 'a'"),
        (gpureg.PrepareOptions, "voxel_size", True, "expected a number, got True"),
        (gpureg.HypothesisOptions, "proposal", "luck", "proposal: expected 'compatibility' or 'quadruples', got 'luck'"),
        (gpureg.HypothesisOptions, "count", -1, "count: expected a whole number from 0 to 4294967295, got -1"),
        (gpureg.HypothesisOptions, "count", 2.5, "whole number"),
        (gpureg.HypothesisOptions, "seed", 2**64, "whole number from 0 to 18446744073709551615"),
        (gpureg.HypothesisOptions, "mutual", "yes", "mutual: expected True or False, got 'yes'"),
        (gpureg.RegistrationOptions, "prepare", {}, "RegistrationOptions.prepare: expected PrepareOptions, got {}"),
    ],
)
def test_wrong_values_are_named(cls, field, value, message):
    with pytest.raises(TypeError, match=message):
        cls(**{field: value})
    with pytest.raises(TypeError, match=message):
        setattr(cls(), field, value)


def test_numbers_are_as_written():
    assert gpureg.PrepareOptions(voxel_size=0.1).voxel_size == 0.1
    assert gpureg.HypothesisOptions(seed=2**64 - 1).seed == 2**64 - 1
    numpy = pytest.importorskip("numpy")
    assert gpureg.HypothesisOptions(count=numpy.int32(7)).count == 7
    assert gpureg.PrepareOptions(voxel_size=numpy.float32(0.1)).voxel_size == 0.1


def test_nested_options_are_the_same_object():
    options = gpureg.RegistrationOptions()
    options.hypothesis.seed = 7
    assert options.hypothesis.seed == 7
    assert options != gpureg.RegistrationOptions()
    options.hypothesis = gpureg.HypothesisOptions(seed=9)
    assert options.hypothesis.seed == 9


def test_presets():
    options = gpureg.RegistrationOptions.from_voxel_size(0.1)
    assert options.prepare.normal_radius == 0.2 and options.score.max_correspondence_distance == 0.15
    assert gpureg.RegistrationOptions.from_voxel_size(0.05) == gpureg.RegistrationOptions()
    assert gpureg.RegistrationOptions.loopsmart().refine.max_iterations == 0
    assert gpureg.RegistrationOptions.loopsmart(0.1).prepare.voxel_size == 0.1


def test_out_of_range_is_a_value_error():
    with pytest.raises(ValueError, match="prepare.voxel_size is nan"):
        gpureg.PrepareOptions(voxel_size=float("nan")).validate()
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
