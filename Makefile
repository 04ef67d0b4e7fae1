# Two commands do everything on a fresh machine (Python 3.11+ with venv, make):
#   make demo    the whole loop on a simulated rig
#   make test    lint, types and tests
#   make test-long  tests of whole sessions (10 minutes)
#   make quick   the demo and the fast part of the tests, as for another Python:
#                make quick PYTHON=python3.13 VENV=build/python3.13
#   make study-accuracy, study-partial, study-diagnosis, study-measured, study-planted, study-simulate, study-bam, study-calibrate, study-teach, study-played, study-reliability, study-fleet, study-board,
#        study-rehearsal, study-exchange, study-volts
#                pages of docs/ from many sessions (minutes to an hour; the last needs avr-gcc, avr-libc, simavr)
#   make docs-commands, docs-effects, docs-tutorial, docs-architecture, docs-notebook
#                docs/commands.md from the program; pictures and facts of docs/effects/ (some minutes);
#                outputs and pictures of docs/tutorial.md
#   make package wheel and sdist into dist/, checked and tried in fresh environments of every Python that there is
#   make fuzz    coverage-guided fuzzing of every reader, a minute each (Linux)
#   make mutants mutation testing of what keeps a hand safe, into docs/reliability.md (half an hour)
#   make bench   the benchmarks, into docs/benchmarks.md (some minutes, 6 GB of memory)
PYTHON ?= python3
VENV   ?= .venv
BIN     = $(VENV)/bin
# What starts again and again is compiled once, as after an install, whatever the environment says.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test lint types tests test-long quick bench fuzz mutants package clean stale study-accuracy study-partial study-diagnosis study-measured study-planted study-simulate study-bam study-calibrate \
    study-board study-teach study-played study-reliability study-fleet study-rehearsal study-exchange study-volts docs-commands docs-effects \
    docs-tutorial docs-architecture docs-notebook
.DELETE_ON_ERROR:

demo: $(VENV)/.ready
	$(BIN)/ffc-id demo -o demo --force

test: lint types tests

lint: $(VENV)/.ready-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.ready-dev
	$(BIN)/mypy --strict idtool cli pages studies testbench benchmarks

tests: export OPENBLAS_NUM_THREADS = 1
tests: $(VENV)/.ready-dev
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not long"

# What takes whole sessions: pages from their first command to their last, every effect by name, every fault.
test-long: export OPENBLAS_NUM_THREADS = 1
test-long: $(VENV)/.ready-dev
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder -m long

# A part of every room, what parses, computes, moves and prints; under a minute.
quick: export OPENBLAS_NUM_THREADS = 1
quick: $(VENV)/.ready-test
	$(BIN)/ffc-id demo -o build/demo --force -q
	$(BIN)/pytest -n 2 -m "not long" tests/model tests/effects tests/log tests/parameters tests/experiment tests/rig/test_contract.py \
	    tests/control/test_force_free.py tests/fit/test_covariance.py tests/cli/test_faults.py tests/cli/test_run.py

bench: $(VENV)/.ready-bench
	$(BIN)/python -m benchmarks

# Longer than tests; each writes a page of docs/.
STUDIES = accuracy partial diagnosis measured planted simulate bam calibrate board played fleet reliability volts exchange rehearsal
# on one core, as the tests
$(patsubst %,study-%,teach $(filter-out board played reliability,$(STUDIES))): export OPENBLAS_NUM_THREADS = 1
$(STUDIES:%=study-%): study-%: $(VENV)/.ready-dev
	$(BIN)/python -m studies.$*

study-teach: stale $(VENV)/.ready-dev
	$(BIN)/python -m studies.guiding

docs-commands: $(VENV)/.ready-dev
	$(BIN)/python -m pages.commands

docs-effects: export OPENBLAS_NUM_THREADS = 1
docs-effects: $(VENV)/.ready-dev
	$(BIN)/python -m pages.effects

docs-tutorial: export OPENBLAS_NUM_THREADS = 1
docs-tutorial: $(VENV)/.ready-dev
	$(BIN)/python -m pages.tutorial

docs-architecture: $(VENV)/.ready-dev
	$(BIN)/python -m pages.architecture

docs-notebook: $(VENV)/.ready-dev
	$(BIN)/python -m pages.notebook

# Needs the network: what a user would install is installed here.
package: $(VENV)/.ready
	$(BIN)/python -m pip install --quiet build twine
	PYTHON=$(BIN)/python .ci/package

# A finding is left as a file crash-*, oom-* or timeout-*.
fuzz: $(VENV)/.ready-fuzz
	for target in log parameters plant recipe packets answers; do \
	    $(BIN)/python -m studies.fuzz $$target -max_total_time=60 -rss_limit_mb=2000 -timeout=20 || exit 1; \
	done

# One core at the lowest priority; a survivor is shown as the change that no test noticed.
mutants: $(VENV)/.ready-mutants
	nice -n 19 $(BIN)/python -m studies.mutants --out docs/reliability.md

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit("ffc-id needs Python 3.11 or newer: make PYTHON=python3.11 ...") if sys.version_info < (3, 11) else 0'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.ready: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e .
	@touch $@

$(VENV)/.ready-dev: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --no-compile -c constraints.txt -e '.[dev]'
	@touch $@ $(VENV)/.ready $(VENV)/.ready-test

$(VENV)/.ready-test: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --no-compile -c constraints.txt -e '.[test]'
	@touch $@ $(VENV)/.ready

$(VENV)/.ready-bench: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[bench]'
	@touch $@ $(VENV)/.ready

$(VENV)/.ready-fuzz: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[fuzz]'
	@touch $@ $(VENV)/.ready

$(VENV)/.ready-mutants: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[dev,mutants]'
	@touch $@ $(VENV)/.ready

# What is compiled holds what it calls, and is kept by the age of its own file alone.
stale:
	find idtool testbench -name "*.nb[ic]" -delete

clean:
	rm -rf $(VENV) demo build *.egg-info
