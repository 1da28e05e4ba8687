# SPDX-License-Identifier: BSD-3-Clause
# conan create packaging/conan --build=missing
import os

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir

FOLDERS = ("apps", "cmake", "cuda", "data", "include", "src", "tests/portability", "tests/support")


class GpuregRecipe(ConanFile):
    name = "gpureg"
    license = "BSD-3-Clause"
    description = "Global point-cloud registration on the GPU and the CPU"
    topics = ("point-cloud", "registration", "cuda", "slam")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False], "cuda": [True, False]}
    default_options = {"shared": False, "fPIC": True, "cuda": False}

    def set_version(self):
        text = load(self, os.path.join(self.recipe_folder, "..", "..", "CMakeLists.txt"))
        self.version = text.split("project(gpureg VERSION ")[1].split()[0]

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..")
        for folder in FOLDERS:
            copy(self, f"{folder}/*", root, self.export_sources_folder)
        for file in ("CMakeLists.txt", "LICENSE"):
            copy(self, file, root, self.export_sources_folder)

    def config_options(self):
        if self.settings.os == "Windows":
            del self.options.fPIC

    def requirements(self):
        self.requires("eigen/[>=3.4 <3.5]", transitive_headers=True)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["GPUREG_CUDA"] = "ON" if self.options.cuda else "OFF"
        for part in ("TESTS", "BENCHMARKS", "APPS", "GOLDEN"):
            toolchain.cache_variables[f"GPUREG_BUILD_{part}"] = False
        for package in ("PCL", "embree", "assimp"):
            toolchain.cache_variables[f"CMAKE_DISABLE_FIND_PACKAGE_{package}"] = True
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        rmdir(self, os.path.join(self.package_folder, "share"))

    def package_info(self):
        # The package's own CMake files define its components and targets.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "gpureg")]
        self.cpp_info.libs = []
