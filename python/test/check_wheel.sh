#!/usr/bin/env bash
# check_wheel.sh WHEEL: is it small, and has a Debian without compiler, where it is installed, all that it promises: the iCub
# balancing with a picture, and the program; does a plugin build with it? Needs the registry. Where no Debian can be made, which
# takes root and debootstrap, an environment of this system stands for it.
set -euo pipefail
. "$(dirname "$0")/../../tests/install/bare_debian.sh"
wheel=$(realpath "$1")
size=$(stat -c %s "$wheel")
echo "wheel: $((size / 1000000)) MB"
python3 -m zipfile -l "$wheel" | grep 'licenses/THIRD_PARTY_LICENCES.txt' >/dev/null || { echo "it has no licences of what it ships" >&2; exit 1; }
[ "$size" -lt 40000000 ] || { echo "it has more than 40 MB" >&2; exit 1; }

folder=$(mktemp -d)
trap 'rm -rf --one-file-system "$folder"' EXIT
cd "$folder"
inside() { env -i PATH=/usr/bin:/bin HOME="$folder" sh -c "$1"; }
root=
if can_make_debian; then
    root=$folder/debian
    make_debian "$root" python3-venv
    inside() { in_debian "$root" "$1"; }
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
TIMEFORMAT='from nothing to a balancing iCub with a picture: %0R s, in which processors worked %0U + %0S s'
time {
    /usr/bin/python3 -m pip --disable-pip-version-check -q download -d "$root$folder/wheels" \
        "blockfactory[icub,notebooks] @ file://$wheel"
    cp "$wheel" "$root$folder/wheels"
    inside "cd $folder && python3 -m venv venv && venv/bin/pip --disable-pip-version-check -q install --no-index \
        --find-links wheels 'blockfactory[icub,notebooks]' && venv/bin/python balance.py"
}
[ -s "$root$folder/balancing.png" ]
cp "$root$folder/balancing.png" "$(dirname "$wheel")/balancing-pip.png"
inside "cd $folder && venv/bin/bf run --quiet --record run.mcap \\
    \$(venv/bin/python -c 'import blockfactory as bf; print(bf.example(\"icub_balancing/balancing.yaml\"))') >run.txt"
[ -s "$root$folder/run.mcap" ]

python3 -m venv venv
venv/bin/pip --disable-pip-version-check -q install --no-index --find-links "$root$folder/wheels" 'blockfactory[icub,notebooks]'
prefix=$("$folder/venv/bin/python" -c 'import blockfactory as bf; print(bf.prefix())')
plugin_sources .
cmake -S . -B build -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build build >/dev/null
BLOCKFACTORY_PLUGIN_PATH=$PWD/build "$folder/venv/bin/python" twice.py
echo "a plugin builds with the wheel and runs"
