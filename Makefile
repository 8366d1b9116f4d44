# make solve: balance the packaged loom.   make test: the suite; make slow: its slow studies.   All make .venv first.
PYTHON ?= python3
BIN := .venv/bin
SUITE := $(BIN)/python -m pytest -n auto --dist loadfile --durations 10
# make coverage: how much of loomopt the suite runs, COVERED="tests/jobs" part of it.   make test COVER=1: both at once.
COVERED ?= tests
COVER ?=
COVERING := --cov loomopt --cov-report=
TOTAL = @echo "Coverage by $(1): $$($(BIN)/python -m coverage report --format=total) % of the lines of loomopt"

.PHONY: solve test slow coverage lint types docs notebooks benchmark locked clean

solve: .venv/installed
	$(BIN)/loomopt solve beatup --target balance

test: .venv/installed-test
	$(SUITE) -m "not slow" $(if $(COVER),$(COVERING))
	$(if $(COVER),$(call TOTAL,make test))

slow: .venv/installed-test
	$(SUITE) -m slow

coverage: .venv/installed-test
	$(SUITE) -m "not slow" $(COVERING) $(COVERED)
	$(call TOTAL,$(COVERED))

lint: .venv/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: .venv/installed-test
	$(BIN)/mypy

docs: .venv/installed
	$(BIN)/python docs/write.py

notebooks: .venv/installed-test
	$(BIN)/python notebooks/run.py

benchmark: .venv/installed-test
	$(BIN)/pip install -q -e '.[bench]'
	$(BIN)/python benchmarks/measure/kinematics_speed.py
	$(BIN)/python benchmarks/peers/balance_peers.py
	$(BIN)/python benchmarks/peers/rapier_peers.py
	$(BIN)/python benchmarks/peers/shedding_peers.py
	$(BIN)/python benchmarks/measure/startup.py

.venv/installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -q -e .
	$(BIN)/python -m compileall -q loomopt
	touch $@

.venv/installed-test: .venv/installed
	$(BIN)/pip install -q -e '.[test]'
	touch $@

# In the place of the newest versions those of requirements.lock, with which the suite has passed.
locked:
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -q -c requirements.lock -e '.[test]'
	$(BIN)/python -m compileall -q loomopt
	touch .venv/installed
	touch .venv/installed-test

clean:
	rm -rf .venv
