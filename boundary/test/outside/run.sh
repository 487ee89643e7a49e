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
export BLOCKFACTORY_PLUGIN_PATH=$work/plugin/lib/blockfactory:$work/prefix/lib/blockfactory
prefix/bin/blockfactory-exists LegacyPlugin Accumulate
prefix/bin/blockfactory-exists WholeBodyToolbox MassMatrix
if prefix/bin/blockfactory-exists LegacyPlugin NoSuchBlock 2>/dev/null; then exit 1; fi
prefix/bin/bf describe LegacyPlugin/Accumulate | grep -q factor
made/driver
