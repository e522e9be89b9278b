#!/bin/sh
# Starts a Slurm of one node, sends it a turntable of 8 frames as an array job of 4 tasks, kills one of them between its
# two frames, requeues it, and finds all frames whole.
#
# Daemons, keys, ports, state and logs are the test's own, in a temporary folder, and end with it. Needs root and the
# packages of cmake/packages_farm.txt.
# Usage: run.sh PROGRAM
set -eu
program=$(realpath "$1")
here=$(realpath "$(dirname "$0")")
data=$here/../../data
user=$(id -un)
PATH=$PATH:/usr/sbin:/sbin
# A short path: sockets have names of at most 107 letters.
folder=$(mktemp -d /tmp/nephele-farm.XXXXXX)
munged_id= controller_id= node_id=

show_logs() {
  for log in "$folder"/*.log; do
    echo "--- $log" >&2
    tail -n 40 "$log" >&2
  done
}

clean_up() {
  code=$?
  trap - EXIT INT TERM
  set +e
  [ "$code" = 0 ] || show_logs
  if [ -n "$node_id" ]; then
    scancel --full --signal=KILL --user="$user" 2>/dev/null
    scancel --user="$user" 2>/dev/null
    for attempt in 1 2 3 4 5; do
      [ -z "$(squeue --noheader --states=running,completing 2>/dev/null)" ] && break
      sleep 1
    done
  fi
  # What is left of the jobs, then the daemons, each by its own number.
  for id in $(cat "$folder"/tasks/*.id 2>/dev/null) $node_id $controller_id $munged_id; do
    kill "$id" 2>/dev/null
  done
  for id in $node_id $controller_id $munged_id; do
    wait "$id" 2>/dev/null
  done
  rm -rf "$folder"
  exit "$code"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

fail() {
  echo "error: $1" >&2
  exit 1
}

# wait_for SECONDS WHAT COMMAND...: until the command succeeds.
wait_for() {
  tries=$(($1 * 5))
  what=$2
  shift 2
  while ! "$@" >/dev/null 2>&1; do
    tries=$((tries - 1))
    [ "$tries" -gt 0 ] || fail "waited in vain for: $what"
    sleep 0.2
  done
}

for tool in munged slurmctld slurmd sbatch scontrol squeue; do
  command -v "$tool" >/dev/null || fail "$tool is not installed; make test-farm installs it"
done
[ "$user" = root ] || fail "the daemons of Slurm need root"

# --- the farm
mkdir "$folder/state" "$folder/spool" "$folder/tasks"
chmod 755 "$folder"
dd if=/dev/urandom of="$folder/munge.key" bs=128 count=1 2>/dev/null
chmod 600 "$folder/munge.key"
ports=$(python3 -c '
import socket
held = [socket.socket() for _ in range(2)]
for s in held: s.bind(("127.0.0.1", 0))
print(*[s.getsockname()[1] for s in held])')
cores=$(nproc)
cat >"$folder/slurm.conf" <<END
ClusterName=nephele_test
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmctldPort=${ports% *}
SlurmdPort=${ports#* }
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_interval=1
PropagateResourceLimits=NONE
NodeName=node1 NodeHostname=$(hostname) NodeAddr=127.0.0.1 CPUs=$cores
PartitionName=farm Nodes=node1 Default=YES State=UP
END
# Read only where a plugin asks for control groups, which none does.
echo 'CgroupAutomount=no' >"$folder/cgroup.conf"
export SLURM_CONF="$folder/slurm.conf"

munged --foreground --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
  --pid-file="$folder/munge.pid" --seed-file="$folder/munge.seed" --log-file="$folder/munged.log" \
  2>"$folder/munged_start.log" &
munged_id=$!
wait_for 10 "munged" test -S "$folder/munge.socket"
slurmctld -D -f "$SLURM_CONF" 2>"$folder/slurmctld_start.log" &
controller_id=$!
wait_for 20 "slurmctld" scontrol ping
slurmd -D -f "$SLURM_CONF" 2>"$folder/slurmd_start.log" &
node_id=$!
idle() { sinfo --noheader --format=%T | grep -q idle; }
wait_for 20 "a node that takes jobs" idle
echo "farm: one node, $cores CPUs"

# --- the job
cd "$folder"
"$program" cloud "$data/cloud_base.obj" -o cloud.vdb --resolution 100 --quiet
# Slow enough that a task can be met between its frames.
job=$(NEPHELE="$program" sbatch --parsable --array=1-4 --cpus-per-task=1 --output="$folder/tasks/%a.log" \
  "$data/render_farm/turntable.sbatch" cloud.vdb 'frames/cloud.####.exr' 1-8 --size 160x90 --samples 400)
echo "farm: array job $job"

finished() { ! squeue --noheader --jobs="$job" --states=all --format=%T | grep -qvE 'COMPLETED|FAILED'; }
state() { squeue --noheader --jobs="${job}_$1" --states=all --format=%T; }
# The process of the program in a task.
process() {
  for id in $(scontrol listpids "$(squeue --noheader --jobs="${job}_$1" --format=%A)" | awk 'NR > 1 { print $1 }' | sort -u); do
    [ "$(readlink "/proc/$id/exe")" != "$program" ] || echo "$id"
  done
}

# Task 2 has the frames 2 and 6.
wait_for 120 "the first frame of task 2" test -e frames/cloud.0002.exr
id=$(process 2)
[ -n "$id" ] || fail "task 2 has no process"
kill -9 "$id"
wait_for 30 "task 2 to have failed" sh -c "[ \"\$(squeue --noheader --jobs=${job}_2 --states=all --format=%T)\" = FAILED ]"
[ ! -e frames/cloud.0006.exr ] || fail "task 2 was killed too late"
before=$(stat -c '%i %Y' frames/cloud.0002.exr)
echo "farm: killed task 2 between its frames"

scontrol requeue "${job}_2"
# Slurm lets a requeued job wait for two minutes.
scontrol update JobId="${job}_2" StartTime=now
wait_for 240 "frame 6" test -e frames/cloud.0006.exr
wait_for 240 "all tasks to have ended" finished
for task in 1 2 3 4; do
  [ "$(state $task)" = COMPLETED ] || { cat "tasks/$task.log" >&2; fail "task $task: $(state $task)"; }
done
[ "$(stat -c '%i %Y' frames/cloud.0002.exr)" = "$before" ] || fail "frame 2 was whole and was made again"

# --- what came out
for frame in 1 2 3 4 5 6 7 8; do
  "$program" info "frames/cloud.000$frame.exr" | grep -q 'image 160 x 90' || fail "frame $frame is not whole"
done
[ "$(ls frames | wc -l)" = 8 ] || fail "there are other files than the 8 frames"

# The end of the work as a job that waits for the array. Not afterok: that remembers the failure.
sheet=$(sbatch --parsable --dependency="afterany:$job" --output="$folder/tasks/sheet.log" --wrap \
  "'$program' turntable cloud.vdb -o 'frames/cloud.####.exr' --frames 1-8 --size 160x90 --samples 400 --skip-existing --contact-sheet sheet.png")
wait_for 60 "the contact sheet" test -e sheet.png
"$program" info sheet.png | grep -q PNG || fail "the contact sheet is not whole"
grep -q 'skipping 8 of 8' tasks/sheet.log || fail "job $sheet made frames again"
echo "farm: 8 frames whole, contact sheet made"
