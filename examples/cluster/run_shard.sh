#!/bin/sh
# Evaluates this job's part of a manifest. A scheduler starts it once for each part of an array of jobs, and says which
# part it is in the environment:
#
#     run_shard.sh flights.csv /shared/out --jobs 4
#
# VICE names the program where it is not on the PATH.
set -eu
usage="usage: run_shard.sh MANIFEST OUT [OPTIONS OF vice batch]"
manifest=${1:?$usage}
out=${2:?$usage}
shift 2

if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    index=$(((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN) / ${SLURM_ARRAY_TASK_STEP:-1}))
    count=$SLURM_ARRAY_TASK_COUNT
elif [ -n "${JOB_COMPLETION_INDEX:-}" ]; then
    # Kubernetes says which part, and not of how many.
    index=$JOB_COMPLETION_INDEX
    count=${SHARDS:?set SHARDS to the completions of the job}
elif [ -n "${AWS_BATCH_JOB_ARRAY_INDEX:-}" ]; then
    index=$AWS_BATCH_JOB_ARRAY_INDEX
    count=${AWS_BATCH_JOB_ARRAY_SIZE:-${SHARDS:?set SHARDS to the size of the array}}
elif [ -n "${BATCH_TASK_INDEX:-}" ]; then
    # Google Batch.
    index=$BATCH_TASK_INDEX
    count=$BATCH_TASK_COUNT
else
    echo "run_shard.sh: no scheduler says which part this is (Slurm array, Kubernetes indexed job, AWS or Google Batch)" >&2
    exit 2
fi
exec "${VICE:-vice}" batch "$manifest" --out "$out" --shard "$((index + 1))/$count" "$@"
