#!/bin/sh
# scripts/fit_array.sbatch on a Slurm of one node, made for the test in a folder of its own and ended with it. Oracles:
# every row is done once, by the shard that its name belongs to; the same array again does what is left.
# usage: test_slurm.sh SOURCE PROGRAMS WORK; exit code 77: Slurm is not installed
set -eu
source_folder=$1
programs=$2
work=$3
PATH=$PATH:/usr/sbin:/sbin
for program in slurmctld slurmd sbatch squeue sinfo scancel munged; do
    command -v "$program" >/dev/null ||
        { echo "$program is not there: of the packages slurm-client, slurmctld, slurmd and munge one is missing"; exit 77; }
done
rm -rf "$work"
mkdir -p "$work"
# munged takes a socket of at most 107 bytes, in folders that none but their owner can write to
cluster=$(mktemp -d)
chmod 755 "$cluster"
munged_pid='' slurmctld_pid='' slurmd_pid=''

finish() {
    code=$?
    trap - EXIT INT TERM
    for pid in $slurmd_pid $slurmctld_pid $munged_pid; do
        kill "$pid" 2>/dev/null || true
        wait "$pid" 2>/dev/null || true
    done
    [ $code = 0 ] || tail -n 40 "$cluster"/*.log "$work"/*.log >&2 || true
    rm -rf "$cluster"
    exit $code
}
trap finish EXIT
trap 'exit 1' INT TERM

fail() {
    echo "[  FAILED  ] $*"
    exit 1
}

# Wait up to a minute for a command to succeed.
await() { # what, command...
    what=$1
    shift
    tries=0
    until "$@" >/dev/null 2>&1; do
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "no $what after a minute"
        sleep 0.1
    done
}

# A port that nobody listens on, from one given on.
free_port() {
    port=$1
    while grep -qi ":$(printf '%04X' "$port") 0*:0000 0A" /proc/net/tcp; do
        port=$((port + 1))
    done
    echo "$port"
}

# ---- a cluster -------------------------------------------------------------------------------------------------------

user=$(id -un)
node=$(hostname -s)
first_port=$((20000 + $$ % 10000))
controller_port=$(free_port $first_port)
node_port=$(free_port $((controller_port + 1)))
mkdir "$cluster/state" "$cluster/spool"
dd if=/dev/urandom of="$cluster/munge.key" bs=1024 count=1 2>/dev/null
chmod 600 "$cluster/munge.key"
cat >"$cluster/slurm.conf" <<CONF
ClusterName=test
SlurmctldHost=$node(127.0.0.1)
SlurmUser=$user
SlurmdUser=$user
SlurmctldPort=$controller_port
SlurmdPort=$node_port
AuthType=auth/munge
AuthInfo=socket=$cluster/munge.socket
CredType=cred/munge
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool
SlurmdParameters=config_overrides
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/slurmd.pid
SlurmctldLogFile=$cluster/slurmctld.log
SlurmdLogFile=$cluster/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=1,sched_interval=2
ReturnToService=2
SwitchType=switch/none
MpiDefault=none
NodeName=$node NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP OverSubscribe=YES
CONF
export SLURM_CONF="$cluster/slurm.conf"

# As daemons in the foreground, they are this script's children, to be ended by their ids.
munged --foreground --force --key-file="$cluster/munge.key" --socket="$cluster/munge.socket" \
    --pid-file="$cluster/munged.pid" --log-file="$cluster/munged.log" --seed-file="$cluster/munge.seed" \
    >"$cluster/munged.log" 2>&1 &
munged_pid=$!
await 'munge socket' test -S "$cluster/munge.socket"
slurmctld -D -f "$SLURM_CONF" >"$cluster/slurmctld.out.log" 2>&1 &
slurmctld_pid=$!
slurmd -D -f "$SLURM_CONF" -N "$node" >"$cluster/slurmd.out.log" 2>&1 &
slurmd_pid=$!
node_is_idle() {
    [ "$(sinfo --noheader --format=%T)" = idle ]
}
await 'idle node' node_is_idle
echo '[       OK ] a Slurm of one node is up'

# ---- a list ----------------------------------------------------------------------------------------------------------

cd "$work"
PATH=$programs:$PATH
cat >scene.json <<'SCENE'
{ "camera": { "eye": [5, 10, 48], "target": [0, 0, 0], "fov_y_deg": 38, "size": [48, 36] },
  "lights": [{ "kind": "directional", "direction": [-0.5, -0.6, -0.6], "irradiance": 3 }],
  "objects": [{ "primitive": "sphere", "detail": 32, "transform": { "scale": 12 }, "material": "skin1" }] }
SCENE
render scene.json -q --epsilon 0.05 -o picture.exr >render.log 2>&1
echo 'name,scene,target,start' >list.csv
for row in 1 2 3 4 5 6 7 8; do
    echo "a$row,scene.json,picture.exr,skin1" >>list.csv
done
echo 'late,scene.json,late.exr,' >>list.csv

submit() { # the array's shape; leaves exit code 0 when all tasks had it
    timeout 120 sbatch --quiet --wait --array="$1" "$source_folder/scripts/fit_array.sbatch" list.csv found
}
done_names() {
    cat found/results.*.jsonl | jq -r 'select(.status == "done") | .name' | sort | tr '\n' ' '
}

if submit 1-3 >submit.log 2>&1; then
    fail 'a failed row does not show in the exit code of its task'
fi
expected='a1 a2 a3 a4 a5 a6 a7 a8 '
[ "$(done_names)" = "$expected" ] || fail "done: $(done_names), expected $expected"
[ "$(ls found/results.*)" = "$(printf 'found/results.%d-of-3.jsonl\n' 1 2 3)" ] || fail "files: $(ls found)"
echo '[       OK ] an array of three does every row but the one without a picture, each once'

cp picture.exr late.exr
submit 1-3 >submit.log 2>&1 || fail 'the array fails although all rows can be done'
[ "$(done_names)" = "${expected}late " ] || fail "done: $(done_names), expected ${expected}late"
echo '[       OK ] the same array does what is left, and that alone'

# the commands in docs/batch.md that make tables
awk '/^    jq / { inside = 1 } !/^    / { inside = 0 } inside' "$source_folder/docs/batch.md" >tables.sh
sh -eu ./tables.sh
[ "$(wc -l <found.csv)" = 27 ] || fail "found.csv: $(cat found.csv)"
[ "$(grep -c '^"a[1-8]","done","dipole","[RGB]",0\.' found.csv)" = 24 ] || fail "found.csv: $(cat found.csv)"
[ "$(wc -l <failed.csv)" = 0 ] || fail "failed.csv: $(cat failed.csv)"
echo '[       OK ] the commands in docs/batch.md make tables'

# a pipe without a writer: a row that never ends
mkfifo never.exr
echo 'never,scene.json,never.exr,' >>list.csv
job=$(sbatch --parsable --array=1-1 "$source_folder/scripts/fit_array.sbatch" list.csv alone)
nine_are_done() {
    [ "$(grep -c '"status": "done"' alone/results.1-of-1.jsonl)" = 9 ]
}
await 'results of a task under way' nine_are_done
scancel "$job"
job_is_over() {
    [ -z "$(squeue --noheader --jobs="$job")" ]
}
await 'end of the cancelled task' job_is_over
grep -q "fit: interrupted; 9 rows done now, 0 skipped, 0 failed" "fit-$job-1.log" ||
    fail "a cancelled task does not say that it was interrupted: $(cat "fit-$job-1.log")"
[ "$(wc -l <alone/results.1-of-1.jsonl)" = 9 ] || fail 'a cancelled row has a line'
echo '[       OK ] a task that is cancelled keeps what it has done'
echo '[  PASSED  ] 5 test(s).'
