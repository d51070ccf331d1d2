#!/bin/bash
# Builds bolide.exe for 64-bit Windows on an x86-64 Debian, packs a zip, and runs the tests of all libraries but the master's under wine.
#
# usage: deploy/windows/build.sh [--install]
#        --install gets what it needs: the compiler and linker of mingw, wine and zip from Debian (root), the target from rustup. Where
#        rustup is missing or has no target, Debian's compiler with the sources of its standard library, which is built then
#
# environment: CARGO_TARGET_DIR  where it is built [default: target]
#
# exit code: 0 well; 1 something is wrong; 3 this machine lacks something.
set -u
cd "$(dirname "$0")/../.." || exit 1
triple=x86_64-pc-windows-gnu
mingw=x86_64-w64-mingw32
if [ "${1:-}" = --install ]; then
    apt-get update -q || exit 3
    apt-get install -y -q --no-install-recommends gcc-mingw-w64-x86-64-posix g++-mingw-w64-x86-64-posix libz-mingw-w64 \
        wine64 zip || exit 3
    rustup target add $triple || apt-get install -y -q --no-install-recommends rustc-web rust-web-src || exit 3
fi
for program in $mingw-gcc-posix $mingw-dlltool zip; do
    command -v $program >/dev/null || { echo "build.sh: no $program; --install gets it (root)" >&2; exit 3; }
done
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
std=()
if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ]; then
    if ! [ -d /usr/lib/rustlib/src/rust/library ]; then
        echo "build.sh: no compiler for $triple; deploy/windows/build.sh --install gets one (root)" >&2
        exit 3
    fi
    # RUSTC_BOOTSTRAP lets a released compiler build its own standard library.
    export RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1
    std=(-Zbuild-std=std,panic_unwind)
fi
export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_LINKER=$mingw-gcc-posix
export CC_x86_64_pc_windows_gnu=$mingw-gcc-posix CXX_x86_64_pc_windows_gnu=$mingw-g++-posix AR_x86_64_pc_windows_gnu=$mingw-ar
export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER=$PWD/deploy/windows/wine.sh

cargo build --release --locked -p master --target $triple "${std[@]}" || exit 1
exe=$CARGO_TARGET_DIR/$triple/release/bolide.exe
file -b "$exe"
# A PC has the libraries of Windows and no others.
needs=$($mingw-objdump -p "$exe" | sed -n 's/.*DLL Name: //p')
for library in $needs; do
    case ${library,,} in
        kernel32.dll | ntdll.dll | msvcrt.dll | advapi32.dll | bcrypt.dll | bcryptprimitives.dll | ws2_32.dll | iphlpapi.dll | \
            userenv.dll | user32.dll | shell32.dll | ole32.dll | oleaut32.dll | secur32.dll | crypt32.dll | ncrypt.dll | psapi.dll | \
            api-ms-win-*) ;;
        *) echo "build.sh: bolide.exe needs $library, which Windows does not have" >&2; exit 1 ;;
    esac
done
packed=$CARGO_TARGET_DIR/bolide-$triple.zip
rm -f "$packed"
zip -q -j "$packed" "$exe" deploy/windows/README.md LICENSE-MIT LICENSE-APACHE || exit 1
echo "$packed: $(stat -c %s "$packed") bytes"

command -v /usr/lib/wine/wine64 >/dev/null || { echo "build.sh: no wine; no test was run" >&2; exit 3; }
cargo test --release --locked -p mechanics -p deck -p worker --target $triple "${std[@]}" || exit 1
cargo test --release --locked -p protocol --lib --target $triple "${std[@]}" || exit 1
# Wine 8 says of no socket whose it is, and keeps no list of who may read a file, so keys that are made under it are everybody's.
cargo test --release --locked -p protocol --test wire --target $triple "${std[@]}" -- --skip tls:: || exit 1
cargo test --release --locked -p system --lib --target $triple "${std[@]}" -- --skip windows_lists_the_sockets \
    --skip lets_nobody_else_read || exit 1
