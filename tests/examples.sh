#!/usr/bin/env bash
# examples.sh BUILD_DIRECTORY EXAMPLES: installs the build into a fresh prefix, then configures, builds and tests each
# project below EXAMPLES against the installed package, as a reader would.
set -euo pipefail
build=$1
examples=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/prefix" >/dev/null
for project in "$examples"/*/; do
  name=$(basename "$project")
  cmake -S "$project" -B "$work/$name" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=-Werror -DCMAKE_CXX_FLAGS_RELEASE=-O1 \
    -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
  cmake --build "$work/$name"
  ctest --test-dir "$work/$name" --output-on-failure
done
