#!/bin/bash
# `bolide service` under wine: a worker and a master that the service manager starts and stops, for a master, workers and clients of
# this machine on loopback. The worker computes a job, then leaves another on the way as it is stopped; the master is stopped
# on the way of a third and goes on with it when it is started again: the digests must be those of one process here. What cannot
# start, or fails, must say so.
#
# usage: deploy/windows/service.sh    (after deploy/windows/build.sh and cargo build --release)
#
# environment: BOLIDE  the executable of this machine [default: target/release/bolide]
#              CARGO_TARGET_DIR  where the exe is [default: target]
#              CYCLES  of the jobs that are interrupted [default: 600]
#
# exit code: 0 as it should; 1 not so; 3 something is missing.
set -u
cd "$(dirname "$0")/../.." || exit 1
target=$(realpath "${CARGO_TARGET_DIR:-target}")
here=$(realpath "${BOLIDE:-$target/release/bolide}") || exit 3
exe=$target/x86_64-pc-windows-gnu/release/bolide.exe
[ -f "$exe" ] || { echo "service.sh: no $exe; deploy/windows/build.sh --install" >&2; exit 3; }
[ -x /usr/lib/wine/wine64 ] || { echo "service.sh: no wine (Debian: wine64)" >&2; exit 3; }
wine=$PWD/deploy/windows/wine.sh
deck=$PWD/deck/examples/plates-free-slip.toml
cycles=${CYCLES:-600}
made=$(mktemp -d) || exit 1
# A disk of its own: what starts with that Windows is here alone.
export WINEPREFIX=$made/wine
data=$WINEPREFIX/drive_c/ProgramData/bolide
started=()
end() {
    exec 9>&-
    kill "${started[@]}" 2>/dev/null
    wait
    timeout 60 /usr/lib/wine/wineserver64 -w
    rm -rf "$made"
}
trap end EXIT
cd "$made" || exit 1
fail() {
    echo "service.sh: $*; the ends of the logs:" >&2
    tail -n 3 ./*.log "$data"/*/*.log >&2 2>/dev/null
    exit 1
}
good() { echo "good: $*"; }
there() { timeout 120 "$wine" "$@" </dev/null 2>/dev/null 9>&- | tr -d '\r'; return "${PIPESTATUS[0]}"; }
digest() { grep -oP '"digest": ?"\K[0-9a-f]+' | head -1; }
# state SERVICE: its state and both of its exit codes.
state() { there sc query "$1" | awk '$1 ~ /^(STATE|WIN32_EXIT_CODE|SERVICE_EXIT_CODE)$/ {printf "%s%s", sep, $1 == "STATE" ? $4 : $3; sep = " "}'; }
# until_state SERVICE STATE: waits for it.
until_state() {
    local now
    for _ in $(seq 300); do
        now=$(state "$1")
        [ "$now" = "$2" ] && return
        sleep 0.2
    done
    fail "$1 is $now instead of $2"
}
# until_line FILE PATTERN: waits for what matches, and prints it.
until_line() {
    for _ in $(seq 600); do
        grep -oP -m 1 "$2" "$1" 2>/dev/null && return
        sleep 0.1
    done
    fail "nothing in $1 matches $2"
}
# until_cycle MASTER CYCLE: waits until its job that is under way has computed so much.
until_cycle() {
    local cycle
    for _ in $(seq 1200); do
        cycle=$("$here" jobs --master "$1" --json 2>>jobs.log | grep -oP '"cycle": ?\K[0-9]+(?=, ?"ended": ?null)')
        [ "${cycle:-0}" -ge "$2" ] && return
        sleep 0.1
    done
    fail "the job does not reach cycle $2"
}

# A disk that is new is made with two service managers, which do not know of each other: Windows starts once more.
there cmd /c exit
timeout 60 /usr/lib/wine/wineserver64 -w
# It stays on as long as one program runs that is no service.
mkfifo hold
exec 9<>hold
"$wine" cmd /c "set /p line=" <&9 >/dev/null 2>&1 &
started+=($!)
short=$("$here" run "$deck" --cycles 40 --no-output --json 2>alone.log | digest)
long=$("$here" run "$deck" --cycles "$cycles" --no-output --json 2>>alone.log | digest)
"$here" master --listen 127.0.0.1:0 --spool spool >master.log 2>&1 &
started+=($!)
address=$(until_line master.log 'listening on \K[0-9.:]+') || exit 1

there "$exe" service install worker --master "$address" --threads 1 --hours "Mon-Fri, Sat-Sun" >install.log 2>&1 ||
    fail "it cannot be registered"
cat install.log
there reg query 'HKLM\System\CurrentControlSet\Services\bolide-worker' >kept.log
grep -E 'ImagePath|ObjectName|Start ' kept.log
for kept in '"--hours=Mon-Fri, Sat-Sun"' 'LocalService' 'Start .*0x2'; do
    grep -q -- "$kept" kept.log || fail "the list does not have $kept"
done
there "$exe" service install worker --master "$address" >again.log && fail "a name is taken twice"
there "$exe" service install worker --mastre "$address" >again.log
[ $? = 2 ] || fail "wrong flags are not refused"
[ "$(state bolide-worker)" = "STOPPED 1077 0" ] || fail "it runs before it is started"
there sc start bolide-worker >started.log
until_state bolide-worker "RUNNING 0 0"
good "registered, started: $(state bolide-worker)"

theirs=$("$here" submit "$deck" --master "$address" --cycles 40 --wait --json 2>submit.log | digest)
echo "$short one process of this machine, 40 cycles"
echo "$theirs the service"
[ -n "$short" ] && [ "$short" = "$theirs" ] || fail "the digests differ"

"$here" worker --master "$address" --threads 1 >worker.log 2>&1 &
started+=($!)
until_line worker.log 'joined' >/dev/null || exit 1
"$here" submit "$deck" --master "$address" --min-workers 2 --cycles "$cycles" --wait --json >left 2>>submit.log &
job=$!
until_cycle "$address" 10
there sc stop bolide-worker >stopped.log
good "told to stop: $(state bolide-worker)"
until_state bolide-worker "STOPPED 0 0"
wait $job || fail "the job failed"
echo "$long one process of this machine, $cycles cycles"
echo "$(digest <left) a job that the service left on the way"
[ "$(digest <left)" = "$long" ] || fail "the digests differ"
grep -q '"losses": \?\[\]' left || fail "the worker was lost instead of leaving"
until_line "$data/bolide-worker/bolide-worker.log" 'leaving once the job can stop' || exit 1
there net start bolide-worker >net.log || fail "net start"
until_state bolide-worker "RUNNING 0 0"
there net stop bolide-worker >>net.log || fail "net stop"
until_state bolide-worker "STOPPED 0 0"
there "$exe" service remove bolide-worker || fail "it cannot be removed"
[ -z "$(state bolide-worker)" ] || fail "it is still there"

# Nobody listens at this port of this machine any more.
there "$exe" service install --name w2 worker --master 127.0.0.1:1 --patience 0 >>install.log || fail "it cannot be registered"
there sc start w2 >>started.log
until_state w2 "STOPPED 1066 1"
until_line "$data/w2/w2.log" 'bolide: no master at .*' || exit 1
there "$exe" service remove w2 >removed.log || fail "it cannot be removed"
there "$exe" service remove Spooler >>removed.log && fail "it removes services that are not its own"
there "$exe" service run --name w2 --folder 'C:\' worker --master x >>removed.log && fail "it runs without the manager"
good "errors end a service with their exit code"

port=$((20000 + RANDOM % 10000))
address=127.0.0.1:$port
there "$exe" service install master --listen "$address" --share >>install.log || fail "it cannot be registered"
there sc start bolide-master >>started.log
until_state bolide-master "RUNNING 0 0"
"$here" worker --master "$address" --threads 1 >second.log 2>&1 &
started+=($!)
"$here" submit "$deck" --master "$address" --cycles "$cycles" >>submit.log 2>&1 || fail "the master takes no job"
until_cycle "$address" 20
there sc stop bolide-master >>stopped.log
good "told to stop: $(state bolide-master)"
until_state bolide-master "STOPPED 0 0"
there sc start bolide-master >>started.log
until_state bolide-master "RUNNING 0 0"
"$here" watch --until done --master "$address" >watched.log 2>&1 || fail "the job does not end"
"$here" results 1 --master "$address" --out results >>watched.log 2>&1 || fail "the job has no results"
until_line "$data/bolide-master/bolide-master.log" 'the job is stored .*' || exit 1
until_line "$data/bolide-master/bolide-master.log" 'the job goes on .*' || exit 1
echo "$(digest <results/summary.json) a job of a master that was stopped and started on the way"
[ "$(digest <results/summary.json)" = "$long" ] || fail "the digests differ"
there sc start bolide-master >>started.log
there "$exe" service remove bolide-master || fail "one that runs cannot be removed"
[ -z "$(state bolide-master)" ] || fail "it is still there"
good "a master that is stopped stores its job"
