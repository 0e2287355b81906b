#!/bin/sh
# Tables in the hands of other programs. Oracles: oiiotool's words for the attributes; readers.py has its own.
# usage: test_readers.sh SOURCE PROGRAMS WORK
set -eu
source_folder=$1
programs=$2
work=$3
rm -rf "$work"
mkdir -p "$work"
# Debian's Python, which has Debian's modules, whatever else is installed
python=/usr/bin/python3
[ -x $python ] || python=python3

bake() { # folder, options
    folder=$1
    shift
    "$programs/lutgen" "$source_folder/materials/marble.json" "$source_folder/materials/ketchup.json" -q \
        -o "$work/$folder" --kind splat1d,splat2d,tsm --format exr,dds,raw "$@" >"$work/$folder.log"
}
bake float
bake half --half

expect_line() { # file, text that a line begins with
    grep -qF "    $2" "$1" || { echo "[  FAILED  ] $1 has no line $2"; cat "$1"; exit 1; }
}
info() { # table; leaves oiiotool's words in $listing
    listing=$work/$(basename "$1").txt
    oiiotool --info -v "$work/float/$1" >"$listing"
    for line in 'channel list: R, G, B' 'compression: "zip"' 'dipole:epsilon: ' 'dipole:max_relative_error: 0.' \
        'dipole:p99_relative_error: 0.' 'dipole:axis_mapping: "' 'dipole:unit: "1/mm^2: ' 'dipole:storage: "float"' \
        'dipole:size_asked: 0, 0, 0' 'dipole:version: "' 'dipole:content_hash: "' 'dipole:input_hash: "'; do
        expect_line "$listing" "$line"
    done
}
info marble.splat1d.exr
for line in 'dipole:kind: "splat1d"' 'dipole:material: "Marble"' 'dipole:model: "dipole"' 'dipole:eta: 1.5' \
    'dipole:sigma_a_per_mm: 0.0021, 0.0041, 0.0071' 'dipole:sigma_s_prime_per_mm: 2.19, 2.62, 3' \
    'dipole:epsilon: 0.001' 'dipole:scale: 1, 1, 1' 'dipole:core_mm: 0, 0, 0' 'dipole:r_max_mm: ' 'dipole:scale_mm: ' \
    'dipole:power: ' 'dipole:falloff: ' 'dipole:size: '; do
    expect_line "$listing" "$line"
done
info materials.splat2d.exr
expect_line "$listing" 'dipole:kind: "splat2d"'
expect_line "$listing" 'dipole:row_json: "[{"material":"Marble"'
info marble.tsm.exr
for line in 'dipole:kind: "tsm"' 'dipole:size: 64, 64, 32' 'dipole:epsilon: 0.15' 'dipole:local_slice: 21' \
    'dipole:depth_factor_slice: 22' 'dipole:self_test_slice: 31' 'dipole:pattern_json: "[{"offset_mm":[0.0,0.0]' \
    'dipole:local_mapping: "' 'dipole:depth_scale_mm: ' 'dipole:depth_max_mm: '; do
    expect_line "$listing" "$line"
done
oiiotool --info "$work/half/marble.tsm.exr" | grep -q '2048 x   64, 3 channel, half openexr' ||
    { echo '[  FAILED  ] oiiotool does not see 2048 x 64 halves'; exit 1; }
echo '[       OK ] oiiotool lists the attributes'

for library in stdlib oiio; do
    $python "$source_folder/tests/readers.py" "$programs" "$source_folder/materials" "$work" $library ||
        { echo "[  FAILED  ] readers.py by $library"; exit 1; }
done
echo '[  PASSED  ] 3 test(s).'
