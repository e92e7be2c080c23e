#!/usr/bin/env bash
# Sets up colcon for the tests, from PyPI, in a virtual environment of its own: target/colcon. Does nothing where it is there and
# nothing has changed.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
prefix=${ROTARY_SINS_COLCON:-$here/../../target/colcon}

mkdir -p "$prefix"
prefix=$(cd "$prefix" && pwd)
key="$prefix $(python3 --version) $(sha256sum <"$here/requirements.txt")"
if [ "$(cat "$prefix/.packages" 2>/dev/null)" != "$key" ]; then
    echo "colcon: installing colcon from PyPI into $prefix" >&2
    rm -rf "$prefix"
    python3 -m venv "$prefix"
    if ! "$prefix/bin/python" -m pip install --no-input --quiet --disable-pip-version-check -r "$here/requirements.txt" \
        >"$prefix/install.log" 2>&1; then
        tail -n 25 "$prefix/install.log" >&2
        echo "colcon: error: installing the packages failed" >&2
        exit 1
    fi
    echo "$key" >"$prefix/.packages"
fi
echo "$prefix/bin/colcon"
