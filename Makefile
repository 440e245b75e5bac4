# `make demo` and `make test` do their whole set-up on a machine with Python 3.11+ and make:
# .ci/set-up makes .venv, installs the packages and finds (as root: installs) an LLVM library.
SHELL := /bin/bash
VENV := .venv
BIN := $(VENV)/bin
WORKERS ?= 2
# A file's tests stay with one worker, which shares their fixtures; files in tests/conftest.py's
# order, the long ones first, not by how many tests they have.
PYTEST := $(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder
INPUTS := pyproject.toml constraints.txt .ci/set-up

# Some hundred tests start Python anew; each would compile the program's source to bytecode again
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo test test-all matrix audit lint format catalogues docs clean

help:
	@echo "make demo      compare the office that the repository ships, blind up, down and controlled"
	@echo "make test      lint and the quick tests"
	@echo "make test-all  lint, all tests, the slow ones too, with coverage, and the documentation"
	@echo "make matrix    the quick tests with every installed Python from 3.11 to 3.14"
	@echo "make audit     known vulnerabilities and licences of the installed packages; their list, sbom.json"
	@echo "make lint      check style and types; make format repairs what it can"
	@echo "make catalogues  bring the pages' translations up to date with the code; name what is missing"
	@echo "make docs      the documentation as a site, in site/index.html"
	@echo "make clean     remove what these made, the virtual environment too"

demo: $(VENV)/.run
	$(BIN)/cfs demo

test: lint
	$(PYTEST) -m "not slow"

test-all: lint docs
	$(PYTEST) --cov --cov-report=term

matrix:
	WORKERS=$(WORKERS) bash .ci/matrix

audit: $(VENV)/.run
	bash .ci/audit $(BIN)/python

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m mypy

docs: $(VENV)/.dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(VENV)/.run: $(INPUTS)
	@bash .ci/set-up .
	@touch $@

$(VENV)/.dev: $(INPUTS)
	@bash .ci/set-up '.[dev,peers,distributed,georeference,netcdf,docs,notebooks]'
	@touch $@ $(VENV)/.run

catalogues: $(VENV)/.dev
	$(BIN)/python -m scenes.language.extraction

clean:
	rm -rf $(VENV) .venv-matrix .venv-audit sbom.json build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .coverage site out cfs-demo
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
