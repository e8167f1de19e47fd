#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# with_parallel.sh MANIFEST FOLDER [SHARDS] [OPTIONS of GNU parallel ...]: runs a batch with GNU parallel, a process for
# each shard.
#
# With --sshlogin host1,host2 the shards run on several machines that share the folder. To share the cores of one machine,
# `subvol batch --jobs N` alone does the same.
set -eu
manifest="$1" folder="$2" shards="${3:-8}"
shift 2
[ $# -eq 0 ] || shift
status=0
seq "$shards" | parallel "$@" "${SUBVOL:-subvol}" batch "$manifest" -o "$folder" --jobs 1 --quiet --shard "{}/$shards" ||
  status=$?
# GNU parallel counts the shards with a failed model, which are no failures of the batch.
"${SUBVOL:-subvol}" batch report "$folder" -o "$folder/report.html" --force
[ "$status" -le 100 ] || exit "$status"
