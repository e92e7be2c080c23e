#!/usr/bin/env bash
# The whole suite in one command: builds it, starts the four nodes and a recorder, runs four hours of the eight-position
# scheme in accelerated simulated time, and holds the estimates against the truth. Needs a Rust toolchain and nothing else.
#
#   launch-scripts/demo.sh [options of `rotary-sins demo`, e.g. --hours 2 --seed 7]
#
# Exit status: 0 every estimate within 4 sigma and no sample lost; 1 not; 2 it could not run.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
target=${CARGO_TARGET_DIR:-target}
[[ $target == /* ]] || target=$PWD/$target

if ! command -v cargo >/dev/null; then
    echo "demo.sh: cargo is missing; install a Rust toolchain, see https://rustup.rs" >&2
    exit 2
fi
cargo build --release --bins -p rotary_sins || exit 2

arguments=(demo)
if [[ " $* " != *" --output"* ]]; then
    arguments+=(--output "$target/demo")
fi
arguments+=("$@")

# In a network of its own the demo cannot meet other ROS 2 nodes, and nobody meets it.
loopback='ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"'
for flags in -n -rn; do
    if unshare "$flags" bash -c "$loopback" bash true 2>/dev/null; then
        unset ROS_LOCALHOST_ONLY ROS_AUTOMATIC_DISCOVERY_RANGE ROS_DOMAIN_ID
        exec unshare "$flags" bash -c "$loopback" bash "$target/release/rotary-sins" "${arguments[@]}"
    fi
done

export ROS_LOCALHOST_ONLY=1
export ROS_DOMAIN_ID=$((RANDOM % 200 + 1))
echo "demo.sh: a network namespace is not permitted here; this host only, ROS_DOMAIN_ID=$ROS_DOMAIN_ID" >&2
exec "$target/release/rotary-sins" "${arguments[@]}"
