#!/usr/bin/env bash
# run.sh BUILD SOURCE: installs BUILD, then builds and runs a plugin of the old API and a generated model there.
set -euo pipefail
build=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cmake --install "$build" --prefix "$work/prefix" >install.log || { cat install.log; exit 1; }
cmake -S "$source/boundary/test/outside" -B made -DSOURCES="$source" -DCMAKE_PREFIX_PATH="$work/prefix" \
    -DCMAKE_INSTALL_PREFIX="$work/plugin" >configure.log 2>&1 || { cat configure.log; exit 1; }
cmake --build made -j2 >build.log 2>&1 || { cat build.log; exit 1; }
cmake --install made >>build.log
test -f plugin/include/LegacyPlugin/Block/LegacyPlugin.hpp
test -f plugin/include/LegacyPlugin/Block/Public.h
export BLOCKFACTORY_PLUGIN_PATH=$work/plugin/lib/blockfactory:$work/prefix/lib/blockfactory:$work/prefix/lib/blockfactory/legacy
prefix/bin/blockfactory-exists LegacyPlugin Accumulate
prefix/bin/blockfactory-exists WholeBodyToolbox MassMatrix
prefix/bin/blockfactory-exists standard UnitDelay
if prefix/bin/blockfactory-exists LegacyPlugin NoSuchBlock 2>/dev/null; then exit 1; fi
prefix/bin/bf describe LegacyPlugin/Accumulate | grep -q factor
prefix/bin/blockfactory-exists Plugin2019 Label
made/engine2019 plugin/lib/blockfactory/libPlugin2019.so
made/driver

# The plugins run in our engine: y = 2 (1 + 10) + 0.5 + the number of steps before, and 1 + the length of "four".
cat >model.yaml <<END
model: hosted
plugins: [LegacyPlugin, Plugin2019]
step: 0.5
stop: 1
blocks:
  one: {block: Constant, value: 1}
  ten: {block: Constant, value: 10}
  sum: {block: LegacyPlugin/Accumulate, factor: 2, bias: 0.5}
  label: {block: Plugin2019/Label, text: "'four'"}
connections: {one: [sum.u1, label.u1], ten: sum.u2}
record: [sum.y1, label.y1]
END
printf 'time,sum.y1,label.y1\n0,22.5,5\n0.5,23.5,5\n' >expected.csv
prefix/bin/bf run model.yaml --record hosted.mcap
prefix/bin/bf export hosted.mcap -o hosted.csv
python3 "$source/tests/install/compare.py" hosted.csv expected.csv 0
