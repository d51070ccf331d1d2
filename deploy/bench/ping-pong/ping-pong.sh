#!/usr/bin/env bash
# Ping-pong of Bolide's frames beside OpenMPI over TCP and PVM: installs or checks what it needs, builds, runs all
# of them in turn, and prints one table for each placement.
#
#   ping-pong.sh [--rounds N] [--bolide FILE] [--json FILE]
#
# Placements: "apart", the two processes pinned to two processors; "together", both to the first of them.
# As root it installs missing Debian packages, then measures as "nobody", because pvmd refuses root.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
rounds=7 bolide= json=
usage() { sed -n '5s/^# *//p' "$0" >&2; exit 2; }
while [ $# -gt 0 ]; do
    [ $# -ge 2 ] || usage
    case $1 in
        --rounds) rounds=$2 ;;
        --bolide) bolide=$(realpath "$2") ;;
        --json) json=$(realpath "$2") ;;
        --work) work=$2 ;; # only from the first half of this script
        *) usage ;;
    esac
    shift 2
done
case $rounds in '' | *[!0-9]* | 0) echo "ping-pong: --rounds $rounds, expected a number from 1" >&2; exit 2 ;; esac

need() {
    local missing=()
    command -v mpicc mpirun > /dev/null || missing+=(openmpi-bin libopenmpi-dev)
    [ -x /usr/lib/pvm3/lib/pvmd ] || missing+=(pvm)
    [ -e /usr/include/pvm3.h ] || missing+=(pvm-dev)
    command -v cc > /dev/null || missing+=(gcc libc6-dev)
    [ ${#missing[@]} -gt 0 ] || return 0
    if [ "$(id -u)" != 0 ]; then
        echo "ping-pong: missing; install with: apt-get install ${missing[*]}" >&2
        exit 1
    fi
    DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}" >&2
}

build() {
    if [ -z "$bolide" ]; then
        (cd "$here/../../.." && cargo build --release -p master --bin bolide) >&2
        bolide=${CARGO_TARGET_DIR:-$here/../../../target}/release/bolide
    fi
    cp "$bolide" "$work/bolide"
    mpicc -O2 -Wall -Werror -o "$work/mpi" "$here/mpi.c"
    cc -O2 -Wall -Werror -o "$work/pvm" "$here/pvm.c" -lpvm3
    "$work/bolide" certs ca "$work/certs" > /dev/null
    "$work/bolide" certs host "$work/certs" pc --role master > /dev/null
    cp "$here/ping-pong.sh" "$work/"
}

# First half: with the rights of whoever called. It ends by calling the second.
if [ -z "${work:-}" ]; then
    need
    work=$(mktemp -d /tmp/ping-pong.XXXXXX)
    trap 'rm -rf "$work"' EXIT
    build
    as=()
    if [ "$(id -u)" = 0 ]; then
        chown -R nobody "$work"
        as=(setpriv --reuid=nobody --regid=nogroup --clear-groups)
    fi
    "${as[@]}" bash "$work/ping-pong.sh" --rounds "$rounds" --work "$work"
    [ -z "$json" ] || cp "$work/result.json" "$json"
    exit
fi

cd "$work"
export HOME=$work PVM_ROOT=/usr/lib/pvm3 PVM_ARCH=LINUX64 PVM_TMP=$work PVM_VMID=ping-pong TMPDIR=$work
PATH=$PATH:/usr/lib/pvm3/lib
mapfile -t processors < <(awk '/^Cpus_allowed_list/ { n = split($2, a, ","); for (i = 1; i <= n; i++) {
    split(a[i], r, "-"); for (j = r[1]; j <= (r[2] == "" ? r[1] : r[2]); j++) print j } }' /proc/self/status)
if [ "${#processors[@]}" -lt 2 ]; then
    echo "ping-pong: 1 processor, expected 2 for the placement \"apart\"" >&2
    exit 1
fi

# run PROGRAM NEAR FAR: prints "bytes half-round-trip-in-us" lines; NEAR and FAR are processors.
run() {
    local far
    case $1 in
        openmpi)
            timeout 300 mpirun --mca btl tcp,self --mca btl_tcp_if_include lo --mca pml ob1 \
                --mca mpi_yield_when_idle 1 --bind-to none --oversubscribe \
                -np 1 taskset -c "$2" ./mpi : -np 1 taskset -c "$3" ./mpi
            ;;
        pvm-default | pvm-direct)
            timeout 300 taskset -c "$3" ./pvm "${1#pvm-}" far &
            far=$!
            timeout 300 taskset -c "$2" ./pvm "${1#pvm-}" near
            wait "$far"
            ;;
        bolide | bolide-tls | bolide-memory)
            local certs=() stay=(--no-shared-memory)
            [ "$1" != bolide-tls ] || certs=(--certs certs/pc)
            [ "$1" != bolide-memory ] || stay=()
            : > far.txt
            timeout 300 taskset -c "$3" ./bolide bench messages --listen 127.0.0.1:0 "${certs[@]}" > far.txt &
            far=$!
            until grep -q listening far.txt; do
                kill -0 "$far" || return 1
                sleep 0.01
            done
            timeout 300 taskset -c "$2" ./bolide bench messages --rounds 1 "${certs[@]}" "${stay[@]}" \
                --to "$(sed 's/listening on //' far.txt)" | awk '$2 == "frame" { print $1, $4 }'
            wait "$far"
            ;;
    esac
}

pvmd -n127.0.0.1 > pvmd.txt 2>&1 &
pvmd=$!
trap 'kill "$pvmd" 2> /dev/null || true; wait "$pvmd" 2> /dev/null || true' EXIT
until [ -e "pvmd.$(id -u).$PVM_VMID" ]; do
    kill -0 "$pvmd" || { cat pvmd.txt >&2; exit 1; }
    sleep 0.05
done

programs=(openmpi pvm-default pvm-direct bolide bolide-tls bolide-memory)
for round in $(seq "$rounds"); do
    for placement in apart together; do
        near=${processors[0]}
        [ $placement = apart ] && far=${processors[1]} || far=$near
        for program in "${programs[@]}"; do
            run "$program" "$near" "$far" | sed "s/^/$placement $program $round /" >> lines.txt
        done
    done
    echo "round $round of $rounds done, load $(cut -d' ' -f1-3 /proc/loadavg)" >&2
done

# lines.txt: placement, program, round, bytes, us. The median of an even number of rounds is the upper of the two.
sort -k1,1 -k2,2 -k4,4n -k5,5n lines.txt | awk '
    function flush() { if (n) print place, program, bytes, v[int(n / 2) + 1], v[1], v[n]; n = 0 }
    { if ($1 != place || $2 != program || $4 != bytes) flush(); place = $1; program = $2; bytes = $4; v[++n] = $5 }
    END { flush() }' > medians.txt

awk -v rounds="$rounds" -v programs="${programs[*]}" '
    { us[$1, $2, $3] = $4; if (!($3 in seen)) { seen[$3]; size[++sizes] = $3 } }
    END {
        n = split(programs, p, " ")
        for (i = 1; i <= sizes; i++) for (j = i + 1; j <= sizes; j++)
            if (size[j] + 0 < size[i] + 0) { t = size[i]; size[i] = size[j]; size[j] = t }
        split("apart together", places, " ")
        for (k = 1; k <= 2; k++) {
            place = places[k]
            printf "\n%s: half a round trip in us, and MB/s; medians of %d rounds\n%9s", place, rounds, "bytes"
            for (j = 1; j <= n; j++) printf "  %18s", p[j]
            printf "  %11s  %11s\n", "rate/MPI", "rate/PVM"
            for (i = 1; i <= sizes; i++) {
                printf "%9d", size[i]
                for (j = 1; j <= n; j++) {
                    t = us[place, p[j], size[i]]
                    printf "  %9.1f %8.0f", t, size[i] / t
                }
                pvm = us[place, "pvm-direct", size[i]]
                if (us[place, "pvm-default", size[i]] < pvm) pvm = us[place, "pvm-default", size[i]]
                own = us[place, "bolide", size[i]]
                printf "  %11.2f  %11.2f\n", us[place, "openmpi", size[i]] / own, pvm / own
            }
        }
        print "\nrate/MPI, rate/PVM: of bolide over TCP without TLS, by OpenMPI and by the better of the two routes of PVM"
    }' medians.txt

awk -v rounds="$rounds" '
    BEGIN { printf "{\"rounds\": %d, \"rows\": [", rounds }
    { printf "%s\n{\"placement\": \"%s\", \"program\": \"%s\", \"bytes\": %d, \"half_round_trip_us\": %s, \"least_us\": %s, \"most_us\": %s, \"mb_per_s\": %.1f}",
        (NR > 1 ? "," : ""), $1, $2, $3, $4, $5, $6, $3 / $4 }
    END { print "\n]}" }' medians.txt > result.json
