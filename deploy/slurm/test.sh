#!/bin/bash
# Runs the job scripts of this folder on a real Slurm: one machine, four virtual nodes of two speeds, a munge and daemons of
# its own in a temporary folder. Every job must give the digest of `bolide run`: an undisturbed one, one whose worker is
# killed, a heterogeneous one, one that is preempted and one that is told to leave before its time limit, which both go on. `study`
# computes a study in arrays, of which two tasks are cancelled: its table must be that of one process.
#
# usage: deploy/slurm/test.sh [undisturbed] [killed] [heterogeneous] [preempted] [signalled] [study]    (the first five without names)
#        Debian: slurmctld slurmd slurm-client munge
#
# environment: BOLIDE  the executable [default: target/release/bolide]
#              CYCLES  length of the jobs to which something is done [default: 20000, which outlast it]; the others have a tenth
#              STUDY   the study [default: tests/decks/study/many.toml, 200 runs]
#              KEEP    any text keeps the folder
#
# exit code: 0 all digests agree; 1 one does not, or something failed; 3 this machine has no Slurm.
set -u
cd "$(dirname "$0")/../.." || exit 1
export BOLIDE
BOLIDE=$(realpath "${BOLIDE:-target/release/bolide}")
CYCLES=${CYCLES:-20000}
DECK=$PWD/tests/decks/plates-small.toml
STUDY=$(realpath "${STUDY:-tests/decks/study/many.toml}")
STUDY_TEST=$PWD/deploy/slurm/test-study.sh
cases=("$@")
[ $# -gt 0 ] || cases=(undisturbed killed heterogeneous preempted signalled)

for program in munged slurmctld slurmd sbatch srun scontrol; do
    if ! PATH=$PATH:/usr/sbin command -v $program >/dev/null; then
        echo "test.sh: no $program on this machine; nothing was run" >&2
        exit 3
    fi
done
PATH=$PATH:/usr/sbin
[ -x "$BOLIDE" ] || { echo "test.sh: no $BOLIDE; build it with: cargo build --release -p master" >&2; exit 1; }

T=$(mktemp -d /tmp/bolide-slurm-XXXXXX) || exit 1
chmod 755 "$T"
daemons=()
clean() {
    local -i i
    scancel --full --user="$USER_NAME" --signal=KILL 2>/dev/null
    # Last started, first ended; munge last.
    for ((i = ${#daemons[@]} - 1; i >= 0; i--)); do
        kill "${daemons[i]}" 2>/dev/null
        wait "${daemons[i]}" 2>/dev/null
    done
    [ -n "${KEEP:-}" ] && echo "kept: $T" || rm -rf "$T"
}
USER_NAME=$(id -un)
trap clean EXIT
trap 'exit 1' INT TERM
fail() {
    for log in "$T"/slurmctld.log "$T"/slurmd.[fs]*.log "$T"/jobs/slurm-*.out; do
        [ -e "$log" ] && tail -n 8 "$log" | sed "s|^|    $(basename "$log"): |" >&2
    done
    echo "test.sh: $*" >&2
    exit 1
}

# First of eight ports in a row that nobody listens on.
port=
for ((first = 21000 + $$ % 20000; first < 60000; first += 8)); do
    busy=
    for ((p = first; p < first + 8; p++)); do
        (exec 3<>"/dev/tcp/127.0.0.1/$p") 2>/dev/null && busy=$p
    done
    [ -z "$busy" ] && port=$first && break
done

mkdir "$T/munge" "$T/state" "$T/jobs"
chmod 755 "$T/munge"
head -c 1024 /dev/urandom >"$T/munge/key"
chmod 600 "$T/munge/key"
munged --foreground --force --key-file="$T/munge/key" --socket="$T/munge/socket" --pid-file="$T/munge/pid" \
    --log-file="$T/munge/munge.log" --seed-file="$T/munge/seed" >"$T/munged.log" 2>&1 &
daemons+=($!)

host=$(uname -n | cut -d. -f1)
cat >"$T/slurm.conf" <<END
ClusterName=bolide
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmUser=$USER_NAME
SlurmdUser=$USER_NAME
AuthType=auth/munge
CredType=cred/munge
# A requeued job waits until the credential of its last start has expired.
AuthInfo=socket=$T/munge/socket,cred_expire=5
StateSaveLocation=$T/state
SlurmdSpoolDir=$T/spool.%n
SlurmctldPidFile=$T/slurmctld.pid
SlurmdPidFile=$T/slurmd.%n.pid
SlurmctldLogFile=$T/slurmctld.log
SlurmdLogFile=$T/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=bf_interval=1,sched_interval=2
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
ReturnToService=2
KillWait=5
InactiveLimit=0
NodeName=fast[1-2] NodeHostName=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 2))] CPUs=1 Feature=fast Weight=2
NodeName=slow[1-2] NodeHostName=$host NodeAddr=127.0.0.1 Port=[$((port + 3))-$((port + 4))] CPUs=1 Feature=slow Weight=1
PartitionName=lab Nodes=ALL Default=YES MaxTime=30 PriorityTier=1 GraceTime=30
PartitionName=urgent Nodes=ALL MaxTime=30 PriorityTier=2
END
export SLURM_CONF=$T/slurm.conf

wait_until() {
    local what=$1 limit=$2
    shift 2
    for ((i = 0; i < limit * 5; i++)); do
        "$@" && return 0
        sleep 0.2
    done
    fail "waited $limit s in vain for $what: $(sinfo -N -h -o '%N %T' 2>&1 | tr '\n' ' ') $(squeue -h -o '%i %T %r' 2>&1 | tr '\n' ' ')"
}
has_socket() { [ -S "$T/munge/socket" ]; }
wait_until "munge" 10 has_socket
slurmctld -D -c >"$T/slurmctld.out.log" 2>&1 &
daemons+=($!)
for node in fast1 fast2 slow1 slow2; do
    slurmd -D -N $node >"$T/slurmd.out.$node.log" 2>&1 &
    daemons+=($!)
done
four_idle() { [ "$(sinfo -N -h -p lab -t idle -o %N 2>/dev/null | wc -l)" = 4 ]; }
wait_until "four idle nodes" 30 four_idle
slurmctld -V
sinfo -N -p lab -o '%.6N %.5T %.4c %.8f %.6w'

digest_in() { grep -oE '"?digest"?:? *"?[0-9a-f]{32}' "$1" | tail -n 1 | grep -oE '[0-9a-f]{32}'; }
digest_of() {
    "$BOLIDE" run "$DECK" --cycles "$1" --no-output --threads 1 --json >"$T/run.json" 2>"$T/run.log" || fail "bolide run failed"
    digest_in "$T/run.json"
}
expected=$(digest_of "$CYCLES")
undisturbed=$(digest_of $((CYCLES / 10)))
echo "bolide run, one process: $expected, a tenth of the cycles: $undisturbed"

export BOLIDE_SPEEDS=fast=2,slow=1
export BOLIDE_JOB=$PWD/deploy/slurm/bolide.sbatch
cd "$T/jobs" || exit 1
# Puts a job into the queue, and its number into $job.
put() { job=$(sbatch --parsable --output="$T/jobs/slurm-%j.out" "$@") || fail "sbatch refused $*"; }
flags=("$DECK" --cycles "$CYCLES" --snapshot-every 1 --keep-every 1)
short=("$DECK" --cycles $((CYCLES / 10)))
spool_of() { echo "$T/jobs/bolide-$1"; }
# Its first checkpoint is there.
runs() { compgen -G "$(spool_of "$1")/spool/queue/job-1.snapshots/*.bolide" >/dev/null && ! is_over "$1"; }
is_over() { scontrol show job "$1" 2>/dev/null | grep -qE 'JobState=(COMPLETED|FAILED|CANCELLED|TIMEOUT|NODE_FAIL)'; }
check() {
    local found expected=${3:-$expected}
    wait_until "the end of job $2" 300 is_over "$2"
    found=$(digest_in "$T/jobs/slurm-$2.out")
    [ "$found" = "$expected" ] || fail "$1: digest '$found', expected $expected"
    echo "$1: $found"
}
# What the summary in the results says.
summary() { python3 -c 'import json, sys; s = json.load(open(sys.argv[1])); print(eval(sys.argv[2]))' \
    "$(spool_of "$1")/spool/job-1/summary.json" "$2"; }

for case in "${cases[@]}"; do
    echo "--- $case"
    case $case in
        undisturbed)
            put "$BOLIDE_JOB" "${short[@]}"
            check undisturbed "$job" "$undisturbed"
            grep -ohE 'worker (fast|slow)[12] joined.*' "$(spool_of "$job")/log/master.log" | sort
            [ "$(grep -cE 'worker fast[12] joined.*speed=2\.0 ' "$(spool_of "$job")/log/master.log")" = 2 ] &&
                [ "$(grep -cE 'worker slow[12] joined.*speed=1\.0 ' "$(spool_of "$job")/log/master.log")" = 2 ] ||
                fail "not two workers of speed 2 and two of speed 1"
            ;;
        killed)
            put "$BOLIDE_JOB" "${flags[@]}"
            wait_until "cycles of job $job" 60 runs "$job"
            step=$(squeue -h -s -j "$job" -o '%i %j' | awk '$2 == "bolide-slow2" { print $1 }')
            [ -n "$step" ] || fail "no step bolide-slow2: $(squeue -h -s -o '%i %j')"
            scancel "$step" || fail "scancel refused $step"
            echo "scancel $step (the worker on slow2)"
            check killed "$job"
            grep 'the worker on slow2 has ended' "$T/jobs/slurm-$job.out" || fail "nobody noticed"
            summary "$job" '", ".join("lost %s at cycle %s" % (l["worker"], l["cycle"]) for l in s["losses"])'
            [ "$(summary "$job" '[l["worker"] for l in s["losses"]]')" = "['slow2']" ] || fail "the loss is not in the summary"
            ;;
        heterogeneous)
            put "$(dirname "$BOLIDE_JOB")/heterogeneous.sbatch" "${short[@]}"
            check heterogeneous "$job" "$undisturbed"
            grep -h 'speed of a core' "$T/jobs/slurm-$job.out"
            ;;
        preempted)
            put "$BOLIDE_JOB" "${flags[@]}"
            wait_until "cycles of job $job" 60 runs "$job"
            preempted=$job
            put --partition=urgent --nodes=4 --ntasks-per-node=1 --wrap 'sleep 3'
            check preempted "$preempted"
            grep -hE 'told to leave|no worker is left|back to the queue|start 2' "$T/jobs/slurm-$preempted.out" || fail "it was not preempted"
            grep -ohE 'the job goes on.*' "$(spool_of "$preempted")/log/master.log" || fail "it did not go on where it was"
            ;;
        signalled)
            put "$BOLIDE_JOB" "${flags[@]}"
            wait_until "cycles of job $job" 60 runs "$job"
            # What --signal=B:TERM@90 does before the time limit.
            scancel --batch --signal=TERM "$job" || fail "scancel refused job $job"
            check signalled "$job"
            grep -hE 'told to leave|back to the queue|start 2' "$T/jobs/slurm-$job.out" || fail "it did not come back"
            grep -ohE 'the job goes on.*' "$(spool_of "$job")/log/master.log" || fail "it did not go on where it was"
            ;;
        study)
            CANCEL=1 "$STUDY_TEST" "$T/study" "$STUDY" >"$T/jobs/slurm-study.out" 2>&1 || fail "the tables differ"
            rows=$(($(wc -l <"$T/study/slurm/table.csv") - 1))
            echo "study: the table of $rows runs in arrays of four nodes, two tasks cancelled, is that of one process"
            ;;
        *) fail "no case $case" ;;
    esac
done
echo "test.sh: ${cases[*]}: digest $expected"
