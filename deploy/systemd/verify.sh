#!/bin/bash
# Checks the units of this folder as systemd reads them, and prints how much each leaves open.
#
# usage: deploy/systemd/verify.sh
#
# environment: BOLIDE  the executable that the units are to find [default: target/release/bolide]
#
# exit code: 0 no remark; 1 a remark; 3 this machine has no systemd-analyze (Debian: systemd).
set -u
cd "$(dirname "$0")/../.." || exit 1
if ! command -v systemd-analyze >/dev/null; then
    echo "verify.sh: no systemd-analyze on this machine; nothing was checked" >&2
    exit 3
fi
BOLIDE=$(realpath "${BOLIDE:-target/release/bolide}")
[ -x "$BOLIDE" ] || { echo "verify.sh: no $BOLIDE" >&2; exit 1; }
root=$(mktemp -d) || exit 1
trap 'rm -rf "$root"' EXIT
# The units name /usr/bin/bolide, which this machine need not have: the copies name the executable.
for unit in deploy/systemd/*.service; do
    sed "s|/usr/bin/bolide|$BOLIDE|" "$unit" >"$root/$(basename "$unit")"
done
said=$(systemd-analyze verify --man=no "$root/bolide-master.service" "$root/bolide-worker@pc2.service" 2>&1)
code=$?
# Of this machine's own units systemd-analyze speaks too.
said=$(grep bolide <<<"$said")
if [ $code -ne 0 ] || [ -n "$said" ]; then
    echo "$said" >&2
    echo "verify.sh: systemd-analyze verify has remarks (exit code $code)" >&2
    exit 1
fi
echo "systemd-analyze verify: no remark on bolide-master.service and bolide-worker@.service"
# By hand, as --offline judges files.
for unit in bolide-master.service bolide-worker@.service; do
    systemd-analyze security --offline=true --threshold=30 --no-pager "$root/$unit" | tail -n 1 || exit 1
done
