# Everything happens in .venv. Files .venv/.* mark what is done, so that a second run is quick.
# Needs Python 3.11 or newer with pip, and make; nothing else, and no rights.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
PYTHON_FILES := app tracker tests

.PHONY: install run test test-library test-page kernels bench check lint format clean

install: $(VENV)/.installed

run: install
	$(BIN)/quadrille

# The library's tests take what those of the page leave: these wait a lot, but what they wait for must not come late.
# Two browsers wait in half the time; what the tests of one file share, a server and its page, stays with one of them.
test:
	$(MAKE) --jobs 2 check kernels
	$(MAKE) --jobs 2 $(if $(filter output-sync,$(.FEATURES)),--output-sync) test-library test-page

test-library: $(VENV)/.tested
	nice -n 19 $(BIN)/python -m pytest --ignore tests/browser --numprocesses auto

test-page: $(VENV)/.tested
	$(BIN)/python -m pytest tests/browser --numprocesses 2 --dist loadfile

# Once, not in each process of the tests at the same time. Modules are found here while pip puts what is installed anew.
kernels: $(VENV)/.installed
	$(BIN)/python -m app.bench.compile_kernels

# How fast it is here, beside what must hold and the ratios that are kept.
bench: $(VENV)/.tested
	$(BIN)/quadrille bench

# What needs no running program: style and types, of Python and of the page.
check: lint $(VENV)/.typescript
	$(BIN)/mypy
	$(BIN)/node node_modules/typescript/bin/tsc

lint: $(VENV)/.tested
	$(BIN)/ruff check $(PYTHON_FILES)
	$(BIN)/ruff format --check $(PYTHON_FILES)

format: $(VENV)/.tested
	$(BIN)/ruff check --fix $(PYTHON_FILES)
	$(BIN)/ruff format $(PYTHON_FILES)

clean:
	rm -rf $(VENV) node_modules .mypy_cache .ruff_cache .hypothesis

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Quadrille needs Python 3.11 or newer: make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install --constraint constraints.txt --editable .
	touch $@

# .tested: the tools of development, and a browser for the tests.
$(VENV)/.tested: $(VENV)/.installed tests/support/chromium.py
	$(PIP) install --constraint constraints.txt --editable '.[dev]'
	$(BIN)/python tests/support/chromium.py
	touch $@

# The path is for npm's own scripts, which look for node there.
$(VENV)/.typescript: package.json .npmrc $(VENV)/.tested
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm install --silent
	touch $@
