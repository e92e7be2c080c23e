#!/usr/bin/env bash
# The whole test command: format, lints, documentation, unit tests, replays through the running nodes, real ROS 2 peers,
# faults. Needs a Rust toolchain; installs the few Debian packages it needs where it may, and says which where it may not.
#
# Two cores are busy from the first minute to the last: while they compile, the peers come over the network; while the tests run,
# which mostly wait for each other's messages, lints and documentation take the time that is left over.
#
# cargo-nextest runs the tests where it is installed. It is not installed for the purpose, because building it (some 400 crates)
# takes as long as building the suite; `cargo test` gives the same results, one executable after the other.
set -uo pipefail
exec </dev/null
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit

target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
logs=$target/test-logs
rm -rf "$logs"
mkdir -p "$logs"
export ROTARY_SINS_SKIPPED=$logs/skipped
# What a step does twice, cargo need not: the next run compiles little anyway, and this one nothing that changes.
export CARGO_INCREMENTAL=0
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

# The ROS 2 peers and colcon are mostly waiting for the network: beside the compilation.
begin() {
    local name=$1
    shift
    "$@" >"$logs/$name.log" 2>&1 &
    background[$name]=$!
}
# Waits for what was begun, and shows what it said.
finish() {
    local status=0
    wait "${background[$1]}" || status=$?
    unset "background[$1]"
    cat "$logs/$1.log"
    return "$status"
}
declare -A background=()
trap '[ ${#background[@]} -eq 0 ] || kill "${background[@]}" 2>/dev/null' EXIT

set_up_peers() { tests/ros2_peers/setup.sh kilted jazzy && tests/colcon/setup.sh && python/environment.sh; }

# Everything that runs is built in release: the tests integrate hours of samples, and it is what a user runs.
# The examples are what the tests of ros_node start.
build() { cargo build --quiet --release --workspace --lib --bins --tests --examples; }

# Without the lowest priority they would slow down the tests that they run beside.
check_sources() {
    nice -n 19 cargo clippy --quiet --workspace --all-targets -- -D warnings &&
        RUSTDOCFLAGS=-Dwarnings nice -n 19 cargo doc --quiet --no-deps --workspace
}

run_tests() {
    # Copies, because the tests of colcon and of install.sh build the executables anew while other tests run them.
    export ROTARY_SINS_BIN_DIR=$target/test-bin
    rm -rf "$ROTARY_SINS_BIN_DIR" && mkdir "$ROTARY_SINS_BIN_DIR" &&
        cp -p "$target"/release/{rotary-sins,imu_simulator,scheme_sequencer,self_calibrator,navigation_compensator} "$ROTARY_SINS_BIN_DIR" ||
        return
    if cargo nextest --version >/dev/null 2>&1; then
        # Most tests wait for messages or for a peer: twice as many as cores.
        cargo nextest run --release --workspace --lib --bins --tests --test-threads $((2 * $(nproc)))
        local status=$?
        cp "$target/nextest/default/junit.xml" "$logs/junit.xml"
        return "$status"
    fi
    # The runner lets the test executables, and nothing else, have the option that tells the time of each test.
    cargo test --release --workspace --lib --bins --tests --no-fail-fast \
        --config 'target."cfg(all())".runner = ["env", "RUSTC_BOOTSTRAP=1"]' -- \
        -Z unstable-options --report-time 2>&1 | tee "$logs/cargo-test.log"
}

# The wheel, its stubs, its tests and notebooks, against the executables that the tests have run.
test_python() { ROTARY_SINS_BIN_DIR=$target/test-bin python/test.sh 2>&1 | tee "$logs/python.log"; }

run_documentation_tests() { cargo test --quiet --release --workspace --doc -- --format pretty 2>&1 | tee "$logs/doc-test.log"; }

begin peers set_up_peers
step "format" cargo fmt --all --check
step "build" build
step "ROS 2 peers and colcon" finish peers
begin lints check_sources
step "tests" run_tests
step "Python package" test_python
step "tests of the documentation" run_documentation_tests
step "lints and documentation" finish lints
step "packages" tests/packages.sh
step "dependencies" tests/dependencies.sh

say "end"
others=0
for what in "${failed_steps[@]}"; do
    echo "failed step: $what"
    # Failed tests are counted one by one.
    [[ $what == tests* ]] || others=$((others + 1))
done
python3 tests/results.py "$logs/junit.xml" "$logs/cargo-test.log" "$logs/doc-test.log" --skipped "$ROTARY_SINS_SKIPPED" \
    --failed-steps $others && [ ${#failed_steps[@]} -eq 0 ]
