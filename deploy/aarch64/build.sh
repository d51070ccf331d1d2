#!/bin/bash
# Builds the binary for 64-bit ARM on an x86-64 Debian, and runs the tests of all libraries but the master's under an emulator.
#
# usage: deploy/aarch64/build.sh [--install]
#        --install gets what it needs: a linker and qemu from Debian (root), the target from rustup. Where rustup is missing or
#        has no target, Debian's compiler and ARM's standard library
#
# environment: CARGO_TARGET_DIR  where it is built [default: target]
#
# exit code: 0 well; 1 something is wrong; 3 this machine lacks something.
set -u
cd "$(dirname "$0")/../.." || exit 1
triple=aarch64-unknown-linux-gnu
if [ "${1:-}" = --install ]; then
    apt-get update -q && apt-get install -y -q --no-install-recommends gcc-12-aarch64-linux-gnu binutils-aarch64-linux-gnu \
        libc6-dev-arm64-cross qemu-user-static || exit 3
    if ! rustup target add $triple; then
        dpkg --add-architecture arm64 && apt-get update -q || exit 3
        apt-get install -y -q --no-install-recommends rustc-web || exit 3
        # The standard libraries of two architectures cannot be installed beside each other: ARM's is unpacked.
        unpacked=$(mktemp -d)
        (cd "$unpacked" && apt-get download libstd-rust-web-dev:arm64 && dpkg-deb -x libstd-rust-web-dev_*_arm64.deb .) || exit 3
        cp -r "$unpacked/usr/lib/rustlib/$triple" /usr/lib/rustlib/ || exit 3
        rm -rf "$unpacked"
    fi
fi
if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ]; then
    if ! [ -d /usr/lib/rustlib/$triple ]; then
        echo "build.sh: no compiler for $triple; deploy/aarch64/build.sh --install gets one (root)" >&2
        exit 3
    fi
    export RUSTC=/usr/bin/rustc
fi
for program in aarch64-linux-gnu-gcc-12 qemu-aarch64-static; do
    command -v $program >/dev/null || { echo "build.sh: no $program; --install gets it (root)" >&2; exit 3; }
done
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
export CC_aarch64_unknown_linux_gnu=aarch64-linux-gnu-gcc-12 AR_aarch64_unknown_linux_gnu=aarch64-linux-gnu-ar
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc-12
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64-static -L /usr/aarch64-linux-gnu"

cargo build --release --locked -p master --target $triple || exit 1
file -b "$CARGO_TARGET_DIR/$triple/release/bolide"
cargo test --release --locked -p mechanics -p deck -p protocol -p worker -p system --target $triple || exit 1
