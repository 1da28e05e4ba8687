#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Headers that are slow to compile stay out of headers that everything includes; folders stay small; sources of one
library can be compiled together (CMAKE_UNITY_BUILD). layers.py and portable.py have rules of their own.

structure.py [ROOT]    exit status 1 and one line per file that may not include what it includes, per folder with
                       too many files, and per name that two sources of a library keep for themselves
"""

import collections
import os
import pathlib
import re
import sys

import layers
import portable

FOLDERS = ("include", "src", "apps/gpureg", "data")

MOST_FILES = 30  # of one folder
# Records are data, one file a figure; builds, caches and generated pages are nobody's code.
UNCOUNTED = re.compile(
    r"bench/results|tests/fuzz/corpus/.*|docs/(images|_static|reference/cpp).*|build.*|out|shared|.*__pycache__|.*\..*"
)

# Who may include a header of other libraries, or a part of its folder. Sources may include Eigen as they like.
HEAVY = {
    r"Eigen/(?!Core$).*": {
        "include/gpureg/overlay.hpp",
        "include/gpureg/result.hpp",
        "src/api/frames.hpp",
        "src/calibration/halves.hpp",
        "src/pose_graph/se3.hpp",
        "src/symmetry/symmetry.hpp",
        "apps/gpureg/pictures/before_after.hpp",
        "apps/gpureg/pictures/render.hpp",
        *(
            f"data/{name}.hpp"
            for name in (
                "ground_truth mesh scene_files surface rooms/house tours/trajectory"
                " sensor/depth_sensor sensor/fusion sensor/planar_scanner sensor/rgbd"
            ).split()
        ),
    },
    r"nlohmann/json\.hpp": {"apps/gpureg/json/json.hpp"},
    r"CLI/.*": {"apps/gpureg/command_line.cpp"},
    r"iostream|regex|iomanip": set(),
    r"fstream": {"apps/gpureg/json/json_file.hpp"},
    r"sstream": {"src/common/validate.hpp"},
}
SOURCES_TOO = {r"nlohmann/json\.hpp", r"CLI/.*"}

# What these include in turn may not be heavy either.
LIGHT = ("include/gpureg/io.hpp", "include/gpureg/options.hpp", "include/gpureg/context.hpp",
         "include/gpureg/point_cloud.hpp", "include/gpureg/evidence.hpp", "apps/gpureg/command_line.hpp",
         "apps/gpureg/text.hpp")  # fmt: skip

INCLUDE = re.compile(r'^\s*#\s*include\s+[<"]([^>"]+)[>"]', re.MULTILINE)


def includes(path: pathlib.Path) -> list[str]:
    return INCLUDE.findall(path.read_text())


def forbidden(root: pathlib.Path) -> list[str]:
    """Files with a heavy include that the table does not allow."""
    found = []
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[hc]pp")):
            name = path.relative_to(root).as_posix()
            for pattern, allowed in HEAVY.items():
                if name in allowed or (path.suffix == ".cpp" and pattern not in SOURCES_TOO):
                    continue
                found += [
                    f"{name} includes {i}" for i in includes(path) if re.fullmatch(pattern, i)
                ]
    return found


def reached(root: pathlib.Path, name: str) -> set[str]:
    """All that a header includes, also through headers of the project."""
    seen: set[str] = set()
    waiting = [root / name]
    while waiting:
        for include in includes(waiting.pop()):
            if include in seen:
                continue
            seen.add(include)
            places = (root / folder / include for folder in FOLDERS)
            waiting += [place for place in places if place.is_file()]
    return seen


def heavy_through_others(root: pathlib.Path) -> list[str]:
    return [
        f"{name} includes {include} through other headers"
        for name in LIGHT
        if (root / name).is_file()
        for include in sorted(reached(root, name))
        if any(re.fullmatch(pattern, include) for pattern in HEAVY)
    ]


def outside_of_umbrella(root: pathlib.Path) -> list[str]:
    """Public headers that gpureg.hpp neither includes nor names as others."""
    umbrella = root / "include/gpureg/gpureg.hpp"
    if not umbrella.is_file():
        return []
    known = (
        reached(root, "include/gpureg/gpureg.hpp")
        | {"gpureg/gpureg.hpp"}
        | {f"gpureg/{name}" for name in re.findall(r"\w+\.hpp", umbrella.read_text())}
    )
    return [
        f"include/gpureg/gpureg.hpp neither includes nor names {path.name}"
        for path in sorted(umbrella.parent.glob("*.hpp"))
        if f"gpureg/{path.name}" not in known
    ]


def full_folders(root: pathlib.Path) -> list[str]:
    """Folders with more files than one looks through."""
    found = []
    for folder, inner, names in os.walk(root):
        place = pathlib.Path(folder)
        inner[:] = [
            i for i in inner if not UNCOUNTED.fullmatch((place / i).relative_to(root).as_posix())
        ]
        count = sum(not name.endswith((".so", ".pyc")) for name in names)
        if count > MOST_FILES:
            found.append(
                f"{place.relative_to(root).as_posix()} has {count} files: split it by subject"
            )
    return found


# Folders whose sources are one library, without those that are compiled alone, for their flags.
TOGETHER = (
    ("src/cpu",),
    tuple(f"src/{name}" for name in ("api viewpoint flat symmetry spacing sensor_fixed confidence calibration"
                                     " loop_consistency pruning scale").split()),
    *((f"src/{name}",) for name in "evaluation io sets pose_graph reconstruction loop_closure localization fields files".split()),
    ("data",),
    tuple(f"apps/gpureg/{name}" for name in "verbs options run inputs json records pages pictures".split()),
)  # fmt: skip
ALONE = {"byte_rows.cpp", "closest_grid.cpp", "feature_search.cpp", "surface_graph.cpp"}

UNNAMED = re.compile(r"^namespace \{$(.*?)^\}  // namespace$", re.MULTILINE | re.DOTALL)
CONSTANT = re.compile(r"^(?:constexpr|const) .*?;", re.MULTILINE | re.DOTALL)
TYPE = re.compile(r"^(?:struct|class|enum class)(?: alignas\(.*?\))? (\w+)", re.MULTILINE)
FUNCTION = re.compile(
    r"^(?!return|using|static_assert)[A-Za-z][\w:<>,&* ]*? (\w+\([^()]*\)) \{", re.MULTILINE
)


def own_names(text: str) -> set[str]:
    """Constants, types and functions, with the types of their parameters, of the unnamed namespace."""
    names: set[str] = set()
    for part in UNNAMED.findall(text):
        for constant in CONSTANT.findall(part):
            names.update(re.findall(r"\b(k[A-Z]\w*)\b(?:\[[^]]*\])?(?= = | = \{)", constant))
        names.update(TYPE.findall(part))
        names.update(re.sub(r" \w+(?=[,)])", "", call) for call in FUNCTION.findall(part))
    return names


def names_of_two_sources(root: pathlib.Path) -> list[str]:
    found = []
    for folders in TOGETHER:
        owners: dict[str, list[str]] = collections.defaultdict(list)
        for path in sorted(path for folder in folders for path in (root / folder).rglob("*.cpp")):
            if path.name not in ALONE:
                for name in own_names(path.read_text()):
                    owners[name].append(path.relative_to(root).as_posix())
        found += [
            f"{name} is a name in the unnamed namespaces of {' and '.join(paths)}: give one another"
            for name, paths in sorted(owners.items())
            if len(paths) > 1
        ]
    return found


def complaints(root: pathlib.Path) -> list[str]:
    return (
        forbidden(root)
        + heavy_through_others(root)
        + outside_of_umbrella(root)
        + full_folders(root)
        + names_of_two_sources(root)
        + layers.complaints(root)
        + portable.complaints(root)
    )


def main() -> int:
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2]
    found = complaints(root)
    for line in found:
        print(f"{line} (rules and exceptions: tests/guard/structure.py)")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
