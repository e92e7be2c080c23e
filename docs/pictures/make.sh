#!/usr/bin/env bash
# Makes run.svg and monitor.svg again, with the executables in target/release. DDS stays in a network of its own.
set -euo pipefail
cd "$(dirname "$0")/../.."
bin=$PWD/target/release
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT

"$bin/rotary-sins" simulate --scheme eight-position --hours 4 --rate 50 --seed 7 --output "$folder/run.mcap"
"$bin/rotary-sins" report "$folder/run.mcap" --figures "$folder/figures"
cp "$folder/figures/sigma.svg" docs/pictures/run.svg

# 2.2 h at 200 times real time, from the start on.
launch-scripts/isolated.sh bash -c '
    "$1/scheme_sequencer" --ros-args -p autostart:=true & sequencer=$!
    "$1/self_calibrator" & calibrator=$!
    "$1/rotary-sins" monitor --picture docs/pictures/monitor.svg > "$2/pages" & monitor=$!
    "$1/imu_simulator" --ros-args -p imu_rate_hz:=20.0 -p speed:=200.0 -p seed:=7 & simulator=$!
    sleep 40
    kill -INT $monitor
    wait $monitor
    kill -INT $simulator $calibrator $sequencer
    wait
' bash "$bin" "$folder"
