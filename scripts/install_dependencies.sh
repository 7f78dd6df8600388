#!/usr/bin/env bash
# Installs what the build needs and the machine has not, on Debian 12 or a relative of it. Asks nothing.
set -euo pipefail

packages=(
  # compilers and tools
  g++ clang libclang-rt-14-dev libomp-14-dev clang-format cmake ninja-build pkg-config git
  # OpenGL without a window, and Mesa's software renderer for machines without a GPU
  libegl-dev libepoxy-dev libegl-mesa0 libgl1-mesa-dri
  # mathematics, pictures, processes, SIMD, compression, checksums
  libglm-dev libopenimageio-dev libopenmpi-dev openmpi-bin libhwy-dev libzstd-dev zlib1g-dev libxxhash-dev
  # foreign volume formats (OpenVDB's headers want Boost's, and its package does not say so)
  libopenvdb-dev libboost-dev libgdcm-dev
  # meshes
  libassimp-dev
  # command line, text
  libcli11-dev libspdlog-dev libfmt-dev nlohmann-json3-dev
  # tests and benchmarks
  libgtest-dev libbenchmark-dev gnuplot-nox
)

missing=()
for package in "${packages[@]}"; do
  state=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $state == installed ]] || missing+=("$package")
done
if ((${#missing[@]} == 0)); then
  exit 0
fi

echo "installing ${missing[*]}"
as_root=()
if ((EUID != 0)); then
  command -v sudo >/dev/null || { echo "these packages are missing, and there is no sudo to install them with" >&2; exit 1; }
  as_root=(sudo)
fi
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 "$@" </dev/null >/dev/null
}
apt update
# libopenimageio-dev recommends a desktop's worth of libraries.
apt install --yes --no-install-recommends "${missing[@]}"
