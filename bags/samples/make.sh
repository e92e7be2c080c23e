#!/usr/bin/env bash
# Makes the bags of this folder again, bit for bit, with what is true of each beside it.
#
#   bags/samples/make.sh [FOLDER]        (default: this folder; what is there is replaced)
#
# Two samples of the IMU a second instead of a hundred, so that four hours fit into 4 MB. At rest that costs nothing, because a sample
# is the mean of its interval and the noise is given by its density; in a rotation one sample covers 2.5 deg, which is why the
# sigmas, but not every use of a bag, are those of 100 Hz.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
folder=${1:-$here}
tool=${ROTARY_SINS_BIN_DIR:-$here/../../target/release}/rotary-sins
[ -x "$tool" ] || {
    echo "make.sh: error: there is no $tool: run cargo build --release first" >&2
    exit 2
}
tool=$(cd "$(dirname "$tool")" && pwd)/rotary-sins

# A name, then options of `rotary-sins simulate`.
make() {
    local name=$1
    shift
    rm -rf "$name"
    "$tool" simulate "$@" --rate 2 --joint-state-rate 1 --output "$name" --json >"$name.truth.json"
}

mkdir -p "$folder"
cd "$folder"
make eight_position --scheme eight-position --hours 4 --seed 1
make paper_experiment --scheme paper-experiment --hours 4 --seed 2
make elsewhere --scheme eight-position --hours 2 --seed 3 --latitude-deg -33.9 --longitude-deg 18.4 \
    --heading-deg 214 --roll-deg 1.5 --pitch-deg -0.8 \
    --gyroscope-drift-deg-per-hour 0.02,-0.015,0.008 --accelerometer-bias-ug 60,-80,120
# A good ring laser on a table of its grade, with everything that either has wrong.
make real_sensor --scheme eight-position --hours 2 --seed 6 --sensor ring-laser
# A ship that rolls at her mooring, with an antenna that is good to 0.3 m.
make moored_sea --scheme eight-position --hours 1.5 --seed 7 --latitude-deg 57.7 --longitude-deg 11.9 --heading-deg 75 \
    --sea-significant-height-m 0.3 --sea-peak-period-s 6 --position-noise-m 0.3
# As a recorder leaves it that loses its power: the end is missing, and with it the index.
make cut_off --scheme eight-position --hours 0.5 --seed 4
truncate --size 300000 cut_off/cut_off_0.mcap
# As a bad disk leaves it: four bytes are others in the second of its chunks.
make damaged_chunk --scheme eight-position --hours 0.5 --seed 5
printf '\xff\x00\xff\x00' | dd of=damaged_chunk/damaged_chunk_0.mcap bs=1 seek=240000 conv=notrunc status=none
