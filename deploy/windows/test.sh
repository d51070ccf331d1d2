#!/bin/bash
# What Windows does differently, under wine: the exe must write the files that the executable of this machine writes, byte by byte,
# into a folder of a long name with letters beyond ASCII, from a deck with the line ends of Windows; with a process for each worker;
# and when it goes on from a checkpoint.
#
# usage: deploy/windows/test.sh       (after deploy/windows/build.sh and cargo build --release)
#
# environment: BOLIDE  the executable of this machine [default: target/release/bolide]
#              CARGO_TARGET_DIR  where the exe is [default: target]
#
# exit code: 0 equal; 1 not so; 3 something is missing.
set -u
cd "$(dirname "$0")/../.." || exit 1
target=$(realpath "${CARGO_TARGET_DIR:-target}")
here=$(realpath "${BOLIDE:-$target/release/bolide}") || exit 3
exe=$target/x86_64-pc-windows-gnu/release/bolide.exe
[ -f "$exe" ] || { echo "test.sh: no $exe; deploy/windows/build.sh --install" >&2; exit 3; }
export CARGO_TARGET_DIR=$target
wine=$PWD/deploy/windows/wine.sh
deck=$PWD/deck/examples/plates-free-slip.toml
made=$(mktemp -d) || exit 1
trap 'rm -rf "$made"' EXIT
cd "$made" || exit 1
wrong=0
fail() { echo "test.sh: $*" >&2; wrong=1; }
there() { "$wine" "$exe" "$@"; }
digest() { grep -oP '"digest": ?"\K[0-9a-f]+' | head -1; }
# same WHAT ONE OTHER
same() { if [ -n "$2" ] && [ "$2" = "$3" ]; then echo "same: $1"; else fail "$1: ${2:-none} here, ${3:-none} on Windows"; fi; }
# sums FOLDER: of what a run writes, but for times of computing.
sums() { (cd "$1" && find . -name '*.vt*' -o -name '*.pvd' -o -name history.csv | sort | xargs sha256sum | sha256sum); }

there --version || fail "it does not run"
sed 's/$/\r/' "$deck" >windows.toml
long=$(printf 'Ordner-mit-langem-Namen-für-Prüfungen-%03d/' 1 2 3 4 5 6 7 8)Ergebnisse
ours=$("$here" run "$deck" --cycles 40 --out ours --json 2>ours.log | digest)
theirs=$(there run windows.toml --cycles 40 --out "$long" --json 2>theirs.log </dev/null | digest)
same "digest of a deck with the line ends of Windows" "$ours" "$theirs"
same "files in a folder whose path has ${#long} letters" "$(sums ours)" "$(sums "$long" 2>/dev/null)"
"$here" picture ours --out ours.png >/dev/null 2>&1
there picture "$long" --out theirs.png >/dev/null 2>&1 </dev/null
same "picture" "$(sha256sum <ours.png)" "$(sha256sum <theirs.png)"
same "digest of two workers as processes" "$ours" \
    "$(there run "$deck" --cycles 40 --workers 2 --threads 1 --processes --no-output --json 2>processes.log </dev/null | digest)"
there run "$deck" --cycles 20 --snapshot-at 10 --out parts --json >/dev/null 2>parts.log </dev/null
same "digest of a run that goes on from a checkpoint of Windows, here and there" "$ours $ours" \
    "$("$here" run "$deck" --cycles 40 --resume parts/snapshot.bolide --no-output --json 2>>parts.log | digest) \
$(there run "$deck" --cycles 40 --resume parts/snapshot.bolide --no-output --json 2>>parts.log </dev/null | digest)"
sed 's/velocity/velocitee/' windows.toml >schön.toml
same "errors of a deck" "$("$here" check schön.toml 2>&1 | sha256sum)" "$(there check schön.toml 2>&1 </dev/null | sha256sum)"
[ $wrong = 0 ] || tail -n 3 ./*.log >&2
exit $wrong
