#!/usr/bin/env bash
# Sets up the virtual environment of the tests of the Python package, from PyPI: target/python. Does nothing where it is there
# and nothing has changed. Prints the path of its python.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
prefix=${ROTARY_SINS_PYTHON:-$here/../target/python}

mkdir -p "$prefix"
prefix=$(cd "$prefix" && pwd)
python=$(command -v python3) || {
    echo "python: error: there is no python3 (Debian: apt-get install python3 python3-venv)" >&2
    exit 1
}
key="$prefix $("$python" --version) $(sha256sum <"$here/requirements.txt")"
if [ "$(cat "$prefix/.packages" 2>/dev/null)" != "$key" ]; then
    echo "python: installing what the tests need from PyPI into $prefix" >&2
    rm -rf "$prefix"
    "$python" -m venv "$prefix"
    if ! "$prefix/bin/python" -m pip install --no-input --quiet --disable-pip-version-check -r "$here/requirements.txt" \
        >"$prefix/install.log" 2>&1; then
        tail -n 25 "$prefix/install.log" >&2
        echo "python: error: installing the packages failed" >&2
        exit 1
    fi
    echo "$key" >"$prefix/.packages"
fi
echo "$prefix/bin/python"
