#!/usr/bin/env bash
# debian_package.sh FOLDER: installs the Debian packages of FOLDER by apt in a Debian that holds nothing else, and tries there what
# they promise: the iCub balancing with a picture, the program and Python giving the same, a plugin built with the installation, and
# nothing left when it is removed. Needs root and debootstrap; exit code 77 without.
set -euo pipefail
. "$(dirname "$0")/bare_debian.sh"
packages=$(realpath "$1")
can_make_debian || { echo "debian_package.sh needs root, and debootstrap, which 'scripts/deps test' installs"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf --one-file-system "$folder"' EXIT
cd "$folder"
make_debian debian
mkdir debian/work
cp "$packages"/*.deb debian/work
inside() { in_debian "$folder/debian" "cd /work && export DEBIAN_FRONTEND=noninteractive && $1"; }

model=/usr/lib/blockfactory/blockfactory/examples/icub_balancing/balancing.yaml
TIMEFORMAT='from nothing to a balancing iCub with a picture, by apt: %0R s, in which processors worked %0U + %0S s'
time {
    inside "apt-get update -qq && apt-get install -y -qq --no-install-recommends ./blockfactory*.deb gnuplot-nox fonts-dejavu-core >log 2>&1 || { cat log; exit 1; }"
    inside "bf run $model --quiet --set scenario=2 --stop 5 --record run.mcap >run.txt && bf plot run.mcap -o balancing.png && bf draw $model -o balancing.svg"
}
inside "grep -q 'stood.*yes' run.txt" || { cat debian/work/run.txt; exit 1; }
[ -s debian/work/balancing.svg ]
for picture in debian/work/balancing*.png; do cp "$picture" "$packages/$(basename "$picture" .png)-apt.png"; done
inside "python3 -c 'import importlib.metadata as m; assert m.version(\"blockfactory\") and not m.requires(\"blockfactory\")'"

# No library is missing anywhere, nor taken from the folder that somebody starts a program in.
inside "find /usr/lib/blockfactory -name '*.so*' -type f | xargs ldd | grep 'not found' && exit 1 || true"
# What the CMake package gives programs that carry the Whole-Body Toolbox is there.
inside "cd /usr/lib/blockfactory && for library in \$(grep -oh '\(cmeel.prefix/lib\|mujoco\)/lib[^;\"]*' blockfactory/lib/cmake/*/*.cmake); do test -e \$library || exit 1; done"
inside "bf doctor --json >doctor.json && bf edit --protocol >/dev/null && test -s /usr/share/doc/blockfactory/copyright"
for plugin in WholeBodyToolbox WholeBodyCameras SharedMemory Udp FMI; do
    grep -A2 "\"name\": \"$plugin\"" debian/work/doctor.json | grep -q '"blocks"' || { cat debian/work/doctor.json; exit 1; }
done

cat >debian/work/balance.py <<'PYTHON'
import blockfactory as bf

m = bf.load(bf.example("icub_balancing/balancing.yaml"), scenario=2)
sim = m.simulate()
recording = sim.record()
sim.run(5)
assert sim.checks["stood"] is True
there = bf.read_recording("run.mcap")["controller.tau"].values
assert (there == recording["controller.tau"].values[: len(there)]).all() and len(there) > 400
PYTHON
inside "python3 balance.py"

plugin_sources debian/work
inside "apt-get install -y -qq --no-install-recommends g++ cmake make libeigen3-dev >log 2>&1 || { cat log; exit 1; }"
inside "{ cmake -S . -B build -DCMAKE_BUILD_TYPE=Release && cmake --build build; } >log 2>&1 || { cat log; exit 1; }"
inside "BLOCKFACTORY_PLUGIN_PATH=/work/build python3 twice.py"
echo "a plugin builds with the Debian package and runs"

inside "apt-get remove -y -qq blockfactory blockfactory-icub >log 2>&1 && test ! -e /usr/lib/blockfactory && test ! -e /usr/bin/bf && test ! -e /usr/share/iCub"
