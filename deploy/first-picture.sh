#!/bin/bash
# From nothing to the first picture: types what a newcomer types, times each line, and fails if one way takes too long.
#
# usage: deploy/first-picture.sh [WAY]...     [default: tar wheel]
#        tar      the archive: unpack, run the README's example, draw it
#        wheel    the wheel in a new environment of Python, whose packages pip downloads anew: run the deck of its README, draw it
#        source   this repository: clone, build and run the README's example, draw it; minutes, so no limit holds
#
# environment: DIST  the folder of deploy/release.sh [default: target/dist]
#              MOST  seconds that an archive and a wheel may take [default: 60]
#
# exit code: 0 in time; 1 something failed or took too long; 3 nothing to try in DIST.
set -euo pipefail
cd "$(dirname "$0")/.."
repository=$PWD
dist=$(realpath -m "${DIST:-target/dist}")
most=${MOST:-60}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0

# one FILE...: the first of the files that is there.
one() {
    local file
    for file in "$@"; do [ -f "$file" ] && { echo "$file"; return; }; done
    echo "first-picture.sh: none of $*; deploy/release.sh makes them" >&2
    exit 3
}

# step COMMAND: runs a line as it stands, with nothing but the system's own programs in the way, and prints what it took.
step() {
    local from=$EPOCHREALTIME to
    env -i HOME="$HOME" PATH="$path" LANG=C.UTF-8 PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 bash -c "$1" >"$work/said" 2>&1 || {
        cat "$work/said" >&2
        echo "first-picture.sh: failed: $1" >&2
        exit 1
    }
    to=$EPOCHREALTIME
    seconds=$(awk "BEGIN { print $to - $from }")
    total=$(awk "BEGIN { print $total + $seconds }")
    printf '%8.1f s  %s\n' "$seconds" "$1"
}

# begin NAME: a folder for a way of its own.
begin() {
    total=0
    path=/usr/local/bin:/usr/bin:/bin
    mkdir "$work/$1"
    cd "$work/$1"
}

# end PICTURE LIMIT: there is a picture, in time.
end() {
    [ "$(head -c 8 "$1" | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ] && [ "$(stat -c %s "$1")" -gt 10000 ] || {
        echo "first-picture.sh: $1 is no picture" >&2
        exit 1
    }
    printf '%8.1f s  to the first picture%s\n' "$total" "${2:+, at most $2}"
    if [ -n "$2" ] && awk "BEGIN { exit !($total > $2) }"; then
        echo "first-picture.sh: too long" >&2
        failed=1
    fi
    cd "$repository"
}

from_tar() {
    local archive name
    archive=$(one "$dist"/bolide-*-"$(uname -m)"-linux-static.tar.gz "$dist"/bolide-*-"$(uname -m)"-linux.tar.gz)
    name=$(basename "$archive" .tar.gz)
    begin tar
    cp "$archive" .
    step "tar -xf $name.tar.gz"
    cd "$name"
    step "./bolide run examples/plates-free-slip.toml"
    step "./bolide picture results/plates-free-slip"
    end picture.png "$most"
}

from_wheel() {
    local wheel
    wheel=$(one "$dist"/bolide-*.whl)
    begin wheel
    cp "$wheel" .
    sed -n '/^import bolide as bo/,/^r = d.run/p' "$repository/deploy/python/README.md" >first.py
    echo 'r.picture("picture.png")' >>first.py
    # What `python3` is here, be it of a version manager; nothing else of the user's path is used.
    path=$(dirname "$(python3 -c 'import sys; print(sys.executable)')"):$path
    step "python3 -m venv env"
    step "env/bin/pip install $(basename "$wheel")"
    step "env/bin/python first.py"
    end picture.png "$most"
}

from_source() {
    begin source
    path=$PATH
    step "git clone --quiet $repository bolide"
    cd bolide
    step "cargo run --release -- run deck/examples/plates-free-slip.toml"
    step "target/release/bolide picture results/plates-free-slip"
    end picture.png ""
}

[ $# -gt 0 ] || set -- tar wheel
for way in "$@"; do
    case $way in
    tar | wheel | source)
        echo "$way"
        "from_$way"
        ;;
    *)
        echo "first-picture.sh: no way $way; there are tar, wheel, source" >&2
        exit 2
        ;;
    esac
done
exit $failed
