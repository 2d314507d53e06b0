# The two main commands: `make demo` plans an example, `make test` checks the project.
VENV := .venv
BIN := $(VENV)/bin
NATIVE := $(wildcard $(foreach below,src src/* src/*/*,solvers/*/$(below)/*.rs) solvers/*/Cargo.toml) solvers/Cargo.toml pyproject.toml
PAGE := feedplan/report/bundle/page.js
# Without --no-compile pip would compile all modules of the packages; most of them are never imported.
INSTALL := $(BIN)/pip install --quiet --no-compile --constraint constraints.txt
CARGO := MAKEFLAGS= CARGO_TARGET_DIR=$(CURDIR)/solvers/target
MANYLINUX := $(if $(filter Linux,$(shell uname -s)),--zig --compatibility manylinux_2_28)
export PATH := $(CURDIR)/$(BIN):$(PATH)
# Packages and pages are installed while cargo compiles; native tests, lint and pytest run at the same time.
MAKEFLAGS += --jobs=4
# With this variable Python would compile modules again at each start, which takes a tenth of a second.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test pytest native lint clippy linuxcnc page wheel docs bench campaign clean cargo

demo: $(VENV)/built $(PAGE)
	@$(BIN)/python examples/vase.py --blocks 2000 --output out/vase.ngc
	@$(BIN)/feedplan plan out/vase.ngc --machine vase -o out/vase
	@echo "The report is out/vase/report.html"

test: pytest native lint

# The first command compiles the test files once, so that not every process does it. Tests wait half of the time for services
# and programs that they start, so there are two processes per processor. The tests of a file share servers, clusters and a
# browser, so one process runs all tests of a file. No test needs NumPy's threads for linear algebra, which would start with each
# of a thousand processes.
pytest: $(VENV)/dev $(PAGE) $(filter linuxcnc,$(MAKECMDGOALS))
	@$(BIN)/pytest --collect-only --quiet --quiet >/dev/null
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest --numprocesses $$((2 * $$(getconf _NPROCESSORS_ONLN))) --dist loadfile --no-loadscope-reorder

# The native tests link the crates that have been compiled for the module. The module is built first, because the tests in
# Python wait for it.
native: | $(VENV)/built
	$(CARGO) cargo test --release --quiet --lib --tests --manifest-path solvers/Cargo.toml

lint: clippy $(VENV)/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest feedplan._solvers
	$(BIN)/lint-imports
	cargo fmt --all --check --manifest-path solvers/Cargo.toml

clippy: cargo
	$(CARGO) cargo clippy --release --quiet --workspace --all-targets --manifest-path solvers/Cargo.toml -- -D warnings

# Installs LinuxCNC, whose interpreter is compared with ours, and an emulator of processors. Without them the tests that need
# them are skipped.
linuxcnc:
	.ci/linuxcnc

page: $(PAGE)

# A package for computers without cargo and Node.js. On Linux zig links it for glibc 2.28 and newer. TARGET selects another
# processor for which cargo can compile: `rustup target add $(ARM)`, then `make wheel TARGET=$(ARM)`.
ARM := aarch64-unknown-linux-gnu
wheel: $(VENV)/dev $(VENV)/zig $(PAGE)
	rm -rf dist
	$(CARGO) $(BIN)/maturin build --release $(MANYLINUX) $(addprefix --target ,$(TARGET)) --out dist
	FEEDPLAN_WHEELS=dist $(BIN)/pytest -rs tests/test_portable.py

# Warnings are errors. The pages show the output of the numbered examples, and load nothing from the network.
docs: $(VENV)/docs $(VENV)/dev $(PAGE)
	@mkdir -p out/examples
	for script in examples/[0-9]_*.py; do \
		$(BIN)/python $$script >out/examples/$$(basename $$script .py).txt || exit 1; \
	done
	$(BIN)/sphinx-build --quiet --fail-on-warning --keep-going -d out/doctrees docs out/docs
	FEEDPLAN_DOCS=out/docs $(BIN)/pytest tests/test_docs.py
	@echo "The documentation is out/docs/index.html"

bench: $(VENV)/dev $(PAGE)
	cargo run --release --package feedplan-benches --manifest-path solvers/Cargo.toml -- --bench
	$(BIN)/python -m benchmarks

# Millions of random paths, thousands on every machine, and property tests with new random cases. A failure becomes a case of
# the test that found it; benchmarks/README.md has the numbers of cases.
campaign: $(VENV)/dev $(PAGE) docs wheel
	FEEDPLAN_SEEDS=1000000 cargo test --release --manifest-path solvers/Cargo.toml --test kernels planning::random:: -- --nocapture
	FEEDPLAN_SEEDS=1000000 cargo test --release --manifest-path solvers/Cargo.toml --test kernels planning::bound:: -- --nocapture
	FEEDPLAN_SEEDS=1250 $(BIN)/pytest --numprocesses auto tests/constraints/test_joints.py -k random
	FEEDPLAN_SEEDS=200 $(BIN)/pytest --numprocesses auto tests/planners/test_meshes.py -k random
	FEEDPLAN_SEEDS=10000 $(BIN)/pytest --numprocesses auto tests/planners/test_jerk_limited.py -k random
	FEEDPLAN_SEEDS=2000 $(BIN)/pytest --numprocesses auto tests/planners/test_curvature_jumps.py
	FEEDPLAN_SEEDS=500 $(BIN)/pytest --numprocesses auto tests/planners/test_slow_feeds.py -k bound
	FEEDPLAN_SEEDS=1000 $(BIN)/pytest --numprocesses auto tests/planners/test_random_programs.py
	FEEDPLAN_SEEDS=2000 $(BIN)/pytest --numprocesses auto tests/planners/test_posted_programs.py
	FEEDPLAN_SEEDS=100000 $(BIN)/pytest --numprocesses auto tests/planners/test_lines.py -k random
	FEEDPLAN_SEEDS=5000 $(BIN)/pytest --numprocesses auto tests/planners/test_awkward_paths.py -k random
	FEEDPLAN_SEEDS=2000 $(BIN)/pytest --numprocesses auto tests/planners/test_tip_programs.py -k random
	FEEDPLAN_EXAMPLES=5000 $(BIN)/pytest --numprocesses auto tests/test_setpoints_curves.py -k planned
	FEEDPLAN_SEEDS=1000 $(BIN)/pytest --numprocesses auto tests/planners/test_extreme_machines.py
	FEEDPLAN_SEEDS=10000 $(BIN)/pytest --numprocesses auto tests/test_hostile.py
	FEEDPLAN_SEEDS=1000 $(BIN)/pytest --numprocesses auto tests/planned_feeds/test_linuxcnc_reads.py
	FEEDPLAN_SEEDS=10000 $(BIN)/pytest tests/service/test_hostile_uploads.py
	FEEDPLAN_SEEDS=200 $(BIN)/pytest tests/service/test_kills.py
	FEEDPLAN_PICTURES=out $(BIN)/pytest -rs tests/service/test_page.py
	$(BIN)/pip install --quiet schemathesis
	FEEDPLAN_EXAMPLES=100 $(BIN)/pytest tests/service/test_documentation.py
	cargo fuzz --version >/dev/null 2>&1 || cargo install --locked cargo-fuzz
	cd solvers && mkdir -p fuzz/corpus && tar -xf fuzz/corpus.tar.xz -C fuzz/corpus && \
		cargo fuzz run --sanitizer none gcode -- -dict=fuzz/gcode.dict -max_total_time=300 -timeout=10 -max_len=4096 && \
		cargo fuzz cmin --sanitizer none gcode && tar --sort=name --mtime=@0 -cJf fuzz/corpus.tar.xz -C fuzz/corpus gcode
	for i in 1 2 3 4 5 6 7 8 9 10; do \
		seed=$$(date +%s%N); echo "property tests of native code, PROPTEST_RNG_SEED=$$seed"; \
		PROPTEST_RNG_SEED=$$seed PROPTEST_CASES=5000 cargo test --release --quiet --manifest-path solvers/Cargo.toml || exit 1; \
	done
	FEEDPLAN_EXAMPLES=1000 $(BIN)/pytest --numprocesses auto -m hypothesis

clean:
	rm -rf $(VENV) out solvers/target page/node_modules $(dir $(PAGE))

$(VENV)/built: $(VENV)/module $(VENV)/packages
	@touch $@

# The native module is built again only if its sources have changed; the native tests link the same crates.
$(VENV)/module: $(VENV)/maturin $(NATIVE) | cargo
	$(CARGO) $(INSTALL) --no-deps --no-build-isolation --editable .
	@touch $@

# The packages that `dependencies` lists.
$(VENV)/packages: pyproject.toml constraints.txt | $(VENV)/maturin
	@sed -n '/^dependencies = \[/,/^\]/s/^ *"\(.*\)",$$/\1/p' pyproject.toml >$@.txt
	$(INSTALL) --requirement $@.txt
	@touch $@

# The additional packages for tests and lint, and those for the documentation.
$(VENV)/dev $(VENV)/docs: pyproject.toml constraints.txt | $(VENV)/built
	$(INSTALL) "feedplan[$(@F)]"
	@touch $@

# Two installations at a time would write the same packages.
$(VENV)/docs: | $(VENV)/dev

$(VENV)/zig: constraints.txt | $(VENV)/maturin
	$(INSTALL) ziglang
	@touch $@

cargo:
	@command -v cargo >/dev/null || { echo "cargo is missing: install the Rust toolchain"; exit 1; }

# The script and the style sheet that draw the report, the comparison and the page of the service.
$(PAGE): $(wildcard page/source/* page/source/*/*) page/build.mjs page/node_modules/installed
	node page/build.mjs

page/node_modules/installed: page/package.json page/package-lock.json
	@command -v npm >/dev/null || { echo "npm is missing: install Node.js 20 or newer with npm"; exit 1; }
	cd page && npm ci --ignore-scripts --no-audit --no-fund --silent
	@touch $@

$(VENV)/maturin: constraints.txt
	@python3 -m venv $(VENV) || { echo "python3 lacks venv: install the package python3-venv"; exit 1; }
	$(INSTALL) maturin
	@touch $@
