#!/usr/bin/env bash
# check_sdist.sh ARCHIVE: does it hold what the repository has, and does a wheel come from it? Its sources are compared with the
# tree's, of which the wheel was built: building all of it anew would show the same.
set -euo pipefail
archive=$(realpath "$1")
cd "$(dirname "$0")/../.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tar -C "$folder" -xzf "$archive"
cd "$folder"/*/
listed=$(git -C "$OLDPWD" ls-files) # fails where there is no repository
mapfile -t files <<<"$listed"
for file in "${files[@]}"; do
    cmp "$file" "$OLDPWD/$file" || { echo "the source archive lacks $file, or has another one" >&2; exit 1; }
done
grep -q '^Name: blockfactory$' PKG-INFO
echo "source archive: $(($(stat -c %s "$archive") / 1000000)) MB, ${#files[@]} files, those of the tree"
