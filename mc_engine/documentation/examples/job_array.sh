#!/bin/bash
# A campaign as a SLURM job array: each job flies one piece on a node of its own.
#
#   mkdir -p shards
#   array=$(sbatch --parsable job_array.sh)
#   sbatch --dependency=afterok:$array --wrap "mc-engine merge runs/merged shards/shard-*"
#
# The merged run is the table that one process would have written.  A job that was killed is submitted again as it is
# (`sbatch --array=7 job_array.sh`): its piece is resumed.  Use nodes of one kind of processor.
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
SHARD=shards/shard-$SLURM_ARRAY_TASK_ID

if [ -f "$SHARD/journal.jsonl" ]; then
    exec mc-engine resume "$SHARD" --workers "$SLURM_CPUS_PER_TASK"
else
    exec mc-engine run "$CAMPAIGN" --shard "$SLURM_ARRAY_TASK_ID/$PIECES" --out "$SHARD" --workers "$SLURM_CPUS_PER_TASK"
fi
