#!/usr/bin/env bash
# Runs a command beside a real Slurm (Debian's slurmctld, slurmd and munged) that exists only for that command:
#
#   tests/slurm/cluster.sh COMMAND [ARGUMENT...]      for example  tests/slurm/cluster.sh sinfo
#
# It needs Linux, root, and Debian's slurm-wlm and munge, which it installs where they are missing; so it does with strace, for
# check.sh. Where Slurm cannot be had it says so in a line that begins with SKIPPED, and ends with 0; else with the exit code of
# the command.
#
# The cluster has one node, with the processors and half of the memory of this machine, in the partition `lab`. It lives in
# namespaces of its own (processes, network, mounts, host name), and its folder is a tmpfs that only they see. When they end,
# the kernel takes all of it away, also after `kill -9`: nothing goes on, and nothing is left in a file.
#
# The command gets SLURM_CONF, a TMPDIR in that folder, and in CLUSTER_LOGS the folder of the logs of the cluster.
set -euo pipefail
programs=(munged slurmctld slurmd sbatch ip strace)
packages=(munge slurm-wlm iproute2 strace)
start_limit_s=60
node=lab1
address=198.51.100.1

say() { echo "slurm: $*"; }
skip() { echo "SKIPPED: there is no Slurm: $*"; exit 0; }
fail() { say "$*" >&2; show_logs; exit 1; }

# --- Outside: packages and namespaces -------------------------------------------------------------------------------------

has_programs() {
  local program
  for program in "${programs[@]}"; do
    command -v "$program" > /dev/null || return
  done
}

# The packages would start their services; here these end with apt-get, and see no systemd to be started by.
install_packages() {
  # shellcheck disable=SC2016  # for the inner shell
  DEBIAN_FRONTEND=noninteractive unshare --mount --pid --fork --kill-child --mount-proc \
    sh -c 'mount -t tmpfs tmpfs /run && exec "$@"' sh \
    apt-get install -y -qq --no-install-recommends -o DPkg::Lock::Timeout=120 "${packages[@]}"
}

get_programs() {
  ! has_programs || return 0
  command -v apt-get > /dev/null || skip "it is not installed, and there is no apt-get"
  say "installing ${packages[*]}"
  local log
  log=$(install_packages 2>&1) || log=$({ apt-get update -qq && install_packages; } 2>&1) || {
    tail -n 5 <<< "$log"
    skip "apt-get cannot install ${packages[*]}"
  }
  has_programs || skip "not all of ${programs[*]} are there after installing ${packages[*]}"
}

# The namespaces end with their first process, that one with `unshare`, and `unshare` with this shell.
inside=(unshare --mount --pid --net --uts --ipc --fork --kill-child=KILL --mount-proc)
check_namespaces() {
  local refused
  refused=$("${inside[@]}" true 2>&1) || skip "this machine allows no namespaces: $refused"
}
run_in_namespaces() {
  # In the background, so that a signal reaches this shell at once.
  setpriv --pdeathsig KILL "${inside[@]}" bash "$0" --inside "$@" <&0 &
  local namespaces=$! status=0
  # shellcheck disable=SC2064  # its value now
  trap "kill -KILL $namespaces" INT TERM HUP
  wait "$namespaces" || status=$?
  exit "$status"
}

# --- Inside: the cluster --------------------------------------------------------------------------------------------------

# The tmpfs hides the machine's own /run.
state=/run/epirig-slurm
logs=$state/log

show_logs() {
  local log
  for log in "$logs"/*; do
    # A daemon says what it writes to its log, too.
    if [ ! -s "$log" ] || [ -s "${log%.out}.log" ]; then continue; fi
    echo "--- the end of $(basename "$log")"
    tail -n 25 "$log"
  done >&2
}

# With nothing but a loopback no address is found, not even 127.0.0.1, as the resolver asks for those that an interface has.
bring_up_network() {
  ip link set lo up
  local kind
  for kind in veth dummy bridge; do
    if ip link add epirig0 type "$kind" 2> /dev/null; then
      ip address add "$address/24" dev epirig0
      ip link set epirig0 up
      return
    fi
  done
  skip "this kernel makes no network interface"
}

# No name server can be reached.
name_node() {
  echo "$node" > /proc/sys/kernel/hostname
  printf '127.0.0.1 localhost\n%s %s\n' "$address" "$node" > "$state/hosts"
  [ ! -e /etc/hosts ] || mount --bind "$state/hosts" /etc/hosts
}

# Half of the memory is what jobs may ask for. Nothing stops a job that takes more.
write_configuration() {
  local cpus memory_mb
  cpus=$(nproc --all)
  memory_mb=$(awk '$1 == "MemTotal:" { print int($2 / 2048) }' /proc/meminfo)
  cat > "$SLURM_CONF" << CONFIGURATION
ClusterName=epirig
SlurmctldHost=$node($address)
SlurmUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$state/munge/socket
StateSaveLocation=$state/controller
SlurmdSpoolDir=$state/node
SlurmctldPidFile=$state/slurmctld.pid
SlurmdPidFile=$state/slurmd.pid
SlurmctldLogFile=$logs/slurmctld.log
SlurmdLogFile=$logs/slurmd.log
MailProg=/bin/true
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$logs/jobs.log
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
DefMemPerCPU=$((memory_mb / cpus))
ReturnToService=2
SlurmdParameters=config_overrides
SchedulerParameters=batch_sched_delay=0
MinJobAge=86400
KillWait=5
NodeName=$node NodeAddr=$address CPUs=$cpus RealMemory=$memory_mb State=UNKNOWN
PartitionName=lab Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONFIGURATION
}

start_munged() {
  (umask 077 && head -c 128 /dev/urandom > "$state/munge/key")
  munged --foreground --num-threads 2 --key-file "$state/munge/key" --socket "$state/munge/socket" \
    --pid-file "$state/munge/pid" --seed-file "$state/munge/seed" < /dev/null > "$logs/munged.out" 2>&1 &
  daemons+=($!)
  wait_until "munged answers" test -S "$state/munge/socket"
}

start() {
  "$@" -D < /dev/null > "$logs/$1.out" 2>&1 &
  daemons+=($!)
}

# shellcheck disable=SC2317  # called by name
is_idle() { [ "$(sinfo --noheader --nodes "$node" --format %T 2> "$logs/sinfo.out")" = idle ]; }

# wait_until WHAT COMMAND...: waits for the command to succeed, while all daemons are there.
wait_until() {
  local what=$1 daemon
  shift
  until "$@"; do
    for daemon in "${daemons[@]}"; do
      kill -0 "$daemon" 2> /dev/null || fail "expected that $what, but a daemon has ended"
    done
    [ "$SECONDS" -lt "$start_limit_s" ] || fail "expected that $what within $start_limit_s s"
    sleep 0.1
  done
}

run_inside() {
  [ $$ = 1 ] || { say "--inside is for this script itself" >&2 && exit 2; }
  mount -t tmpfs -o mode=755 tmpfs /run
  mkdir -p "$logs" "$state/munge" "$state/controller" "$state/node" "$state/tmp"
  # This may itself be a job of another Slurm.
  unset "${!SLURM@}" "${!SBATCH@}" "${!SQUEUE@}" "${!SINFO@}" "${!SCANCEL@}" HOSTNAME
  export SLURM_CONF=$state/slurm.conf TMPDIR=$state/tmp CLUSTER_LOGS=$logs
  bring_up_network
  name_node
  write_configuration
  daemons=()
  SECONDS=0
  start_munged
  start slurmctld
  start slurmd
  wait_until "sinfo says that $node is idle" is_idle
  say "$(slurmctld -V) is up after $SECONDS s"
  local status=0
  "$@" || status=$?
  exit "$status"
}

case ${1:-} in
  '') sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "$0" && exit 2 ;;
  --inside) shift && run_inside "$@" ;;
esac
[ "$(uname -s)" = Linux ] || skip "this is not Linux"
[ "$(id -u)" = 0 ] || skip "only root can start it"
for program in unshare setpriv; do
  command -v "$program" > /dev/null || skip "there is no $program"
done
check_namespaces
get_programs
run_in_namespaces "$@"
