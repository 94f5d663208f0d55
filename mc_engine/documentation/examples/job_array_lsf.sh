#!/bin/bash
# A campaign as an array of LSF: each job flies one piece on a node of its own.
#
#   mkdir -p shards
#   bsub < job_array_lsf.sh
#   bsub -w "done(campaign)" mc-engine merge runs/merged shards/shard-*
#
# The merged run is the table that one process would have written.  A job that was killed is submitted again as it is
# (`bsub -J "campaign[7]" < job_array_lsf.sh`): its piece is resumed.  Use nodes of one kind of processor.
# `exec`, so that the signal two minutes before the end of the time comes to the run, which then stops in good order.

#BSUB -J campaign[1-20]
#BSUB -n 16
#BSUB -R span[hosts=1]
#BSUB -W 01:00
#BSUB -wa TERM
#BSUB -wt 2
#BSUB -o shards/log-%I.txt

set -euo pipefail

CAMPAIGN=my_case
PIECES=20 # as many as the array has jobs
WORKERS=16 # as many as -n
SHARD=shards/shard-$LSB_JOBINDEX

if [ -f "$SHARD/journal.jsonl" ]; then
    exec mc-engine resume "$SHARD" --workers "$WORKERS"
else
    exec mc-engine run "$CAMPAIGN" --shard "$LSB_JOBINDEX/$PIECES" --out "$SHARD" --workers "$WORKERS"
fi
