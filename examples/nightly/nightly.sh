#!/bin/sh
# One night in this checkout: it sets itself up, runs, and ends with the night's exit code:
# 0 fine, 1 worse, 2 wrong use, 3 data or machine changed so that there is no verdict, 4 could not run.
# The history and the latest night's files lie in out/nights.
set -eu
cd "$(dirname "$0")/../.."
make setup
exec .venv/bin/python -m pipelines nightly run nightly --history out/nights "$@"
