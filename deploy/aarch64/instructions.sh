#!/bin/bash
# Counts the instructions of an element-cycle on 64-bit ARM, by lanes: qemu says which blocks of instructions it executes. Beside them
# stand those of this machine's AVX2, counted by valgrind in the same cycles. Each is the difference of two runs over the
# element-cycles between them, so that the start does not count.
#
# usage: deploy/aarch64/instructions.sh       (after cargo build --release and deploy/aarch64/build.sh; valgrind, qemu-user-static)
#
# environment: BOLIDE  the executable of this machine [default: target/release/bolide]
#              CARGO_TARGET_DIR  where that of ARM is [default: target]
#
# exit code: 0 counted; 1 something is wrong; 3 this machine lacks something.
set -u
cd "$(dirname "$0")/../.." || exit 1
target=${CARGO_TARGET_DIR:-target}
here=${BOLIDE:-$target/release/bolide}
arm=$target/aarch64-unknown-linux-gnu/release/bolide
for program in qemu-aarch64-static valgrind "$here" "$arm"; do
    command -v "$program" >/dev/null || { echo "instructions.sh: no $program" >&2; exit 3; }
done
made=$(mktemp -d) || exit 1
trap 'rm -rf "$made"' EXIT
run=(--no-output --threads 1 --json)

# of_arm DECK CYCLES LANES: all instructions of a run. The log has each block's instructions when it is first met, then the address
# of every block that is executed.
of_arm() {
    mkfifo "$made/log"
    awk '/^IN:/ { begins = ""; n = 0; inside = 1; next }
        inside && /^0x/ { if (n++ == 0) { begins = $1; sub(/^0x0*/, "", begins); sub(/:$/, "", begins) } next }
        inside && /^$/ { length_of[begins] = n; inside = 0 }
        /^Trace/ { split($4, at, "/"); sub(/^0*/, "", at[2]); total += length_of[at[2]] }
        END { printf "%d\n", total }' "$made/log" >"$made/count" &
    qemu-aarch64-static -L /usr/aarch64-linux-gnu -d exec,nochain,in_asm -D "$made/log" \
        "$arm" run "$1" --cycles "$2" --lanes "$3" "${run[@]}" >"$made/out" 2>"$made/error" || { cat "$made/error" >&2; exit 1; }
    wait $!
    rm "$made/log"
    cat "$made/count"
}
# of_here DECK CYCLES LANES: the same of this machine.
of_here() {
    valgrind --tool=cachegrind --cache-sim=no --cachegrind-out-file=/dev/null "$here" run "$1" --cycles "$2" --lanes "$3" "${run[@]}" \
        2>&1 >"$made/out" | sed -n 's/.*I *refs: *//p' | tr -d ,
}

printf '%-26s%10s%12s%12s%12s%12s\n' 'cycles' '' neon 'one lane' 'avx2 here' 'neon/avx2'
for case in taylor-copper:2:12 plates-joined:2:4 explosive-on-plate:2:6 fragment-on-water-box:2:5 tube-crush:2:12; do
    IFS=: read -r name from to <<<"$case"
    deck=deck/examples/$name.toml
    elements=$("$here" check "$deck" --json | grep -oP '"elements": ?\K[0-9]+' | head -1)
    row=()
    for on in "of_arm neon" "of_arm scalar" "of_here avx2"; do
        read -r count lanes <<<"$on"
        less=$($count "$deck" "$from" "$lanes") && more=$($count "$deck" "$to" "$lanes") || exit 1
        row+=("$(awk "BEGIN { printf \"%.1f\", ($more - $less) / ($elements * ($to - $from)) }")")
    done
    printf '%-26s%10s%12s%12s%12s%12.2f\n' "$name" "$from to $to" "${row[@]}" "$(awk "BEGIN { print ${row[0]} / ${row[2]} }")"
done
