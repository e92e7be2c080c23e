#!/usr/bin/env bash
# Packages the crates that others may use, and builds what is in the packages, examples too, as somebody would who has nothing else of this
# repository. Needs no network.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

crates=(stream_monitor rotary_sins_files ros2_interfaces ros_node)
target=${CARGO_TARGET_DIR:-$PWD/target}
# Outside of the repository: within it, cargo would take the packages for members of the workspace.
unpacked=$(mktemp -d)
trap 'rm -rf "$unpacked"' EXIT
options=()
for crate in "${crates[@]}"; do
    options+=(-p "$crate")
done
cargo package --quiet --offline --no-verify --allow-dirty "${options[@]}" 

patches=()
for crate in "${crates[@]}"; do
    package=$(ls "$target/package/$crate"-*.crate)
    tar -xzf "$package" -C "$unpacked"
    folder=$unpacked/$(basename "$package" .crate)
    patches+=(--config "patch.crates-io.$crate.path='$folder'")
    for file in README.md LICENSE-APACHE LICENSE-MIT; do
        [[ $crate = @(stream_monitor|rotary_sins_files) ]] || [ -f "$folder/$file" ] || {
            echo "packages.sh: error: $folder has no $file" >&2
            exit 1
        }
    done
done
# The dependencies as they are locked here: what was fetched for the workspace is enough.
for crate in ros2_interfaces ros_node; do
    folder=$(echo "$unpacked/$crate"-*)
    cp Cargo.lock "$folder/Cargo.lock"
    (cd "$folder" && cargo check --quiet --release --offline --examples --target-dir "$target" "${patches[@]}")
    echo "$crate: packaged, and its package builds"
done
