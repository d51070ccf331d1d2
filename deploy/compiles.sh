#!/bin/bash
# Shows that the sources compile for platforms on which nobody has run them: Windows with the tools of Microsoft, and macOS. `cargo
# check` looks at all of the Rust; of the C in two libraries a stand-in makes empty objects, since nothing is linked.
#
# usage: deploy/compiles.sh [TARGET]...     [default: x86_64-pc-windows-msvc aarch64-apple-darwin]
#        the targets are of rustup: rustup target add TARGET
#
# environment: CARGO_TARGET_DIR  where it is checked [default: target]
#
# exit code: 0 all compile; 1 one does not; 3 this machine lacks a target.
set -u
cd "$(dirname "$0")/.." || exit 1
stand_in=$(mktemp -d) || exit 1
trap 'rm -rf "$stand_in"' EXIT
# A compiler, which is asked what it is and for objects, and what packs those.
cat >"$stand_in/clang-cl" <<'C'
#!/bin/bash
previous=
for word in "$@"; do
    case $word in -E | /E) exec cc -E -x c "${@: -1}" ;; -Fo* | /Fo*) : >"${word#?Fo}" ;; esac
    [ "$previous" != -o ] || : >"$word"
    previous=$word
done
C
cat >"$stand_in/ar" <<'C'
#!/bin/bash
for word in "$@"; do
    case $word in -out:* | -OUT:*) : >"${word#?????}"; exit ;; *.a | *.lib) : >"$word"; exit ;; esac
done
C
chmod +x "$stand_in"/*
[ $# -gt 0 ] || set -- x86_64-pc-windows-msvc aarch64-apple-darwin
for triple in "$@"; do
    if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ]; then
        echo "compiles.sh: no target $triple; rustup target add $triple gets it" >&2
        exit 3
    fi
    name=${triple//-/_}
    env "CC_$name=$stand_in/clang-cl" "CXX_$name=$stand_in/clang-cl" "AR_$name=$stand_in/ar" \
        cargo check --quiet --locked -p master --target "$triple" || exit 1
    echo "compiles for $triple"
done
