#!/usr/bin/env bash
# One dataset by a Ray cluster: this machine and others that ssh reaches.
#
#     examples/cluster/ray.sh RECIPE OUT [HOST...]      (from the checkout)
#
# Each machine has the checkout and its .venv under the same path, with Ray in it (.venv/bin/python -m pip install
# "ray>=2.9"), and sees OUT under the same path. At the end Ray is stopped on all of them, with whatever else this user
# runs in it.
set -euo pipefail
recipe=${1:?give a recipe} out=${2:?give the folder of the dataset}
shift 2
bin=$(cd "${BIN:-.venv/bin}" && pwd)
address=$(hostname -f):${PORT:-6379}

everywhere() { # a command on the other machines
    for host in "${hosts[@]}"; do ssh "$host" "cd $(printf '%q' "$PWD") && $*"; done
}
stop() {
    everywhere "$bin/ray stop" || true
    "$bin/ray" stop
}

hosts=("$@")
trap stop EXIT
"$bin/ray" start --head --port="${address##*:}" --disable-usage-stats
everywhere "$bin/ray start --address=$address"
"$bin/python" -m pipelines run "$recipe" --out "$out" --engine ray --ray-address "$address"
