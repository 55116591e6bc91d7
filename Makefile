# Two commands matter: `make demo` (a made-up studio, danced) and `make test`.
.DEFAULT_GOAL := help
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
BLENDER := .venv-blender

help: ## what can be made
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 14

# The Pythons that pyproject.toml allows, read from it: there they are said once.
ALLOWED := import re, sys; \
  said = re.search(r"requires-python = \">=3.(\d+),<3.(\d+)\"", open("pyproject.toml").read()).groups(); \
  sys.exit(not (3, int(said[0])) <= sys.version_info[:2] < (3, int(said[1])))

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c '$(ALLOWED)' || { echo "odori: want a Python that is $$(sed -n 's/^requires-python = "\(.*\)".*/\1/p' \
	  pyproject.toml), got $$($(PYTHON) --version 2>&1); name one with 'make PYTHON=python3.11'"; exit 2; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check uv==0.13.9
	@VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/uv pip install --quiet --compile-bytecode --require-hashes -r requirements.lock
	@VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/uv pip install --quiet --no-build-isolation --no-deps --editable .
	@touch $(STAMP)

install: $(STAMP) ## .venv with odori, ruff, lint-imports, pytest in it

demo: $(STAMP) ## a made-up studio, the whole pipeline, one dance
	@$(BIN)/odori demo

wheel: $(STAMP) ## dist/odori-*.whl, which needs no checkout
	@VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/uv build --quiet --wheel --no-build-isolation --out-dir dist
	@ls dist/odori-*.whl

test: $(STAMP) ## the tests
	@$(BIN)/python -m pytest -n auto --dist loadfile

mutants: $(STAMP) ## small changes of kernels and of dancing, which tests have to find; goes on where it was ended
	@$(BIN)/python tests/mutants/run.py

mutants-sample: $(STAMP) ## a part of them again; a kill that is lost is an error
	@$(BIN)/python tests/mutants/run.py --sample

lint: $(STAMP) ## style, types, import contracts
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

docs: $(STAMP) ## docs/data.md, docs/settings.md and the pictures of docs, from what is declared and measured
	@$(BIN)/python docs/generate.py
	@$(BIN)/python docs/draw_graph.py
	@$(BIN)/python docs/draw_springs.py
	@$(BIN)/python docs/draw_spikes.py

$(BLENDER)/.installed: requirements-blender.lock $(STAMP)
	@$(BIN)/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
	  { echo "odori: bpy 4.5 wants Python 3.11, got $$($(BIN)/python --version); make a .venv of that"; exit 2; }
	@test -x $(BLENDER)/bin/python || $(BIN)/python -m venv $(BLENDER)
	@VIRTUAL_ENV=$(CURDIR)/$(BLENDER) $(BIN)/uv pip install --quiet --require-hashes -r requirements-blender.lock
	@touch $@

blender: $(BLENDER)/.installed ## Blender's Python module (0.9 GB), and the tests that open stages in it
	@$(BIN)/python -m pytest -m blender

lock: $(STAMP) ## resolve the dependencies anew
	@$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-annotate --no-emit-index-url \
	  --no-emit-find-links --no-header --extra dev pyproject.toml -o requirements.lock
	@echo 'bpy==4.5.*' | $(BIN)/uv pip compile - --quiet --python-version 3.11 --python-platform x86_64-manylinux_2_28 \
	  --generate-hashes --no-annotate --no-emit-index-url --no-emit-find-links --no-header -o requirements-blender.lock

.PHONY: help install demo wheel test mutants mutants-sample lint docs blender lock
