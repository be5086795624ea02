# Everything happens in .venv. The files .venv/.* mark finished steps, so that a second run is quick.
# Needs Python 3.11 or newer with pip, and make; no other program and no rights.

WHERE := 'import sys; print(sys.executable)'
# The first that runs: of versions that are not chosen, pyenv has names that do not.
PYTHON ?= $(firstword $(foreach name,python3.11 python3.12 python3.13 python3,$(shell $(name) -c $(WHERE) 2>/dev/null)))
VENV := .venv
BIN := $(VENV)/bin
# Without compiling to bytecode: the first import of a module does that, and most modules are never imported.
PIP_INSTALL := $(BIN)/python -m pip --disable-pip-version-check --quiet install --no-compile --constraint constraints.txt --editable
SITE := $(VENV)/site
# Interpreters that a release is tried with.
RELEASE_PYTHONS ?= $(foreach version,3.11 3.12 3.13 3.14,$(shell python$(version) -c $(WHERE) 2>/dev/null))
PYTEST := $(BIN)/python -m pytest --numprocesses 2 --dist loadfile
PYTHON_FILES := quadrille app tracker tests docs
# Set by `test` to what shows one line of a step.
STEP =
HIDE = $(if $(STEP),@)
PARALLEL := $(MAKE) --jobs 4 $(if $(filter output-sync,$(.FEATURES)),--output-sync)
# Tests start hundreds of programs: each would compile the library again if none may keep its bytecode.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: install run test test-all test-quick test-library test-page test-slow kernels bench check lint types \
	page-types format docs release demo clean

install: $(VENV)/.installed

run: install
	$(BIN)/quadrille

# What must hold on every change: at most five minutes on two cores. The steps run beside one another. The kernels, for
# which others wait, have the highest priority; they are compiled from when the program is installed. Tests of the page
# wait a lot: those of the library take what they leave. All steps run to their end: one run shows all that fails, and
# one line with its time of each that passes.
test: $(VENV)/.installed
	$(PARALLEL) --no-print-directory --keep-going STEP='.ci/step $$@' kernels test-page test-library check

# And what is long, or costs much for what it alone reaches.
test-all: test
	$(MAKE) test-slow

# The inner loop: under a minute.
test-quick: $(VENV)/.tested
	nice -n 19 $(PYTEST) -m "not slow and not kernels" --ignore=tests/browser tests

# Tests of rooms that need no kernels come first (tests/conftest.py), while the kernels are compiled.
test-library: $(VENV)/.tested
	$(HIDE)$(STEP) nice -n 19 $(PYTEST) --no-loadscope-reorder -m "not slow" --ignore=tests/browser tests

# Starts at once: only the files of tests/browser/live and share, which come last, wait for the kernels. Three processes,
# because these tests wait more than they compute.
test-page: $(VENV)/.tested
	$(HIDE)$(STEP) nice -n 5 $(PYTEST) --numprocesses 3 --no-loadscope-reorder -m "not slow" tests/browser

test-slow: $(VENV)/.slow $(VENV)/.typescript kernels
	$(PYTEST) -m slow

# Once, not in each process of the tests at the same time.
kernels: $(VENV)/.installed
	$(HIDE)$(STEP) $(BIN)/python -m app.bench.compile_kernels

# How fast it is here, beside what must hold and the ratios of the last release.
bench: $(VENV)/.tested
	$(BIN)/quadrille bench

# What needs no running program: style and types, of Python and of the page.
check: lint types page-types

lint: $(VENV)/.tested
	$(HIDE)$(STEP) $(BIN)/ruff check $(PYTHON_FILES)
	$(HIDE)$(STEP) $(BIN)/ruff format --check $(PYTHON_FILES)

types: $(VENV)/.tested
	$(HIDE)$(STEP) $(BIN)/pyrefly check --progress-bar no

page-types: $(VENV)/.typescript $(VENV)/.installed
	$(HIDE)$(BIN)/python tests/recipes/protocol_docs.py static/model/protocol.d.ts
	$(HIDE)$(STEP) $(BIN)/node node_modules/typescript/bin/tsc

format: $(VENV)/.tested
	$(BIN)/ruff check --fix $(PYTHON_FILES)
	$(BIN)/ruff format $(PYTHON_FILES)

# The documents as a site, with the library's reference: below .venv, which git ignores.
docs: $(VENV)/.documented
	$(BIN)/python docs/site/build.py $(SITE)
	@echo "file://$(CURDIR)/$(SITE)/index.html"

# Wheel and sdist in dist/, installed and tried with each of RELEASE_PYTHONS; needs a package index.
release: $(VENV)/.tested
	@test -n "$(RELEASE_PYTHONS)" || { echo "expected python3.11 to python3.14, found none: make release RELEASE_PYTHONS=..."; exit 1; }
	rm -rf dist
	$(BIN)/python -m build --outdir dist
	QUADRILLE_RELEASE_DIST=dist QUADRILLE_RELEASE_PYTHONS="$(RELEASE_PYTHONS)" $(BIN)/python -m pytest -m slow tests/release
	ls -l dist

# A folder to look at without installing anything: it opens from a file or any web server.
DEMO ?= dist/demo
demo: kernels
	$(BIN)/python tests/recipes/demo.py $(DEMO)

clean:
	rm -rf dist $(VENV) node_modules .ruff_cache .hypothesis

# A pip of today resolves in two thirds of the time of the one that Python 3.11 brings.
$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "expected Python 3.11 or newer, found none: make PYTHON=..."; exit 1; }
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Quadrille needs Python 3.11 or newer: make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip --disable-pip-version-check --quiet install --no-compile --constraint constraints.txt --upgrade pip

$(VENV)/.installed: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP_INSTALL) .
	touch $@

# .tested: the tools of development, and a browser for the tests.
$(VENV)/.tested: $(VENV)/.installed tests/support/chromium.py
	$(PIP_INSTALL) '.[dev]'
	$(BIN)/python tests/support/chromium.py
	touch $@

# .slow: the programs that write imported files and read exported ones, and the site's; OpenSim is big.
$(VENV)/.slow: $(VENV)/.tested
	$(PIP_INSTALL) '.[dev,slow,import,export,detect,detect-onnx,docs]'
	touch $@

# .documented: what makes a site of the documents.
$(VENV)/.documented: $(VENV)/.installed
	$(PIP_INSTALL) '.[docs]'
	touch $@

# The path is for npm's own scripts, which look for node there.
$(VENV)/.typescript: package.json .npmrc $(VENV)/.tested
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm install --loglevel=error
	touch $@
