# SPDX-License-Identifier: BSD-3-Clause
# Sourced by the other scripts: say, run_as_root, install_packages.

# With the minutes since the start.
say() { printf '\n== %d:%02d  %s\n' $((SECONDS / 60)) $((SECONDS % 60)) "$*"; }

run_as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  elif command -v sudo > /dev/null; then
    sudo "$@"
  else
    echo "error: '$*' needs root: run as root or install sudo" >&2
    exit 2
  fi
}

# Installs the Debian or Ubuntu packages that are missing; silent where there is nothing to do.
install_packages() {
  if ! command -v dpkg-query > /dev/null; then
    echo "note: this is no Debian or Ubuntu; these packages must be there already: $*" >&2
    return 0
  fi
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2> /dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ "${#missing[@]}" -eq 0 ] && return 0
  say "installing ${missing[*]}"
  run_as_root apt-get update -qq
  run_as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" > /dev/null
}

# What the library, its io component and the command are built with.
build_packages=(build-essential cmake ninja-build libeigen3-dev libembree-dev libcli11-dev nlohmann-json3-dev libpng-dev)
# What the tests and benchmarks need besides; PCL and FLANN are oracles, valgrind counts instructions.
# libassimp-dev is what the generator reads buildings with.
# libopencv-dev and libceres-dev are what slam_demo needs.
test_packages=(libassimp-dev libopencv-dev libceres-dev libgtest-dev libbenchmark-dev libpcl-dev libflann-dev liblz4-dev ccache python3 valgrind assimp-utils)

# ccache refuses files with a precompiled header without these.
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}

# Configure arguments that make rebuilds cheap where ccache is installed.
launcher_arguments() {
  if command -v ccache > /dev/null; then
    echo "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_CUDA_COMPILER_LAUNCHER=ccache"
  fi
}

# ccache knows the files that CMake makes in one build folder again in another one.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD/build}

# For builds of single sources that share the objects of the libraries: for work on them.
shared_objects() {
  if command -v ccache > /dev/null; then echo "$(launcher_arguments) -DGPUREG_PRECOMPILED_LIBRARIES=OFF -DCMAKE_UNITY_BUILD=OFF"; fi
}

# For scripts/test: from nothing, several sources compile at a time, in half the time. A build folder of single sources stays one.
whole_build() {
  if grep -qs '^CMAKE_UNITY_BUILD:.*=OFF' build/cpu/CMakeCache.txt; then
    shared_objects
  else
    echo "$(launcher_arguments) -DCMAKE_UNITY_BUILD=ON"
  fi
}
