# make demo: a first run.  make test: lint, types, tests.  Another Python: `make demo PYTHON=python3.13`, another
# folder for it: VENV=... (one environment for each Python; `make clean` removes .venv).
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
OUT    ?= runs/demo

.PHONY: help demo test test-all lint bench lock clean
help:
	@echo "make demo      install into $(VENV), build the plants, run the scenario output_sync, write its report"
	@echo "make test      lint, types and every test that is not slow"
	@echo "make test-all  the slow tests as well, and all but those on the compiled modules"
	@echo "make lint      ruff and mypy"
	@echo "make bench     which benchmarks there are"
	@echo "make lock      renew requirements-dev.lock"
	@echo "make clean     remove $(VENV) and caches"

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed: make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)

# The compiler is marconet's own choice ($$CC, cc, gcc, clang, ziglang); ziglang is fetched where there is none of them.
COMPILER = $(BIN)/python -c 'from fmus.build import find_compiler; find_compiler()' 2> /dev/null \
           || $(BIN)/python -m pip install --quiet ziglang

$(VENV)/.installed: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[compiled]'
	@$(COMPILER)
	@touch $@

$(VENV)/.installed-dev: pyproject.toml requirements-dev.lock | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements-dev.lock -e .
	@$(COMPILER)
	@touch $@ $(VENV)/.installed

demo: $(VENV)/.installed
	@$(BIN)/marconet fmu build
	@$(BIN)/marconet compile --if-possible
	@$(BIN)/marconet run output_sync --out $(OUT) --overwrite

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/mypy

test: lint
	$(BIN)/pytest -q -m "not slow"

test-all: lint
	$(BIN)/pytest -q
	$(BIN)/marconet compile
	MARCONET_COMPILED=1 $(BIN)/pytest -q -m "not slow"

bench:
	@grep -H -m1 -o '^"""[^"]*' benchmarks/*.py benchmarks/lockstep/compare.py | sed 's/:"""/: /'

# Exact versions of a fresh developer environment, from the ranges in pyproject.toml.
lock:
	rm -rf $(VENV)-lock && $(PYTHON) -m venv $(VENV)-lock
	$(VENV)-lock/bin/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	{ echo '# Written by `make lock`: every package of the developer environment. Installs on Python 3.11, 3.12 and 3.13.'; \
	  $(VENV)-lock/bin/python -m pip freeze --exclude-editable; } > requirements-dev.lock
	rm -rf $(VENV)-lock

clean:
	rm -rf $(VENV) $(VENV)-lock build dist .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
