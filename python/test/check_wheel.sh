#!/usr/bin/env bash
# check_wheel.sh WHEEL: is it small, and has a Debian without compiler, where it is installed, all that it promises: the iCub
# balancing with a picture, and the program; does a plugin build with it? Needs the registry. Where no Debian can be made, which
# takes root and debootstrap, an environment of this system stands for it.
set -euo pipefail
wheel=$(realpath "$1")
size=$(stat -c %s "$wheel")
echo "wheel: $((size / 1000000)) MB"
[ "$size" -lt 40000000 ] || { echo "it has more than 40 MB" >&2; exit 1; }

folder=$(mktemp -d)
trap 'rm -rf --one-file-system "$folder"' EXIT
cd "$folder"
inside() { env -i PATH=/usr/bin:/bin HOME="$folder" sh -c "$1"; }
root=
if [ "$(id -u)" = 0 ] && command -v debootstrap >/dev/null; then
    release=$(. /etc/os-release && echo "$VERSION_CODENAME")
    mirror=$(apt-get indextargets --format '$(SITE)' "Created-By: Packages" "Codename: $release" | head -n 1)
    debootstrap --variant=minbase --include=python3-venv "$release" debian "$mirror" >debootstrap.log ||
        { tail debootstrap.log; exit 1; }
    root=$folder/debian
    # With /proc, by which the loader of programs knows where a program is.
    inside() {
        unshare --mount sh -c 'mount -t proc proc "$0/proc" && exec chroot "$0" /usr/bin/env -i PATH=/usr/bin:/bin HOME=/root sh -c "$1"' \
            "$root" "$1"
    }
    if inside "command -v cc || command -v c++"; then
        echo "that Debian is not bare" >&2
        exit 1
    fi
fi

mkdir -p "$root$folder"
cat >"$root$folder/balance.py" <<'PYTHON'
import blockfactory as bf

m = bf.load(bf.example("icub_balancing/balancing.yaml"), scenario=2)
sim = m.simulate()
recording = sim.record()
sim.run(5)
assert sim.checks["stood"] is True
recording.plot().savefig("balancing.png")
m.draw().save("balancing.svg")
PYTHON
begin=$(date +%s)
/usr/bin/python3 -m pip --disable-pip-version-check -q download -d "$root$folder/wheels" \
    "blockfactory[icub,notebooks] @ file://$wheel"
cp "$wheel" "$root$folder/wheels"
inside "cd $folder && python3 -m venv venv && venv/bin/pip --disable-pip-version-check -q install --no-index \
    --find-links wheels 'blockfactory[icub,notebooks]' && venv/bin/python balance.py"
[ -s "$root$folder/balancing.png" ]
echo "from nothing to a balancing iCub with a picture: $(($(date +%s) - begin)) s"
cp "$root$folder/balancing.png" "$(dirname "$wheel")"
inside "cd $folder && venv/bin/bf run --quiet --record run.mcap \\
    \$(venv/bin/python -c 'import blockfactory as bf; print(bf.example(\"icub_balancing/balancing.yaml\"))') >run.txt"
[ -s "$root$folder/run.mcap" ]

python3 -m venv venv
venv/bin/pip --disable-pip-version-check -q install --no-index --find-links "$root$folder/wheels" 'blockfactory[icub,notebooks]'
prefix=$("$folder/venv/bin/python" -c 'import blockfactory as bf; print(bf.prefix())')
cat >CMakeLists.txt <<'CMAKE'
cmake_minimum_required(VERSION 3.16)
project(plugin LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 20)
find_package(BlockFactory REQUIRED COMPONENTS Library)
bf_plugin(Filters SOURCES filters.cpp)
CMAKE
cat >filters.cpp <<'CPP'
#include <bf/core/registry.hpp>

struct Twice final : bf::Block {
    using Block::Block;
    bf::Dim n{this, "n"};
    bf::Input<bf::Vector> u{this, "u", {.shape = {n}}};
    bf::Output<bf::Vector> y{this, "y", {.shape = {n}}};
    bf::Status output(bf::Now at, bf::Out out) const noexcept override {
        out[y] = 2 * at[u];
        return bf::ok;
    }
};
extern "C" void bf_plugin_v1(bf::Library& library) { library.group("filters").add<Twice>("Twice", "y = 2 u."); }
CPP
cmake -S . -B build -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build build >/dev/null
cat >twice.py <<'PYTHON'
import blockfactory as bf

m = bf.Model("m").set("", step=1).add("c", "Constant", value=[1, 2]).add("t", "Filters/Twice").add("e", "Terminator")
sim = bf.load(m.connect("c", "t").connect("t", "e")).simulate()
sim.step()
assert sim["t"].tolist() == [2, 4]
PYTHON
BLOCKFACTORY_PLUGIN_PATH=$PWD/build "$folder/venv/bin/python" twice.py
echo "a plugin builds with the wheel and runs"
