#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The check of the structure sees heavy headers, directly and through others, full folders, and names of two sources."""

import pathlib
import tempfile
import unittest

import structure


class Structure(unittest.TestCase):
    def complaints(self, **files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                path = root / "include/gpureg" / name.replace("_dot_", ".")
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            return structure.complaints(root)

    def test_the_project_itself(self):
        self.assertEqual(structure.complaints(pathlib.Path(__file__).parents[2]), [])

    def test_light_ones_pass(self):
        self.assertEqual(
            self.complaints(a_dot_hpp="#include <Eigen/Core>\n#include <vector>\n"), []
        )

    def test_a_header_with_a_heavy_one(self):
        for heavy in (
            "Eigen/Geometry",
            "Eigen/Dense",
            "nlohmann/json.hpp",
            "CLI/CLI.hpp",
            "iostream",
        ):
            self.assertEqual(len(self.complaints(a_dot_hpp=f"#include <{heavy}>\n")), 1, heavy)

    def test_sources(self):
        self.assertEqual(self.complaints(a_dot_cpp="#include <Eigen/Geometry>\n"), [])
        self.assertEqual(len(self.complaints(a_dot_cpp="#include <CLI/CLI.hpp>\n")), 1)

    def test_through_another_header(self):
        found = self.complaints(
            io_dot_hpp='#include "gpureg/result.hpp"\n',
            result_dot_hpp="#include <Eigen/Geometry>\n",
        )
        self.assertEqual(
            found, ["include/gpureg/io.hpp includes Eigen/Geometry through other headers"]
        )

    def test_what_gpureg_hpp_says(self):
        header = {"gpureg_dot_hpp": '/// But io.hpp.\n#include "gpureg/a.hpp"\n', "io_dot_hpp": ""}
        found = self.complaints(a_dot_hpp='#include "gpureg/b.hpp"\n', b_dot_hpp="", **header)
        self.assertEqual(found, [])
        found = self.complaints(a_dot_hpp="", b_dot_hpp="", **header)
        self.assertEqual(found, ["include/gpureg/gpureg.hpp neither includes nor names b.hpp"])

    def test_full_folders(self):
        for count, most in ((30, 0), (31, 1)):
            files = {f"a{k}_dot_hpp": "" for k in range(count)}
            self.assertEqual(len(self.complaints(**files)), most, count)

    def test_names_of_two_sources(self):
        for text, names in (
            ("constexpr int kMost = 3, kLeast = 1;", 2),
            ("struct Part {};", 1),
            ("double share(double part, double whole) {\n  return part / whole;\n}", 1),
            ("using Rows = int;", 0),
        ):
            with tempfile.TemporaryDirectory() as folder:
                source = pathlib.Path(folder) / "src/io"
                source.mkdir(parents=True)
                for name in ("a.cpp", "b.cpp"):
                    (source / name).write_text(f"namespace {{\n\n{text}\n\n}}  // namespace\n")
                found = structure.complaints(pathlib.Path(folder))
                self.assertEqual(len(found), names, text)

    def in_project(self, **files):
        """Complaints about files of src/io in a project with a table of layers."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name in ("src/io", "src/api", "include/gpureg"):
                (root / name).mkdir(parents=True)
            (root / "CONTRIBUTING.md").write_text(
                "| folder | may include |\n| --- | --- |\n| `include/gpureg` | nothing |\n"
                "| `src/io` | of the public headers `gpureg/error.hpp` |\n| `src/api` | `src/io` |\n\nmore `src/x`\n"
            )
            for header in (
                "src/api/a.hpp",
                "src/io/b.hpp",
                "include/gpureg/error.hpp",
                "include/gpureg/c.hpp",
            ):
                (root / header).write_text("")
            for name, text in files.items():
                (root / "src/io" / f"{name}.cpp").write_text(text)
            return structure.complaints(root)

    def test_layers(self):
        for include, count in (
            ("io/b.hpp", 0),
            ("b.hpp", 0),
            ("gpureg/error.hpp", 0),
            ("gpureg/c.hpp", 1),
            ("api/a.hpp", 1),
        ):
            found = self.in_project(x=f'#include "{include}"\n')
            self.assertEqual(len(found), count, include)

    def test_functions_that_differ_between_libraries(self):
        for text, count in (
            ("double y = std::exp(x);", 1),
            ("double y = exp(x) + expf(x);", 2),
            ("double y = 2*std::pow (x, 2) - ::acosf(x);", 2),
            ("double y = portable::exp(x) + sqrt(x);  // not std::exp(x)", 0),
            ("auto y = cloud.log(x), z = problem->exp(x), w = expand(x);", 0),
            ("Eigen::AngleAxisd turn(a, b);", 1),
            ("auto y = a.array().exp();", 1),
            ("std::mt19937 random(1);", 1),
            ("std::normal_distribution<double> noise;", 1),
            ("int k = rand() + strand(3);", 1),
        ):
            self.assertEqual(len(self.in_project(x=text)), count, text)


if __name__ == "__main__":
    unittest.main()
