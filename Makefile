# One virtual environment in .venv from environment.lock, then one command in it. `make help` lists the targets.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.ONESHELL:
.DELETE_ON_ERROR:
.PHONY: results report check test test-library test-processes test-workflow coverage smoke lint check-reference \
        environment lock docs clean-environment help

CORES ?= 2
SNAKEMAKE_ARGS ?=
CHECKED ?= default
REPORT ?= results/default/report.html
PYTEST_ARGS ?=
# Wheels only, or a missing one would turn into a long failing compilation; connection_pool has none and is pure Python.
INSTALL := -m pip install --quiet --disable-pip-version-check --only-binary=:all: --no-binary=connection_pool
RUN := PATH="$(CURDIR)/.venv/bin:$$PATH"
# The first compiles UMAP's loops beside them, where the smoke run finds them.
PROCESSES := tests/encoders/test_reduction.py tests/process/test_processor.py tests/test_emulation.py tests/test_benchmarks.py
PARTS := test-workflow test-library test-processes
# What is imported is kept compiled, whatever the user's environment says: thousands of processes import it.
PYTEST := $(RUN) OMP_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE= python -m pytest

results: environment ## every table and figure of config/config.yaml, into results/ (SNAKEMAKE_ARGS passes through)
	$(RUN) snakemake -j$(CORES) all $(SNAKEMAKE_ARGS)

report: environment ## Snakemake's report of the same run in one HTML file, REPORT
	mkdir -p $(dir $(REPORT))
	$(RUN) snakemake -j$(CORES) all --report $(REPORT) --report-after-run $(SNAKEMAKE_ARGS)

# Side by side, as each keeps one core busy most of the time; the later ones start on the core that is free first. Each
# prints its report when it is done.
SIDE_BY_SIDE := $(MAKE) --no-print-directory -j$(CORES) --keep-going --output-sync=target

check: environment ## lint and test, as before every commit
	@$(SIDE_BY_SIDE) $(PARTS) lint

test: environment ## the tests, or only those of PYTEST_ARGS
ifeq ($(strip $(PYTEST_ARGS)),)
	@$(SIDE_BY_SIDE) $(PARTS)
else
	$(PYTEST) $(PYTEST_ARGS)
endif

test-library: environment ## the tests of functions and steps
	$(PYTEST) --ignore=tests/workflow $(addprefix --ignore=,$(PROCESSES))

test-processes: environment ## the tests that run long by themselves: processors, benchmarks, reductions
	$(PYTEST) $(PROCESSES)

test-workflow: environment ## the tests that run Snakemake, including the whole smoke run
	$(PYTEST) tests/workflow

smoke: environment ## every rule of the workflow at tiny size
	$(RUN) snakemake -j$(CORES) all --configfile config/smoke.yaml $(SNAKEMAKE_ARGS)

coverage: environment ## the share of lines that the tests of functions and steps run, at least 90 %
	$(PYTEST) --ignore=tests/workflow --cov --cov-report=term:skip-covered --cov-fail-under=90

lint: environment ## ruff, snakefmt, mypy and snakemake's own linter
	export $(RUN)
	ruff check .
	ruff format --check .
	snakefmt --check Snakefile workflow
	mypy
	snakemake --lint

check-reference: environment ## compare the numbers of results/CHECKED with its reference; reruns nothing
	$(RUN) python -m gpca check-reference results/$(CHECKED)

environment: .venv/complete ## only the virtual environment, and the loops that are compiled ahead of their first call
	@.venv/bin/python -m gpca.process.build_loops || true

docs: environment ## the site of the docs, build/docs/html/index.html, with packages of its own beside those of .venv
	rm -rf build/docs
	.venv/bin/python $(INSTALL) --no-deps --require-hashes --target build/docs/packages -r docs/requirements.txt
	PYTHONPATH=build/docs/packages $(RUN) python -m sphinx -q -W --keep-going -c docs -d build/docs/doctrees \
	    . build/docs/html

# Sets `python` to the first interpreter that runs, is 3.11 or 3.12 and can make virtual environments.
# A name on PATH is not enough: version managers put shims there that only print an error.
define choose_python
python=""; found=""
for candidate in python3.11 python3.12 python3; do
    version="$$($$candidate -c 'import platform; print(platform.python_version())' 2>/dev/null)" || continue
    case "$$version" in
        3.11.*|3.12.*) if $$candidate -c 'import venv, ensurepip' 2>/dev/null; then python="$$candidate"; break; fi
                       found="$$found $$candidate $$version without its venv module," ;;
        *) found="$$found $$candidate $$version," ;;
    esac
done
if [ -z "$$python" ]; then
    found="$${found%,}"
    echo "Python 3.11 or 3.12 with venv is needed, found:$${found:- none}; install it, e.g." \
         "'apt-get install python3.11 python3.11-venv' (Debian 12) or 'dnf install python3.11' (Fedora)" >&2
    exit 2
fi
endef

# The stamp is written last, so an install that was killed is made anew; pip's cache keeps what was already downloaded.
.venv/complete: environment.lock environment.hashes
	@$(choose_python)
	echo "installing $$(grep -c '==' environment.lock) packages from environment.lock into .venv (about 2.2 GB, 2 to 5 minutes)"
	$$python -m venv --clear .venv
	if ! { .venv/bin/python $(INSTALL) --no-deps --require-hashes -r environment.hashes &&
	       .venv/bin/python $(INSTALL) -c environment.lock torch; }; then
	    echo "the packages of environment.lock could not be installed: pip's message above says which and why;" \
	         "wheels exist for Linux on x86-64 with Python 3.11 and 3.12 (here: $$(uname -sm), $$($$python -V))" >&2
	    exit 2
	fi
	.venv/bin/python -m gpca.process.environment
	rm -f gpca/process/loops.so # numba may be another
	touch $@

lock: ## renew environment.lock and environment.hashes from what pyproject.toml names, in a fresh environment
	@$(choose_python)
	rm -rf build/lock
	$$python -m venv build/lock
	build/lock/bin/python $(INSTALL) '.[workflow,methods,dev]'
	# The suite itself is no package of the lock. The build of torch is the user's choice: neither its local version nor its CUDA packages belong into the lock.
	build/lock/bin/python -m pip freeze --all --exclude pip --exclude wheel --exclude gpca-bench \
	    | sed -E -e '/^(nvidia|cuda|triton)/Id' -e 's/\+[A-Za-z0-9.]+$$//' > build/lock/packages
	{ sed '/^[^#]/,$$d' environment.lock; cat build/lock/packages; } > build/lock/environment.lock
	mv build/lock/environment.lock environment.lock
	build/lock/bin/python $(INSTALL) uv
	{ echo "# The files of the packages in environment.lock but torch, by their SHA-256. Made by 'make lock'."
	  grep -v '^torch==' environment.lock | build/lock/bin/uv pip compile - --quiet --no-deps --no-annotate --no-header \
	      --python-version 3.11 --generate-hashes; } > build/lock/environment.hashes
	mv build/lock/environment.hashes environment.hashes
	{ echo "# Made by 'make lock' from environment.lock, for those who run with 'snakemake --sdm conda'."
	  printf '%s\n' 'channels: [conda-forge]' 'dependencies:' '  - python=3.11' '  - pip' '  - pip:'
	  sed -nE 's/^([A-Za-z0-9].*)/      - \1/p' environment.lock; } > workflow/envs/gpca.yaml
	rm -rf build/lock

clean-environment: ## remove .venv
	rm -rf .venv

help: ## this list
	@sed -nE 's/^([a-z-]+):[^#]*## (.*)/\1\t\2/p' Makefile | expand -t 20
