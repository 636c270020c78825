#!/usr/bin/env bash
# run.sh BUILD_DIRECTORY EXAMPLES_DIRECTORY: installs the build into a fresh prefix, then builds every example as a
# project of its own against it and runs it. An example that does not show what it claims exits with a status.
set -euo pipefail
build=$1
examples=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/prefix" >/dev/null
for project in "$examples"/*/CMakeLists.txt; do
  name=$(basename "$(dirname "$project")")
  echo "== $name"
  cmake -S "$examples/$name" -B "$work/$name" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=-Werror \
    -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
  cmake --build "$work/$name" >"$work/log" || { cat "$work/log"; exit 1; }
  "$work/$name/$name"
done
