#!/bin/bash
# Runs a program for Windows under wine, without a screen.
#
# usage: deploy/windows/wine.sh PROGRAM.exe [ARGUMENT]...
#
# environment: WINEPREFIX  the folder that stands for the disk of Windows [default: target/wine; made if there is none]
#
# Wine 8 lacks bcryptprimitives.dll, of which Rust asks random numbers and which Windows has from version 10 on: a stand-in that asks
# another library of wine is put beside the program.
set -u
root=$(cd "$(dirname "$0")/../.." && pwd)
mingw=x86_64-w64-mingw32
wine=/usr/lib/wine/wine64
[ -x $wine ] || { echo "wine.sh: no $wine (Debian: wine64)" >&2; exit 3; }
export WINEPREFIX=${WINEPREFIX:-${CARGO_TARGET_DIR:-$root/target}/wine}
# No words of wine's own, no menus, no .NET, no browser.
export WINEDEBUG=${WINEDEBUG:--all} WINEDLLOVERRIDES="mscoree,mshtml=;winemenubuilder.exe=d"
mkdir -p "$WINEPREFIX"
(
    flock 9
    library=$WINEPREFIX/drive_c/windows/system32/bcryptprimitives.dll
    [ -e "$library" ] && exit
    $wine wineboot -i >/dev/null 2>&1 9>&-
    made=$(mktemp -d)
    cat >"$made/random.c" <<'C'
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE bytes, SIZE_T n) { return SystemFunction036(bytes, (ULONG)n); }
C
    $mingw-gcc-posix -shared -O1 -s "$made/random.c" -o "$library" -ladvapi32
    cp -L /usr/$mingw/lib/zlib1.dll "$WINEPREFIX/drive_c/windows/system32/" 2>/dev/null
    rm -rf "$made"
) 9>"$WINEPREFIX/lock"
exec $wine "$@"
