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
while read -r file; do
    cmp "$file" "$OLDPWD/$file" || { echo "the source archive lacks $file, or has another one" >&2; exit 1; }
done < <(git -C "$OLDPWD" ls-files)
grep -q '^Name: blockfactory$' PKG-INFO
echo "source archive: $(($(stat -c %s "$archive") / 1000000)) MB, $(git -C "$OLDPWD" ls-files | wc -l) files, those of the tree"
