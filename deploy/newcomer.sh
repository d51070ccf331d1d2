#!/bin/bash
# Executes the newcomer's transcript of deploy/README.md as it is written: two bare PCs (network namespaces) to a running
# cluster with mutual TLS, and a job whose digest is that of `bolide run`. Compares what the lines print with the transcript,
# except for times, tokens, ports, threads and lanes.
#
# usage: deploy/newcomer.sh [--update]                            (as root)
#        --update replaces the transcript by what the lines print
#
# environment: BOLIDE  the executable [default: target/release/bolide]
#              DECK    the deck that the transcript calls plates.toml [default: tests/decks/plates-small.toml]
#
# exit code: 0 every line did and printed what is written; 1 one did not; 3 this machine cannot do it (no root, no namespaces).

set -u
cd "$(dirname "$0")/.." || exit 1
BOLIDE=$(realpath "${BOLIDE:-target/release/bolide}")
DECK=$(realpath "${DECK:-tests/decks/plates-small.toml}")
README=deploy/README.md
UPDATE=no
case ${1:-} in
"") ;;
--update) UPDATE=yes ;;
*)
    echo "newcomer.sh: read $1, expected --update or nothing" >&2
    exit 2
    ;;
esac

cannot() {
    echo "newcomer.sh: $*; nothing was run" >&2
    exit 3
}
fail() {
    echo "newcomer.sh: $*" >&2
    [ -z "${FOLDER:-}" ] || tail -n 5 "$FOLDER"/*.log >&2
    exit 1
}

[ -x "$BOLIDE" ] || fail "no $BOLIDE; build it with: cargo build --release -p master"
[ "$(id -u)" = 0 ] || cannot "network namespaces need root"
command -v ip >/dev/null || cannot "no ip on this machine (package iproute2)"

P=newcomer$$ # prefix of the namespaces
FOLDER=$(mktemp -d) || fail "no temporary folder"
DAEMONS=()
clean() {
    [ ${#DAEMONS[@]} -eq 0 ] || kill "${DAEMONS[@]}" 2>/dev/null
    [ ${#DAEMONS[@]} -eq 0 ] || wait "${DAEMONS[@]}" 2>/dev/null
    ip netns del "$P-pc1" 2>/dev/null
    ip netns del "$P-pc2" 2>/dev/null
    rm -rf "$FOLDER"
}
trap clean EXIT

ip netns add "$P-pc1" 2>/dev/null && ip netns add "$P-pc2" || cannot "no network namespaces here"
ip link add "n1-$$" netns "$P-pc1" type veth peer name "n2-$$" netns "$P-pc2" || cannot "no veth pairs here"
for pc in 1 2; do
    ip -n "$P-pc$pc" link set lo up
    ip -n "$P-pc$pc" addr add "10.77.0.$pc/24" dev "n$pc-$$"
    ip -n "$P-pc$pc" link set "n$pc-$$" up
    mkdir -p "$FOLDER/pc$pc/bin"
    ln -s "$BOLIDE" "$FOLDER/pc$pc/bin/bolide"
done
cp "$DECK" "$FOLDER/pc1/plates.toml"

mapfile -t LINES < <(sed -n '/^<!-- deploy\/newcomer.sh runs/,/^pc1\$ bolide submit/p' "$README" | grep -E '^pc[12]\$ ')
[ ${#LINES[@]} -eq 6 ] || fail "$README has ${#LINES[@]} lines with a prompt, expected 6"

# What this script prints, as the transcript holds it.
PRINTED=$FOLDER/printed
say() {
    echo "$1" | tee -a "$PRINTED"
}
quote() {
    sed 's/^/    /; s/ *$//' "$1" | tee -a "$PRINTED"
}
# Standard input without what differs from run to run or from machine to machine.
without_chance() {
    sed -E -e 's/bolide-[0-9a-f]{32}-[0-9a-f]{32}/TOKEN/g' \
        -e 's/^    [0-9-]+T[0-9:.]+Z +/    TIME /' \
        -e 's/10\.77\.0\.2:[0-9]+ announced=[0-9]+/10.77.0.2:PORT announced=PORT/' \
        -e 's/incarnation=[0-9]+/incarnation=N/' \
        -e 's/in [0-9.]+ s on 1 worker with [0-9]+ threads?/in SECONDS on 1 worker/' \
        -e 's/^( *origin +bolide [0-9.]+), .*/\1/' \
        -e '/^    job 1 running( .*)?$/d'
}

for line in "${LINES[@]}"; do
    pc=${line%%\$ *}
    words=${line#*\$ }
    if [[ $words == *TOKEN* ]]; then
        printed=$(sed -n 's/^a new PC joins with: //p' "$FOLDER/pc1.log")
        [ "${printed%--join *}--join TOKEN" = "${words% &}" ] || fail "the master printed: $printed; written is: $words"
        words="$printed &"
    fi
    say "$pc\$ $words"
    run=(ip netns exec "$P-$pc" env -C "$FOLDER/$pc" "PATH=$FOLDER/$pc/bin" BOLIDE_LOG=info)
    if [[ $words == *" &" ]]; then
        read -ra command <<<"${words% &}"
        "${run[@]}" "${command[@]}" >"$FOLDER/$pc.log" 2>&1 &
        DAEMONS+=($!)
        for _ in $(seq 100); do
            grep -qE 'new PC joins with|joined 10' "$FOLDER/$pc.log" && break
            kill -0 "${DAEMONS[-1]}" 2>/dev/null || fail "it ended: $words"
            sleep 0.1
        done
        quote "$FOLDER/$pc.log"
    else
        read -ra command <<<"$words"
        "${run[@]}" "${command[@]}" >"$FOLDER/line.log" 2>&1 || fail "it failed: $words: $(cat "$FOLDER/line.log")"
        quote "$FOLDER/line.log"
    fi
done
found=$(grep -oE 'digest +[0-9a-f]{32}' "$FOLDER/line.log" | grep -oE '[0-9a-f]{32}')
expected=$("$BOLIDE" run "$DECK" --cycles 40 --no-output --json | grep -oE '"digest": *"[0-9a-f]{32}' | grep -oE '[0-9a-f]{32}')
[ -n "$found" ] && [ "$found" = "$expected" ] || fail "digest '$found' over two PCs, '$expected' in one process"
say "newcomer.sh: six lines as written, digest $found as in one process"

# The transcript is what stands between this line of the document and the end of its block.
COMMAND='$ cargo build --release -p master && deploy/newcomer.sh'
if [ $UPDATE = yes ]; then
    awk -v command="$COMMAND" -v printed="$PRINTED" '
        within && /^```$/ { within = 0 }
        !within { print }
        $0 == command { within = 1; while ((getline line < printed) > 0) print line }' "$README" >"$FOLDER/updated" &&
        cat "$FOLDER/updated" >"$README"
    exit
fi
awk -v command="$COMMAND" 'within && /^```$/ { exit } within { print } $0 == command { within = 1 }' "$README" |
    without_chance >"$FOLDER/written"
without_chance <"$PRINTED" >"$FOLDER/found"
diff -u --label "$README" --label "what the lines print" "$FOLDER/written" "$FOLDER/found" >&2 ||
    fail "the transcript in $README is not what the lines print; see above, and run deploy/newcomer.sh --update"
