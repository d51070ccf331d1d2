#!/bin/bash
# Builds a static binary (target x86_64-unknown-linux-musl), and compares it with the one that is linked dynamically.
#
# usage: deploy/static/build.sh [--install] [DYNAMIC]     (default: target/release/bolide; compared with, if it is there)
#        --install gets what it needs: musl-gcc from Debian (musl-tools; root), the target from rustup
#
# environment: CARGO_TARGET_DIR  where it is built [default: target]
#              ROUNDS            of the comparison, paired [default: 5]
#
# exit code: 0 static, and of one digest with the other; 1 not so; 3 this machine cannot build it.
set -u
cd "$(dirname "$0")/../.." || exit 1
triple=x86_64-unknown-linux-musl
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
if [ "${1:-}" = --install ]; then
    shift
    apt-get update -q && apt-get install -y -q --no-install-recommends musl-tools || exit 3
    rustup target add $triple || exit 3
fi
if ! command -v musl-gcc >/dev/null; then
    echo "build.sh: no musl-gcc; deploy/static/build.sh --install gets it (root); nothing was built" >&2
    exit 3
fi
if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ]; then
    echo "build.sh: no compiler for $triple; deploy/static/build.sh --install gets it; nothing was built" >&2
    exit 3
fi
cargo build --release --locked -p master --target $triple || exit 1
static=$CARGO_TARGET_DIR/$triple/release/bolide
bare=$CARGO_TARGET_DIR/static/bolide
mkdir -p "$(dirname "$bare")"
strip --strip-unneeded --remove-section=.comment -o "$bare" "$static" || exit 1

echo "$bare: $(stat -c %s "$bare") bytes"
file -b "$bare"
ldd "$bare"
if readelf --dynamic "$bare" | grep -q NEEDED || readelf --program-headers "$bare" | grep -q INTERP; then
    echo "build.sh: it needs a library or a loader" >&2
    exit 1
fi
# Where there is nothing else: no library, no loader, no /etc.
if [ "$(id -u)" = 0 ]; then
    empty=$(mktemp -d)
    cp "$bare" "$empty/bolide"
    chroot "$empty" /bolide --version && echo "it runs in an empty root"
    rm -rf "$empty"
fi

dynamic=${1:-target/release/bolide}
[ -x "$dynamic" ] || exit 0
of() { "$1" run deck/examples/plates-free-slip.toml --threads 1 --cycles "$2" --no-output --json 2>/dev/null | grep -oP "\"$3\":\"?\K[^,\"}]+"; }
echo "$(of "$bare" 40 digest) static"
echo "$(of "$dynamic" 40 digest) dynamic"
[ "$(of "$bare" 40 digest)" = "$(of "$dynamic" 40 digest)" ] || { echo "build.sh: the digests differ" >&2; exit 1; }
for _ in $(seq "${ROUNDS:-5}"); do
    echo "$(of "$bare" 120 grind_ns) $(of "$dynamic" 120 grind_ns)"
done | awk '{ printf "static %.1f ns, dynamic %.1f ns of thread-CPU time per element-cycle, ratio %.3f\n", $1, $2, $1 / $2; r[NR] = $1 / $2 }
    END { for (i = 1; i <= NR; i++) for (j = i + 1; j <= NR; j++) if (r[j] < r[i]) { t = r[i]; r[i] = r[j]; r[j] = t }
          printf "median ratio %.3f\n", r[int((NR + 1) / 2)] }'
