# Curves of docs/headline.svg for bench_headline plot, from the same list as bench_headline.jq: all cases thin and pale, then geometric
# means of all cases at the same setting.
def geometric_mean: map(log) | add / length | exp;
def techniques: [["tsm", "translucent shadow maps", "#aa3388", "#ecd0e4"], ["uniform", "uniform splats", "#cc3311", "#f6cfc6"],
    ["gather-gl", "gather, OpenGL", "#009e73", "#bfe7dc"], ["gather-c", "gather, C", "#0072b2", "#bfdcf0"]];
def line($kind; $name; $color): [$kind, $name, $color, (.[] | .ms, .max)] | map(tostring) | join("\t");

. as $all | techniques[] as [$technique, $name, $color, $pale]
| ($all | map(select(.technique == $technique and .knob != "auto") | .n = (.knob | tonumber)) | group_by(.case)
    | map(sort_by(if $technique == "uniform" or $technique == "tsm" then .n else - .n end))) as $cases
| ($cases[] | select(length > 1) | line("thin"; "-"; $pale)),
  ([range(0; $cases | map(length) | min)]
    | map(. as $i | $cases | map(.[$i]) | {ms: (map(.ms) | geometric_mean), max: (map(.max) | geometric_mean)})
    | (select(length > 1) | line("line"; $name; $color)), line("points"; if length > 1 then "-" else $name end; $color))
