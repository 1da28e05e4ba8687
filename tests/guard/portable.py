# SPDX-License-Identifier: BSD-3-Clause
"""No result depends on a function whose last bits, or on a generator whose numbers, the C or C++ library chooses.

src/math has elementary functions and Philox; sqrt, fma, floor, ceil and round are exact everywhere.
"""

import pathlib
import re

FOLDERS = ("src", "include", "cuda")
SOURCES = {".cpp", ".hpp", ".cu", ".cuh"}

FUNCTION = (
    "exp exp2 exp10 expm1 log log2 log10 log1p pow cbrt hypot sin cos tan sincos asin acos atan atan2"
    " sinh cosh tanh asinh acosh atanh erf erfc tgamma lgamma"
).replace(" ", "|")
FORBIDDEN = {
    "function": re.compile(rf"(?<![\w.>:])(?:std::|::|__)?(?:{FUNCTION})[fl]?\s*\("),
    # Eigen calls those of the C library.
    "function of Eigen": re.compile(
        rf"\bAngleAxis\w*|\bRotation2D\w*|\b(?:slerp|angularDistance|(?:canonicalE|e)ulerAngles|computeDirect)\("
        rf"|\.(?:{FUNCTION})\(\)"
    ),
    "generator": re.compile(
        r"\b(?:mt19937\w*|minstd_rand0?|ranlux\w+|knuth_b|default_random_engine|random_device|\w+_distribution)\b"
        r"|\b(?:std::shuffle|std::sample|random_shuffle|s?rand|[dlm]rand48)\s*\("
    ),
}

# Place -> what it may call, and why.
ALLOWED = {
    # Its own functions, in namespace portable.
    "src/math": r"(exp|log|log1p|sin|cos|atan2|acos)\(",
    # exp() and log() of rigid motions, which take no number.
    "src/pose_graph": r"(exp|log)\(",
    # Decides only far from a whole step; near one, portable::acos does.
    "src/algorithm/cell_summary.hpp": r"acosf\(",
    # The C++ standard defines the words of this generator; others would sample other points of the
    # meshes that records were made with.
    "src/io/meshes/mesh.cpp": r"mt19937",
}


def without_comments(text: str) -> str:
    return re.sub(r"//.*", "", text)


def allowed(name: str, found: str) -> bool:
    return any(
        (name == place or name.startswith(place + "/")) and re.fullmatch(pattern, found)
        for place, pattern in ALLOWED.items()
    )


def complaints(root: pathlib.Path) -> list[str]:
    out = []
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in SOURCES:
                continue
            name = path.relative_to(root).as_posix()
            for number, line in enumerate(without_comments(path.read_text()).splitlines(), 1):
                out += [
                    f"{name}:{number} has the {kind} {match.group().strip('( ')}, which differs between"
                    " libraries: use src/math"
                    for kind, pattern in FORBIDDEN.items()
                    for match in pattern.finditer(line)
                    if not allowed(name, match.group())
                ]
    return out
