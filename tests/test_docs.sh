#!/bin/sh
# Oracle: the documents themselves. Every T-number cited in the code stands in docs/theory.md, quoted code is that of
# its files, and the README's examples run as they are printed.
# usage: test_docs.sh SOURCE PROGRAMS WORK
set -eu
source_folder=$1
programs=$2
work=$3
rm -rf "$work"
mkdir -p "$work"
cd "$source_folder"

for number in $(grep -rhoE 'theory\.md (\(?T[0-9]+[, to]*)+|[( ]T[0-9]+[.,:)]' libdipole io lutgen renderer fit accuracy dipole plot |
    grep -oE 'T[0-9]+' | sort -u); do
    grep -q "\*\*$number\." docs/theory.md ||
        { echo "[  FAILED  ] $number is cited in the code and not in docs/theory.md"; exit 1; }
done
echo '[       OK ] every formula cited stands in docs/theory.md'

for path in $(grep -ohE '\]\((docs|materials|scenes)/[^)]*\)' README.md | sed 's/](\(.*\))/\1/'); do
    [ -e "$path" ] || { echo "[  FAILED  ] README.md links to $path, which does not exist"; exit 1; }
done
echo '[       OK ] what the README links to exists'

# the GLSL in docs/engines.md is that of the files, in their order
cat lutgen/glsl/splat.glsl lutgen/glsl/tsm.glsl >"$work/files.glsl"
awk '/^```/ { inside = /^```glsl$/; next } inside' docs/engines.md >"$work/quoted.glsl"
cmp "$work/files.glsl" "$work/quoted.glsl" ||
    { echo '[  FAILED  ] docs/engines.md does not quote lutgen/glsl as it is'; exit 1; }
echo '[       OK ] docs/engines.md quotes lutgen/glsl as it is'

# a window needs a display: test_window has that
grep '^    build/release/bin/' README.md | grep -v -e '--view' >"$work/examples"
ln -s "$source_folder/materials" "$source_folder/scenes" "$source_folder/tests" "$work/"
cd "$work"
while read -r example; do
    sh -c "$(printf '%s' "$example" | sed "s|build/release/bin|$programs|")" >log 2>&1 </dev/null ||
        { echo "[  FAILED  ] $example"; cat log; exit 1; }
done <examples
for file in marble.svg models.svg skin.svg tables/marble.splat1d.exr knot.png knot.exr found.json; do
    [ -s "$file" ] || { echo "[  FAILED  ] the README's examples made no $file"; exit 1; }
done
echo "[       OK ] the README's examples run"
echo '[  PASSED  ] 4 test(s).'
