#!/usr/bin/env bash
# in_chroot.sh PACKAGES_DIRECTORY [CHROOT]: installs both packages that cpack made in a fresh Debian 12 and uses them: the
# program carries points, its manual page and completion are there, and the README's example builds and prints what the
# README says. Needs root, debootstrap and a Debian archive; takes some minutes. CHROOT is made where it does not exist.
set -euo pipefail
packages=$(readlink -f "$1")
chroot=${2:-$(mktemp -d)/bookworm}
root=$(readlink -f "$(dirname "${BASH_SOURCE[0]}")/../..")

[[ -e $chroot/usr/bin/apt-get ]] || debootstrap --variant=minbase bookworm "$chroot" http://deb.debian.org/debian
# The way to the archive that this machine takes.
cp /etc/apt/apt.conf.d/* "$chroot/etc/apt/apt.conf.d/"
cp /etc/resolv.conf /etc/hosts "$chroot/etc/"
mount -t proc proc "$chroot/proc"
mount --bind /dev "$chroot/dev"
trap 'umount "$chroot/proc" "$chroot/dev"' EXIT

work=$chroot/halfgrad
rm -rf "$work"
mkdir -p "$work/consumer"
cp "$packages"/*.deb "$work"
cp "$root/configs/meshes/ball.msh" "$root/configs/quickstart.json" "$work"
cp "$root/tests/install_consumer/CMakeLists.txt" "$work/consumer"
block() {
  sed -n "/^<!-- $1 -->\$/,/^<!-- \/$1 -->\$/p" "$root/README.md" | grep -v -e '^<!--' -e '^```'
}
block example >"$work/consumer/example.cpp"
block output >"$work/consumer/expected.txt"

chroot "$chroot" /bin/bash -euc '
export DEBIAN_FRONTEND=noninteractive
cd /halfgrad
apt-get update -qq
apt-get install -qq -y --no-install-recommends ./halfgrad_*.deb >/dev/null
echo "== the program, without anything else"
halfgrad --version
halfgrad info ball.msh
halfgrad run quickstart.json --out results --reduced --quiet
halfgrad deform --rest ball.msh --frames ball.msh --points ball.msh --out out.npy
test -s out.npy
test -s /usr/share/bash-completion/completions/halfgrad
echo "== the library"
apt-get install -qq -y --no-install-recommends ./libhalfgrad-dev_*.deb g++ cmake ninja-build >/dev/null
(cd /usr/include/halfgrad && find . -name "*.hpp" -not -path "./tests/*" -printf "#include \"%P\"\n" | sort) >consumer/headers.cpp
cmake -S consumer -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DEXAMPLE_SOURCE=example.cpp \
  -DHEADERS_SOURCE=headers.cpp >/dev/null
cmake --build build >/dev/null
build/example | diff consumer/expected.txt -
echo "the README example prints what the README says"
apt-get purge -qq -y halfgrad libhalfgrad-dev >/dev/null
test ! -e /usr/bin/halfgrad
test ! -e /usr/include/halfgrad
echo "removed without a trace"
'
