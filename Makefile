# Two doors: `make demo` and `make test`. Each installs what is missing (cmake/deps.txt), configures, builds
# and runs; a second call installs and rebuilds nothing. The rest is for those who work on the library.
PREFIX ?= /usr/local
SCENE ?= examples/scenes/two_cylinders.json
# How many compilers or tests run at a time; a compiler needs two thirds of a gigabyte.
JOBS ?= $(shell nproc)
EXAMPLES = $(patsubst examples/%.c,example_%,$(wildcard examples/*.c))
# A folder of contact problems in Siconos' text format or FCLIB's HDF5
CONTACT_PROBLEMS ?=
# What bench-peers runs: all or quick
PEERS ?= all
SETUP = @cmake/fresh.sh && cmake/setup.sh
BUILD = @cmake --build -j $(JOBS) --preset
# The set-up's own, as in cmake/DeformPython.cmake.
PYTHON ?= $(firstword $(wildcard /usr/bin/python3) python3)

# The doors share build folders: `make -j demo test` runs one after the other. JOBS is for the compilers.
.NOTPARALLEL:
.PHONY: help demo test bench soak soak-fuzz lint format tidy asan tsan fuzz install clean
.PHONY: view tools bench-contact bench-peers packages deb docs wheel wasm ports ports-built abi-report
.PHONY: setup setup-test setup-bench setup-fuzz setup-docs setup-peers setup-wasm setup-ports

help:
	@echo "make demo             two soft cylinders with and without friction: table, picture, out/demo/"
	@echo "make view [SCENE=..]  the same scene in a window"
	@echo "make tools            left out by the demo: check, cost, calibrate, friction, scans, ccd, rollback"
	@echo "make test             the whole test suite"
	@echo "make bench            the figures: kernels and full steps"
	@echo "make bench-contact    contact problems of others (FCLIB, Siconos): CONTACT_PROBLEMS=folder"
	@echo "make bench-peers      beside MuJoCo, Bullet and Jolt: speed at equal error, build/peers/"
	@echo "                      PEERS=quick: coarse scenes and the sliding block only, some minutes"
	@echo "make soak             long tests, jitter, combinations, first scenes: hours; can stop"
	@echo "make lint             layout, includes, headers, text"
	@echo "make format           clang-format on all C and C++ files, one version everywhere"
	@echo "make tidy             clang-tidy on the library, where it is installed"
	@echo "make asan, make tsan  the suite under the sanitizers; asan by clang; tsan: several threads"
	@echo "make fuzz             the readers under libFuzzer"
	@echo "make install PREFIX=  library, headers, plugins, command (default $(PREFIX))"
	@echo "make wheel            the Python package for CPython 3.9 up, manylinux: build/dist/"
	@echo "make wasm             scenes in a browser without a server: build/wasm/page/index.html"
	@echo "make ports            arm64 and Windows, tested by qemu and Wine; the wheel for Windows"
	@echo "make deb              Debian packages of the same, build/release/packages/"
	@echo "make packages         source archive, wheel; the same bytes from two folders: build/dist/"
	@echo "make abi-report       build/abi/report.txt: what changed in the public headers, for release notes"
	@echo "make docs             the pages, the API and search as a site: build/site/index.html"
	@echo "make clean            removes build/ and out/"
	@echo "JOBS=N                with any of them: compilers or tests at a time (default: one per processor)"

setup:
	$(SETUP) doors
setup-test:
	$(SETUP) doors readers
setup-bench:
	$(SETUP) doors bench
setup-peers:
	$(SETUP) doors peers
setup-docs:
	$(SETUP) docs
setup-wasm:
	$(SETUP) doors wasm
setup-ports:
	$(SETUP) doors ports
setup-fuzz:
	$(SETUP) doors clang

# Configured once; ninja calls CMake again by itself where a CMake file changed.
build/bench/build.ninja: | setup-bench
build/fuzz/build.ninja build/asan/build.ninja: | setup-fuzz
build/wasm/build.ninja: | setup-wasm
build/arm64/build.ninja build/windows/build.ninja: | setup-ports
build/%/build.ninja: CMakePresets.json | setup
	cmake --preset $*

# With a display the window is built too, for `deform view`.
demo: setup build/release/build.ninja
	$(BUILD) release --target deform_command $(if $(DISPLAY)$(WAYLAND_DISPLAY),deform_viewer)
	@$(PYTHON) -B bindings/python/deform/demo.py build/release/bin/deform \
	  examples/scenes/two_cylinders.json out/demo

view: setup build/release/build.ninja
	$(BUILD) release --target deform_viewer
	@build/release/bin/deform view "$(SCENE)"

tools: setup build/release/build.ninja
	$(BUILD) release --target deform_tools

test: setup-test build/release/build.ninja
	$(BUILD) release
	@ctest --preset release -j $(JOBS)

lint: setup build/release/build.ninja
	@ctest --preset release -j $(JOBS) -L lint

format:
	@cmake/format.sh write

tidy: setup
	@cmake/tidy.sh $(JOBS) $(FILES)

asan tsan: %: setup build/%/build.ninja
	$(BUILD) $@ --target checked_by_$@
	@ctest --preset $@ -j $(JOBS)

bench: setup-bench build/bench/build.ninja
	$(BUILD) bench
	$(BUILD) bench --target run_bench

bench-contact: setup build/release/build.ninja
	$(BUILD) release --target deform_command --target deform_contact
	build/release/bin/deform contact "$(CONTACT_PROBLEMS)"
	@if [ -f "$(CONTACT_PROBLEMS)/siconos_results.txt" ]; then $(PYTHON) tests/bench/contact_profile.py \
	  build/release/bin/deform "$(CONTACT_PROBLEMS)" build/contact_profile.png build/contact_profile.csv; fi

bench-peers: setup-peers build/release/build.ninja
	$(BUILD) release --target deform_command
	@$(PYTHON) -B tests/bench/peers/bench_peers.py build/release/bin/deform build/peers $(PEERS) $(JOBS)

# Rows that are in the table already are not run again.
soak: setup-bench build/bench/build.ninja build/release/build.ninja
	@if command -v em++ >/dev/null; then $(MAKE) --no-print-directory wasm; \
	  else echo "deform: no emscripten, so WebAssembly is not tested (make setup-wasm installs it)"; fi
	@if (command -v aarch64-linux-gnu-g++ && command -v x86_64-w64-mingw32-g++-posix && command -v wine) \
	  >/dev/null; then \
	  $(MAKE) --no-print-directory ports-built; \
	  else echo "deform: no cross compilers, so arm64 and Windows are not tested (make setup-ports)"; fi
	cmake --preset release
	$(BUILD) release
	DEFORM_SOAK=1 nice -n 19 ctest --test-dir build/release -j $(JOBS) --output-on-failure -L 'soak|stability'
	DEFORM_SOAK=1 nice -n 19 ctest --preset release -R '^python\.cut_scenes$$'
	@if command -v clang++ >/dev/null; then $(MAKE) --no-print-directory soak-fuzz; \
	  else echo "deform: no clang, so the readers are not fuzzed (make setup-fuzz)"; fi
	$(MAKE) --no-print-directory packages
	$(BUILD) bench --target hold_soak suite_soak cover_soak cut_soak
	nice -n 19 build/bench/bin/cover_soak tests/bench/results/cover_soak.csv
	nice -n 19 build/bench/bin/cut_soak tests/bench/results/cut_soak.csv
	nice -n 19 build/bench/bin/suite_soak tests/bench/results/suite_soak.csv
	nice -n 19 build/bench/bin/hold_soak tests/bench/results/hold_soak.csv
	nice -n 19 $(PYTHON) -B tests/bench/first_scenes/first_scenes.py build/release/bin/deform \
	  tests/bench/results/first_scenes.csv --scenes 1000

fuzz: setup-fuzz build/fuzz/build.ninja
	$(BUILD) fuzz --target run_fuzz

# 1e7 inputs in all
soak-fuzz: setup-fuzz build/fuzz/build.ninja
	$(BUILD) fuzz --target soak_fuzz

install: setup build/release/build.ninja
	$(BUILD) release --target deform_viewer deform_tools
	@cmake --install build/release --strip --prefix "$$(realpath -m -- "$(PREFIX)")"

# $(call wheel_of,BUILD or no,FOLDER)
wheel_of = @mkdir -p $(2) && cd bindings/python && $(PYTHON) -B -c "import wheel_backend as b; \
	  print(b.build_wheel('$(CURDIR)/$(2)', {'prebuilt': '$(1)'}))"
wheel: setup
	$(call wheel_of,no,build/dist)

wasm: setup-wasm build/wasm/build.ninja
	$(BUILD) wasm --target deform_page
	@ls -l build/wasm/page

# Configured anew, because compilers that came later add tests.
ports: ports-built
	cmake --preset release
	$(BUILD) release --target deform_command $(EXAMPLES)
	@ctest --test-dir build/release --output-on-failure --no-tests=error -R '^ports\.(arm64|windows)'
	@ctest --preset arm64 -j $(JOBS)

# The tests that compare with the native build are among soak's own.
ports-built: setup-ports build/arm64/build.ninja build/windows/build.ninja
	$(BUILD) arm64
	$(BUILD) windows
	$(call wheel_of,$(CURDIR)/build/windows,build/windows/dist)

# What a release ships, from the source archive; compiles twice, in two folders, and compares.
packages: setup
	@$(PYTHON) -B tests/abi/reproducible.py . build/dist build/packages

# Debian packages of the release build.
deb: setup build/release/build.ninja
	$(BUILD) release --target deform_viewer deform_tools deform_python_native
	@SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct 2>/dev/null || echo 315532800) \
	  cpack --config build/release/CPackConfig.cmake -B build/release/packages
	@rm -rf build/release/packages/_CPack_Packages && ls build/release/packages/*.deb

# For release notes: what changed in the public headers, additions too, since a revision (SINCE=v0.1.0).
SINCE ?= $(shell git describe --tags --abbrev=0 2>/dev/null || \
  git log --diff-filter=A --format=%h -- tests/abi/baseline/public.txt | tail -n 1)
abi-report: setup
	@mkdir -p build/abi && git show $(SINCE):tests/abi/baseline/public.txt >build/abi/since.txt
	@$(PYTHON) -B tests/abi/baseline.py cc libdeform/include/deform build/abi/since.txt build/abi --report \
	  >build/abi/report.txt && echo "build/abi/report.txt: $$(wc -l <build/abi/report.txt) lines since $(SINCE)"

docs: setup-docs
	@$(PYTHON) -B cmake/docs/make_site.py

clean:
	rm -rf build out
