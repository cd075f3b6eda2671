# Needs Python 3.11 or newer, make and git. Another interpreter: make PYTHON=python3.12 ...
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help serve test bench format lock

help: ## Show the targets
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

serve: $(VENV)/.runtime ## Start the gateway with a simulated line on http://127.0.0.1:8420
	$(BIN)/motion-gateway serve --demo

test: $(VENV)/.development ## Check format, style, types and the dependency rules, and run the tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/pytest -n 2

bench: $(VENV)/.development ## Measure, each figure against its yardstick
	$(BIN)/python -m benchmarks

format: $(VENV)/.development ## Write the code as the tests want it
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

LOCK := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
	--custom-compile-command "make lock" --group build --extra oidc pyproject.toml

# The gateway is served with the versions it is tested with: the first file binds the second.
lock: ## Pin the dependencies anew as pyproject.toml asks (needs uv)
	$(LOCK) --group dev -o requirements-dev.txt
	$(LOCK) --constraint requirements-dev.txt -o requirements.txt

# Stamps: what is installed is installed again only when its pins or the project's own metadata change.
$(VENV)/.runtime: REQUIREMENTS := requirements.txt
$(VENV)/.runtime: requirements.txt
$(VENV)/.development: REQUIREMENTS := requirements-dev.txt
$(VENV)/.development: requirements-dev.txt

$(VENV)/.runtime $(VENV)/.development: pyproject.toml | $(BIN)/pip
	$(BIN)/pip install --quiet --require-hashes -r $(REQUIREMENTS)
	$(BIN)/pip install --quiet --no-deps --no-build-isolation -e .
	touch $@

$(BIN)/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed.")'
	$(PYTHON) -m venv $(VENV)
