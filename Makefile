# make help    what there is
#
# Needs Python 3.11 to 3.13, pip and make. The rest goes into .venv, once.

SHELL := /bin/sh
PYTHON ?= python3
VENV := .venv
STAMP := $(VENV)/.installed

STEPS ?= 245760
SEED ?= 1
ifndef OUT
OUT := runs/quickstart-$(shell date +%Y%m%d-%H%M%S)
endif

WORKERS ?= $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)
# One thread a worker: torch's own threads would only fight over the cores.
PYTEST := OMP_NUM_THREADS=1 $(VENV)/bin/python -m pytest -q -n $(WORKERS) --dist loadfile

.PHONY: help install quickstart check test test-slow test-browser test-ray clean
.DEFAULT_GOAL := help
.NOTPARALLEL:

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## /\1	/p' Makefile | while IFS='	' read -r name text; do printf '  make %-12s %s\n' "$$name" "$$text"; done
	@echo '  settings: PYTHON=python3.12  STEPS=245760  SEED=1  OUT=runs/NAME'

install: $(STAMP)  ## make .venv with irl and its tools in it (the others do this by themselves)

quickstart: $(STAMP)  ## demonstrations, GAIL on Hopper, evaluation and a report
	@# A second quickstart learns from the demonstrations of the first.
	$(VENV)/bin/irl demos show irl/hopper/expert-v0 2>/dev/null || $(VENV)/bin/irl demos generate --env-id Hopper-v5 --episodes 25 --seed 0
	$(VENV)/bin/irl train gail --env-id Hopper-v5 --demos irl/hopper/expert-v0 --demo-episodes 4 --steps $(STEPS) --seed $(SEED) --out $(OUT)
	$(VENV)/bin/irl evaluate $(OUT)

check: $(STAMP)  ## format, lint, spelling, types, import direction
	@scripts/check

test: $(STAMP)  ## the tests, except those that learn for minutes
	@$(PYTEST)

test-slow: $(STAMP)  ## the tests that learn for minutes
	@$(PYTEST) -m slow

test-browser: $(STAMP)  ## the report in a headless Chromium, which is installed where apt-get is and it is missing
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null || { \
	  echo "Installing chromium"; \
	  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null; } \
	  || { echo "chromium is needed and could not be installed; install it by hand" >&2; exit 1; }
	@OMP_NUM_THREADS=1 $(VENV)/bin/python -m pytest -q -s -m browser tests/browser

test-ray: $(STAMP)  ## a grid on a Ray cluster of two workers, one of them killed; installs Ray, the extra
	@$(VENV)/bin/python -m pip install -q --disable-pip-version-check --no-input -c constraints.txt --no-build-isolation -e '.[ray]'
	@OMP_NUM_THREADS=1 $(VENV)/bin/python -m pytest -q -s -m ray tests/bench

clean:  ## remove caches and builds; runs, datasets and .venv stay
	rm -rf build dist .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find irl tests scripts -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null || { \
	  found=$$($(PYTHON) -c 'import sys; print("Python %d.%d" % sys.version_info[:2])' 2>/dev/null || echo 'not found'); \
	  echo "irl needs Python 3.11, 3.12 or 3.13; '$(PYTHON)' is $$found. Name another: make PYTHON=/path/to/python3" >&2; exit 1; }
	@echo "Making $(VENV) with $$($(PYTHON) --version)"
	@# Some distributions ship Python without ensurepip; the outside pip can fill the environment too.
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 \
	  || { $(PYTHON) -m venv --clear --without-pip $(VENV) && $(PYTHON) -m pip --python $(VENV)/bin/python install -q pip; } \
	  || { rm -rf $(VENV); echo "could not make $(VENV): '$(PYTHON)' needs its venv module, and pip" >&2; exit 1; }

$(STAMP): pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing irl and its tools into $(VENV) (once; minutes when torch must be fetched)"
	@$(VENV)/bin/python -m pip install -q --disable-pip-version-check --no-input -c constraints.txt hatchling
	@$(VENV)/bin/python -m pip install -q --disable-pip-version-check --no-input -c constraints.txt --no-build-isolation -e '.[dev]'
	@touch $@
	@echo "Installed"
