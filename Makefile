# make demo: a first run.  make test: lint, types, tests.  Another Python: `make demo PYTHON=python3.13`, another
# folder for it: VENV=... (one environment for each Python; `make clean` removes .venv).
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
# The tests start thousands of Python processes: without bytecode on the disk each compiles the sources anew, which makes
# the start of `marconet` three times as slow.
unexport PYTHONDONTWRITEBYTECODE
OUT    ?= runs/demo
# Two more than the cores, since many tests wait for processes.
WORKERS ?= $(shell echo $$(( $$(getconf _NPROCESSORS_ONLN) + 2 )))
TYPES   = $(VENV)/mypy.log
PYTEST  = $(BIN)/pytest -q -n $(WORKERS) --dist loadfile

.PHONY: help demo test test-all lint docs bench lock clean
help:
	@echo "make demo      install into $(VENV), run the scenario output_sync, write its report, then compile"
	@echo "make test      lint, types and every test that is not slow"
	@echo "make test-all  the slow tests as well, the others on the compiled modules too; none may be skipped"
	@echo "make lint      ruff and mypy"
	@echo "make docs      build all pages and the reference of the packages into build/site"
	@echo "make bench     which benchmarks there are"
	@echo "make lock      renew requirements-dev.lock"
	@echo "make clean     remove $(VENV) and caches"

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed: make PYTHON=...")'
	@echo "environment: $(VENV)"
	@$(PYTHON) -m venv $(VENV)

# uv installs in seconds what pip installs in minutes. Where PyPI has no uv for this machine, or uv finds no index (pip's own
# configuration is not uv's), pip installs the same.
UV       = { command -v uv || { $(BIN)/python -m pip install --quiet --disable-pip-version-check uv && echo $(BIN)/uv; }; }
install  = { uv=$$($(UV)) && $$uv pip install --quiet --python $(BIN)/python $(1); } \
           || $(BIN)/python -m pip install --quiet --disable-pip-version-check $(1)

# marconet itself chooses the C compiler ($$CC, cc, gcc, clang, ziglang); where none of them is there, ziglang is installed.
COMPILER = $(BIN)/python -c 'from fmus.build import find_compiler; find_compiler()' 2> /dev/null || $(call install,ziglang)

$(VENV)/.installed: pyproject.toml | $(BIN)/python
	@echo "packages: into $(VENV)"
	@$(call install,-e .)
	@$(COMPILER)
	@touch $@

$(VENV)/.installed-dev: pyproject.toml requirements-dev.lock | $(BIN)/python
	@echo "packages of developers: into $(VENV)"
	@$(call install,-r requirements-dev.lock -e .)
	@$(COMPILER)
	@touch $@ $(VENV)/.installed $(VENV)/.installed-compiled

$(VENV)/.installed-compiled: pyproject.toml | $(VENV)/.installed
	@$(call install,-e '.[compiled]')
	@touch $@

$(VENV)/.installed-docs: pyproject.toml | $(VENV)/.installed
	@$(call install,-e '.[docs]')
	@touch $@

# A variable, since `call` would split its arguments at the commas.
EXTRAS = dev,clients,oracles,peers,compiler,cortex-m,pandas,docs

$(VENV)/.installed-all: pyproject.toml | $(VENV)/.installed-dev
	@$(call install,-e '.[$(EXTRAS)]')
	@touch $@ $(VENV)/.installed-docs

# The first verdict comes first; the compiler of the inner loops is installed and run after it.
demo: $(VENV)/.installed
	@echo "run: output_sync; its plants are built before it starts"
	@$(BIN)/marconet run output_sync --out $(OUT) --overwrite
	@echo
	@echo "compile: the inner loops, two to five minutes, so that later runs are faster; Ctrl-C does no harm"
	@$(MAKE) --no-print-directory $(VENV)/.installed-compiled
	@$(BIN)/marconet compile --if-possible

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/mypy

# mypy, which uses one core for a minute, runs beside the tests; what it found comes after theirs.
test: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	@$(BIN)/mypy > $(TYPES) 2>&1 & types=$$!; \
	echo '$(PYTEST) -m "not slow"'; $(PYTEST) -m "not slow"; tests=$$?; \
	wait $$types; types=$$?; cat $(TYPES); test $$tests -eq 0 && test $$types -eq 0

# A test that lacks a tool (Chromium, tshark, a ground station) fails here and says how to get it; property tests try more
# examples.
WHOLE    = --fail-on-skip --hypothesis-profile whole

test-all: lint $(VENV)/.installed-all
	$(PYTEST) $(WHOLE) -m "not slow"
	$(BIN)/pytest -q $(WHOLE) -m slow
	$(BIN)/marconet compile
	MARCONET_COMPILED=1 $(PYTEST) $(WHOLE) -m "not slow"

docs: $(VENV)/.installed-docs
	@echo "docs: Zensical reads every docstring and writes some 200 pages; it says nothing more for up to five minutes"
	@$(BIN)/python docs/build_site.py build/site
	@echo "site: build/site/index.html; to search in it: $(BIN)/python -m http.server -d build/site"

bench:
	@grep -H -m1 -o '^"""[^"]*' benchmarks/*.py benchmarks/lockstep/compare.py | sed 's/:"""/: /'

# Exact versions of a developer environment, from the ranges in pyproject.toml, for every Python from 3.11 on.
lock: | $(BIN)/python
	@uv=$$($(UV)) && $$uv pip compile --quiet --universal --python-version 3.11 --extra dev --no-header --no-annotate \
	  --output-file requirements-dev.lock --upgrade pyproject.toml
	@sed -i '1i # Written by `make lock`: every package of the developer environment, for each Python from 3.11 on.' requirements-dev.lock

clean:
	rm -rf $(VENV) build dist .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
