#!/bin/bash
# Compares the binary for 64-bit ARM, under an emulator, with the one of this machine: one digest for every deck, and for a
# job on workers of both kinds, one of which is killed on the way.
#
# usage: deploy/aarch64/test.sh               (after deploy/aarch64/build.sh and cargo build --release)
#
# environment: BOLIDE  the executable of this machine [default: target/release/bolide]
#              ARM     the one for ARM [default: target/aarch64-unknown-linux-gnu/release/bolide]
#              CYCLES  of each deck [default: 40]
#
# exit code: 0 equal; 1 not so; 3 something is missing.
set -u
cd "$(dirname "$0")/../.." || exit 1
here=$(realpath "${BOLIDE:-target/release/bolide}") || exit 3
arm=$(realpath "${ARM:-target/aarch64-unknown-linux-gnu/release/bolide}") || exit 3
command -v qemu-aarch64-static >/dev/null || { echo "test.sh: no qemu-aarch64-static; nothing was compared" >&2; exit 3; }
there=(qemu-aarch64-static -L /usr/aarch64-linux-gnu "$arm")
made=$(mktemp -d) || exit 1
started=()
trap 'kill "${started[@]}" 2>/dev/null; wait; rm -rf "$made"' EXIT
digest() { grep -oP '"digest": ?"\K[0-9a-f]+' | head -1; }

# A mesh whose nodes pass sines and cosines: these differ between the C libraries of machines.
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
wrong=0
for deck in "$made/tube.toml" ${DECKS:-deck/examples/*.toml deck/examples/*.k}; do
    case $deck in *-mesh.k) continue ;; esac
    one=$("$here" run "$deck" --cycles "${CYCLES:-40}" --no-output --json 2>/dev/null | digest)
    other=$("${there[@]}" run "$deck" --cycles "${CYCLES:-40}" --no-output --json 2>"$made/error" | digest)
    if [ -n "$one" ] && [ "$one" = "$other" ]; then
        echo "$one $(basename "$deck")"
    else
        echo "test.sh: $(basename "$deck"): ${one:-no digest} here, ${other:-no digest} on ARM; $(tail -1 "$made/error")" >&2
        wrong=1
    fi
done

# A job on two workers of this machine and one of ARM's; one of this machine's is killed as soon as it computes.
deck=deck/examples/plates-free-slip.toml
alone=$("$here" run $deck --cycles 150 --no-output --json 2>/dev/null | digest)
"$here" master --listen 127.0.0.1:0 --spool "$made/spool" >"$made/master.log" 2>&1 &
started+=($!)
for _ in $(seq 100); do
    address=$(grep -oP 'listening on \K[0-9.:]+' "$made/master.log" | head -1)
    [ -n "$address" ] && break
    sleep 0.1
done
"$here" worker --master "$address" --name here --threads 1 >"$made/here.log" 2>&1 &
started+=($!)
"${there[@]}" worker --master "$address" --name arm --threads 1 --speed 0.2 >"$made/arm.log" 2>&1 &
started+=($!)
"$here" worker --master "$address" --name dies --threads 1 >"$made/dies.log" 2>&1 &
dies=$!
started+=($dies)
"$here" submit $deck --master "$address" --min-workers 3 --cycles 150 --wait --json >"$made/summary" 2>"$made/submit.log" &
job=$!
# An emulated worker needs some 0.1 s for a cycle: after 6 s the job is under way, and not over.
sleep 6
kill -9 $dies
wait $job
mixed=$(digest <"$made/summary")
lanes=$(grep -oP '"lanes": ?"\K[^"]+' "$made/summary" | head -1)
lost=$(grep -oP '"losses": ?\[\K[^]]*' "$made/summary" | head -c 200)
echo "$mixed a job on lanes $lanes, lost: ${lost:-nobody}"
if [ -z "$mixed" ] || [ "$mixed" != "$alone" ]; then
    echo "test.sh: the mixed job has ${mixed:-no digest}, one process here $alone; see its logs:" >&2
    for log in "$made"/*.log; do tail -n 3 "$log" >&2; done
    wrong=1
fi
case $lanes in *neon*) ;; *) echo "test.sh: no ARM worker took part" >&2; wrong=1 ;; esac
[ -n "$lost" ] || { echo "test.sh: nobody was lost: the job was over before" >&2; wrong=1; }
exit $wrong
