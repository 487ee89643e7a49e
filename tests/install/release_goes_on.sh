#!/usr/bin/env bash
# release_goes_on.sh SOURCE: scripts/release in a repository whose tools only say that they were called. A failure says where it
# stopped and the next start goes on there; another commit is done from the beginning; a tree with changes is refused.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
mkdir -p tree/scripts tree/tests/install tree/python/test tree/.deps/python/bin tree/.deps/venv/bin
cp "$1/scripts/release" tree/scripts
cd tree
export CALLS=$folder/calls FAILS=
for tool in scripts/deps scripts/deps-python scripts/package-debian python/test/check_sdist.sh python/test/check_wheel.sh \
    tests/install/debian_package.sh .deps/venv/bin/python .deps/python/bin/python; do
    cat >"$tool" <<'SH'
#!/bin/sh
called="$(basename "$0") $*"
echo "$called" >>"$CALLS"
case $called in
*--wheel*) mkdir -p build-wheel/raw && touch build-wheel/raw/b.whl ;;
*--sdist*) touch dist/b.tar.gz ;;
*auditwheel*) touch dist/b.whl ;;
package-debian*) touch dist/b.deb ;;
"check_wheel.sh dist/b.whl") [ "$FAILS" != changes ] || touch new ;;
debian_package.sh*) [ "$FAILS" != skipped ] || exit 77 ;;
esac
[ -z "$FAILS" ] || case $called in *"$FAILS"*) exit 3 ;; esac
SH
    chmod +x "$tool"
done
printf '/build-*/\n/dist/\n/.deps\n' >.gitignore
commit() { git add -A && git -c user.name=t -c user.email=t@t commit -q --allow-empty -m "$1"; }
git init -q .
commit first

release() { : >"$CALLS" && FAILS=$1 scripts/release >../said 2>&1; }
fail() { echo "$1"; cat "$CALLS" ../said; exit 1; }
called() { grep -q -- "$1" "$CALLS"; }

! release check_sdist || fail "a check that fails is passed over"
grep -q "stopped at 'source archive holds the tree'" ../said || fail "it does not say where it stopped"
[ ! -e dist/SHA256SUMS ] || fail "it looks as if it were finished"

release "" || fail "it does not go on"
! called "-m build\|auditwheel\|package-debian\|interfaces.py" || fail "it does again what is done"
called check_sdist && called check_wheel && called debian_package || fail "it leaves out what is not done"
[ "$(wc -l <dist/SHA256SUMS)" = 3 ]

commit second
release skipped || fail "it needs a bare Debian where none can be made"
called "--wheel" && called "--sdist" && called auditwheel && called package-debian && called "interfaces.py exact" || fail "another commit is not built"

rm -r dist
! release changes || fail "a tree that is changed meanwhile is released"
grep -q "the tree was changed meanwhile" ../said
called "--wheel" || fail "it goes on without what it made"
! release "" || fail "a tree with changes is released"
grep -q "commit them" ../said || fail "it does not say what to do"
