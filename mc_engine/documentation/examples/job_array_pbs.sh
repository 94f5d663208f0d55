#!/bin/bash
# A campaign as an array of PBS: each job flies one piece on a node of its own.
#
#   mkdir -p shards
#   array=$(qsub job_array_pbs.sh)
#   echo "cd $PWD && mc-engine merge runs/merged shards/shard-*" | qsub -W depend=afterok:$array
#
# The merged run is the table that one process would have written.  A job that was killed is submitted again as it is
# (`qsub -J 7-8 job_array_pbs.sh`): its piece is resumed.  Use nodes of one kind of processor.
# `exec`, so that the SIGTERM of `qdel` and of the end of the time comes to the run, which then stops in good order.

#PBS -N campaign
#PBS -J 1-20
#PBS -l select=1:ncpus=16:mem=16gb
#PBS -l walltime=01:00:00
#PBS -j oe

set -euo pipefail
cd "$PBS_O_WORKDIR"

CAMPAIGN=my_case
PIECES=20 # as many as the array has jobs
WORKERS=16 # as many as ncpus
SHARD=shards/shard-$PBS_ARRAY_INDEX

if [ -f "$SHARD/journal.jsonl" ]; then
    exec mc-engine resume "$SHARD" --workers "$WORKERS"
else
    exec mc-engine run "$CAMPAIGN" --shard "$PBS_ARRAY_INDEX/$PIECES" --out "$SHARD" --workers "$WORKERS"
fi
