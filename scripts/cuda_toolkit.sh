# SPDX-License-Identifier: BSD-3-Clause
# Sourced by the other scripts, after packages.sh: find_nvcc.

# Sets nvcc to the CUDA compiler: the installed one, or else one from NVIDIA's Python wheels in build/cuda-toolkit (0.3 GB; the packages
# of the distributions are several GB and older). Returns 1 where there is none to be had. Needs no device and no driver.
find_nvcc() {
  nvcc=${CUDACXX:-$(command -v nvcc || true)}
  [ -z "$nvcc" ] && [ -x /usr/local/cuda/bin/nvcc ] && nvcc=/usr/local/cuda/bin/nvcc
  [ -n "$nvcc" ] && return 0
  local folder=$PWD/build/cuda-toolkit version='==13.0.*' root
  nvcc=$(compgen -G "$folder/lib/python3*/site-packages/nvidia/cu13/bin/nvcc" || true)
  [ -n "$nvcc" ] && return 0
  [ "$(uname -sm)" = "Linux x86_64" ] || return 1
  install_packages python3-venv
  say "installing a CUDA compiler into build/cuda-toolkit"
  python3 -m venv "$folder" &&
    "$folder/bin/pip" install -q --disable-pip-version-check "nvidia-cuda-nvcc$version" "nvidia-cuda-crt$version" "nvidia-nvvm$version" \
      "nvidia-cuda-runtime$version" "nvidia-cuda-cccl$version" || { rm -rf "$folder"; return 1; }
  nvcc=$(compgen -G "$folder/lib/python3*/site-packages/nvidia/cu13/bin/nvcc") || return 1
  # CMake looks for libraries where the toolkit's installer puts them.
  root=${nvcc%/bin/nvcc}
  ln -sfn lib "$root/lib64"
  ln -sf libcudart.so.13 "$root/lib/libcudart.so"
}
