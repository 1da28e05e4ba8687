# SPDX-License-Identifier: BSD-3-Clause
"""What tests share."""

import os
import pathlib
import signal

import numpy as np
import pytest
from scenes import moved, pose, room


@pytest.fixture(scope="session")
def source() -> np.ndarray:
    return room()


@pytest.fixture(scope="session")
def truth() -> np.ndarray:
    return pose()


@pytest.fixture(scope="session")
def target(source: np.ndarray, truth: np.ndarray) -> np.ndarray:
    return moved(source, truth)


@pytest.fixture(scope="session")
def kitchen() -> pathlib.Path:
    """Fragments of the red kitchen: real data, where GPUREG_DATA_DIR has them."""
    folder = pathlib.Path(os.environ.get("GPUREG_DATA_DIR", "")) / "redkitchen" / "fragments"
    if not (folder / "cloud_bin_0.ply").exists():
        pytest.skip("GPUREG_DATA_DIR with redkitchen/fragments is not set")
    return folder


@pytest.fixture(autouse=True, scope="session")
def interruptible():
    """Shells start background jobs with SIGINT ignored, and Python leaves it so: tests that press
    Ctrl-C would wait for ever.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
