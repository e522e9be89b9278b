# One word per job; the work is done by CMake. `make demo` and `make test` need nothing but Debian 12.

PACKAGES := $(shell cat cmake/packages.txt)
FARM_PACKAGES := $(shell cat cmake/packages_farm.txt)
LINT_PACKAGES := clang-format
DOCS_PACKAGES := doxygen
FUZZ_PACKAGES := clang libclang-rt-14-dev
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
RESULTS := build/demo
PREFIX := /usr/local
# ON: warnings end the build.
STRICT := OFF
# How long each format is fuzzed, 0 for the inputs that are the same every time, and which: all, or some as "obj vdb".
SECONDS := 60
FORMATS :=

.PHONY: all deps fuzz-deps build demo examples test test-sanitized fuzz test-farm test-look bench docs format lint install package clean

all: build

deps:
	@dpkg -s $(PACKAGES) >/dev/null 2>&1 || { \
	  $(SUDO) apt-get update && \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $(PACKAGES); }

build: deps
	cmake --preset release -DNEPHELE_BUILD_TESTS=OFF -DNEPHELE_BUILD_BENCHMARKS=OFF
	cmake --build build

demo: build
	sh data/demo.sh build/bin/nephele $(RESULTS)

# The models that README and docs/ work with.
examples: build
	cmake --build build --target examples

test: deps
	cmake --preset release -DNEPHELE_BUILD_TESTS=ON -DNEPHELE_BUILD_BENCHMARKS=OFF -DNEPHELE_WARNINGS_AS_ERRORS=$(STRICT)
	cmake --build build
	sh tests/check_includes.sh
	ctest --test-dir build --output-on-failure --parallel 2

fuzz-deps: deps
	@dpkg -s $(FUZZ_PACKAGES) >/dev/null 2>&1 || \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $(FUZZ_PACKAGES)

# Of hundreds of thousands of leaves, of many millions of letters: nothing that smaller tests do not reach.
SLOW_TESTS := *.WallsThatMarchingCubesWouldLoseAreRefused:*.AWrapIsCoarserWhereAFinerOneWouldEnterHoles:$\
  *.RefusesToWriteTextsThatAreTooLongToBeRead

# The tests of grids, meshes and files once more, under AddressSanitizer and UndefinedBehaviorSanitizer, with the libraries of
# the fuzzers: building them takes far longer than the tests.
test-sanitized: fuzz-deps
	cmake --preset fuzz
	cmake --build build-fuzz --target nephele_grids_tests
	seq 0 1 | LSAN_OPTIONS=suppressions=$(CURDIR)/tests/support/lsan_suppressions.txt GTEST_TOTAL_SHARDS=2 \
	  xargs -P 2 -I{} env GTEST_SHARD_INDEX={} build-fuzz/bin/nephele_grids_tests --gtest_brief=1 --gtest_filter='-$(SLOW_TESTS)'

# Every reader of files with inputs that clang's libFuzzer makes up; docs/limits.md says what came of it.
fuzz: fuzz-deps
	cmake --preset fuzz
	cmake --build build-fuzz --target nephele_fuzz nephele_fuzz_seeds
	sh tests/fuzz/run.sh build-fuzz/bin/nephele_fuzz build-fuzz/fuzz $(SECONDS) $(FORMATS)

# The page of `nephele look` in a browser, with BROWSER=firefox in that one; what was seen is kept in
# build/look-screenshots.
BROWSER ?= chromium
export BROWSER
test-look: deps
	@for tool in $(BROWSER:firefox=firefox-esr) nodejs:node npm; do command -v $${tool#*:} >/dev/null || \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $${tool%:*}; done
	cmake --preset release
	cmake --build build --target nephele
	cd tests/look && npm ci --no-audit --no-fund && node --test

# Starts a Slurm of its own, as root; not part of `make test`.
test-farm: build
	@dpkg -s $(FARM_PACKAGES) >/dev/null 2>&1 || \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $(FARM_PACKAGES)
	$(SUDO) sh tests/render_farm/run.sh build/bin/nephele

bench: deps
	cmake --preset release -DNEPHELE_BUILD_TESTS=OFF -DNEPHELE_BUILD_BENCHMARKS=ON
	cmake --build build
	python3 tests/bench/run.py build bench-results

# Help texts in the pages, the stubs of the module for Python, and the reference of the headers in build/reference.
docs: build
	sh docs/update_help.sh $(CURDIR)/build/bin/nephele
	PYTHONPATH=build/python /usr/bin/python3 apps/python/make_stubs.py
	@dpkg -s $(DOCS_PACKAGES) >/dev/null 2>&1 || \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $(DOCS_PACKAGES)
	mkdir -p build/reference
	doxygen docs/Doxyfile

format:
	clang-format -i $$(git ls-files '*.h' '*.cpp')

lint:
	@dpkg -s $(LINT_PACKAGES) >/dev/null 2>&1 || \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $(LINT_PACKAGES)
	clang-format --dry-run --Werror $$(git ls-files '*.h' '*.cpp')
	sh tests/check_includes.sh

# Libraries, headers, CMake package and program, e.g. make install PREFIX=$$HOME/nephele
install: build
	cmake --install build --prefix $(PREFIX)

# Debian packages of the program, the libraries and the module for Python, in build/package.
package: build
	cmake build -DCMAKE_INSTALL_LIBDIR=lib/$(shell gcc -print-multiarch) -DNEPHELE_PYTHON_DIR=lib/python3/dist-packages
	cmake --build build
	cd build && cpack -B package
	cmake build -UCMAKE_INSTALL_LIBDIR -UNEPHELE_PYTHON_DIR

clean:
	rm -rf examples build build-debug build-asan build-fuzz build-tsan bench-results
