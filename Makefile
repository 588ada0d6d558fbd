# Needs python3 (3.11 to 3.13) with venv, and make; everything else goes into .venv.
#   make PYTHON=python3.12 ...    uses another Python

PYTHON ?= python3
VENV = .venv
BIN = $(VENV)/bin
INSTALLED = $(VENV)/.installed
UNFINISHED = $(VENV)/.unfinished
DEMO = runs/demo
# Where PyTorch's CPU build is found: PyPI's, on Linux, brings 5 GB of CUDA.
TORCH_INDEX ?= https://download.pytorch.org/whl/cpu

.PHONY: help demo test bench docs lint release-check clean

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## */  make \1	/p' Makefile

demo: $(INSTALLED)  ## the arm moves a screwdriver and a circuit board; recordings in runs/demo
	$(BIN)/tca-mj demo pick-and-place --option object=screwdriver --out $(DEMO)/screwdriver
	$(BIN)/tca-mj demo pick-and-place --option object=pcb --out $(DEMO)/pcb
	@for object in screwdriver pcb; do \
	    echo "$$object:"; \
	    for file in summary.json rollout.rrd rollout.mp4 rollout.html; do \
	        path=$(DEMO)/$$object/$$file; \
	        if [ -e "$$path" ]; then echo "  $$path"; else echo "  $$path (not written)"; fi; \
	    done; \
	done
	@echo "open a recording:  $(BIN)/rerun $(DEMO)/screwdriver/rollout.rrd"

test: $(INSTALLED)  ## all tests
	MPLBACKEND=Agg $(BIN)/pytest -q -n auto --maxprocesses 8 --dist loadfile

bench: $(INSTALLED)  ## speed and accuracy figures, in runs/bench
	$(BIN)/python scripts/benchmark.py --out runs/bench

docs: $(INSTALLED)  ## the site, in build/site; it opens without a server
	$(BIN)/python scripts/build_site.py

lint: $(INSTALLED)  ## style and types
	$(BIN)/ruff check .
	$(BIN)/python scripts/typing_tree.py
	$(BIN)/mypy

release-check: $(INSTALLED)  ## all that a release is tried with, some hours; its table is in docs/release.md
	$(BIN)/python scripts/release_check.py

clean:  ## removes .venv and what was built; keeps runs
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# .unfinished stands in .venv from before its making to after the first complete installation:
# where it is found, a run was interrupted, and the environment is made anew. So is one whose pip
# does not start. An environment that somebody else made in .venv is used as it is.
$(INSTALLED): pyproject.toml constraints.txt
	@if [ -e $(UNFINISHED) ] || ! $(BIN)/python -m pip --version >/dev/null 2>&1; then \
	    echo "making $(VENV), which takes some minutes"; \
	    rm -rf $(VENV) && mkdir $(VENV) && : >$(UNFINISHED) && $(PYTHON) -m venv $(VENV); \
	fi
	@rm -f $(INSTALLED)
	@$(BIN)/python -c 'import torch' 2>/dev/null || $(BIN)/python -m pip install --quiet \
	    --disable-pip-version-check --retries 0 --timeout 15 -c constraints.txt \
	    --index-url $(TORCH_INDEX) --no-deps torch 2>/dev/null || \
	    echo "no CPU build of PyTorch at $(TORCH_INDEX): pip looks elsewhere"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    -c constraints.txt -e '.[demo,rl,dev]'
	@: >$(INSTALLED)
	@rm -f $(UNFINISHED)
