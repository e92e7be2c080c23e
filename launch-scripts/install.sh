#!/usr/bin/env bash
# Builds the suite and lays it out as an ament prefix: what ros2 run, ros2 launch, ros2 pkg and ros2 interface look for.
#
#   launch-scripts/install.sh [PREFIX]          (default: target/install)
#   . PREFIX/setup.bash                          after ROS 2's own setup; or PREFIX/setup.sh for other shells
#   ros2 launch rotary_sins demo.launch.py
#
# It does not bring the Python and C++ code of rotary_sins_msgs, which only rosidl makes: `ros2 topic echo` of our own messages
# needs `colcon build --packages-select rotary_sins_msgs`. It says so on standard error.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
prefix=${1:-target/install}
# Whoever may write here decides what moves the table.
umask 022
# The list that colcon goes by too.
installed() { sed -n "s/^$1 //p" nodes/rotary_sins/installed.txt; }

command -v cargo >/dev/null || {
    echo "install.sh: cargo is missing; install a Rust toolchain, see https://rustup.rs" >&2
    exit 2
}
cargo build --quiet --release --workspace --bins

mkdir -p "$prefix"
prefix=$(cd "$prefix" && pwd)
target=${CARGO_TARGET_DIR:-target}
share=$prefix/share
index=$share/ament_index/resource_index

install -d "$prefix/lib/rotary_sins" "$share/rotary_sins" "$share/rotary_sins_msgs" \
    "$index/packages" "$index/package_run_dependencies" "$index/rosidl_interfaces"
installed lib | while read -r name; do
    install -m 755 "$target/release/$name" "$prefix/lib/rotary_sins/$name"
done

# The package of nodes, launch files and parameters.
install -m 644 nodes/rotary_sins/package.xml "$share/rotary_sins/package.xml"
installed share | while read -r folder; do
    rm -rf "${share:?}/rotary_sins/$folder"
    cp -R "launch-scripts/$folder" "$share/rotary_sins/$folder"
done

# The package of messages, for ros2 interface show. Python and C++ get theirs by building msgs/ with colcon.
install -m 644 msgs/package.xml "$share/rotary_sins_msgs/package.xml"
interfaces=$(cd msgs && find . -regex '\./\(msg/.*\.msg\|srv/.*\.srv\|action/.*\.action\)' -printf '%P\n' | sort)
while read -r file; do
    install -D -m 644 "msgs/$file" "$share/rotary_sins_msgs/$file"
done <<<"$interfaces"
echo "$interfaces" >"$index/rosidl_interfaces/rotary_sins_msgs"

for package in rotary_sins rotary_sins_msgs; do
    : >"$index/packages/$package"
    sed -n 's#.*<\(exec_depend\|depend\)>\(.*\)</.*#\2#p' "$share/$package/package.xml" | paste -sd ';' - |
        tr -d '\n' >"$index/package_run_dependencies/$package"
done

# As colcon marks what it installs: nothing in here is built again, where the prefix stands within a workspace.
: >"$prefix/COLCON_IGNORE"

# What a shell needs to find it. No other setup of this prefix is called, so it may stand beside or above others.
for name in setup.sh setup.bash local_setup.sh local_setup.bash; do
    cat >"$prefix/$name" <<SETUP
# Puts $prefix before what is there. Source ROS 2's own setup first.
case ":\${AMENT_PREFIX_PATH:-}:" in
*":$prefix:"*) ;;
*) export AMENT_PREFIX_PATH="$prefix\${AMENT_PREFIX_PATH:+:\$AMENT_PREFIX_PATH}" ;;
esac
case ":\${PATH:-}:" in
*":$prefix/lib/rotary_sins:"*) ;;
*) export PATH="$prefix/lib/rotary_sins\${PATH:+:\$PATH}" ;;
esac
SETUP
done
echo "install.sh: not here: Python and C++ of rotary_sins_msgs (ros2 topic echo of its messages, PlotJuggler); build msgs/ with" \
    "colcon for them" >&2
echo "$prefix"
