#!/bin/bash
# One digest on every platform: runs every example, and a tube whose mesh passes sines and cosines, with each binary that was built,
# and prints the table. A digest that differs from the first of its line is marked, and the command fails.
#
# usage: deploy/platforms.sh [--build] [--short] [DECK]...
#        --build  installs from Debian what the others need (root), and builds all of them; an hour on two cores
#        --short  five decks on this machine's own processor alone: as it is, without fused multiply-add in the library of C, and
#                 on lanes of one; half a minute
#
# environment: BOLIDE  the executable of this machine [default: target/release/bolide]
#              CARGO_TARGET_DIR  where the others are [default: target]
#              CYCLES  of each deck [default: 40]
#
# exit code: 0 one digest for each deck; 1 not so; 3 a platform is missing from the table, and the others agree.
set -u
cd "$(dirname "$0")/.." || exit 1
short= build= decks=()
for word in "$@"; do
    case $word in
        --short) short=1 ;;
        --build) build=1 ;;
        *) decks+=("$word") ;;
    esac
done
target=${CARGO_TARGET_DIR:-target}
if [ -n "$build" ]; then
    cargo build --release --locked -p master || exit 1
    for platform in static aarch64 windows; do
        deploy/$platform/build.sh --install || exit
    done
fi
here=$(realpath "${BOLIDE:-$target/release/bolide}") || exit 3
[ -x "$here" ] || { echo "platforms.sh: no $here; cargo build --release -p master" >&2; exit 3; }
made=$(mktemp -d) || exit 1
trap 'rm -rf "$made"' EXIT

cat >"$made/tube.toml" <<'D'
title = "a tube of 997 cells around"
units = "mm-ms-kg"
[control]
end_time = 1.0
[[part]]
name = "tube"
material = "STEEL_4340"
velocity = [0, 0, -100]
tube = { base = [0, 0, 0], inner_radius = 40, outer_radius = 42, length = 4, cells = [2, 997, 2] }
[[wall]]
point = [0, 0, 0]
normal = [0, 0, 1]
D
if [ ${#decks[@]} = 0 ]; then
    decks=("$made/tube.toml")
    if [ -n "$short" ]; then
        decks+=(deck/examples/{plates-free-slip,explosive-on-plate,tube-crush,rod-through-plate}.toml)
    else
        for deck in deck/examples/*.toml deck/examples/*.k; do
            case $deck in *-mesh.k) ;; *) decks+=("$deck") ;; esac
        done
    fi
fi

# Each platform is a name and a function that runs a command line of bolide.
missing=0
platforms=() names=()
platform() { names+=("$1"); platforms+=("$2"); }
# absent NAME FOLDER: says which build is missing.
absent() { echo "platforms.sh: $1 is not built: deploy/$2/build.sh --install" >&2; missing=1; }
glibc() { "$here" "$@"; }
# The library of C then takes its functions without fused multiply-add, which round otherwise.
unfused() { GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2 "$here" "$@"; }
scalar() { "$here" "$@" --lanes scalar; }
unfused_scalar() { GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2 "$here" "$@" --lanes scalar; }
musl() { "$target/static/bolide" "$@"; }
musl_scalar() { "$target/static/bolide" "$@" --lanes scalar; }
arm() { qemu-aarch64-static -L /usr/aarch64-linux-gnu "$target/aarch64-unknown-linux-gnu/release/bolide" "$@"; }
arm_scalar() { arm "$@" --lanes scalar; }
windows() { deploy/windows/wine.sh "$target/x86_64-pc-windows-gnu/release/bolide.exe" "$@"; }
windows_scalar() { windows "$@" --lanes scalar; }
platform glibc glibc
platform glibc-no-fma unfused
platform glibc-scalar scalar
platform glibc-no-fma-scalar unfused_scalar
if [ -z "$short" ]; then
    if [ -x "$target/static/bolide" ]; then
        platform musl musl
        platform musl-scalar musl_scalar
    else
        absent musl static
    fi
    if [ -x "$target/aarch64-unknown-linux-gnu/release/bolide" ] && command -v qemu-aarch64-static >/dev/null; then
        platform aarch64-neon arm
        platform aarch64-scalar arm_scalar
    else
        absent aarch64 aarch64
    fi
    if [ -f "$target/x86_64-pc-windows-gnu/release/bolide.exe" ] && [ -x /usr/lib/wine/wine64 ]; then
        platform windows windows
        platform windows-scalar windows_scalar
    else
        absent Windows windows
    fi
fi

wrong=0
seconds=()
for deck in "${decks[@]}"; do
    first=
    line=
    for i in "${!platforms[@]}"; do
        from=$(date +%s%N)
        found=$("${platforms[i]}" run "$deck" --cycles "${CYCLES:-40}" --no-output --json 2>"$made/error" </dev/null |
            grep -oP '"digest": ?"\K[0-9a-f]+' | head -1)
        seconds[i]=$((${seconds[i]:-0} + ($(date +%s%N) - from) / 1000000))
        first=${first:-${found:-none}}
        if [ -n "$found" ] && [ "$found" = "$first" ]; then
            line+=" ${names[i]}"
        else
            echo "platforms.sh: $(basename "$deck"): $first on ${names[0]}, ${found:-no digest} on ${names[i]}; $(tail -1 "$made/error")" >&2
            wrong=1
        fi
    done
    printf '%s %-26s%s\n' "$first" "$(basename "$deck")" "$line"
done
echo "seconds for ${#decks[@]} decks:"
for i in "${!platforms[@]}"; do
    printf "%8d.%d %s\n" "$((seconds[i] / 1000))" "$((seconds[i] % 1000 / 100))" "${names[i]}"
done
[ $wrong = 0 ] || exit 1
[ $missing = 0 ] || exit 3
