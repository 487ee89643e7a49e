#!/usr/bin/env bash
# package_in_debian.sh BF SOURCE: deploys the balancing iCub and runs the package in a Debian that holds nothing else,
# no compiler, no interpreter and none of our sources; it computes what `bf run` does here, bit for bit. Exit code 77
# where this cannot be tried: only root makes a Debian and changes the root to it.
set -euo pipefail
bf=$1 source=$2
unset BLOCKFACTORY_PLUGIN_PATH
. "$source/tests/install/bare_debian.sh"
if ! can_make_debian; then
    echo "package_in_debian.sh needs root, and debootstrap, which 'scripts/deps test' installs"
    exit 77
fi
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
cd "$work"

make_debian debian
if in_debian debian "command -v python3"; then
    echo "that Debian is not bare"
    exit 1
fi

model=$source/examples/icub_balancing/balancing.yaml
options="--quiet --stop 2 --set scenario=2"
"$bf" deploy "$model" -o debian/opt/icub
in_debian debian "/opt/icub/run $options --priority 0 --realtime-factor 4 --record /there.mcap"
"$bf" run "$model" $options --record here.mcap

"$bf" export here.mcap -o here.csv >/dev/null
"$bf" export debian/there.mcap -o there.csv >/dev/null
for here in here*.csv; do cmp "$here" "there${here#here}"; done
[ "$(wc -l <here_controller.tau.csv)" -gt 200 ]
