#!/bin/bash
# A campaign as a SLURM job array: each job flies one piece on a node of its own.
#
#   mkdir -p shards
#   array=$(sbatch --parsable job_array.sh)
#   sbatch --dependency=afterok:$array --wrap "mc-engine merge runs/merged shards/shard-*"
#
# The merged run is the table that one process would have written.  A job that was killed is submitted again as it is
# (`sbatch --array=7 job_array.sh`): its piece is resumed.  Use nodes of one kind of processor.
# With STORE each piece keeps a copy on an object store.  A job that does not find its piece in the folder shards fetches
# it from there, and so does a machine elsewhere that is to merge them:
#
#   seq 20 | xargs -P 8 -I{} mc-engine fetch s3://bucket/my_case/shard-{} shards/shard-{}
#
# `exec`, so that the signal before the end of the time comes to the run, which then stops in good order.

#SBATCH --job-name=campaign
#SBATCH --array=1-20
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=16
#SBATCH --time=01:00:00
#SBATCH --signal=B:TERM@120
#SBATCH --output=shards/log-%a.txt

set -euo pipefail

CAMPAIGN=my_case
PIECES=20 # as many as the array has jobs
STORE= # such as s3://bucket/my_case
SHARD=shards/shard-$SLURM_ARRAY_TASK_ID
COPY=${STORE:+$STORE/shard-$SLURM_ARRAY_TASK_ID}

if [ -n "$COPY" ] && [ ! -d "$SHARD" ]; then
    said=$(mc-engine fetch "$COPY" "$SHARD" 2>&1) || case $said in
    *"holds no run"*) ;; # no job has flown this piece
    *)
        echo "$said" >&2
        exit 5
        ;;
    esac
fi
if [ -f "$SHARD/journal.jsonl" ]; then
    exec mc-engine resume "$SHARD" --workers "$SLURM_CPUS_PER_TASK" ${COPY:+--publish "$COPY"}
else
    exec mc-engine run "$CAMPAIGN" --shard "$SLURM_ARRAY_TASK_ID/$PIECES" --out "$SHARD" \
        --workers "$SLURM_CPUS_PER_TASK" ${COPY:+--publish "$COPY"}
fi
