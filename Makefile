# Everything is one of these commands; each does whatever set-up it needs and repeats none of it.
#
#   make setup     the Python environment in .venv and the packages of the viewer
#   make build     the native module (release) and the page that reports are made from
#   make run       the pool break: found, resolved, recorded; prints where to look
#   make test      all tests: Rust, Python, TypeScript
#   make lint      formatting, lints, types, stubs
#   make bench     how fast it is here; make instructions: instructions a collision, against what they were
#   make validate  the long runs against theory
#   make docs      the documentation, in docs/_build/html
#   make clean     removes whatever the others made
#
# Needed: git, make, Python >= 3.11, Rust (rustup), Node.js >= 20.19 with npm.

PYTHON ?= $(shell for name in python3 python3.14 python3.13 python3.12 python3.11 python; do \
	"$$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo "$$name" && break; done)
CARGO ?= cargo
NPM ?= npm

# A command that fails inside a pipe fails its rule.
SHELL := bash
.SHELLFLAGS := -o pipefail -c
CARGO_TARGET_DIR ?= target
export CARGO_TARGET_DIR := $(abspath $(CARGO_TARGET_DIR))

venv := .venv
bin := $(venv)/bin
python := $(bin)/python
stamps := $(venv)/stamps
page := python/carom/page/report.html

native_sources := $(shell find crates -name '*.rs' -o -name 'Cargo.toml' 2>/dev/null) \
	$(wildcard Cargo.toml Cargo.lock pyproject.toml)
viewer_sources := $(shell find viewer -type f -not -path '*/node_modules/*' -not -path '*/dist/*' \
	-not -name '*.md' -not -path '*/tests/*' 2>/dev/null)

.PHONY: help setup build native page run test test-rust test-python test-viewer test-page \
	lint lint-rust lint-python lint-viewer bench instructions validate docs wheel lock clean
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

help:
	@sed -n '3,11s/^# *//p' Makefile

# --- set-up -------------------------------------------------------------------------------------------------------

setup: $(stamps)/python viewer/node_modules/.package-lock.json

$(stamps)/python: requirements.lock
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed; name it: make PYTHON=/path/to/python" >&2; exit 1; }
	test -x $(python) || "$(PYTHON)" -m venv $(venv)
	$(python) -m pip install --disable-pip-version-check --quiet --require-hashes -r requirements.lock
	@mkdir -p $(stamps) && touch $@

viewer/node_modules/.package-lock.json: viewer/package.json viewer/package-lock.json
	$(NPM) --prefix viewer ci --no-audit --no-fund
	@touch $@

# --- build --------------------------------------------------------------------------------------------------------

build: native page

native: $(stamps)/native

# The package is installed so that edits in python/ count at once; the module is built again when Rust files change.
$(stamps)/native: $(stamps)/python $(native_sources)
	VIRTUAL_ENV="$(abspath $(venv))" $(bin)/maturin develop --release --locked
	@touch $@

page: $(page)

$(page): viewer/node_modules/.package-lock.json $(viewer_sources)
	$(NPM) --prefix viewer run build
	@test -s $@ && touch $@

wheel: $(stamps)/python $(page)
	$(bin)/maturin build --release --locked --out dist

# --- run ----------------------------------------------------------------------------------------------------------

run_folder := runs/pool_break

run: build
	$(bin)/carom run pool_break --out $(run_folder) --force
	@echo
	@echo "The replay, the plots and every impact: open $(abspath $(run_folder)/report.html) in a browser."
	@echo "One impact in the notes' own steps:     $(bin)/carom explain pool_break --impact 1"

# --- test ---------------------------------------------------------------------------------------------------------

test: test-rust test-viewer test-page test-python

test-rust:
	$(CARGO) test --locked
	$(CARGO) test --locked --profile unoptimised --test same_bits same_hash_as_ever

test-python: build
	$(python) -m pytest -n 2

test-viewer: viewer/node_modules/.package-lock.json
	$(NPM) --prefix viewer run check
	$(NPM) --prefix viewer test

chromium := $(firstword $(foreach name,chromium chromium-browser google-chrome,$(shell command -v $(name) 2>/dev/null)))

test-page: build
ifeq ($(chromium),)
	@echo "Left out: the checks of the page in a browser, because no Chromium is installed here."
else
	CHROMIUM="$(chromium)" $(NPM) --prefix viewer run e2e
endif

# --- lint ---------------------------------------------------------------------------------------------------------

lint: lint-rust lint-python lint-viewer

lint-rust:
	$(CARGO) fmt --all --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings

lint-python: $(stamps)/native
	$(bin)/ruff check
	$(bin)/ruff format --check
	$(bin)/pyright
	$(python) -m mypy.stubtest carom._carom

lint-viewer: viewer/node_modules/.package-lock.json
	$(NPM) --prefix viewer run check

# --- the rest -----------------------------------------------------------------------------------------------------

# OPTIONS=--quick: the three standard fluids, in less than a minute.
bench: build
	$(bin)/carom bench $(OPTIONS)

# OPTIONS=--rewrite makes what is counted the baseline.
instructions: $(stamps)/python
	$(CARGO) build --release --locked --example fluid_speed
	$(python) benches/instructions.py $(CARGO_TARGET_DIR)/release/examples/fluid_speed $(OPTIONS)

# The long runs against theory; what they print is kept in validation/results.
validate: $(stamps)/native
	@mkdir -p validation/results
	@set -e; for script in validation/*.py; do \
		name=$$(basename "$$script" .py); echo "$$name"; \
		$(python) "$$script" > "validation/results/$$name.txt.new"; \
		mv "validation/results/$$name.txt.new" "validation/results/$$name.txt"; cat "validation/results/$$name.txt"; \
	done
	CAROM_DRIFT_IMPACTS=10000000 $(CARGO) test --release --locked --test conservation -- --nocapture --test-threads 1 \
		| sed 's|^test [a-z_]* \.\.\. ||' | grep -E '^(1,000|two|one|clock)' | tee validation/results/drift.txt
	CAROM_LIOUVILLE_STARTS=500000 $(CARGO) test --release --locked --test liouville -- --nocapture --test-threads 1 \
		| sed -nE 's/^(test [a-z_]+ \.\.\. )?\| //p' | tee validation/results/liouville.txt
	$(CARGO) run --release --locked --example turning_search -- 65000 11 | tee validation/results/turning_search.txt

docs: $(stamps)/native
	$(bin)/sphinx-build --fail-on-warning --keep-going -b html docs docs/_build/html
	@echo "Open $(abspath docs/_build/html/index.html) in a browser."

# Which version of each Python package, for every platform and every Python from 3.11 on. Needs uv.
lock:
	uv pip compile pyproject.toml --extra plots --group all --universal --python-version 3.11 --generate-hashes \
		--no-header --output-file requirements.lock --quiet
	@sed -i.old '1i # One version of every Python package that building, running, testing and the documentation need. Made by: make lock' \
		requirements.lock && rm requirements.lock.old

clean:
	rm -rf $(venv) $(CARGO_TARGET_DIR) dist runs viewer/node_modules viewer/dist docs/_build $(page) python/carom/scenes \
		.pytest_cache .ruff_cache .mypy_cache .hypothesis
	find python examples validation benches -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true
	rm -f python/carom/_carom*.so python/carom/_carom*.pyd
