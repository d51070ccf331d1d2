#!/bin/bash
# One job on workers of unlike platforms, with mutual TLS: a master and two workers of this machine, and one worker of each other
# platform that was built. One of this machine's is killed on the way. The digest must be that of one process here.
#
# usage: deploy/mixed.sh       (after cargo build --release, deploy/aarch64/build.sh, deploy/windows/build.sh)
#
# environment: BOLIDE  the executable of this machine [default: target/release/bolide]
#              CARGO_TARGET_DIR  where the others are [default: target]
#              CYCLES  of the job [default: 150]
#
# exit code: 0 equal; 1 not so; 3 no other platform was built.
set -u
cd "$(dirname "$0")/.." || exit 1
target=$(realpath "${CARGO_TARGET_DIR:-target}")
here=$(realpath "${BOLIDE:-$target/release/bolide}") || exit 3
deck=$PWD/deck/examples/plates-free-slip.toml
cycles=${CYCLES:-150}
wine=$PWD/deploy/windows/wine.sh
arm=$target/aarch64-unknown-linux-gnu/release/bolide
exe=$target/x86_64-pc-windows-gnu/release/bolide.exe
others=()
[ -x "$arm" ] && command -v qemu-aarch64-static >/dev/null && others+=(arm)
[ -f "$exe" ] && [ -x /usr/lib/wine/wine64 ] && others+=(windows)
if [ ${#others[@]} = 0 ]; then
    echo "mixed.sh: neither ARM's nor Windows' binary is built; nothing was compared" >&2
    exit 3
fi
export CARGO_TARGET_DIR=$target
made=$(mktemp -d) || exit 1
started=()
trap 'kill "${started[@]}" 2>/dev/null; wait; rm -rf "$made"' EXIT
cd "$made" || exit 1
digest() { grep -oP '"digest": ?"\K[0-9a-f]+' | head -1; }
fail() {
    echo "mixed.sh: $*; the ends of the logs:" >&2
    tail -n 3 ./*.log >&2
    exit 1
}

alone=$("$here" run "$deck" --cycles "$cycles" --no-output --json 2>alone.log | digest)
"$here" certs ca lab >certs.log || fail "no CA"
"$here" certs host lab master --role master --address 127.0.0.1 >>certs.log || fail "no certificate"
"$here" certs host lab me --role client >>certs.log || fail "no certificate"
for name in here dies "${others[@]}"; do
    "$here" certs host lab "$name" --role worker >>certs.log || fail "no certificate"
done
"$here" master --listen 127.0.0.1:0 --spool spool --certs lab/master >master.log 2>&1 &
started+=($!)
for _ in $(seq 100); do
    address=$(grep -oP 'listening on \K[0-9.:]+' master.log | head -1)
    [ -n "$address" ] && break
    sleep 0.1
done
[ -n "$address" ] || fail "the master does not listen"
# work NAME SPEED COMMAND...: starts a worker. Those of other platforms are emulated, and are dealt less.
work() {
    local name=$1 speed=$2
    shift 2
    "$@" worker --master "$address" --certs "lab/$name" --name "$name" --threads 1 --speed "$speed" >"$name.log" 2>&1 &
    started+=($!)
}
work here 1 "$here"
for other in "${others[@]}"; do
    case $other in
        arm) work arm 0.2 qemu-aarch64-static -L /usr/aarch64-linux-gnu "$arm" ;;
        windows) work windows 0.5 "$wine" "$exe" ;;
    esac
done
work dies 1 "$here"
dies=$!
at=(--master "$address" --certs lab/me)
"$here" submit "$deck" "${at[@]}" --min-workers $((${#others[@]} + 2)) --cycles "$cycles" --wait --json >summary 2>submit.log &
job=$!
# Killed as soon as the job has computed a few cycles.
for _ in $(seq 1200); do
    cycle=$("$here" jobs "${at[@]}" --json 2>>jobs.log | grep -oP '"cycle": ?\K[0-9]+' | head -1)
    [ "${cycle:-0}" -ge 10 ] && break
    kill -0 $job 2>/dev/null || fail "the job ended before it had computed 10 cycles"
    sleep 0.1
done
kill -9 $dies
wait $job || fail "the job failed"
mixed=$(digest <summary)
lost=$(grep -oP '"losses": ?\[\K[^]]*' summary | head -c 200)
echo "$alone one process of this machine"
echo "$mixed ${#others[@]} of other platforms (${others[*]}) and two of this machine, lanes $(grep -oP '"lanes": ?"\K[^"]+' summary | head -1)"
echo "lost: ${lost:-nobody}"
[ -n "$mixed" ] && [ "$mixed" = "$alone" ] || fail "the digests differ"
[ -n "$lost" ] || fail "nobody was lost: the job was over before"
for other in "${others[@]}"; do
    grep -q "joined" "$other.log" || fail "$other took no part"
done
