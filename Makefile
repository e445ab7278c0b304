# `make demo` shows what the program does, `make console` lets you drive. Each sets up what it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
RUNTIME := $(VENV)/.runtime
DEV := $(VENV)/.dev
BENCH := $(VENV)/.bench
DOCS := $(VENV)/.docs
EXTRAS := $(VENV)/.extras
DEMO := results/demo
SITE := build/docs

.DEFAULT_GOAL := help
.PHONY: help setup demo console published test test-all test-contract test-system test-browser test-extras extras test-long test-soak storms mutants soak kills fuzz tools check docs release-check same-bytes statements bench budget goals clean

# Compiled files are kept whatever a shell says: without them each program that a test starts
# compiles all modules again.
export PYTHONDONTWRITEBYTECODE =

# As many processes as there are processors share the tests, file by file.
PYTEST := $(BIN)/python -m pytest -n logical --dist loadfile --max-worker-restart=0

help:  ## say what can be made
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /make \1\t/' | expand -t 20

setup: $(DEV)  ## the development environment, in .venv

demo: $(RUNTIME)  ## one drive as picture and film, and the main study's small version: a minute
	@$(BIN)/dva-sim demo -o $(DEMO)

console: $(RUNTIME)  ## drive robots yourself, on a page in the browser; Ctrl-C ends it
	@$(BIN)/dva-sim console

published: $(RUNTIME)  ## the main study at its published size, and its report: ten minutes
	@$(BIN)/dva-sim run req-rep-vs-pub-sub -o results/req-rep-vs-pub-sub

test: $(DEV)  ## the tests that are quick, which are nearly all
	@echo "Running the quick tests ..."
	@$(PYTEST) --cpu-by-room -m "not system and not soak and not browser"

test-all: test-browser check test test-system test-long  ## what must pass, one after the other

test-contract: $(DEV)  ## what every transport promises, in virtual time and over sockets
	@$(PYTEST) -m contract

test-system: $(DEV)  ## programs as users start them, with real processes, sockets and signals
	@echo "Running the tests of whole programs ..."
	@$(PYTEST) -m "system and not soak and not browser"

test-browser: $(DEV)  ## the console's pages, and the search of the docs, in Chromium
	@$(BIN)/python tests/helpers/console/chromium.py
	@echo "Running the tests in a browser ..."
	@$(PYTEST) tests/console/browser tests/docs/browser

test-extras: $(EXTRAS)  ## what needs extras: every transport over its real middleware, environments for learners, a client of ROS
	@$(BIN)/python -c 'import shutil, sys; sys.exit(shutil.which("mosquitto") is None)' \
	  || echo "MQTT is left out: the program mosquitto is missing; try: apt-get install mosquitto"
	@$(PYTEST) -m "system or not system" tests/testing/test_transports.py tests/network/middleware tests/simulation/middleware \
	  tests/live/test_taking_over.py tests/contracts tests/envs tests/ros/test_with_roslibpy.py

test-long: $(DEV)  ## long searches and whole studies, the same cases each time
	@echo "Running the long tests ..."
	@$(PYTEST) -m soak

test-soak: $(DEV)  ## the same and all searches with 20 times as many cases, new ones each time
	@DVA_SIM_SEARCH=20 $(PYTEST) -m "soak or hypothesis"

storms: $(RUNTIME)  ## a hundred hours of a team in which much goes wrong; goes on where it stopped
	@$(BIN)/dva-sim storm --hours $(or $(HOURS),100) -o results/storms

mutants: $(DEV)  ## whether tests notice planted faults: make mutants ROOM=core DRAW=2, or storms: PLANTED=all
	@$(BIN)/python tests/mutants.py --room "$(ROOM)" --draw "$(or $(DRAW),1)" --planted "$(PLANTED)" --storms $(or $(STORMS),32)

soak: $(DEV)  ## live runs for hours, with load, faults and visitors: make soak HOURS=2 SEED=1 HOUR=1
	@$(BIN)/python tests/soak.py --hours $(or $(HOURS),1) --seed $(or $(SEED),1) --hour $(or $(HOUR),1)

kills: $(DEV)  ## commands killed, stopped, without disk or memory at each step: make kills ONLY="full disk"
	@$(BIN)/python tests/kill_all.py --only "$(ONLY)"

fuzz: $(RUNTIME)  ## damaged files and messages, read and used within limits: make fuzz COUNT=2000 SEED=1
	@$(BIN)/python tests/fuzz/fuzz_files.py --count $(or $(COUNT),2000) --seed $(or $(SEED),1) --keep results/fuzz

tools: $(DEV)  ## what some tests need besides Python: Chromium, node, TypeScript, Spin
	@tests/install_tools.sh $(VENV)

check: $(DEV)  ## lint, format, types, import contracts, prose
	@echo "Checking style, types and import contracts ..."
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-logo 2>/dev/null || $(BIN)/lint-imports
	@$(BIN)/python tests/prose_lint.py

docs: $(DOCS)  ## the documentation as web pages, in build/docs; needs no network
	@$(BIN)/python -m sphinx --fail-on-warning --quiet docs $(SITE)
	@echo "Open $(SITE)/index.html"

release-check: $(DEV)  ## the wheel, built, installed in an empty environment and tried
	@$(BIN)/python tests/release_check.py

same-bytes: $(DEV)  ## whether results are those of another version: make same-bytes AGAINST=COMMIT
	@$(BIN)/python tests/same_bytes.py --against $(or $(AGAINST),HEAD)

statements: $(DEV)  ## how much there is to hold, by room: make statements AGAINST=COMMIT
	@$(BIN)/python tests/statements.py --against "$(AGAINST)"

bench: $(BENCH)  ## what the program costs, in instructions: make bench AGAINST=COMMIT ONLY=WORD
	@$(BIN)/python tests/benchmarks/meter.py --against "$(AGAINST)" --only "$(ONLY)"

budget: $(DEV)  ## whether the program costs more than it may: make budget REASON="..." raises what is missed
	@$(BIN)/python tests/benchmarks/budget.py --reason "$(REASON)"

goals: $(DEV)  ## what performance work aims at by the clock: crowds, memory, floods, the console
	@$(BIN)/python -m pytest tests/benchmarks -p no:cacheprovider -s

clean:  ## remove the environment and all caches, keep results
	@rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	@find dva_sim tests -name __pycache__ -prune -exec rm -rf {} +

$(VENV):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "dva-sim needs Python 3.11 or newer; try: make PYTHON=python3.12 ..."; exit 1; }
	@echo "Creating an environment in $(VENV) ..."
	@$(PYTHON) -m venv $(VENV)

$(RUNTIME): pyproject.toml constraints.txt | $(VENV)
	@echo "Installing dva-sim (about a minute the first time) ..."
	@$(PIP) install -c constraints.txt -e .
	@touch $@

$(DEV): pyproject.toml constraints.txt | $(VENV)
	@echo "Installing dva-sim and its development tools (about a minute the first time) ..."
	@$(PIP) install -c constraints.txt -e '.[dev]'
	@touch $@ $(RUNTIME)

extras: $(EXTRAS)  ## install the extras: middleware for transports, Gymnasium, a client of ROS

$(EXTRAS): $(DEV)
	@echo "Installing the extras: middleware for transports, Gymnasium ..."
	@$(PIP) install -c constraints.txt -e '.[dev,mqtt,zenoh,webrtc,dds,rl,ros]'
	@touch $@ $(DEV) $(RUNTIME)

$(BENCH): $(DEV)
	@echo "Installing what the benchmarks compare with ..."
	@$(PIP) install -c constraints.txt -e '.[dev,bench]'
	@touch $@ $(DEV) $(RUNTIME)

$(DOCS): pyproject.toml constraints.txt | $(VENV)
	@echo "Installing dva-sim and what builds the documentation ..."
	@$(PIP) install -c constraints.txt -e '.[docs]'
	@touch $@ $(RUNTIME)
