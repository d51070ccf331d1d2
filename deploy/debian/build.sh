#!/bin/bash
# Builds the Debian package: binary, manual pages, completions, units, examples.
#
# usage: deploy/debian/build.sh [FOLDER]      writes FOLDER/bolide_VERSION_ARCH.deb [default: target/debian]
#        needs dpkg-dev, which finds what the binary depends on
#
# environment: BOLIDE  the executable [default: target/release/bolide]; that of 64-bit ARM makes a package for ARM, with
#                      qemu-aarch64-static to write its manual pages
set -eu
cd "$(dirname "$0")/../.."
BOLIDE=$(realpath "${BOLIDE:-target/release/bolide}")
out=${1:-target/debian}
[ -x "$BOLIDE" ] || { echo "build.sh: no $BOLIDE; build it with: cargo build --release -p master" >&2; exit 1; }
mkdir -p "$out"
out=$(realpath "$out")
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
architecture=$(dpkg --print-architecture)
prefix='' emulator=()
if [ "$architecture" != arm64 ] && file -bL "$BOLIDE" | grep -q 'ARM aarch64'; then
    architecture=arm64 prefix=aarch64-linux-gnu- emulator=(qemu-aarch64-static -L /usr/aarch64-linux-gnu)
fi
bolide() { "${emulator[@]}" "$BOLIDE" "$@"; }
# The same sources give the same package.
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || stat -c %Y Cargo.toml)}
umask 022

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root
doc=$root/usr/share/doc/bolide
mkdir -p "$root/DEBIAN" "$doc/examples"

install -D -m 755 "$BOLIDE" "$root/usr/bin/bolide"
"${prefix}strip" --strip-unneeded --remove-section=.comment "$root/usr/bin/bolide"

bolide man --out "$root/usr/share/man/man1"
gzip -9n "$root"/usr/share/man/man1/*
completions() { mkdir -p "$(dirname "$root/$2")" && bolide completions "$1" >"$root/$2"; }
completions bash usr/share/bash-completion/completions/bolide
completions zsh usr/share/zsh/vendor-completions/_bolide
completions fish usr/share/fish/vendor_completions.d/bolide.fish

for unit in deploy/systemd/*.service; do
    install -D -m 644 "$unit" "$root/usr/lib/systemd/system/$(basename "$unit")"
done
install -D -m 644 deploy/systemd/bolide.sysusers "$root/usr/lib/sysusers.d/bolide.conf"
install -D -m 644 deploy/systemd/bolide.default "$root/etc/default/bolide"
echo /etc/default/bolide >"$root/DEBIAN/conffiles"

cp -r deck/examples "$doc/examples/decks"
cp -r deploy/clusters deploy/hosts deploy/kubernetes deploy/slurm "$doc/examples/"
cp deck/README.md "$doc/decks.md"
cp README.md CITATION.cff "$doc/"
gzip -9n <CHANGELOG.md >"$doc/changelog.gz"
{
    echo "Bolide is licensed under MIT or Apache-2.0, as you like."
    echo "The latter is in /usr/share/common-licenses/Apache-2.0."
    echo
    cat LICENSE-MIT
} >"$doc/copyright"

install -m 755 deploy/debian/postinst deploy/debian/prerm deploy/debian/postrm "$root/DEBIAN/"
if [ -n "$prefix" ]; then
    # This machine has no packages of the other processor to ask: the newest version of a symbol says which library it needs.
    libc=$("${prefix}objdump" -T "$root/usr/bin/bolide" | grep -oP 'GLIBC_\K[0-9.]+' | sort -V | tail -1)
    depends="libc6 (>= $libc), libgcc-s1 (>= 4.2)"
else
    # dpkg-shlibdeps wants a source package around it.
    mkdir "$work/debian"
    printf 'Source: bolide\n\nPackage: bolide\nArchitecture: any\n' >"$work/debian/control"
    depends=$(cd "$work" && dpkg-shlibdeps -O --ignore-missing-info root/usr/bin/bolide 2>/dev/null | sed 's/^shlibs:Depends=//')
fi
cat >"$root/DEBIAN/control" <<END
Package: bolide
Version: $version
Architecture: $architecture
Maintainer: Bolide <bolide@example.invalid>
Section: science
Priority: optional
Depends: $depends
Recommends: openssh-client
Installed-Size: $(du -sk --exclude=DEBIAN "$root" | cut -f1)
Description: explicit Lagrangian impact simulation on whatever PCs a lab has
 Master and workers in one binary: hexahedra with strength, shocks and contact,
 on unequal machines over TCP, with the same bits on any number of them.
END
(cd "$root" && find . -type f ! -path './DEBIAN/*' -printf '%P\0' | sort -z | xargs -0 md5sum >DEBIAN/md5sums)
find "$root" -newermt "@$SOURCE_DATE_EPOCH" -print0 | xargs -0 --no-run-if-empty touch --no-dereference --date="@$SOURCE_DATE_EPOCH"
dpkg-deb --root-owner-group --build "$root" "$out/bolide_${version}_$architecture.deb"
