# SPDX-License-Identifier: BSD-3-Clause
from setuptools import setup

NAME = "gpureg_localizer"

setup(
    name=NAME,
    version="0.1.0",
    description="Finds the pose of a point cloud in a map of gpureg, without an initial guess",
    license="BSD-3-Clause",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/localizer.launch.py"]),
    ],
    install_requires=["setuptools", "numpy"],
    zip_safe=True,
    entry_points={"console_scripts": [f"localizer = {NAME}.node:main"]},
)
