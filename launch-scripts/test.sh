#!/usr/bin/env bash
# The whole test command: format, lints, documentation, unit tests, replays through the running nodes, real ROS 2 peers,
# faults. Needs a Rust toolchain; installs the few Debian packages it needs where it may, and says which where it may not.
set -uo pipefail
exec </dev/null
cd "$(dirname "${BASH_SOURCE[0]}")/.."

logs=target/test-logs
mkdir -p "$logs"
started=$SECONDS
failed_steps=()

say() { printf '\n== %s (%d min %02d s)\n' "$*" $(((SECONDS - started) / 60)) $(((SECONDS - started) % 60)); }

step() {
    local what=$1
    shift
    say "$what"
    "$@" || {
        failed_steps+=("$what")
        echo "== FAILED: $what"
    }
}

# Debian packages by the command, or the file, that must be there.
install_missing() {
    local missing=()
    command -v ip >/dev/null || missing+=(iproute2)
    command -v unshare >/dev/null || missing+=(util-linux)
    command -v c++ >/dev/null || missing+=(g++)
    command -v git >/dev/null || missing+=(git)
    python3 -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3 python3-venv)
    python3 -c 'import os, sys, sysconfig; sys.exit(not os.path.exists(sysconfig.get_path("include") + "/Python.h"))' 2>/dev/null ||
        missing+=(python3-dev)
    command -v chromium >/dev/null || command -v google-chrome >/dev/null || missing+=(chromium)
    [ ${#missing[@]} -eq 0 ] && return
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        say "installing ${missing[*]}"
        apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${missing[@]}" >/dev/null && return
    fi
    echo "test.sh: error: these packages are missing: ${missing[*]} (sudo apt-get install ${missing[*]})" >&2
    exit 2
}

command -v cargo >/dev/null || {
    echo "test.sh: error: there is no Rust toolchain: see https://rustup.rs" >&2
    exit 2
}
install_missing

# The ROS 2 peers are mostly waiting for the network: beside the first compilations.
peers_log=$logs/ros2-peers-setup.log
tests/ros2_peers/setup.sh kilted jazzy >"$peers_log" 2>&1 &
peers=$!
trap 'kill "$peers" 2>/dev/null' EXIT

finish_peers() {
    wait "$peers"
    local status=$?
    cat "$peers_log"
    [ "$status" = 0 ] || return "$status"
    ROTARY_SINS_PYTHON=$(grep "/kilted/bin/python$" "$peers_log")
    export ROTARY_SINS_PYTHON ROTARY_SINS_REQUIRE_PEERS=1
}

# Everything that runs is built in release: the tests integrate hours of samples, and it is what a user runs.
run_tests() { cargo test --release --workspace --no-fail-fast 2>&1 | tee "$logs/cargo-test.log"; }

step "format" cargo fmt --all --check
step "lints" cargo clippy --quiet --workspace --all-targets -- -D warnings
step "documentation" env RUSTDOCFLAGS=-Dwarnings cargo doc --quiet --no-deps --workspace
step "executables" cargo build --quiet --release --workspace --bins
step "real ROS 2 peers" finish_peers
step "packages" tests/packages.sh
step "colcon" tests/colcon/setup.sh
step "tests" run_tests

count() { awk -v word="$1" '/^test result:/ { for (i = 2; i <= NF; i++) if ($i ~ "^" word) sum += $(i - 1) } END { print sum + 0 }' "$logs/cargo-test.log"; }
say "end"
grep -hE '^skipped:' "$logs/cargo-test.log" | sort -u
for what in "${failed_steps[@]}"; do
    echo "failed step: $what"
done
echo "$(count passed) passed, $(count failed) failed, $(count ignored) ignored"
[ ${#failed_steps[@]} -eq 0 ]
