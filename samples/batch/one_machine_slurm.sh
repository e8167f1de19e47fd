#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# one_machine_slurm.sh FOLDER COMMAND ...: starts Slurm on this machine alone, runs a command with it, and ends it again:
# to try scripts out without a cluster. Needs slurm-wlm and munge, and to be root in a container or machine of your own.
#
#   samples/batch/one_machine_slurm.sh slurm_folder sbatch --wait --array=1-8 samples/batch/slurm_array.sh models.csv out
set -eu
folder="$(mkdir -p "$1" && cd "$1" && pwd)"
shift
node="$(hostname -s)"
memory="$(awk '/MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo)"
mkdir -p "$folder/state" "$folder/spool"
export SLURM_CONF="$folder/slurm.conf"
cat > "$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$node
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
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
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
MpiDefault=none
NodeName=$node CPUs=$(nproc) RealMemory=$memory State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF

# munge wants files that only its user can write, in folders that nobody else can.
chmod 755 "$folder"
[ -f "$folder/munge.key" ] || (umask 077 && head -c 1024 /dev/urandom > "$folder/munge.key")
munged --force --foreground --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
  --pid-file="$folder/munged.pid" --log-file="$folder/munged.log" --seed-file="$folder/munged.seed" 2> "$folder/munged.out" &
munge=$!
trap 'kill $daemons $munge 2>/dev/null || true; wait' EXIT
daemons=""
sleep 1
slurmctld -D > "$folder/slurmctld.out" 2>&1 &
daemons="$!"
slurmd -D > "$folder/slurmd.out" 2>&1 &
daemons="$daemons $!"
for _ in $(seq 60); do
  sinfo --noheader --format %t 2>/dev/null | grep -q idle && break
  sleep 1
done
sinfo --noheader --format %t | grep -q idle || { tail "$folder"/*.log >&2; exit 77; }
"$@"
