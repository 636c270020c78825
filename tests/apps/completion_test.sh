#!/usr/bin/env bash
# completion_test.sh PROGRAM: what shells complete, and that the scripts for shells that are installed load.
set -uo pipefail
program=$1
failures=0

expect() {  # expect LINE WORD...: the words are among what completes the last word of the line
  local line=$1 word
  shift
  read -ra COMP_WORDS <<<"$line"
  [[ $line == *" " ]] && COMP_WORDS+=("")
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  COMPREPLY=()
  _halfgrad
  for word in "$@"; do
    [[ " ${COMPREPLY[*]} " == *" $word "* ]] && continue
    echo "\"$line\": expected $word among: ${COMPREPLY[*]}"
    failures=$((failures + 1))
  done
}

source <("$program" describe bash)
expect "halfgrad " deform run export info list check stress
expect "halfgrad de" deform describe
expect "halfgrad --th" --threads
expect "halfgrad deform --re" --rest --reconstructor --report
expect "halfgrad deform --rest a.msh --interpolant " linear phong hermite
expect "halfgrad export --as st" stencils
expect "halfgrad deform --normals " gradient smooth
expect "halfgrad deform --normals --ta" --tangents
expect "halfgrad bind --interpolant attr" attribute_transfer
expect "halfgrad deform --ta" --tangents
expect "halfgrad list re" reconstructors
expect "halfgrad stress --element te" tetrahedron
expect "halfgrad --quiet deform --outside n" nearest
COMP_WORDS=(halfgrad deform --rest "")
COMP_CWORD=3
_halfgrad
((${#COMPREPLY[@]} == 0)) || { echo "file names are left to the shell, found ${COMPREPLY[*]}"; failures=$((failures + 1)); }

# Every command and long option that --help shows is completed.
for command in $("$program" describe markdown | sed -n 's/^## halfgrad //p'); do
  for option in $("$program" "$command" --help | grep -oE '^  --[a-z-]+' | tr -d ' '); do
    expect "halfgrad $command $option" "$option"
  done
done

if command -v zsh >/dev/null; then
  "$program" describe zsh | zsh -n /dev/stdin || failures=$((failures + 1))
fi
if command -v fish >/dev/null; then
  found=$(fish --no-config -c "$program describe fish | source; complete -C 'halfgrad deform --outside '")
  [[ $found == *nearest* ]] || { echo "fish completes --outside with: $found"; failures=$((failures + 1)); }
fi
if command -v man >/dev/null; then
  warnings=$("$program" describe man | MANWIDTH=100 man --warnings -l - 2>&1 >/dev/null)
  [[ -z $warnings ]] || { echo "$warnings"; failures=$((failures + 1)); }
fi
((failures == 0))
