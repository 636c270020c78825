#!/usr/bin/env bash
# run.sh COMPILER ROOT FLAG...: an element that lacks a member of the concept Element must be refused by a message that
# names the member. Segment, which has one member a line, compiles whole; each variant lacks one of its lines.
set -euo pipefail
compiler=$1
root=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

compile() {
  LC_ALL=C "$compiler" -std=c++20 -fsyntax-only -I "$root" "$@" "$work/lists.cpp" >"$work/messages.txt" 2>&1
}

# variant NAMESPACE PATTERN: Segment without the lines that match, in a list of its own.
variant() {
  printf 'namespace halfgrad::%s {\n' "$1"
  sed -n '/^struct Segment/,/^};/p' "$root/elements/segment.hpp" | grep -vE "$2"
  printf 'constexpr auto size = ElementList<Segment>::size;\n}\n'
}

{
  echo '#include "elements/element.hpp"'
  variant complete '^$'
} >"$work/lists.cpp"
if ! compile "$@"; then
  echo "Segment does not compile:"
  cat "$work/messages.txt"
  exit 1
fi

# The members, as the concept lists them.
members=$(sed -n '/^concept Element/,/^};/s/.*E::\([a-z_]*\)[^}]*}.*/\1/p' "$root/elements/element.hpp" | sort -u)
{
  echo '#include "elements/element.hpp"'
  for member in $members; do variant "without_$member" "^ *static.* $member( |\(|\{|;)"; done
} >"$work/lists.cpp"
if compile "$@"; then
  echo "elements that lack a member compile"
  exit 1
fi
for member in $members; do
  # GCC, GCC for what the signature needs, Clang.
  if ! grep -qE -e "the required expression 'E::$member\b.*is invalid" \
    -e "'$member' is not a member of '(halfgrad::)?without_$member::" \
    -e "no member named '$member' in '(halfgrad::)?without_$member::" "$work/messages.txt"; then
    echo "no message names the missing member $member:"
    cat "$work/messages.txt"
    exit 1
  fi
done
echo "$(wc -w <<<"$members") members, each named where it is missing"
