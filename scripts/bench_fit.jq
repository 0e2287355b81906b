# What a fit found against the truth. A record has "truth", {sigma_a_per_mm: [..], sigma_s_prime_per_mm: [..]}, and
# "found", the "fit" block of docs/formats.md.

def percent: . * 100;
def digits(n): if . == null then "–" elif . == 0 then "0" else
    (if . < 0 then -. else . end) as $size | ($size | log10 | floor) as $power | pow(10; n - 1 - $power) as $unit |
    ((. * $unit | round) / $unit) | tostring end;

# Every coefficient: error and half-width in parts of the truth (null: the truth is 0).
def coefficients: . as $r | [range($r.found.channels | length) as $c | $r.found.channels[$c] as $f |
    { name: "sigma_a", truth: $r.truth.sigma_a_per_mm[$c], value: $f.sigma_a_per_mm, ci: $f.sigma_a_ci95 },
    { name: "sigma_s_prime", truth: $r.truth.sigma_s_prime_per_mm[$c], value: $f.sigma_s_prime_per_mm,
      ci: $f.sigma_s_prime_ci95 } |
    . + { channel: $c, identifiable: $f.identifiable,
          inside: (.ci[0] <= .truth and .truth <= .ci[1]),
          error: (if .truth > 0 then ((.value - .truth) / .truth | fabs) else null end),
          half: (if .truth > 0 then ((.ci[1] - .ci[0]) / 2 / .truth) else null end) }];

# The combination that a channel tells where it does not tell both, against the truth.
def combinations: . as $r | [range($r.found.channels | length) as $c | $r.found.channels[$c] as $f |
    select($f.identifiable | not) |
    $r.truth.sigma_a_per_mm[$c] as $a | $r.truth.sigma_s_prime_per_mm[$c] as $s |
    { alpha_prime: ($s / ($a + $s)), sigma_tr_per_mm: (3 * $a * ($a + $s) | sqrt), sigma_t_prime_per_mm: ($a + $s) } |
    to_entries[] | select($f[.key] != null) |
    { channel: $c, name: .key, truth: .value, value: $f[.key], ci: $f.combination_ci95 } |
    . + { inside: (.ci[0] <= .truth and .truth <= .ci[1]),
          error: (if .truth > 0 then ((.value - .truth) / .truth | fabs) else null end) }];

def largest: map(select(. != null)) | if length > 0 then max else null end;
def smallest: map(select(. != null)) | if length > 0 then min else null end;
def median: map(select(. != null)) | sort | if length > 0 then .[(length - 1) / 2 | floor] else null end;
def count(f): map(select(f)) | length;
def span: if length == 0 then "–" else "\(smallest | percent | digits(2))–\(largest | percent | digits(2))" end;
def channel_names: ["R", "G", "B"];
def identifiable_text: [.found.channels | to_entries[] | select(.value.identifiable) | channel_names[.key]] |
    if length == 0 then "none" else join("") end;
def in_percent(n): if . == null then "–" else percent | digits(n) end;
def signed_error: if .truth > 0 then ((.value - .truth) / .truth | in_percent(2)) else "–" end;

# "5 of 6 intervals hold the truth; median error 1 %, largest 2 %"
def verdict: "\(count(.inside)) of \(length) intervals hold the truth; median error \(map(.error) | median | in_percent(2)) %, largest \(
    map(.error) | largest | in_percent(2)) %";

# ---- own renders ----

def own_table: group_by([.material, .light])[] | . as $fits | [$fits[] | select(.found) | coefficients[]] as $all |
    ($all | map(select(.identifiable))) as $told |
    "\($fits[0].material), \($fits[0].light) | " + if $all == [] then $fits[0].message else
    "\($told | map(.error) | largest | in_percent(2)) | \($told | map(select(.name == "sigma_a").half) | span) | \(
    $told | map(select(.name == "sigma_s_prime").half) | span) | \($told | count(.inside)) of \($told | length) | \(
    $fits | map(identifiable_text) | unique | join(" or ")) | \(
    [$told | group_by([.name, .channel])[] | map(.value) | (max - min) / ((max + min) / 2 + 1e-300)] | largest | in_percent(1))" end;

def own_summary: [.[] | select(.found) | coefficients[]] as $all | ($all | map(select(.identifiable))) as $told |
    ($told | map(select(.half and .half <= 0.01))) as $sure | [.[] | select(.found) | combinations[]] as $combined |
    "- Of \($all | length) coefficients \($told | length) can be told; \($told | count(.inside)) of these intervals hold the truth, and \(
    $all | map(select(.identifiable | not)) | count(.inside)) of the \($all | length - ($told | length)) others.",
    "- \($sure | length) intervals are within ±1 %: \($sure | count(.error <= 0.01)) of these coefficients are within 1 % of the truth, the worst off by \(
    $sure | map(.error) | largest | in_percent(2)) %, and \($sure | count(.inside)) of the intervals hold it.",
    "- Whatever the intervals say, \($told | count(.error and .error <= 0.01)) of \($told | count(.error)) are within 1 %, the worst off by \(
    $told | map(.error) | largest | in_percent(2)) %; the median half-width is \(
    $told | map(.half) | median | in_percent(2)) %, the median error \($told | map(.error) | median | in_percent(2)) %.",
    "- Where a channel is said to tell only a combination, its interval holds the truth \($combined | count(.inside)) times of \(
    $combined | length).",
    "- \(count(.found == null)) fits failed and \(count(.found and (.found.converged | not))) did not converge.";

# ---- coverage; input: trials ----

def coverage_cell: length as $n | count(.ci95[0] <= .truth and .truth <= .ci95[1]) as $inside |
    map((.ci95[1] - .ci95[0]) / 2 / .truth) as $half | map(.value / .truth) as $x | (($x | add) / $n) as $mean |
    ($x | map(pow(. - $mean; 2)) | add / $n | sqrt) as $sd |
    "\($inside) of \($n): ±\($half | median | in_percent(2)) (\(1.96 * $sd | in_percent(1)))";

def coverage_row($name; $truth): . as $trials |
    [range(3) as $c | $trials | map(.channels[$c].a + { truth: $truth.sigma_a_per_mm[$c] }) | coverage_cell] +
    [range(3) as $c | $trials | map(.channels[$c].s + { truth: $truth.sigma_s_prime_per_mm[$c] }) | coverage_cell] +
    [$trials | map(.gain + { truth: .exposure }) | coverage_cell] | "\($name) | " + join(" | ");

# ---- photographs ----

def photos_table: .[] | "\(.material), \(.light), \(.format), \(.exposure) | " + if .found == null then .message else
    ([coefficients[] | select(.identifiable)] | "\(map(.error) | largest | in_percent(2)) | \(
        map(select(.name == "sigma_a").half) | span) | \(map(select(.name == "sigma_s_prime").half) | span) | \(
        count(.inside)) of \(length)") + " | \(identifiable_text)" end;

def photos_summary: [.[] | select(.found) | . as $r | coefficients[] | . + { format: $r.format }] | group_by(.format)[] |
    . as $all | map(select(.identifiable)) |
    "- \(.[0].format): \(length) of \($all | length) coefficients can be told, \(count(.error <= 0.05)) of these within 5 %; \(verdict).";

# ---- profiles and totals ----

def profiles_table: . as $all | .[] | select(.data == "measured") | . as $r |
    "\(.case), \(.truth.sigma_a_per_mm[0]), \(.truth.sigma_s_prime_per_mm[0]), \(.eta) | \(
    if .asked == "" then "none: \(.found.model)" else .asked end) | " + if .found == null then .message else
    ([coefficients[] | "\(signed_error) | \(.half | in_percent(2)) | \(if .inside then "yes" else "no" end)"] | join(" | ")) +
    " | \(.found.rms_residual | in_percent(2)) | " +
    ([$all[] | select(.data == "own" and .case == $r.case and .asked == $r.asked)] |
     if length == 0 then "" elif .[0].found == null then .[0].message else
     .[0] | [coefficients[].error] | max | in_percent(1) end) end;

def profiles_summary: [.[] | select(.found) | . as $r | coefficients[] | . + { data: $r.data, asked: $r.asked }] |
    ([.[] | select(.data == "measured")] | group_by(.asked)[] |
     "- \(.[0].asked | if . == "" then "no model asked for" else "`\(.)`" end): \(verdict)."),
    "- own profiles: the largest error of a coefficient is \(map(select(.data == "own").error) | largest | digits(1)) of it.";

def totals_table: group_by([.albedo, .eta, .tau])[] | "\(.[0].albedo), \(.[0].eta), \(.[0].tau) | " +
    ([("modes", "beam") as $m | .[] | select(.model == $m) | if .found == null then "\(.message) | " else
      [coefficients[] | "\(signed_error) ± \(.half | in_percent(2))" as $text | if .inside then $text else "**\($text)**" end] |
      join(" | ") end] | join(" | "));

def totals_summary: [.[] | select(.found) | . as $r | coefficients[] | . + { model: $r.model }] | group_by(.model)[] |
    "- `\(.[0].model)`: \(verdict).";

# ---- traced pictures ----

def traced_table: .[] | . as $r | "\(.material), \(.shape), \(.exposure) | " + if .found == null then .message else
    "\(if .asked == "" then "none: \(.found.model)" else .asked end) | " +
    ([("sigma_a", "sigma_s_prime") as $n | [$r | coefficients[] | select(.name == $n) |
        "\(signed_error) ± \(.half | in_percent(2))" as $text | (if .inside then $text else "**\($text)**" end) as $text |
        if .identifiable then $text else "(\($text))" end] | join(", ")] | join(" | ")) +
    " | \(.found.rms_residual | in_percent(2)) | \(.noise)" end;

def traced_summary: [.[] | select(.found) | . as $r | coefficients[] | . + ($r | { asked, exposure, shape })] |
    group_by([.asked, .exposure, .shape])[] | . as $all | map(select(.identifiable)) as $told |
    "- \(.[0].asked | if . == "" then "no model asked for" else "`\(.)`" end), exposure \(.[0].exposure), \(.[0].shape): \(
    $told | length) of \(length) coefficients can be told" + if $told == [] then "" else ": \($told | verdict)" end +
    if ($told | length) == length then "." else "; \(map(select(.identifiable | not)) | count(.inside)) of the other intervals hold the truth." end;

# ---- time; input: what bench_fit_time prints ----

def time_row($text): def s: . * 1000 | round / 1000; "\($text) | \(.wall_s | s) | \(.cpu_s | s) | \(.count)";

def time_table: .[0] as [$f, $d] |
    ($f.total | time_row("fit, all of it")),
    ($f.prepare | time_row("- drawing light and view, choosing pixels, the operator")),
    ($f.search | time_row("- searching")),
    ($f.judge | time_row("- judging, intervals")),
    ($f.solve | time_row("*of all this Ceres, with what it calls:* \($f.iterations) iterations")),
    ($d.total | time_row("differences, all of it")),
    ($d.solve | time_row("*of this Ceres, with what it calls:* \($d.iterations) iterations, \($d.draws) pictures")),
    ($d.create | time_row("- of this getting renderers"));

def time_summary($truth): .[0] as [$f, $d] | [range(3) as $c | $truth.sigma_a_per_mm[$c], $truth.sigma_s_prime_per_mm[$c]] as $t |
    def worst: .found as $x | [range(6) as $i | ($x[$i] / $t[$i] - 1) | fabs] | max | in_percent(2);
    "Ratios of the Ceres parts, wall and CPU: \($d.solve.wall_s / $f.solve.wall_s | digits(3)) and \(
    $d.solve.cpu_s / $f.solve.cpu_s | digits(3)) to 1; end to end: \($d.total.wall_s / $f.total.wall_s | digits(3)) and \(
    $d.total.cpu_s / $f.total.cpu_s | digits(3)) to 1. An iteration of Ceres takes \(
    $f.solve.wall_s / $f.iterations * 1000 | digits(2)) ms, one by differences \(
    $d.solve.wall_s / $d.iterations * 1000 | digits(2)) ms. Largest error of a coefficient: fit \($f | worst) %, differences \($d | worst) %\(
    if $d.converged then "" else " (not converged)" end).";

# ---- uniform light ----

def uniform_table: group_by(.material)[] | "\(.[0].material) | " + ([("known", "free") as $e | .[] | select(.exposure == $e) |
    if .found == null then "\(.message) | | | " else . as $r |
    [range(3) as $c | $r.found.channels[$c] as $f | $r.truth.sigma_a_per_mm[$c] as $a | $r.truth.sigma_s_prime_per_mm[$c] as $s |
        (($f.sigma_s_prime_per_mm / ($f.sigma_a_per_mm + $f.sigma_s_prime_per_mm)) / ($s / ($a + $s)) - 1) | fabs] as $errors |
    [combinations[] | select(.name == "alpha_prime")] as $said | [coefficients[]] as $all |
    "\(identifiable_text) | \($errors | max | in_percent(2)) | \($said | count(.inside)) of \($said | length) | \(
    $all | count(.inside)) of 6" end] | join(" | "));
