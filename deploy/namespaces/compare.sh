#!/bin/bash
# Kernel-shaped links against our own: a master and workers in network namespaces on a bridge, mutual TLS on.
#
# usage: deploy/namespaces/compare.sh [WORKERS] [RATE...]        (as root; default: 3 workers, 10mbit 100mbit)
#
# For each rate, first with `tc tbf` on both ends of every cable, then with `--link RATE` of the daemons on bare cables:
# goodput of a bulk transfer (payload of our frames, Mb/s), and seconds of a cycle of a benchmark deck by route.
# Both count a packet as Ethernet carries it: 90 bytes beside 1448. A cycle is the difference of two runs, so that
# sending the problem out does not count.
#
# environment: BOLIDE, GOODPUT  the executables [default: those of ./target/release; built with
#                               cargo build --release -p master -p protocol --bins --examples]
#              DECK             the deck [default: deck/examples/plates-free-slip.toml]
#              CYCLES           two numbers of cycles [default: "20 80"]
#              ROUTES           routes [default: "direct master"]
#
# exit code: 0 goodput within 3 % and cycles within 10 %; 1 not so, or something failed; 3 this machine cannot do it (no
# root, no namespaces, no bridge, no tbf), with the reason.

set -u
cd "$(dirname "$0")/../.." || exit 1
BOLIDE=${BOLIDE:-target/release/bolide}
GOODPUT=${GOODPUT:-target/release/examples/goodput}
DECK=${DECK:-deck/examples/plates-free-slip.toml}
read -r FEW MANY <<<"${CYCLES:-20 80}"
ROUTES=${ROUTES:-direct master}
WORKERS=${1:-3}
shift
RATES=("$@")
[ ${#RATES[@]} -gt 0 ] || RATES=(10mbit 100mbit)

cannot() {
    echo "compare.sh: $*; nothing was compared" >&2
    exit 3
}
fail() {
    echo "compare.sh: $*" >&2
    exit 1
}

case $WORKERS in [2-8]) ;; *) fail "$WORKERS workers; expected 2 to 8" ;; esac
[ "$(id -u)" = 0 ] || cannot "network namespaces and tc need root"
for tool in ip tc awk; do
    command -v $tool >/dev/null || cannot "no $tool on this machine (packages iproute2 and awk)"
done
for file in "$BOLIDE" "$GOODPUT" "$DECK"; do
    [ -e "$file" ] || fail "no $file; build with: cargo build --release -p master -p protocol --bins --examples"
done

P=bolide$$ # prefix of the namespaces
FOLDER=$(mktemp -d) || fail "no temporary folder"
DAEMONS=()

stop_daemons() {
    [ ${#DAEMONS[@]} -eq 0 ] || kill "${DAEMONS[@]}" 2>/dev/null
    [ ${#DAEMONS[@]} -eq 0 ] || wait "${DAEMONS[@]}" 2>/dev/null
    DAEMONS=()
}
clean() {
    stop_daemons
    for i in hub $(seq 0 "$WORKERS"); do ip netns del $P-"$i" 2>/dev/null; done
    rm -rf "$FOLDER"
}
trap clean EXIT
trap 'exit 1' INT TERM

# Host 0 runs the master, host i worker i; the cable of host i ends at port p<i> of the bridge.
try() { "$@" 2>"$FOLDER/why" || cannot "$* failed: $(tr '\n' ' ' <"$FOLDER/why")"; }
try ip netns add $P-hub
try ip -n $P-hub link add bridge type bridge
try ip -n $P-hub link set bridge up
for i in $(seq 0 "$WORKERS"); do
    try ip netns add $P-"$i"
    try ip link add eth0 netns $P-"$i" type veth peer name p"$i" netns $P-hub
    try ip -n $P-hub link set p"$i" master bridge up
    try ip -n $P-"$i" addr add 10.77.0.$((i + 1))/24 dev eth0
    try ip -n $P-"$i" link set lo up
    try ip -n $P-"$i" link set eth0 up
    # One packet at a time, so that tbf counts every header.
    try ip -n $P-"$i" link set eth0 gso_max_segs 1
    try ip -n $P-hub link set p"$i" gso_max_segs 1
done

# `tc` counts the 14 bytes of Ethernet; 24 are check sum, preamble and gap.
tbf() {
    for i in $(seq 0 "$WORKERS"); do
        for end in "$i eth0" "hub p$i"; do
            read -r where device <<<"$end"
            tc -n $P-"$where" qdisc del dev "$device" root 2>/dev/null
            [ "$1" = none ] || try tc -n $P-"$where" qdisc add dev "$device" root tbf rate "$1" \
                burst "$2" limit 400000 overhead 24
        done
    done
}
# A millisecond of a rate, as our shaper has it, but two packets at least.
burst() { awk -v r="$1" 'BEGIN { u = r ~ /gbit/ ? 1e9 : r ~ /mbit/ ? 1e6 : r ~ /kbit/ ? 1e3 : 1; b = int(r * u / 8 * 0.001); print b < 3076 ? 3076 : b }'; }

"$BOLIDE" certs ca "$FOLDER/ca" >/dev/null || fail "no CA"
for i in $(seq 0 "$WORKERS"); do
    role=worker
    [ "$i" = 0 ] && role=master
    "$BOLIDE" certs host "$FOLDER/ca" host-"$i" --address 10.77.0.$((i + 1)) --role $role >/dev/null || fail "no certificate"
done
certs() { echo "$FOLDER/ca/host-$1"; }
on() { ip netns exec $P-"$1" "${@:2}"; }

# goodput RATE [LINK]: 4 s of bulk from worker 1 to the master.
goodput() {
    local bytes link=${2:+link=$2}
    bytes=$(awk -v r="$1" 'BEGIN { u = r ~ /gbit/ ? 1e9 : r ~ /mbit/ ? 1e6 : r ~ /kbit/ ? 1e3 : 1; print int(r * u / 2) }')
    ip netns exec $P-0 "$GOODPUT" receive 10.77.0.1:7200 certs="$(certs 0)" $link >"$FOLDER/goodput" &
    local receiver=$!
    for _ in $(seq 50); do on 0 ss -ltn 2>/dev/null | grep -q :7200 && break || sleep 0.05; done
    on 1 "$GOODPUT" send 10.77.0.1:7200 bytes="$bytes" certs="$(certs 1)" $link || { kill $receiver; fail "goodput: nothing sent"; }
    wait $receiver || fail "goodput: nothing received"
    cat "$FOLDER/goodput"
}

# wall ROUTE CYCLES: seconds of a run.
wall() {
    on 0 "$BOLIDE" submit "$DECK" --master 10.77.0.1 --certs "$(certs 0)" --route "$1" --cycles "$2" \
        --min-workers "$WORKERS" --wait --json --no-output >"$FOLDER/run" 2>"$FOLDER/run.err" ||
        fail "the run failed: $(tail -n 3 "$FOLDER/run.err" "$FOLDER/run" "$FOLDER"/log-*)"
    sed -n 's/.*"wall_s": *\([0-9.e-]*\).*/\1/p' "$FOLDER/run" | tail -n 1
}

# cycles LINK: starts daemons; seconds of a cycle by route.
cycles() {
    local link=${1:+--link $1} i route few many
    # Without a shell between: what is ended must be the daemon itself.
    ip netns exec $P-0 "$BOLIDE" master --listen 10.77.0.1:7117 --certs "$(certs 0)" --spool "$FOLDER/spool" $link >"$FOLDER/log-0" 2>&1 &
    DAEMONS+=($!)
    for i in $(seq "$WORKERS"); do
        ip netns exec $P-"$i" "$BOLIDE" worker --master 10.77.0.1 --certs "$(certs "$i")" --threads 1 --name host-"$i" $link >"$FOLDER/log-$i" 2>&1 &
        DAEMONS+=($!)
    done
    for _ in $(seq 100); do
        on 0 "$BOLIDE" hosts --master 10.77.0.1 --certs "$(certs 0)" >/dev/null 2>&1 && break
        sleep 0.1
    done
    CYCLE=()
    for route in $ROUTES; do
        few=$(wall "$route" "$FEW") && many=$(wall "$route" "$MANY") || exit 1
        CYCLE+=("$(awk -v a="$few" -v b="$many" -v n=$((MANY - FEW)) 'BEGIN { printf "%.5f", (b - a) / n }')")
    done
    stop_daemons
}

bad=0
# row WHAT KERNEL OURS LIMIT: one line; too far apart is bad.
row() {
    awk -v what="$1" -v k="$2" -v o="$3" -v limit="$4" 'BEGIN {
        d = 100 * (o / k - 1); far = d > limit || d < -limit
        printf "%-34s %10s %10s  %+6.2f %%%s\n", what, k, o, d, far ? "  (limit " limit " %)" : ""
        exit far }' || bad=1
}

printf '%s, %s workers, mutual TLS, cycles %s to %s\n' "$(basename "$DECK")" "$WORKERS" "$FEW" "$MANY"
printf '%-34s %10s %10s\n' '' 'tc tbf' '--link'
for rate in "${RATES[@]}"; do
    tbf "$rate" "$(burst "$rate")"
    kernel=$(goodput "$rate") || exit 1
    cycles ''
    kernel_cycle=("${CYCLE[@]}")
    tbf none
    ours=$(goodput "$rate" "$rate") || exit 1
    cycles "$rate"
    row "$rate, goodput (Mb/s)" "$kernel" "$ours" 3
    i=0
    for route in $ROUTES; do
        row "$rate, cycle, route $route (s)" "${kernel_cycle[i]}" "${CYCLE[i]}" 10
        i=$((i + 1))
    done
done
exit $bad
