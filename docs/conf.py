# SPDX-License-Identifier: BSD-3-Clause
"""Configuration of the documentation site. scripts/docs builds it.

GPUREG_REPOSITORY_URL: where the repository can be browsed. Links to its files go there, to
``URL/blob/main/FILE``. Without it such links are plain text.
"""

import os
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).parent
sys.path.insert(0, str(DOCS / "_ext"))

project = "gpureg"
author = "the gpureg authors"
version = release = re.search(
    r"project\(gpureg VERSION ([0-9.]+)", (DOCS.parent / "CMakeLists.txt").read_text()
).group(1)

extensions = [
    "myst_parser",
    "breathe",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "generated_reference",
    "header_reference",
    "python_package",
    "repository_files",
]
root_doc = "index"
exclude_patterns = ["_ext"]
nitpicky = True

myst_heading_anchors = 4
myst_url_schemes = ["http", "https", "mailto", "repository"]
repository_url = os.environ.get("GPUREG_REPOSITORY_URL", "")

breathe_projects = {"gpureg": str(DOCS.parent / "build" / "docs" / "xml")}
breathe_default_project = "gpureg"
breathe_default_members = ("members",)
breathe_show_include = False
cpp_index_common_prefix = ["gpureg::"]

autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "undoc-members": True}
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_mock_imports = ["pyarrow", "ray", "tqdm"]
napoleon_google_docstring = False
napoleon_use_param = False  # types are prose: "(N, 3) array"
napoleon_use_ivar = True
napoleon_use_rtype = False
toc_object_entries_show_parents = "hide"
default_role = "py:obj"  # in docstrings
add_module_names = False
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
cpp_maximum_signature_line_length = 88

# Names of other libraries, namespaces, what is private, and words of docstrings.
nitpick_ignore_regex = [
    (
        r"cpp:.*",
        r"(std|Eigen|pcl|Unaligned\w+)::.*|reconstruction|UnalignedMatrix6d|UnalignedVector6d|gpureg(::(io|evaluation|files|pose_graph|reconstruction|loop_closure|localization|pruning))?|std|Eigen|pcl|pose_graph(::.*)?",
    ),
    (
        r"cpp:.*",
        r"u?int\d+_t|size_t|CUstream_st|PreparedState|PrepareSettings|Engine|Base|Point\w+|SignatureT",
    ),
    (r"py:.*", r"(np|numpy|npt|pa|pyarrow|ray|collections|os|pathlib)\..*|Path|Any"),
    (r"py:.*", r"(gpureg\.)?_.*|results"),
    (
        r"py:class",
        r".* .*|fragments|pairs|tried|kept|source|confidence|accepted|float64|N|more_scans|MapGraph|\d",
    ),
]

html_theme = "furo"
html_title = f"gpureg {release}"
html_static_path = ["_static"]
html_css_files = ["gpureg.css"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"source_repository": repository_url} if repository_url else {}
