#!/usr/bin/env bash
# Two hosts on a wire that carries no multicast, in network namespaces:
#
#   two_hosts.sh NODE COMMAND...
#
# runs the node on the other host (10.77.0.2; its peers are in NODE_PEERS) and the command on this one (10.77.0.1).
set -euo pipefail

node=$1
shift
unshare -n sleep infinity &
other=$!
trap 'kill "$other" 2>/dev/null' EXIT
until [ "$(readlink /proc/$other/ns/net)" != "$(readlink /proc/self/ns/net)" ]; do sleep 0.05; done
ip link add here type veth peer name there netns "$other"
ip link set lo up
ip address add 10.77.0.1/24 dev here
ip link set here up multicast off
nsenter -t "$other" -n bash -c 'ip link set lo up; ip address add 10.77.0.2/24 dev there; ip link set there up multicast off'
ROS_STATIC_PEERS=$NODE_PEERS nsenter -t "$other" -n "$node" &
running=$!
trap 'kill -INT "$running" 2>/dev/null; wait "$running" 2>/dev/null; kill "$other" 2>/dev/null' EXIT
"$@"
