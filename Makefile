# make solve: balance the packaged loom.   make test: the suite; make slow: its slow studies.   All make .venv themselves.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: solve test slow lint types docs notebooks benchmark clean

solve: .venv/installed
	$(BIN)/loomopt solve beatup --target balance

test: .venv/installed-test
	$(BIN)/python -m pytest -n auto --dist loadfile -m "not slow" --durations 10

slow: .venv/installed-test
	$(BIN)/python -m pytest -n auto --dist loadfile -m slow --durations 10

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

clean:
	rm -rf .venv
