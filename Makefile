# Everything sets itself up: a machine needs Python >= 3.11 with venv, and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SETUP := $(VENV)/.done
BLENDER := .venv-blender
BLENDER_PYTHON ?= $(PYTHON)

.PHONY: help setup demo nightly test test-full test-gpu check-slow stress test-oldest test-newest lint types layers layers-picture \
	docs bench bench-blender measurements wheel lock clean

help:  ## this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 16

setup: $(SETUP)  ## the lab's environment in .venv

$(SETUP): requirements.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or later is needed; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.txt
	@$(BIN)/python tools/link.py
	@touch $@

demo: $(SETUP)  ## 40 frames in closed form, 10 in a room, poses and out/demo/report.html
	$(BIN)/python -m pipelines demo --out out/demo

NIGHTLY := $(BIN)/python -m pipelines nightly
NIGHTS := out/nights-smoke

# The first night has no baseline yet, so that it ends with 3; accepted, it is the baseline of the second and of later
# calls. The night's exit code is in the last lines; make's own is 2 for any code but 0.
nightly: $(SETUP)  ## two small nights, the first accepted as the second's baseline, then the path of their page
	@test -f $(NIGHTS)/baselines.toml || { $(NIGHTLY) run nightly-smoke --history $(NIGHTS) --quiet; test $$? -eq 3; }
	@test -f $(NIGHTS)/baselines.toml || $(NIGHTLY) accept latest --history $(NIGHTS) --reason "the first night"
	@$(NIGHTLY) run nightly-smoke --history $(NIGHTS) --quiet; code=$$?; echo $(NIGHTS)/report.html; exit $$code

# Two threads of OpenBLAS in each of pytest's two processes wait for each other on two cores, and busily: tests of small
# matrices take up to seven times the processor time.
test test-full stress: export OPENBLAS_NUM_THREADS := 1
# Where Python may not keep what it compiles, each process compiles every module again; tests start hundreds of processes.
test test-full stress: export PYTHONDONTWRITEBYTECODE :=

test: $(SETUP)  ## the tests that need pip only, under 6 minutes on 2 cores
	$(BIN)/python -m pytest -n 2 --dist loadfile -m "not full and not slow"

test-full: $(SETUP)  ## adds long cases, kills, a Ray cluster, an object store, and other environments: the built wheel, readers of a dataset, a browser
	$(BIN)/python -m pip install --quiet --disable-pip-version-check "ray>=2.9" playwright
	@# A folder of its own: it needs another pydantic than ours.
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade --target build/moto "moto[server]>=5"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade --target build/gcs gcp-storage-emulator
	$(BIN)/python -m pytest -n 2 --dist loadfile -m full

test-gpu: $(SETUP)  ## the tests of rendering on a CUDA GPU
	EPOSIT_VARIANT=cuda_ad_rgb $(BIN)/python -m pytest -m "not slow" tests/render

check-slow: $(SETUP)  ## kills at random moments, two commands at once
	$(BIN)/python -m pytest -m slow

stress: $(SETUP)  ## detection and OpenCV's finders on pictures as cameras spoil them; goes on where it stopped; ARGS="--views 2"
	$(BIN)/python -m tests.stress $(ARGS)

test-oldest:  ## the library alone, with the oldest NumPy, SciPy and llvmlite that it allows
	$(call library_tests,llvmlite==0.45.* numpy==1.26.* scipy==1.11.*)

test-newest:  ## the library alone, with the newest NumPy, SciPy and llvmlite
	$(call library_tests,llvmlite numpy scipy)

# OpenCV is what some of the tests compare with.
define library_tests
$(PYTHON) -m venv --clear build/$@
build/$@/bin/python -m pip install --quiet --disable-pip-version-check opencv-python-headless hypothesis pytest $(1)
build/$@/bin/python -m pytest tests/eposit --confcutdir=tests/eposit
endef

lint: $(SETUP)  ## ruff
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(SETUP)  ## pyright, strict on eposit
	$(BIN)/basedpyright

layers: $(SETUP)  ## the layer contract
	PYTHONPATH=. $(BIN)/lint-imports

layers-picture: $(SETUP)  ## the layers as the imports are, into build/layers.svg
	$(BIN)/python tools/layers.py build/layers.svg

docs: $(SETUP)  ## the pages into build/docs, with strict links
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going -E -d build/doctrees docs build/docs
	@echo build/docs/index.html

bench: $(SETUP)  ## speed, as ratios measured side by side in one run
	$(BIN)/python -m pipelines bench

bench-blender: $(SETUP) $(BLENDER)/.done  ## the same against Blender's Cycles; downloads 350 MB
	EPOSIT_BLENDER=$(BLENDER)/bin/python $(BIN)/python -m pipelines bench --only blender

$(BLENDER)/.done:
	$(BLENDER_PYTHON) -m venv --clear $(BLENDER)
	$(BLENDER)/bin/python -m pip install --quiet --disable-pip-version-check --only-binary bpy bpy || \
		{ echo "bpy has wheels for some Pythons only, as 3.11 and 3.13; set BLENDER_PYTHON=..."; exit 1; }
	@touch $@

measurements: $(SETUP)  ## the figures of the documents, some twenty minutes; goes on where it stopped; ARGS="--only NAME"
	$(BIN)/python -m tools.measurements $(ARGS)

wheel: $(SETUP)  ## the library `eposit` as a wheel in dist/
	$(BIN)/python -m build --wheel --no-isolation

lock: $(SETUP)  ## pin every dependency again
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/uv pip compile --generate-hashes --no-emit-index-url --no-annotate --no-header --universal --python-version 3.11 \
		--extra lab --extra dev --extra docs --quiet -o requirements.txt pyproject.toml requirements-build.in

clean:  ## everything that was made
	rm -rf $(VENV) $(BLENDER) out build dist *.egg-info
