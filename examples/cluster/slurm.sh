#!/usr/bin/env bash
# One dataset by the tasks of a Slurm job array, each of which does its part of the shards, and then the report.
#
#     examples/cluster/slurm.sh RECIPE OUT [TASKS]      (on the login node, from the checkout)
#
# OUT lies on a file system that every node sees. The checkout and its .venv do, too.
#SBATCH --cpus-per-task=1
#SBATCH --mem=4G
#SBATCH --time=04:00:00
set -euo pipefail
recipe=${1:?give a recipe} out=${2:?give the folder of the dataset} tasks=${3:-16}
python=${PYTHON:-.venv/bin/python}

if [[ -n ${SLURM_ARRAY_TASK_ID:-} ]]; then # on a node: array tasks count from 1, as --shard does
    exec "$python" -m pipelines run "$recipe" --out "$out" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --quiet
fi
job=$(sbatch --parsable --array="1-$tasks" "$0" "$recipe" "$out")
sbatch --dependency="afterok:$job" --kill-on-invalid-dep=yes --wrap "$(printf '%q -m pipelines report %q' "$python" "$out")"
