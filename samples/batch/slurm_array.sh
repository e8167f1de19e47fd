#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A job array of Slurm: each task runs a shard of a batch. A task that is killed, preempted or whose node fails is
# requeued, and goes on where it was.
#
#   sbatch --array=1-8 samples/batch/slurm_array.sh models.csv out [OPTIONS of subvol batch ...]
#SBATCH --job-name=subvol
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@60
set -eu
manifest="$1" folder="$2"
shift 2
"${SUBVOL:-subvol}" batch "$manifest" -o "$folder" --quiet --jobs "${SLURM_CPUS_PER_TASK:-1}" \
  --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" "$@" &
batch=$!
# Signals of Slurm (a time limit, a preemption) come to this shell; the batch then ends in order.
trap 'kill -TERM "$batch"' TERM
status=0
wait "$batch" || status=$?
while kill -0 "$batch" 2>/dev/null; do
  status=0
  wait "$batch" || status=$?
done
# Models that failed (1) or have not converged (4) are in the records; the task itself has done its work.
[ "$status" -eq 1 ] || [ "$status" -eq 4 ] || exit "$status"
