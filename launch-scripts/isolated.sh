#!/usr/bin/env bash
# Runs a command in a network namespace that has a loopback and nothing else, multicast on it for DDS discovery.
[ $# -gt 0 ] || {
    echo "usage: isolated.sh COMMAND [ARGUMENT...]" >&2
    exit 2
}
enter='ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"'
map=()
[ "$(id -u)" = 0 ] || map=(--map-root-user)
exec unshare --net "${map[@]}" bash -c "$enter" bash "$@"
