# SPDX-License-Identifier: BSD-3-Clause
"""Types and docstrings say what the code does."""

import ast
import doctest
import importlib
import inspect
import os
import pathlib
import pkgutil
import subprocess
import sys

import gpureg
import pytest
from gpureg import _core

ROOT = pathlib.Path(__file__).parents[2]
PACKAGE = pathlib.Path(gpureg.__file__).parent
OPTIONAL = {"gpureg.ray": "ray", "gpureg.batch": "pyarrow"}


def modules():
    names = [m.name for m in pkgutil.iter_modules([str(PACKAGE)], "gpureg.")]
    return [n for n in names if n not in ("gpureg._core", "gpureg.__main__")]


@pytest.mark.parametrize("name", modules())
def test_examples_in_docstrings(name):
    if name in OPTIONAL:
        pytest.importorskip(OPTIONAL[name])
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_everything_public_has_a_docstring():
    for name in gpureg.__all__:
        value = getattr(gpureg, name)
        if callable(value):
            assert inspect.getdoc(value), name


def test_stub_has_the_fields_of_the_structs():
    tree = ast.parse((PACKAGE / "_core.pyi").read_text())
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    checked = 0
    for name, node in classes.items():
        fields = getattr(getattr(_core, name), "_fields", None)
        if fields is None:
            continue
        declared = [
            n.target.id for n in node.body if isinstance(n, ast.AnnAssign) and n.target.id[0] != "_"
        ]
        methods = {n.name: n for n in node.body if isinstance(n, ast.FunctionDef)}
        if declared:  # options: attributes, constructor and replace agree
            assert declared == list(fields), name
            for method in ("__init__", "replace"):
                assert [a.arg for a in methods[method].args.kwonlyargs] == list(fields), (
                    name,
                    method,
                )
        else:
            assert set(fields) <= set(methods), name
        checked += 1
    assert checked >= 8


def run(*arguments):
    # Not installed, but on the path: mypy has to be told.
    folder = (
        {}
        if "site-packages" in str(PACKAGE)
        else {"MYPYPATH": str(PACKAGE.parent), "PYTHONPATH": str(PACKAGE.parent)}
    )
    done = subprocess.run(
        [sys.executable, "-m", *arguments],
        capture_output=True,
        text=True,
        cwd="/",
        env={**os.environ, **folder},
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubtest(tmp_path):
    pytest.importorskip("mypy")
    # pybind11's metaclass, and constructors that only raise: neither is part of the face.
    allowed = [
        r"gpureg\._core\.[A-Za-z]+",
        r"gpureg\._core\.(?!\w*Options|PointCloud)\w+\.__init__",
    ]
    (tmp_path / "allowed").write_text("\n".join(allowed))
    run(
        "mypy.stubtest",
        "gpureg._core",
        "--allowlist",
        str(tmp_path / "allowed"),
        "--ignore-unused-allowlist",
        "--mypy-config-file",
        str(ROOT / "pyproject.toml"),
    )


def test_mypy_strict():
    pytest.importorskip("mypy")
    run("mypy", "--config-file", str(ROOT / "pyproject.toml"), "-p", "gpureg")
