# The Debian 12 packages halfgrad needs, in one place, and the function that installs those that are missing.
# Sourced by quickstart, run-tests and .ci/run.

build_packages=(g++ cmake ninja-build libeigen3-dev libfmt-dev nlohmann-json3-dev libtbb-dev libhwy-dev
  libfast-float-dev libpugixml-dev zlib1g-dev libcli11-dev libnanoflann-dev libzip-dev pkg-config)
test_packages=(libgtest-dev libgmock-dev librapidcheck-dev python3-scipy python3-meshio)
check_packages=(clang-format)
benchmark_packages=(libbenchmark-dev)
fuzz_packages=(clang-14 libclang-rt-14-dev)
coverage_packages=(gcovr)
site_packages=(mkdocs mkdocs-material doxygen)
browser_packages=(chromium)
# npm bundles the interactive report; a Node.js from elsewhere brings its own and conflicts with Debian's.
web_packages=()
command -v npm >/dev/null || web_packages=(npm)

# install_packages NAME...: leaves apt alone where nothing is missing.
install_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "This is not a Debian system: install what provides these packages, then build with CMake: $*" >&2
    return 1
  fi
  local name missing=() as_root=()
  for name in "$@"; do
    [[ $(dpkg-query -W -f='${db:Status-Status}' "$name" 2>/dev/null) == installed ]] || missing+=("$name")
  done
  ((${#missing[@]})) || return 0
  if ((EUID != 0)); then
    if ! command -v sudo >/dev/null; then
      echo "Missing packages: ${missing[*]}" >&2
      echo "Run as root, or install sudo, or as root: apt-get install --no-install-recommends ${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
  fi
  echo "Installing ${missing[*]}"
  "${as_root[@]}" apt-get update -qq &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
      apt-get install -qq -y --no-install-recommends "${missing[@]}" >/dev/null
}

# A compiler cache is used where there is one.
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER=ccache; fi
