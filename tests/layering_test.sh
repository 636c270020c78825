#!/usr/bin/env bash
# Plants one violation of each rule in a small tree and expects layering.sh to name it.
set -euo pipefail
layering=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/layering.sh
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT

fresh_tree() {
  rm -rf "${tree:?}"/*
  mkdir "$tree"/{elements,framework,reconstruction,experiments,apps}
  printf '#pragma once\n#include <Eigen/Core>\n#include <array>\n' >"$tree/elements/cell.hpp"
  printf '#pragma once\n#include "elements/cell.hpp"\n' >"$tree/framework/mesh.hpp"
  printf '#pragma once\n#include "framework/mesh.hpp"\n' >"$tree/reconstruction/average.hpp"
  printf '#include <fmt/core.h>\nint main() { fmt::print("one"); }\n' >"$tree/apps/main.cpp"
}

# expect_violation FILE TEXT FACT: TEXT added to FILE must be refused with a message that names FILE and holds FACT.
expect_violation() {
  fresh_tree
  printf '%b\n' "$2" >>"$tree/$1"
  if output=$(bash "$layering" "$tree"); then
    echo "accepted in $1: $2"
    exit 1
  fi
  if [[ $output != "$1:"*"$3"* || $(wc -l <<<"$output") != 1 ]]; then
    printf 'for "%s" in %s expected one message with "%s", got:\n%s\n' "$2" "$1" "$3" "$output"
    exit 1
  fi
}

fresh_tree
bash "$layering" "$tree"
expect_violation elements/cell.hpp '#include "framework/mesh.hpp"' 'elements may include from elements'
expect_violation framework/mesh.hpp '#include "reconstruction/average.hpp"' 'framework may include from elements framework,'
expect_violation reconstruction/mean.cpp '#include "framework/none.hpp"' 'no file "framework/none.hpp"'
expect_violation elements/cell.hpp '#include <fmt/core.h>' 'not <fmt/core.h>'
expect_violation framework/mesh.hpp '  #  include <Eigen/SVD>' '<Eigen/SVD> is slow'
expect_violation framework/bare.hpp 'struct Bare {};' 'no #pragma once'
expect_violation framework/mesh.cpp '#include <array>\n#include "framework/mesh.hpp"' 'the first include is "framework/mesh.hpp"'
expect_violation framework/print.cpp 'void f() { std::cout << 1; }' 'only apps print'
expect_violation experiments/table.cpp 'void f() {\n  printf("1");\n}' 'only apps print'
expect_violation reconstruction/mean.cpp 'void f() { fmt::print("1"); }' 'only apps print'
