#!/bin/bash
# Builds the module that computes a block of a run again in browsers and in Node, and shows that it gives the bits of this machine: it
# computes a block of a job on two workers, whose hash they and the master have found.
#
# usage: deploy/wasm/build.sh [--install] [--page]
#        --install  gets the Rust target wasm32-unknown-unknown from rustup, and Node from Debian (root)
#        --page     also builds the binary with the module in it, and has a browser compute a block on the page
#
# environment: CARGO_TARGET_DIR  where it is built [default: target]
#
# exit code: 0 well; 1 something is wrong; 3 this machine lacks something.
set -u
cd "$(dirname "$0")/../.." || exit 1
triple=wasm32-unknown-unknown
page=
for word in "$@"; do
    case $word in
        --install)
            rustup target add $triple || exit 3
            command -v node >/dev/null || { apt-get update -q && apt-get install -y -q --no-install-recommends nodejs; } || exit 3
            ;;
        --page) page=1 ;;
        *) echo "build.sh: $word? The words are --install and --page" >&2; exit 1 ;;
    esac
done
[ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ] || { echo "build.sh: no target $triple; --install gets it" >&2; exit 3; }
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export CARGO_TARGET_DIR=$target
CARGO_PROFILE_RELEASE_STRIP=true cargo rustc --release --locked -p recompute --lib --crate-type cdylib --target $triple || exit 1
module=$target/recompute.wasm
cp "$target/$triple/release/recompute.wasm" "$module" || exit 1
export BOLIDE_RECOMPUTE=$module
echo "$module: $(stat -c %s "$module") bytes; BOLIDE_RECOMPUTE=$module cargo build --release puts it into the binary"

command -v node >/dev/null || { echo "build.sh: no node, so nothing was computed; --install gets it (root)" >&2; exit 3; }
cargo build --release --locked -p master || exit 1
bolide=$target/release/bolide
made=$(mktemp -d) || exit 1
started=()
trap 'kill "${started[@]}" 2>/dev/null; wait; rm -rf "$made"' EXIT
"$bolide" master --listen 127.0.0.1:0 --http 127.0.0.1:0 --spool "$made/spool" >"$made/master.log" 2>&1 &
started+=($!)
for _ in $(seq 100); do
    grep -q "page: " "$made/master.log" && break
    sleep 0.1
done
address=$(grep -oP 'listening on \K[0-9.:]+' "$made/master.log")
at=$(grep -oP 'page: \Khttp://[0-9.:]+' "$made/master.log")
token=$(grep -oP 'token=\K\w+' "$made/master.log")
[ -n "$address" ] && [ -n "$token" ] || { cat "$made/master.log" >&2; exit 1; }
for name in one two; do
    "$bolide" worker --master "$address" --name $name --threads 1 >"$made/$name.log" 2>&1 &
    started+=($!)
done
# ask PATH: what the master answers about jobs.
ask() {
    node --input-type=module --eval '
        const [url, token] = process.argv.slice(1);
        const answer = await fetch(url, { headers: { authorization: `Bearer ${token}` } });
        process.stdout.write(Buffer.from(await answer.arrayBuffer()));
        process.exitCode = answer.ok ? 0 : 1;' "$at/api/jobs/$1" "$token"
}
wrong=0
job=0
for deck in deck/examples/*.toml deck/examples/*.k; do
    case $deck in *-mesh.k) continue ;; esac
    job=$((job + 1))
    "$bolide" submit "$deck" --master "$address" --min-workers 2 --cycles 40 --no-output --wait >/dev/null 2>"$made/submit.log" ||
        { cat "$made/submit.log" >&2; exit 1; }
    due=$(ask $job/sheet | grep -oP '"proved":\{[^}]*"hash":"\K[0-9a-f]+')
    ask $job/sample >"$made/block" || { echo "build.sh: job $job gives no block" >&2; exit 1; }
    found=$(node deploy/wasm/recompute.mjs "$module" "$made/block") || exit 1
    case $found in
        *"\"hash\":\"$due\""*) echo "$(basename "$deck"): $found" ;;
        *) echo "build.sh: $deck: the worker's hash is ${due:-missing}, Node's $found" >&2; wrong=1 ;;
    esac
done
# A cut block is refused.
head -c 200 "$made/block" >"$made/cut"
node deploy/wasm/recompute.mjs "$module" "$made/cut" 2>"$made/refused" && { echo "build.sh: a cut block was computed" >&2; wrong=1; }
cat "$made/refused"
[ $wrong = 0 ] || exit 1
[ -z "$page" ] || cargo test --release --locked -p master --test page dropped || exit 1
