# `make demo` and `make test` need nothing but Python 3.11 or newer; everything is installed into .venv.
.DEFAULT_GOAL := help
.PHONY: help demo test test-long bench pages check clean

BIN := .venv/bin
STAMP := .venv/.installed
OUTPUTS := outputs
# Test files side by side, one worker per core; a worker holds about 1 GiB, so no more than four. In the order
# of tests/conftest.py.
WORKERS := -n logical --maxprocesses 4 --dist loadfile --no-loadscope-reorder

help:  ## this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

demo: $(STAMP)  ## optimise a small actuator and export it: quick.stl and quick.png in outputs/quick/
	$(BIN)/poro run configs/quick.yaml --output $(OUTPUTS)

test: $(STAMP)  ## the tests
	$(BIN)/python -m pytest $(WORKERS)

test-long: $(STAMP)  ## the tests that take minutes
	$(BIN)/python -m pytest -m slow

bench: $(STAMP)  ## counts and errors to compare with the committed ones: benchmarks/results/bench.csv
	$(BIN)/python -m benchmarks.guard

pages: $(STAMP)  ## make the generated pages anew: commands and case file
	$(BIN)/python -m pipeline.cli.reference docs/reference/commands.md
	$(BIN)/python -m pipeline.case.reference docs/reference/case-file.md

check: $(STAMP)  ## lint, format, types, layers and tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/python -m pytest $(WORKERS)

clean:  ## remove the environment and the caches, but no outputs
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

# Renewed when the project's dependencies change; the code itself is installed in place.
$(STAMP): pyproject.toml
	@python=""; \
	for candidate in python3 python3.14 python3.13 python3.12 python3.11; do \
	  if "$$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then python=$$candidate; break; fi; \
	done; \
	if $(BIN)/python -c 'import pip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then :; \
	elif [ -z "$$python" ]; then \
	  echo "poro needs Python 3.11 or newer: install it (https://www.python.org/downloads/) and run make again." >&2; exit 1; \
	elif ! "$$python" -m venv --clear .venv; then \
	  echo "$$python cannot make an environment: install its venv module (Debian and Ubuntu: apt install python3-venv) and run make again." >&2; exit 1; \
	fi
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@
