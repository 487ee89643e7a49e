#!/usr/bin/env bash
# example_plugin.sh BUILD SOURCE: installs BUILD, builds the example plugin against the installation only and
# compares what its model gives with the expected result.
set -euo pipefail
build=$1 source=$2
unset BLOCKFACTORY_PLUGIN_PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

cmake --install "$build" --prefix "$work/made" >install.log || { cat install.log; exit 1; }
mv made prefix # an installation may be moved
for binary in prefix/bin/bf prefix/lib/libblockfactory.so prefix/lib/blockfactory/*.so; do
    libraries=$(ldd "$binary")
    if grep "not found" <<<"$libraries"; then echo "$binary misses libraries"; exit 1; fi
    # Nothing of the build is searched, nor the folder that the program is started in, as an empty entry would.
    folders=$(readelf -d "$binary" | sed -n 's/.*R.*PATH.*\[\(.*\)\]/\1/p')
    case ":$folders:" in *::* | *"$build"*) echo "$binary searches '$folders'"; exit 1 ;; esac
    if grep -q "$build/lib" "$binary"; then echo "$binary knows the folder it was built in"; exit 1; fi
    grep -q "libbf_core.so => $work/prefix/" <<<"$libraries" || { echo "$binary does not use the installed core"; exit 1; }
done
prefix/bin/bf describe WholeBodyToolbox/MassMatrix >/dev/null

cp -r "$source/examples/second_order_filter" example
# Installed headers include nothing that is not installed.
(cd prefix/include && find bf -name '*.hpp' -printf '#include <%p>\n') | sort >example/headers.cpp
cat >>example/CMakeLists.txt <<END
add_library(headers OBJECT headers.cpp)
target_link_libraries(headers PRIVATE BlockFactory::library)
find_package(BlockFactory QUIET COMPONENTS NoSuchComponent)
if(BlockFactory_FOUND)
    message(FATAL_ERROR "a component that does not exist was found")
endif()
END
# Whoever writes blocks may have another compiler than those who built the program.
for compiler in clang++-14 g++; do
    rm -rf example/build
    cmake -S example -B example/build -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=$compiler \
        -DCMAKE_PREFIX_PATH="$work/prefix" >configure.log 2>&1 || { cat configure.log; exit 1; }
    cmake --build example/build -j2 >build.log 2>&1 || { cat build.log; exit 1; }

    export BLOCKFACTORY_PLUGIN_PATH=$work/example/build
    prefix/bin/bf run example/model.yaml --record filter.mcap
    prefix/bin/bf export filter.mcap -o filter.csv
    python3 "$source/tests/install/compare.py" filter.csv example/expected.csv 1e-12
    rm filter.mcap filter.csv
done

# Programs that load, run, edit and sweep models need the installation only, too.
cmake -S "$source/examples/library" -B library -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" \
    >configure.log 2>&1 || { cat configure.log; exit 1; }
cmake --build library -j2 >build.log 2>&1 || { cat build.log; exit 1; }
library/run_a_model "$source/docs/start/motor.yaml" motor.mcap
prefix/bin/bf replay motor.mcap
library/build_edit_plot .
library/tune_in_parallel "$source/docs/start/motor.yaml"

# A generated program takes the plugins from their folders, or carries them: then it needs none, and records the same.
cat >linked.yaml <<END
model: linked
step: 0.01
stop: 1
blocks:
  sine: {block: Sine, frequency: 30}
  filter: {block: MyBlocks/SecondOrderFilter}
  configuration: {block: WholeBodyToolbox/Configuration, joints: [l_knee, r_knee]}
  pose: {block: Constant, value: eye(4)}
  positions: {block: Constant, value: "[0.1; 0.2]"}
  gravity: {block: WholeBodyToolbox/GetGravityForces}
connections: {sine: filter, pose: gravity.w_H_b, positions: gravity.s}
END
prefix/bin/bf generate linked.yaml -o linked/generated >/dev/null
cp -r example linked/example
cat >linked/CMakeLists.txt <<END
cmake_minimum_required(VERSION 3.16)
project(linked LANGUAGES CXX)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY \${CMAKE_BINARY_DIR})
find_package(BlockFactory REQUIRED)
add_subdirectory(example)
add_subdirectory(generated)
END
for how in "g++ OFF" "g++ ON" "clang++-14 ON"; do
    read -r compiler carries <<<"$how"
    cmake -S linked -B linked/$compiler -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER=$compiler \
        -DLINK_PLUGINS=$carries >configure.log 2>&1 || { cat configure.log; exit 1; }
    cmake --build linked/$compiler -j2 --target run_linked >build.log 2>&1 || { cat build.log; exit 1; }
    mv linked/$compiler/run_linked "run_$compiler$carries"
done
./run_g++OFF --csv opened.csv
for compiler in g++ clang++-14; do
    (unset BLOCKFACTORY_PLUGIN_PATH && mv prefix/lib/blockfactory aside && ./run_${compiler}ON --csv carried.csv &&
        mv aside prefix/lib/blockfactory)
    cmp opened.csv carried.csv
    rm carried.csv
done

# A generated program that finds its sizes at its start builds against the installation only, too.
cat >sized.yaml <<END
model: sized
step: 0.1
stop: 0.1
variables: {n: 2, k: 3}
blocks:
  c: {block: Constant, value: "k*ones(n, 1)"}
END
prefix/bin/bf generate sized.yaml --sizes=runtime -o sized >/dev/null
cmake -S sized -B sized/build -DCMAKE_PREFIX_PATH="$work/prefix" >configure.log 2>&1 || { cat configure.log; exit 1; }
cmake --build sized/build -j2 >build.log 2>&1 || { cat build.log; exit 1; }
echo '{n: 3, k: 2^2}' >three.yaml
sized/build/run_sized --params three.yaml --csv sized.csv
printf 'time,"c.y[1]","c.y[2]","c.y[3]"\n0,4,4,4\n' | cmp - sized.csv
PYTHONPATH=sized/build python3 -c 'from sized import Sized; assert Sized("three.yaml").get("c.value") == [4, 4, 4]'
