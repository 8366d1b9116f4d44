# make solve: balance the packaged loom.   make test: the suite; make slow: its slow studies; make whole: those in full size.   All make .venv first.
PYTHON ?= python3
BIN := .venv/bin
SUITE := $(BIN)/python -m pytest -n auto --dist loadfile --durations 10
# make coverage: how much of loomopt the suite runs, COVERED="tests/jobs" part of it.   make test COVER=1: both at once.
COVERED ?= tests
COVER ?=
COVERING := --cov loomopt --cov-report=
# make docs-open: where the site is served.
PORT ?= 8000
# Bytecode is kept, whatever the environment says: else each worker of the suite compiles all tests anew, for ten seconds.
unexport PYTHONDONTWRITEBYTECODE
TOTAL = @echo "Coverage by $(1): $$($(BIN)/python -m coverage report --format=total) % of the lines of loomopt"

.PHONY: solve test slow whole coverage lint types docs docs-open outputs notebooks benchmark locked clean

solve: .venv/installed
	$(BIN)/loomopt solve beatup --target balance

test: .venv/installed-test
	$(SUITE) -m "not slow" $(if $(COVER),$(COVERING))
	$(if $(COVER),$(call TOTAL,make test))

slow: .venv/installed-test
	$(SUITE) -m "slow and not whole" -rs

whole: .venv/installed-test
	$(SUITE) -m whole -rs

coverage: .venv/installed-test
	$(SUITE) -m "not slow" $(COVERING) $(COVERED)
	$(call TOTAL,$(COVERED))

lint: .venv/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: .venv/installed-test
	$(BIN)/mypy

# Warnings are errors; nothing is fetched. What was run is kept in build/executed.
docs: .venv/installed-docs
	$(BIN)/python -m sphinx -W --keep-going -q -j 2 -c docs . build/site
	@echo "build/site/index.html"

docs-open: docs
	@echo "http://127.0.0.1:$(PORT)/ until Ctrl-C"
	$(BIN)/python -m http.server $(PORT) --bind 127.0.0.1 --directory build/site

outputs: .venv/installed
	$(BIN)/python docs/write.py

notebooks: .venv/installed-test
	$(BIN)/python notebooks/run.py

benchmark: .venv/installed-test
	$(BIN)/pip install -q -e '.[bench]'
	$(BIN)/python benchmarks/measure/kinematics_speed.py
	$(BIN)/python benchmarks/peers/balance_peers.py
	$(BIN)/python benchmarks/peers/rapier_peers.py
	$(BIN)/python benchmarks/peers/shedding_peers.py
	$(BIN)/python benchmarks/measure/answers.py
	$(BIN)/python benchmarks/measure/fronts.py
	$(BIN)/python benchmarks/measure/startup.py
	$(BIN)/python benchmarks/measure/stretches.py

.venv/installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -q -e .
	$(BIN)/python -m compileall -q loomopt
	touch $@

.venv/installed-test: .venv/installed
	$(BIN)/pip install -q -e '.[test]'
	touch $@

.venv/installed-docs: .venv/installed-test
	$(BIN)/pip install -q -e '.[docs]'
	touch $@

# In the place of the newest versions those of requirements.lock, with which the suite has passed.
locked:
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -q -c requirements.lock -e '.[test,docs]'
	$(BIN)/python -m compileall -q loomopt
	touch .venv/installed
	touch .venv/installed-test
	touch .venv/installed-docs

clean:
	rm -rf .venv build/site build/executed
