#!/bin/sh
# Oracle: the gallery's page and its script. Every scene that scripts/gallery draws loads, is planned and drawn; the page shows and links to what
# exists, every picture beside it is shown, and all of them together are small.
# usage: test_gallery.sh SOURCE PROGRAMS WORK
set -eu
source_folder=$1
programs=$2
work=$3
meshes=/usr/share/glmark2/models
[ -e $meshes/bunny.obj ] || { echo "no $meshes/bunny.obj"; exit 77; }
rm -rf "$work"
mkdir -p "$work"
cd "$source_folder"

scripts/gallery --scenes "$work" >"$work/list"
[ "$(wc -l <"$work/list")" -gt 10 ] || { echo '[  FAILED  ] the gallery has hardly any scene'; exit 1; }
while read -r scene; do
    "$programs/render" "$scene" -o "$work/picture.exr" --size 16x12 --epsilon 0.3 --json -q --allow-path $meshes \
        --allow-path scenes/probes >"$work/result.json" </dev/null ||
        { echo "[  FAILED  ] $scene cannot be drawn"; exit 1; }
    jq -e '.effects | any(.name == "gather" and .active)' "$work/result.json" >"$work/log" ||
        { echo "[  FAILED  ] light does not scatter in $scene"; exit 1; }
done <"$work/list"
echo '[       OK ] every scene of the gallery is drawn'

cd docs/gallery
grep -ohE '\]\([^)]*\)' README.md | sed 's/](\([^)#]*\).*)/\1/' | sort -u >"$work/links"
while read -r path; do
    [ -e "$path" ] || { echo "[  FAILED  ] docs/gallery/README.md shows $path, which does not exist"; exit 1; }
done <"$work/links"
for picture in *.jpg; do
    grep -qx "$picture" "$work/links" || { echo "[  FAILED  ] docs/gallery/README.md does not show $picture"; exit 1; }
done
echo '[       OK ] what the gallery shows exists, and what exists is shown'

[ "$(cat ./*.jpg | wc -c)" -lt 2000000 ] || { echo '[  FAILED  ] the pictures take more than 2 MB'; exit 1; }
echo '[       OK ] the pictures are small'
echo '[  PASSED  ] 3 test(s).'
