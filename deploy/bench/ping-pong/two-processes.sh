#!/usr/bin/env bash
# The wall time of a run on one worker's process, on two over TCP, and on two over memory, in turns on this machine.
#
#   two-processes.sh BOLIDE DECK CYCLES [TURNS]
#
# Prints a line for each turn: seconds of the three, and the speed of two over twice that of one for TCP and memory; then
# the medians. All of it wants two processors.
set -euo pipefail

[ $# -ge 3 ] || { sed -n '4s/^# *//p' "$0" >&2; exit 2; }
bolide=$(realpath "$1") deck=$(realpath "$2") cycles=$3 turns=${4:-5}
work=$(mktemp -d /tmp/two-processes.XXXXXX)
started=()
end() {
    for process in "${started[@]}"; do kill -9 "$process" 2> /dev/null || true; done
    wait 2> /dev/null || true
    started=()
}
trap 'end; rm -rf "$work"' EXIT

# run WORKERS [FLAG]: seconds of the cycles, on so many workers.
run() {
    local workers=$1 flag=${2:-} i
    rm -rf "$work/spool"
    "$bolide" master --listen 127.0.0.1:0 --spool "$work/spool" $flag > "$work/master.txt" 2>&1 &
    started+=($!)
    until grep -q '^listening on' "$work/master.txt"; do sleep 0.05; done
    local master
    master=$(sed -n 's/^listening on //p' "$work/master.txt")
    for i in $(seq "$workers"); do
        "$bolide" worker --master "$master" --name "w$i" --threads 1 --pin $((i - 1)) $flag > "$work/w$i.txt" 2>&1 &
        started+=($!)
    done
    "$bolide" submit "$deck" --master "$master" --cycles "$cycles" --no-output --wait --min-workers "$workers" --route direct --json |
        sed -n 's/.*"wall_s": *\([0-9.e-]*\).*/\1/p' | head -1
    end > /dev/null 2>&1
}

for turn in $(seq "$turns"); do
    one=$(run 1)
    # Whoever is second in one turn is first in the next.
    if [ $((turn % 2)) = 0 ]; then
        tcp=$(run 2 --no-shared-memory)
        memory=$(run 2)
    else
        memory=$(run 2)
        tcp=$(run 2 --no-shared-memory)
    fi
    awk -v a="$one" -v t="$tcp" -v m="$memory" \
        'BEGIN { printf "one %.3f s, two over TCP %.3f s, over memory %.3f s; %.3f and %.3f\n", a, t, m, a / 2 / t, a / 2 / m }' |
        tee -a "$work/turns.txt"
done
median() { awk -v f="$1" '{ gsub(/[,;]/, ""); print $f }' "$work/turns.txt" | sort -n | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
echo "medians of $turns turns: one $(median 2) s, two over TCP $(median 7) s, over memory $(median 11) s; of twice one: TCP $(median 13), memory $(median 15)"
