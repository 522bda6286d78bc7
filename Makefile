# make replay   100 steps of the paper, figures in out/paper; a policy and the baseline in out/learned
# make test     tests of every part in a few minutes
# make test-all all tests; installs PyTorch and RLlib
# make lint     formatting, warnings, types
# make bench    real-time factor of the paper's replay at each accuracy
# make microbench  time and instructions of the engine's parts (instructions need valgrind)
# make effects  cost of each effect of the paper's scene; renews docs/generated/effects.*
# make performance  IceSkate and other simulators in one run; renews docs/generated/performance.*
# make accuracy  time against error for every motion; renews docs/generated/accuracy*
# make hardcases  every hard case with every method; renews docs/generated/hard-cases.*
# make cases    the hard cases of the page; renews web/src/cases.json
# make gaits    cards of the presets beside their limits; renews docs/generated/gait*
# make docs     the site of the documents: target/docs; with the page in it after make web
# make notebooks  runs the notebooks of docs/notebooks, and stores their outputs; minutes
# make film     the films and the picture; renews docs/*.gif and docs/iceskate.png
# make artefacts  everything that a program makes, policies included; goes on where it was
# make mutations  every hard case fails without the mechanism that it tests; renews docs/generated/mutations.md
# make fuzz     fuzzing of the engine, for 600 s or SECONDS=...; needs a nightly Rust and cargo-fuzz
# make wheels   the wheel for this machine and the sdist, each installed and tried; in target/wheels
# make web      the page with the engine in WebAssembly: skate_env/web; needs Node 20.19 or newer
# make web-test tests of the page in Node and in headless Chromium
# make licences  licences of what wheel and page contain; renews docs/third-party-licences.txt
# make unused   checks that an effect which no scene uses costs no instruction (needs valgrind)
#
# Needs Rust's cargo and python3 >= 3.10; everything else goes into .venv.

PYTHON ?= python3
RUST := Cargo.toml Cargo.lock $(shell find rust -type f)

# pip, maturin and the build of the bindings all look for the environment here.
export VIRTUAL_ENV := $(CURDIR)/.venv
export PATH := $(VIRTUAL_ENV)/bin:$(PATH)
unexport CONDA_PREFIX PYTHONHOME PYTHONPATH

.PHONY: replay test test-rust test-python test-all test-all-rust test-all-python lint lint-rust lint-python bench microbench performance effects accuracy hardcases cases gaits docs notebooks film artefacts mutations fuzz unused licences wheels web web-test
.DELETE_ON_ERROR:

replay: .venv/.package
	.venv/bin/skate-env replay --scene paper --steps 100 --out out/paper
	.venv/bin/skate-env replay $(LEARNED) --steps 30 --out out/learned
	.venv/bin/skate-env record $(LEARNED) $(COMPARISON) --out out/learned/comparison.gif

# Push-only contact, where the baseline falls.
LEARNED = --scene push_only --policy shipped --perturb 0.02
COMPARISON = --compare-baseline --steps 8 --fps 20 --size 800x320

# The quick tier: without long tests and learning libraries (tests/conftest.py), without the unit
# tests of the engine, which compile it once more, and its tests of lanes.
test:
	$(MAKE) -j2 --output-sync=target test-rust test-python
test-rust:
	cargo test $(RUST_TIER)
test-python: .venv/.package .venv/.test
	.venv/bin/python -m pytest -n auto -m "not long"
RUST_TIER = -p skate-core --test laws --test push_only --test effects --test layers

# All tests. RLlib pins Gymnasium 1.2.2; tests of environments run with 1.4, too, but not those of
# motions, trainings and speed, which make environments only to run them.
RUN_ONCE = accuracy any_ice_training bench gait_limits laws reward_order shipped_policies site vector_bits
GYMNASIUM_TESTS = $(filter-out $(RUN_ONCE:%=tests/test_%.py), $(shell \
	grep -lE '^(import|from) (gymnasium|skate_env\.(environments|sb3))|^from skate_env import .*IceSkate' tests/test_*.py))
test-all: test-all-rust test-all-python
test-all-rust:
	cargo test
test-all-python: .venv/.package .venv/.test-all .venv/gymnasium-1.4
	SKATE_TESTS=all GYMNASIUM=1.2 .venv/bin/python -m pytest -n auto
	SKATE_TESTS=all GYMNASIUM=1.4 PYTHONPATH=$(CURDIR)/.venv/gymnasium-1.4 \
		.venv/bin/python -m pytest -n auto $(GYMNASIUM_TESTS)

# Types are those of the newest Gymnasium.
lint: lint-rust lint-python
# The bindings want an interpreter to be there.
lint-rust: .venv/.made
	cargo fmt --all --check
	cargo clippy --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps
lint-python: .venv/.package .venv/.test-all .venv/gymnasium-1.4
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	PYTHONPATH=$(CURDIR)/.venv/gymnasium-1.4 .venv/bin/mypy
	.venv/bin/python -m mypy.stubtest skate_env._core

bench:
	cargo run --release -p skate-core --example replay_speed -- skate_env/scenes/paper.toml

microbench:
	cargo bench --quiet -p skate-core --bench micro

effects: .venv/.package .venv/.test-all
	.venv/bin/skate-env effects --scene paper_printed --out out/effects
	cp out/effects/effects.md out/effects/effects.png docs/generated

performance: .venv/.package .venv/.test-all
	.venv/bin/python -m tests.bench --out out/bench
	cp out/bench/performance.md out/bench/performance.png docs/generated

accuracy: .venv/.package .venv/.test-all
	.venv/bin/skate-env accuracy --out out/accuracy
	cp out/accuracy/accuracy.md out/accuracy/accuracy.png out/accuracy/accuracy_*.png docs/generated

hardcases: .venv/.package
	.venv/bin/skate-env hardcases --method all --out out/hardcases
	cp out/hardcases/hard-cases.md out/hardcases/hard-cases.png docs/generated

cases: .venv/.package
	.venv/bin/python web/catalogue.py

gaits: .venv/.package
	.venv/bin/python -m training.gaits $(foreach scene,$(PRESETS),--scene $(scene)) --out out/gaits
	cp out/gaits/gaits.md out/gaits/gait_*.png docs/generated
PRESETS = paper paper_printed paper_arms push_only

# Tools of 150 MB. The site is read without a network; a broken link or a missing name is an error.
docs: .venv/docs
	NO_MKDOCS_2_WARNING=1 PYTHONPATH=$(CURDIR)/.venv/docs \
		.venv/bin/python -m mkdocs build --quiet --config-file docs/site/mkdocs.yml

notebooks: .venv/.package .venv/.test-all .venv/notebooks
	PYTHONPATH=$(CURDIR)/.venv/notebooks .venv/bin/python docs/site/notebooks.py

film: .venv/.package
	.venv/bin/skate-env record --steps 6 --fps 25 --size 640x360 --out docs/iceskate.gif
	.venv/bin/skate-env record $(LEARNED) $(COMPARISON) --out docs/comparison.gif
	.venv/bin/skate-env record --scene paper --policy shipped --perturb 0.08 $(FILM) --out docs/films/IceSkate-v0.gif
	.venv/bin/skate-env record $(LEARNED) $(FILM) --out docs/films/IceSkatePushOnly-v0.gif
	.venv/bin/skate-env record --policy skate_env/policies/any_ice.npz --perturb 0.05 --seed 3 $(FILM) --out docs/films/IceSkateAnyIce-v0.gif
	.venv/bin/python -m training.orbits.push_only --feedback out/step.npz
	.venv/bin/skate-env record --policy out/step.npz --steps 4 --fps 20 --size 560x316 --out docs/push-only-order.gif
	.venv/bin/python -c "import skate_env, skate_env.render as render, PIL.Image as image; \
		sim = skate_env.Simulator('paper'); sim.advance(1.05); \
		image.fromarray(render.Renderer().draw(sim)).save('docs/iceskate.png', optimize=True)"
FILM = --steps 7 --fps 20 --size 480x270

artefacts: .venv/.package .venv/.test-all
	.venv/bin/python -m training.artefacts

mutations: .venv/.package .venv/.test-all
	.venv/bin/python -m tests.campaigns.mutate --out out/mutations
	cp out/mutations/mutations.md docs/generated

# What is new in coverage goes to target/fuzz, what breaks to rust/skate-fuzz/artifacts.
SECONDS ?= 600
fuzz:
	mkdir -p target/fuzz
	cargo +nightly fuzz run --fuzz-dir rust/skate-fuzz --features libfuzzer --sanitizer none \
		scene_and_steps target/fuzz rust/skate-fuzz/corpus/scene_and_steps -- \
		-timeout=20 -max_len=1024 -max_total_time=$(SECONDS)

unused: .venv/.package .venv/.test-all
	.venv/bin/python tests/unused_effect.py

licences: .venv/.made web/node_modules
	.venv/bin/python -m tests.licences

wheels: .venv/.made
	.ci/wheels

WASM = wasm32-unknown-unknown
CARGO_WEB = --manifest-path rust/skate-web/Cargo.toml --target-dir target/web
web: web/public/engine.wasm web/public/licences.txt web/node_modules
	cd web && npx tsc && npx vite build && npx vite build --config vite.player.ts

# Chromium is the one of CHROMIUM, or an installed one.
web-test: web web/native.json web/recording
	cargo fmt --manifest-path rust/skate-web/Cargo.toml --check
	cargo clippy --release $(CARGO_WEB) --all-targets -- -D warnings
	cd web && npx vitest run

web/public/engine.wasm: $(RUST)
	rustup target add $(WASM)
	cargo build --release $(CARGO_WEB) --lib --target $(WASM)
	mkdir -p web/public
	cp target/web/$(WASM)/release/skate_web.wasm $@

web/public/licences.txt: docs/third-party-licences.txt
	mkdir -p web/public
	cp $< $@

# 100 gait steps of every preset, and of the scenes of studies, in the native engine.
WEB_SCENES = $(wildcard skate_env/scenes/*.toml skate_env/studies/scenes/*.toml)
web/native.json: $(RUST) $(WEB_SCENES)
	cargo build --release $(CARGO_WEB) --example checksums
	target/web/release/examples/checksums 100 $(WEB_SCENES) > $@

# A recording of the Python package.
web/recording: .venv/.package web
	.venv/bin/skate-env replay --scene paper_printed --steps 3 --no-figures --html --out $@

web/node_modules: web/package-lock.json
	cd web && npm ci --no-audit --no-fund
	touch $@

# The files below say when each part was last brought up to date.

.venv/.made:
	$(PYTHON) -m venv .venv
	.venv/bin/pip install --quiet --disable-pip-version-check 'maturin>=1.9,<2'
	touch $@

# The package, compiled, with what it needs to run. Its Python files are used in place.
.venv/.package: .venv/.made pyproject.toml $(RUST)
	.venv/bin/maturin develop --release
	touch $@

# Libraries of the test tiers. They include the package by its own name, so that goes first.
.venv/.test: pyproject.toml | .venv/.package
	.venv/bin/maturin develop --release --extras test
	touch $@
.venv/.test-all: pyproject.toml | .venv/.package
	.venv/bin/maturin develop --release --extras test-all
	touch $@

# A second Gymnasium, for PYTHONPATH.
.venv/gymnasium-1.4: | .venv/.made
	.venv/bin/pip install --quiet --disable-pip-version-check --no-deps --target $@ 'gymnasium==1.4.*'

# The tools of the site, for PYTHONPATH.
.venv/docs: | .venv/.made
	.venv/bin/pip install --quiet --disable-pip-version-check --target $@ 'mkdocs-material>=9.6,<10' 'mkdocstrings-python>=2,<3'

# A kernel for the notebooks, for PYTHONPATH.
.venv/notebooks: | .venv/.made
	.venv/bin/pip install --quiet --disable-pip-version-check --target $@ 'ipykernel>=6,<8' 'nbclient>=0.10,<1'
