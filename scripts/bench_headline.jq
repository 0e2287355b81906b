# Markdown of docs/headline.md from what scripts/bench_headline measured: a list of {case, technique, knob, ms, rss_mb, and
# errors in %: rmse, max, most (99.9 % of values), weber}.

def significant($digits): if . == 0 then 0 else pow(10; $digits - 1 - (fabs | log10 | floor)) as $f | . * $f | round / $f end;
def short: significant(3) | if fabs >= 100 then round else . end | tostring;
def geometric_mean: if length == 0 then null else (map(log) | add / length | exp) end;

def shapes: ["sphere", "bunny", "knot"];
def lights: ["directional", "point"];
def materials: ["ketchup", "skin1", "marble", "skimmilk", "wholemilk"];
def cases: (map(.case) | unique) as $measured
    | [shapes[] as $s | lights[] as $l | materials[] as $m | "\($s)-\($l)-\($m)" | select(. as $case | $measured | index($case))];

def rows($case; $technique): map(select(.case == $case and .technique == $technique));
def cheapest($key; $level): map(select(.[$key] <= $level)) | min_by(.ms);

# Where a finer grid would reach the level: the error as the power of N between the two finest, time as N^2.
def estimate($key; $level): map(select(.knob != "auto") | .n = (.knob | tonumber)) | sort_by(.n) | .[-2:]
    | if length < 2 then null else
        .[0] as $a | .[1] as $b | (($a[$key] / $b[$key] | log) / ($b.n / $a.n | log)) as $power
        | if $power < 0.25 then null else
            ($b.n * pow($b[$key] / $level; 1 / $power)) as $n
            | {n: ($n | round), ms: ($b.ms * pow($n / $b.n; 2))} end end;

# One case by one criterion.
def compare($case; $key): rows($case; "gather-c") as $c | rows($case; "gather-gl") as $gl | rows($case; "uniform") as $u
    | rows($case; "tsm") as $tsm | ($c | cheapest($key; 1)) as $reached
    | (if $reached then 1 else ([$c[], $gl[] | .[$key]] | min) end) as $level
    | ($u | cheapest($key; $level)) as $uniform | ($u | map(select(.knob != "auto")) | max_by(.knob | tonumber)) as $finest
    | {case: $case, level: $level, is_reached: ($reached != null), c: ($c | cheapest($key; $level * 1.0001)),
       gl: ($gl | cheapest($key; $level * 1.0001)),
       uniform: $uniform, finest: $finest, guess: (if $uniform then null else ($u | estimate($key; $level)) end),
       tsm: ($tsm | min_by(.[$key])), is_tsm_reached: ($tsm | cheapest($key; 1) != null)}
    | .at_least_ms = (if .uniform then .uniform.ms else .finest.ms end)
    | .about_ms = (if .uniform then .uniform.ms elif .guess then .guess.ms else null end)
    | .c_ratio = (if .c then .at_least_ms / .c.ms else null end) | .gl_ratio = (if .gl then .at_least_ms / .gl.ms else null end)
    | .c_about = (if .c and .about_ms then .about_ms / .c.ms else null end)
    | .gl_about = (if .gl and .about_ms then .about_ms / .gl.ms else null end);

def cell: if . then "\(.ms | short) (\(.knob))" else "–" end;
def ratio($least; $about; $is_measured): if $least == null then "–" elif $is_measured then $least | short
    else "> \($least | short)" + (if $about then ", ≈ \($about | short)" else "" end) end;

def table($key): . as $all | (cases | map(. as $case | $all | compare($case; $key))) as $rows
    | "case | level, % | gather, C | gather, OpenGL | uniform splats | finest grid: %, ms | estimate: N, ms | C against uniform | OpenGL against uniform | tsm at best: %, ms",
      "---|---|---|---|---|---|---|---|---|---",
      ($rows[] | [(.case | gsub("-"; ", ")), (.level | short), (.c | cell), (.gl | cell), (.uniform | cell),
         "\(.finest[$key] | short), \(.finest.ms | short)", (if .guess then "\(.guess.n), \(.guess.ms | short)" else "" end),
         ratio(.c_ratio; .c_about; .uniform != null), ratio(.gl_ratio; .gl_about; .uniform != null),
         "\(.tsm[$key] | short), \(.tsm.ms | short)"] | join(" | ")),
      "",
      "| | C | OpenGL |", "|---|---|---|",
      "| cases within 1 % | \($rows | map(select(.is_reached)) | length) of \($rows | length) | \(
          $rows | map(select(.gl and .is_reached)) | length) of \($rows | length) |",
      "| geometric mean of times against uniform splats, at least | \([$rows[] | .c_ratio // empty] | geometric_mean | short) | \(
          [$rows[] | .gl_ratio // empty] | geometric_mean | short) |",
      "| the same, grids that were not drawn estimated | \([$rows[] | .c_about // .c_ratio // empty] | geometric_mean | short) | \(
          [$rows[] | .gl_about // .gl_ratio // empty] | geometric_mean | short) |",
      "| least of all cases | \([$rows[] | .c_ratio // empty] | min | short) | \([$rows[] | .gl_ratio // empty] | min | short) |",
      "",
      "Uniform splats are within the level in \($rows | map(select(.uniform)) | length) cases, translucent shadow maps within 1 % in \(
          $rows | map(select(.is_tsm_reached)) | length).";

# Times of gathering over the materials, at one epsilon.
def spread($technique): . as $all
    | "shape, light | \(materials | join(" | ")) | most over least", "---|---|---|---|---|---|---",
      (shapes[] as $s | lights[] as $l
        | [materials[] as $m | $all | rows("\($s)-\($l)-\($m)"; $technique)[] | select(.knob == "0.01") | .ms] as $ms
        | select($ms | length > 0)
        | "\($s), \($l) | \($ms | map(short) | join(" | ")) | \(($ms | max) / ($ms | min) | significant(3))");

def memory: . as $all
    | "technique | \(materials | join(" | "))", "---|---|---|---|---|---",
      ([["gather-c", "0.01", "gather, C"], ["gather-gl", "0.01", "gather, OpenGL"], ["uniform", "auto", "uniform splats"],
        ["tsm", "21", "tsm"]][] as [$technique, $knob, $name]
        | "\($name) | \([materials[] as $m | $all | rows("bunny-directional-\($m)"; $technique)[] | select(.knob == $knob) | .rss_mb | round]
            | map(tostring) | join(" | "))");

"# The headline: error against time

Made by `./dev bench headline`. Times are of the machine it ran on, so compare within the page only; they are of what the scattering takes,
the light's view, its samples and their sum, or the translucent shadow maps and theirs, the least of four pictures, techniques in turns (uniform splats
from N = 64 on: of one).

30 cases: a sphere 20 mm wide, the bunny 50 mm high and the knot 50 mm wide, each under a directional and a point light and of five
materials; 256 x 256, no gloss. The *reference* is the surface integral on the CPU (theory.md T33) at ε = 0.01, its own error estimated below 0.1 %, at the worst
pixel 0.3 %. Compared are pixels that show one surface, they and all within two pixels of them, at four points and at 64: at edges it is
the number of points to a pixel that differs. The *largest error* is the largest |L − L_ref| of these pixels and of the three channels, each as part of
that channel's brightest L_ref.

- *gather*: `--technique gather`, T43, on the processor and by OpenGL; ε of 0.1, 0.03, 0.01, 0.003 and 0.001.
- *uniform splats*: `--splat-grid N`, T44, the splats of Shah, Konttinen and Pattanaik 2009: one for each texel of the light's view, over all of r_max. N is doubled
  from 32 on until the largest error is within 1 %, or until a picture would take too long; also the N that the sampling theorem asks for (`auto`).
- *tsm*: translucent shadow maps (T37) of 21, 53 and 117 samples.

![error against time](headline.svg)

## By the largest error

The *level* is 1 %, or the least error that gathering reached where that is more. For each technique the cheapest setting that is within
the level: ms, and ε or N in brackets. Where no grid that was drawn is within it, its time is more than the finest one's, and an estimate
is given: the error goes on to fall as between the two finest grids, time grows as N².
", table("max"), "
## By 99.9 % of the values

The same with the error that one value in a thousand exceeds in place of the largest.
", table("most"), "
## Over the materials

Mean free paths of these materials are 0.26 to 4.2 mm, and 1/σtr, which says how far light spreads, is 0.4 to 18 mm. Gathering at ε = 0.01, in ms, C:
", spread("gather-c"), "
OpenGL:
", spread("gather-gl"), "
Peak memory of the whole program in MB, the bunny under the directional light:
", memory
