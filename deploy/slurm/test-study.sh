#!/bin/sh
# Computes a small study here and once more through the Slurm of this site, and compares the tables. Run it in a folder that all nodes see:
#   BOLIDE=/shared/bolide deploy/slurm/test-study.sh FOLDER [STUDY]
# With CANCEL=1 two tasks of the array are cancelled meanwhile. Without STUDY it is tests/decks/study/grid.toml.
set -eu
here=$(cd "$(dirname "$0")/../.." && pwd)
folder=${1:?a folder that all nodes see}
bolide=${BOLIDE:-bolide}
study=$(realpath "${2:-$here/tests/decks/study/grid.toml}")
mkdir -p "$folder"
cd "$folder"
"$bolide" study "$study" --out here --cache cache-here
"$bolide" study "$study" --out slurm --cache cache-slurm --on slurm &
if [ -n "${CANCEL:-}" ]; then
    until job=$(squeue --noheader --name=bolide-study --format=%A | head -n 1) && [ -n "$job" ]; do sleep 0.2; done
    scancel "${job}_2" "${job}_3" || true
fi
wait $!
cmp here/table.csv slurm/table.csv
echo "the tables are equal"
