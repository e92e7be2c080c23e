#!/usr/bin/env bash
# Builds the wheel of the Python package and tests it: stubs against the module, types, pytest, notebooks. One command; it needs a
# Rust toolchain and python3 with venv, and takes the rest from PyPI into target/python. Arguments go to pytest.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "$here"
python=$(./environment.sh)
bin=$(dirname "$python")
target=${CARGO_TARGET_DIR:-$here/../target}
wheels=$target/wheels

rm -rf "$wheels"
VIRTUAL_ENV=$(dirname "$bin") "$bin/maturin" build --quiet --locked --release --interpreter "$python" --out "$wheels"
"$python" -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheels"/*-abi3-*.whl

# What the tests compare with.
if [ -z "${ROTARY_SINS_BIN_DIR:-}" ]; then
    cargo build --quiet --release --workspace --bins
fi

cd "$target"
"$python" -m mypy.stubtest rotary_sins
"$python" -m mypy --strict "$here/rotary_sins"
# The oldest Python that the wheel is for.
"$python" -m mypy --strict --python-version 3.10 "$here/rotary_sins"
exec "$python" -m pytest --quiet --rootdir "$here" -c "$here/pyproject.toml" "$here/tests" "$@"
