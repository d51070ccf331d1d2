#!/bin/bash
# Builds the package, installs it in a scratch root, runs what is installed there, and removes it again.
#
# usage: deploy/debian/test.sh                (as root: files of a package belong to root)
#
# environment: BOLIDE  the executable [default: target/release/bolide]
#
# exit code: 0 well; 1 something is wrong; 3 this machine cannot do it (no dpkg-dev, no root).
set -u
cd "$(dirname "$0")/../.." || exit 1
export BOLIDE
BOLIDE=$(realpath "${BOLIDE:-target/release/bolide}")
for program in dpkg-deb dpkg-shlibdeps; do
    command -v $program >/dev/null || { echo "test.sh: no $program (dpkg-dev); nothing was done" >&2; exit 3; }
done
[ "$(id -u)" = 0 ] || { echo "test.sh: dpkg needs root; nothing was done" >&2; exit 3; }
root=$(mktemp -d) || exit 1
trap 'rm -rf "$root"' EXIT
fail() {
    echo "test.sh: $*" >&2
    exit 1
}

deploy/debian/build.sh "$root/made" || fail "no package"
deb=$(echo "$root"/made/*.deb)
dpkg-deb --field "$deb" Package Version Architecture Depends Installed-Size
sum=$(md5sum <"$deb")
deploy/debian/build.sh "$root/made" >/dev/null || fail "no second package"
[ "$sum" = "$(md5sum <"$deb")" ] || fail "the same sources gave another package"

# The scratch root has the packages that this one depends on as this machine has them, so that dependencies count.
mkdir -p "$root/var/lib/dpkg/info" "$root/var/lib/dpkg/updates" "$root/etc"
for package in $(dpkg-deb --field "$deb" Depends | tr ',' '\n' | awk '{ print $1 }'); do
    dpkg --status "$package" >>"$root/var/lib/dpkg/status" || fail "$package is not installed on this machine"
    echo >>"$root/var/lib/dpkg/status"
    touch "$root/var/lib/dpkg/info/$package.list" "$root/var/lib/dpkg/info/$package:$(dpkg --print-architecture).list"
done
here() { dpkg --root="$root" --force-script-chrootless --log=/dev/null "$@"; }
here --install "$deb" || fail "dpkg does not install it"
grep -q '^bolide:' "$root/etc/passwd" || fail "no user bolide"
here --verify bolide || fail "files differ from the package"

installed=$root/usr/bin/bolide
"$installed" --version || fail "it does not run"
digest() { "$1" run "$2" --cycles 40 --no-output --threads 1 --json 2>/dev/null | grep -oE '"digest": *"[0-9a-f]{32}' | grep -oE '[0-9a-f]{32}'; }
deck=$root/usr/share/doc/bolide/examples/decks/two-bars.toml
found=$(digest "$installed" "$deck")
[ -n "$found" ] && [ "$found" = "$(digest "$BOLIDE" deck/examples/two-bars.toml)" ] || fail "digest '$found' is not that of $BOLIDE"
echo "the installed binary runs an installed deck: $found"
pages=$(find "$root/usr/share/man/man1" -name '*.1.gz' | wc -l)
[ "$pages" -gt 10 ] || fail "$pages manual pages"
bash -n "$root/usr/share/bash-completion/completions/bolide" || fail "completions that bash does not take"
if command -v systemd-analyze >/dev/null; then
    BOLIDE=$installed deploy/systemd/verify.sh || fail "units"
fi
here --purge bolide || fail "dpkg does not remove it"
left=$(cd "$root" && find . -path ./made -prune -o -path ./var/lib/dpkg -prune -o -type f -print | grep -i bolide)
[ -z "$left" ] || fail "left behind: $left"
echo "test.sh: installed, run, removed; $pages manual pages, $(stat -c %s "$deb") bytes"
