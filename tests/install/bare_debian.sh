# Sourced by what tries things in a Debian that holds nothing else, and what packages are tried with.

# Only root makes one and changes the root to it.
can_make_debian() { [ "$(id -u)" = 0 ] && command -v debootstrap >/dev/null; }

# make_debian FOLDER [PACKAGES]: of this release, with PACKAGES (a,b,c) and without a compiler.
make_debian() {
    local release mirror
    release=$(. /etc/os-release && echo "$VERSION_CODENAME")
    mirror=$(apt-get indextargets --format '$(SITE)' "Created-By: Packages" "Codename: $release" | head -n 1)
    debootstrap --variant=minbase ${2:+--include="$2"} "$release" "$1" "$mirror" >debootstrap.log || { tail debootstrap.log; exit 1; }
    if in_debian "$1" "command -v cc || command -v c++ || command -v cmake"; then
        echo "that Debian is not bare"
        exit 1
    fi
}

# in_debian FOLDER COMMAND: with /proc, by which the loader of programs knows where a program is.
in_debian() {
    unshare --mount sh -c 'mount -t proc proc "$0/proc" &&
        exec chroot "$0" /usr/bin/env -i PATH=/usr/bin:/bin:/usr/sbin:/sbin HOME=/root sh -c "$1"' "$1" "$2"
}

# plugin_sources FOLDER: a plugin that somebody else would write, and twice.py, which runs it.
plugin_sources() {
    cat >"$1/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.16)
project(plugin LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 20)
find_package(BlockFactory REQUIRED COMPONENTS Library)
bf_plugin(Filters SOURCES filters.cpp)
CMAKE
    cat >"$1/filters.cpp" <<'CPP'
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
    cat >"$1/twice.py" <<'PYTHON'
import blockfactory as bf

m = bf.Model("m").set("", step=1).add("c", "Constant", value=[1, 2]).add("t", "Filters/Twice").add("e", "Terminator")
sim = bf.load(m.connect("c", "t").connect("t", "e")).simulate()
sim.step()
assert sim["t"].tolist() == [2, 4]
PYTHON
}
