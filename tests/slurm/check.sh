#!/usr/bin/env bash
# Checks that a match in bands, sent to Slurm, survives the death of a band and has the maps of a match in one process:
#
#   tests/slurm/cluster.sh tests/slurm/check.sh EPIRIG_BINARY
#
# All files lie in a folder of TMPDIR that is removed in the end. Exit code 0: all is as expected; 1: not, with what was expected
# and all logs; 2: wrong use.
#
# How a band dies: `epirig submit` names its own file in the job script. That file is a copy here, and no job starts while the
# partition is down. In that time a script takes the place of the copy. It calls the real one, for one band under strace, which
# sends SIGKILL when that band first asks for its data to be on the disk: as it writes its first part, before the part has its
# name. So it dies at the same point in every run, however fast the machine is.
set -euo pipefail
if [ $# != 1 ] || [ ! -x "$1" ]; then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "$0"
  exit 2
fi
# It takes a partition down: not on a cluster that others use.
: "${CLUSTER_LOGS:?run this by tests/slurm/cluster.sh}"
given=$(realpath "$1")

bands=8
killed=5
block_rows=16
limit_s=300

# --- What the check knows of epirig ---------------------------------------------------------------------------------------

# All run in the folder of the check; `$bin/epirig` is the program.
make_sequence() { "$bin/epirig" capture --out seq --rig sim --set camera.size=256x192 --frames 24 --step-mm 5; }
match_whole() { "$bin/epirig" match seq --out whole --block-rows "$block_rows"; }
survey() { "$bin/epirig" match seq --survey --bands "$bands" --block-rows "$block_rows"; }
print_script() { "$bin/epirig" submit seq --slurm partition=lab --dry-run; }
# Writes {"array": "ID", "merge": "ID", ...}.
submit() { "$bin/epirig" submit seq --slurm partition=lab --json; }
merge() { "$bin/epirig" match seq --merge; }
plan=seq/bands/plan.json
results=seq/results
refusal="of $bands bands these are missing or not to be used: $killed (not there);"
# Each part with what changes when it is written again.
list_parts() { stat --format '%n inode %i, written %y' seq/bands/*.part; }

# --- Steps ----------------------------------------------------------------------------------------------------------------

SECONDS=0
say() { echo "slurm check, $SECONDS s: $*"; }

show_logs() {
  local log
  for log in "$CLUSTER_LOGS"/*.log log/* seq/bands/*.log; do
    [ -s "$log" ] || continue
    echo "--- the end of $log"
    tail -n 20 "$log"
  done
  echo "--- jobs"
  scontrol --oneliner show job | grep -oE '\b(JobId|ArrayJobId|ArrayTaskId|JobName|JobState|Reason|Dependency|ExitCode)=[^ ]+' |
    paste --serial --delimiters ' ' | sed 's/ JobId=/\nJobId=/g' || true
  echo "--- seq/bands"
  ls -lA seq/bands || true
}

# expected WHAT INSTEAD
expected() {
  show_logs >&2
  say "FAILED: expected that $1, but $2" >&2
  exit 1
}

# run NAME COMMAND...: what it says goes to log/NAME.
run() {
  local name=$1 status=0
  shift
  "$@" > "log/$name" 2> "log/$name.err" || status=$?
  [ "$status" = 0 ] || expected "\`$name\` ends with 0" "it ended with $status"
}

# job_id array|merge FILE
job_id() {
  local id
  id=$(grep -oE "\"$1\": *\"?[0-9]+" "$2" | grep -oE '[0-9]+$') ||
    expected "submit names the job of the $1" "it printed: $(cat "$2")"
  echo "$id"
}

# Holds all jobs that are sent from now on, or lets them go.
partition() { scontrol update PartitionName=lab State="$1"; }

# job_states ID: a line `BAND STATE` for each band that is not in the queue as one of a range, or `- STATE`.
job_states() {
  scontrol --oneliner show job "$1" |
    sed -nE 's/^JobId=[0-9]+ (ArrayJobId=[0-9]+ ArrayTaskId=([^ ]+) )?.* JobState=([A-Z_]+) .*/\2 \3/; s/^ /- /; T; p' | sort -n
}

# wait_for ID NAME: until it has ended, whatever its end is.
wait_for() {
  local states end=$((SECONDS + limit_s))
  while states=$(job_states "$1") && grep -qE ' (PENDING|CONFIGURING|RUNNING|COMPLETING|SUSPENDED)$' <<< "$states"; do
    [ "$SECONDS" -lt "$end" ] || expected "the $2 ends within $limit_s s" "it is: $(tr '\n' ',' <<< "$states")"
    sleep 0.2
  done
}

# The script in the place of the copy.
write_stand_in() {
  cat > "$bin/stand-in" << STAND_IN
#!/usr/bin/env bash
case " \$* " in
  *" --band $killed "* | *" --band=$killed "*)
    strace -f -qq -y -o "$work/log/killed-at" -e signal=none -e trace=fsync,fdatasync -e inject=fsync,fdatasync:signal=KILL \\
      "$work/real/epirig" "\$@"
    status=\$?
    echo \$status >> "$work/killed"
    exit \$status
    ;;
esac
exec "$work/real/epirig" "\$@"
STAND_IN
  chmod +x "$bin/stand-in"
}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
bin=$work/bin
mkdir bin real log
cp "$given" bin/epirig

run capture make_sequence
say "the sequence is made"

run whole match_whole
say "one process has matched it: $(cd whole && echo *.tiff)"

run survey survey
[ -s "$plan" ] || expected "the survey writes $plan" "there is no such file"
say "the survey has written $plan"

run dry-run print_script
grep -qF "$bin/epirig" log/dry-run || expected "the job script calls $bin/epirig" "it does not, see log/dry-run"
[ -z "$(squeue --noheader)" ] || expected "--dry-run sends nothing" "there are jobs"
say "--dry-run prints the job script and sends nothing"

partition DOWN
run submit submit
array_id=$(job_id array log/submit)
merge_id=$(job_id merge log/submit)
write_stand_in
mv bin/epirig real/epirig
mv bin/stand-in bin/epirig
say "sent: array $array_id, merge $merge_id; epirig of band $killed will be killed"

partition UP
wait_for "$array_id" array
[ -s killed ] || expected "a task calls \`$bin/epirig match seq --band $killed\`" "none did"
[ "$(cat killed)" = "$((128 + $(kill -l KILL)))" ] ||
  expected "band $killed is killed, once, at its first fsync" "epirig ended with $(tr '\n' ' ' < killed)"
killed_at=$(grep -m1 -oE '(fsync|fdatasync)\([^)]*\)' log/killed-at || true)
[[ $killed_at == */seq/bands/* ]] || expected "band $killed is killed as it writes its first part" "it was at: $killed_at"
for ((band = 0; band < bands; band++)); do
  [ "$band" = "$killed" ] && echo "$band FAILED" || echo "$band COMPLETED"
done > log/expected-states
job_states "$array_id" > log/states
cmp -s log/expected-states log/states || expected "only band $killed failed" "the bands are: $(tr '\n' ',' < log/states)"
say "band $killed was killed at $killed_at; all others have ended well"

wait_for "$merge_id" merge
[ "$(job_states "$merge_id")" = '- CANCELLED' ] || expected "the merge is cancelled" "it is: $(job_states "$merge_id")"
[ ! -e "$results" ] || expected "there are no results" "there is $results"
say "the merge was cancelled"

# By the real program: the stand-in is still in the place of the copy.
mv real/epirig bin/epirig
status=0
merge > log/refused-merge 2>&1 || status=$?
[ "$status" != 0 ] || expected "\`match --merge\` refuses" "it ended with 0"
grep -qF "$refusal" log/refused-merge || expected "it says \"$refusal\"" "it said: $(cat log/refused-merge)"
[ ! -e "$results" ] || expected "there are no results" "there is $results"
say "\`match --merge\` refuses, and ends with $status: $(grep -F "$refusal" log/refused-merge)"

list_parts > log/parts-before
partition DOWN
run submit-again submit
array_id=$(job_id array log/submit-again)
merge_id=$(job_id merge log/submit-again)
scontrol hold "$merge_id"
say "sent again: array $array_id, merge $merge_id"

partition UP
wait_for "$array_id" array
job_states "$array_id" > log/states
! grep -qv ' COMPLETED$' log/states || expected "all bands end well" "they are: $(tr '\n' ',' < log/states)"
[ "$(wc -l < log/states)" = 1 ] || expected "only band $killed is sent again" "the bands are: $(tr '\n' ',' < log/states)"
list_parts > log/parts-after
[ -z "$(comm -23 <(sort log/parts-before) <(sort log/parts-after))" ] ||
  expected "valid parts stay as they are" "some have changed: $(diff log/parts-before log/parts-after || true)"
say "$(wc -l < log/parts-before) parts are as they were, $(($(wc -l < log/parts-after) - $(wc -l < log/parts-before))) are new"

scontrol release "$merge_id"
wait_for "$merge_id" merge
[ "$(job_states "$merge_id")" = '- COMPLETED' ] || expected "the merge ends well" "it is: $(job_states "$merge_id")"
say "the merge has ended"

(cd whole && ls -- *.tiff) > log/maps-whole
(cd "$results" && ls -- *.tiff) > log/maps-merged || true
cmp -s log/maps-whole log/maps-merged ||
  expected "$results has the maps of one process" "they are others: $(diff log/maps-whole log/maps-merged || true)"
while read -r map; do
  difference=$(cmp "whole/$map" "$results/$map" 2>&1) || expected "$map is that of one process to the last bit" "$difference"
done < log/maps-whole
say "passed: $(wc -l < log/maps-whole) maps are equal to the last bit: $(tr '\n' ' ' < log/maps-whole)"
