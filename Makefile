# make demo, make test: need Python 3.11 or newer with venv, and make; they set up .venv themselves.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: demo test check validity mutants recorded bench examples docs clean

demo: .venv/.app
	rm -rf build/demo
	$(BIN)/forcemap demo build/demo

# One worker more than there are cores: many tests wait for another process or a browser. What is compiled is kept, also
# where PYTHONDONTWRITEBYTECODE is set: every worker and every started process would compile it anew. Files in the order of
# tests/conftest.py: xdist's own would begin those of few long tests last, when the other workers have nothing left.
test: .venv/.test
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n $$($(BIN)/python -c "import os; print(1 + (os.cpu_count() or 1))") --dist loadfile --no-loadscope-reorder

check: .venv/.check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -q tests/test_import_directions.py tests/test_architecture.py

validity: .venv/.test
	FORCEMAP_VALIDITY=full $(BIN)/python -m pytest tests -s

# A seeded sample of changed sources, each held against the tests that run it: make mutants SEED=7 COUNT=100
SEED ?= 1
COUNT ?= 300
mutants: .venv/.mutants
	$(BIN)/python scripts/mutants.py --seed $(SEED) --count $(COUNT)

# What the tests hold of whole texts and tables, written anew: look at the diff, only what was meant to change may have
RECORDED := chain map_figures pieces readings refusals sheets speed_refusals
recorded: .venv/.test
	for name in $(RECORDED); do $(BIN)/python tests/$$name.py || exit 1; done
	$(BIN)/python scripts/make_paper_page.py

bench: .venv/.test
	$(BIN)/python benchmarks/run.py
	$(BIN)/python benchmarks/fast.py
	$(BIN)/python benchmarks/growth.py

examples: .venv/.app
	$(BIN)/python scripts/make_examples.py

docs: .venv/.docs
	$(BIN)/python scripts/make_figures.py
	$(BIN)/python scripts/make_paper_page.py
	$(BIN)/python scripts/draw_rooms.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "open build/site/index.html; with search: $(BIN)/python -m http.server --bind 127.0.0.1 -d build/site"

clean:
	rm -rf .venv build dist

.venv/.app: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "forcemap needs Python 3.11 or newer, this is " + sys.version.split()[0] + "; name another with: make PYTHON=python3.12 ...")'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "this Python has no venv; on Debian or Ubuntu: apt install python3-venv"; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(PIP) -e '.[app]'
	$(BIN)/python -m compileall -q src
	@touch $@

.venv/.docs: .venv/.app
	$(PIP) -e '.[app,docs]'
	@touch $@

.venv/.test: .venv/.app
	$(PIP) -e '.[app,docs,test]'
	@touch $@

.venv/.check: .venv/.test
	$(PIP) -e '.[app,docs,test,check]'
	@touch $@

.venv/.mutants: .venv/.test
	$(PIP) -e '.[app,docs,test,mutants]'
	@touch $@
