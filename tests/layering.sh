#!/usr/bin/env bash
# layering.sh ROOT: checks what the directories promise each other. Prints each violation as file:line: reason and
# fails if there is one.
#   - includes point one way: elements <- framework <- reconstruction <- experiments <- apps
#   - includes name files from the root of the repository, and the files exist
#   - elements know Eigen and the standard library only
#   - headers have #pragma once and leave the slow third-party headers to .cpp files
#   - a source includes the header of its name first, so that its own build shows that the header compiles alone
#   - only apps print
set -uo pipefail
cd "$1" || exit

layers=(elements framework reconstruction experiments apps)
violations=0

report() {  # report FILE:LINE REASON
  echo "$1: $2"
  violations=$((violations + 1))
}

allowed=()
for layer in "${layers[@]}"; do
  allowed+=("$layer")
  [[ -d $layer ]] || report "$layer:0" "no such directory"

  while IFS=: read -r file line text; do
    include=$(sed -E 's/^[^<"]*[<"]([^>"]*)[>"].*/\1/' <<<"$text")
    if [[ $text == *'"'* ]]; then
      [[ " ${allowed[*]} " == *" ${include%%/*} "* ]] ||
        report "$file:$line" "$layer may include from ${allowed[*]}, not \"$include\""
      [[ -f $include ]] || report "$file:$line" "no file \"$include\" under the root"
    elif [[ $layer == elements && $include != Eigen/* && $include == *[./]* ]]; then
      report "$file:$line" "elements may include Eigen and the standard library, not <$include>"
    elif [[ $file == *.hpp && $include =~ ^(nlohmann/json\.hpp|CLI/.*|tbb/.*|pugixml\.hpp|Eigen/(Dense|SVD|QR|Eigenvalues))$ ]]; then
      report "$file:$line" "<$include> is slow to compile and belongs in .cpp files"
    fi
  done < <(grep -rnE '^[[:space:]]*#[[:space:]]*include' --include='*.hpp' --include='*.cpp' "$layer")

  while read -r file; do
    report "$file:1" "no #pragma once"
  done < <(grep -rL '^#pragma once' --include='*.hpp' "$layer")

  while read -r file; do
    header=${file%.cpp}.hpp
    [[ ! -f $header || $(grep -m 1 -E '^#include' "$file") == "#include \"$header\"" ]] ||
      report "$file:1" "the first include is \"$header\""
  done < <(find "$layer" -name '*.cpp')

  [[ $layer == apps ]] && continue
  while IFS=: read -r file line _; do
    report "$file:$line" "only apps print"
  done < <(grep -rnE --include='*.hpp' --include='*.cpp' \
    '<iostream>|std::(cout|cerr|clog)|fmt::print\((stdout|stderr|")|\b(stdout|stderr)\b|(^|[^[:alnum:]_.>])(printf|puts|putchar|perror)[[:space:]]*\(' \
    "$layer")
done

((violations == 0))
