#!/usr/bin/env bash
# run.sh BUILD_DIRECTORY README: installs the build into a fresh prefix, compiles the README's example against the
# installed package, and compares what it prints with what the README says it prints; compiles every installed header.
set -euo pipefail
build=$1
readme=$2
consumer=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# block NAME: the fenced block between <!-- NAME --> and <!-- /NAME -->.
block() {
  sed -n "/^<!-- $1 -->\$/,/^<!-- \/$1 -->\$/p" "$readme" | grep -v -e '^<!--' -e '^```'
}
block example >"$work/example.cpp"
block output >"$work/expected.txt"

cmake --install "$build" --prefix "$work/prefix" >/dev/null
(cd "$work/prefix/include/halfgrad" && find . -name '*.hpp' -not -path './tests/*' -printf '#include "%P"\n' | sort) >"$work/headers.cpp"
cmake -S "$consumer" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DEXAMPLE_SOURCE="$work/example.cpp" -DHEADERS_SOURCE="$work/headers.cpp" >/dev/null
cmake --build "$work/build"
"$work/build/example" | diff "$work/expected.txt" -
