# Needs Python 3.11 or later (with venv) and make. Everything else goes into .venv, from hashed locks.
#   make demo    the whole network on this machine        make test   every check
#   make prove   every promised figure, measured          make lock   renew requirements/*.txt
#   make wheel   dist/*.whl                               make test-wheel   the tests against the wheel

PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check -q
PARTS := body wire nodes router fusion viewer deploy
ARGS ?=

# Tests start hundreds of processes: they share what is compiled once.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test check pytest prove lock wheel test-wheel clean
.DEFAULT_GOAL := demo

demo: $(VENV)/demo.stamp
	$(BIN)/brachium demo $(ARGS)

test: check pytest

check: $(VENV)/dev.stamp
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

# Many tests wait for processes: three at a time keep two cores busy.
pytest: $(VENV)/dev.stamp
	$(BIN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder $(ARGS)

prove: $(VENV)/demo.stamp
	$(BIN)/brachium prove --out docs/figures $(ARGS)

# The source is kept off the path: --import-mode=importlib and an empty pythonpath leave only the installed wheel.
test-wheel: wheel $(VENV)/dev.stamp
	rm -rf build/wheel && mkdir -p build/wheel
	$(PYTHON) -m venv build/wheel/venv
	build/wheel/venv/bin/python -m pip --disable-pip-version-check -q install --require-hashes -r requirements/dev.txt
	build/wheel/venv/bin/python -m pip --disable-pip-version-check -q install --no-deps dist/brachium-*.whl
	cp -r tests pyproject.toml docs README.md CHANGELOG.md requirements build/wheel/
	cd build/wheel && BRACHIUM_WHEEL=1 BRACHIUM_DATA=$${BRACHIUM_DATA:-$(CURDIR)/../shared/data} \
		venv/bin/python -m pytest -o pythonpath= $(ARGS)

wheel: $(VENV)/dev.stamp
	rm -rf dist && $(BIN)/python -m build --wheel --no-isolation --outdir dist

lock:
	test -x build/lock/bin/uv || ($(PYTHON) -m venv build/lock && build/lock/bin/pip install -q uv)
	build/lock/bin/uv pip compile $(LOCK) pyproject.toml --extra demo --group build -o requirements/demo.txt
	build/lock/bin/uv pip compile $(LOCK) pyproject.toml --extra demo --extra can --extra lsl --extra micropython --group dev -o requirements/dev.txt

# One lock for CPython 3.11 and later on every platform, the public index's hashes, no address.
LOCK := -q --no-config --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --upgrade

$(VENV)/python.stamp:
	@test -n "$(PYTHON)" || { echo "Brachium needs Python 3.11 or later; none was found. Set PYTHON=/path/to/python3"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' || { echo "$(PYTHON) has no venv; on Debian: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/%.stamp: requirements/%.txt pyproject.toml $(VENV)/python.stamp
	$(PIP) install --require-hashes -r requirements/$*.txt
	$(PIP) install --no-deps --no-build-isolation -e .
	touch $@

clean:
	rm -rf $(VENV) build dist
