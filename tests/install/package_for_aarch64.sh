#!/usr/bin/env bash
# package_for_aarch64.sh BF SOURCE BUILD: builds BlockFactory for aarch64, deploys the balancing iCub for it and runs the
# package on QEMU; it computes what `bf run` does here but for rounding. So does a plugin that somebody else builds
# for aarch64.
set -euo pipefail
bf=$1 source=$2 build=$3
unset BLOCKFACTORY_PLUGIN_PATH MAKEFLAGS
if ! command -v aarch64-linux-gnu-g++ >/dev/null || ! command -v qemu-aarch64 >/dev/null; then
    echo "package_for_aarch64.sh needs g++-aarch64-linux-gnu and qemu-user, which 'scripts/deps test' installs"
    exit 1
fi
"$source/scripts/deps-aarch64"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
make -C "$source" BUILD="$build" aarch64 >build.log 2>&1 || { tail -n 50 build.log; exit 1; }

if aarch64-linux-gnu-objdump -d "$build/aarch64/lib/libbf_blocks.a" | grep -wE 'fn?m(add|sub)|fml[as]'; then
    echo "the compiler has contracted products and sums"
    exit 1
fi

# on_arm PACKAGE ARGUMENT...: PACKAGE/run on QEMU, which stands in for the kernel that would start the loader.
on_arm() {
    local loader=$1/lib/ld-linux-aarch64.so.1
    mv "$loader" "$1/loader"
    printf '#!/bin/sh\nexec %s -L /nowhere "%s" "$@"\n' "$(command -v qemu-aarch64)" "$PWD/$1/loader" >"$loader"
    chmod +x "$loader"
    env -i "$1/run" --quiet --priority 0 "${@:2}" >run.log || { cat run.log; exit 1; }
}
# Somebody else's plugin, beside those that `make aarch64` installed.
cp -r "$build/aarch64/prefix" prefix
cmake -S "$source/examples/second_order_filter" -B filter --toolchain "$source/cmake/aarch64.cmake" \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" >build.log 2>&1 &&
    cmake --build filter >>build.log 2>&1 || { cat build.log; exit 1; }
cp filter/MyBlocks.so prefix/lib/blockfactory
BLOCKFACTORY_PLUGIN_PATH=$build/examples "$bf" deploy "$source/examples/second_order_filter/model.yaml" \
    --target aarch64 --prefix prefix -o filtered
on_arm filtered --record there.mcap
"$bf" export there.mcap -o there.csv >/dev/null
python3 "$source/tests/install/compare.py" there.csv "$source/examples/second_order_filter/expected.csv" 1e-12

# Both sides round forces of 150 N differently, and the quadratic program's weights differ by six orders of magnitude:
# torques differ by some 1e-9 Nm. The tolerance is below what a gain that is wrong in its sixth digit makes.
model=$source/examples/icub_balancing/balancing.yaml
options=(--set Sine.frequency=pi --set stop=0.5)
"$bf" deploy "$model" "${options[@]}" --target aarch64 -o icub
on_arm icub --realtime-factor 0.25 --record there.mcap
"$bf" run "$model" "${options[@]}" --quiet --record here.mcap >/dev/null
"$bf" export here.mcap -o here.csv >/dev/null
"$bf" export there.mcap -o there.csv >/dev/null
for here in here*.csv; do python3 "$source/tests/install/compare.py" "there${here#here}" "$here" 1e-7; done
[ "$(wc -l <there_world.wrench_l_sole.csv)" -gt 500 ]
