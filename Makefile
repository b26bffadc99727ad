# One word per task; each does all its own set-up.
#   make build      the programs: build/release/bin/kilvo, and the nodes whose libraries are here
#   make demo       simulate a humanoid that walks through a room, run on it, compare with the truth, show it
#   make test       install the tests' packages, build and run every test
#   make test-asan  build and run every test under the address and undefined-behaviour sanitizers, with Eigen's assertions
#   make test-tsan  the tests with threads under the thread sanitizer
#   make bench      time the functions; RECORDINGS=DIR: time and judge whole recordings as well
#   make tables     RECORDINGS=DIR: every modality on every recording, as Markdown
#   make check      layout, modules, sizes, constants, headers, clang-tidy (files that changed since they last passed; ALL=1: every file)
#   make golden     eighty-two runs must give the bytes of tests/golden/manifest.json (a refactoring changes none)
#   make format     rewrite the sources in the one layout
#   make fuzz       fuzz the readers, SECONDS_EACH=60 each
#   make install    into PREFIX=/usr/local
#   make package    Debian packages in build/package
#   make clean      remove build/
.PHONY: build demo test test-asan test-tsan bench tables golden check format fuzz install package clean dependencies-run dependencies dependencies-dev configure configure-program
.NOTPARALLEL:
.DEFAULT_GOAL := build

BUILD := build/release
KILVO := $(BUILD)/bin/kilvo
PREFIX ?= /usr/local
SECONDS_EACH ?= 60
SOURCES = $(shell find kilvo lab apps tests bench -name '*.hpp' -o -name '*.cpp')

dependencies-run:
	@scripts/install_dependencies --run

dependencies:
	@scripts/install_dependencies

dependencies-dev:
	@scripts/install_dependencies --dev

configure: dependencies
	@cmake --preset release

# Needs no package of the tests; a folder that was configured for them stays so.
configure-program: dependencies-run
	@grep -qs '^build build.ninja:' $(BUILD)/build.ninja || cmake --preset release -D BUILD_TESTING=OFF -D KILVO_BUILD_BENCHMARKS=OFF --log-level=WARNING

build: configure-program
	@cmake --build --preset release --target programs

demo: configure-program
	@echo "compiling the kilvo program: three to five minutes on two cores"
	@cmake --build --preset release --target kilvo_cli
	@$(KILVO) demo
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ] && command -v xdg-open >/dev/null; then xdg-open demo/results/report.html; fi

test: configure
	@echo "compiling the programs, tests and benchmarks: five to ten minutes on two cores"
	cmake --build --preset release
	ctest --preset release

test-asan: dependencies
	cmake --preset asan
	cmake --build --preset asan
	ctest --preset asan

test-tsan: dependencies
	cmake --preset tsan
	cmake --build --preset tsan --target kilvo_live_test kilvo_live_walk_test kilvo_math_test kilvo_lab_doctor_test
	ctest --preset tsan -R '^(live|math|lab_doctor/DescriptionWatch)'

bench: configure
	cmake --build --preset release --target kilvo_bench_micro kilvo_cli
	$(BUILD)/bench/micro/kilvo_bench_micro
ifdef RECORDINGS
	bench/macro/run --kilvo $(KILVO) $(RECORDINGS)
endif

tables: build
	@bench/macro/tables --kilvo $(KILVO) $(or $(RECORDINGS),$(error RECORDINGS=DIR says where the recordings are))

golden: configure-program
	@cmake --build --preset release --target kilvo_cli
	@scripts/golden --kilvo $(KILVO)

check: dependencies-dev configure
	@scripts/check_modules
	@scripts/check_sizes
	@scripts/check_constants
	@clang-format-14 --dry-run --Werror $(SOURCES)
	@scripts/check_headers --build $(BUILD)
	@scripts/check_tidy --build $(BUILD) $(if $(ALL),--all)

format: dependencies-dev
	clang-format-14 -i $(SOURCES)

fuzz: dependencies-dev
	cmake --preset fuzz
	cmake --build --preset fuzz
	scripts/run_fuzzers build/fuzz $(SECONDS_EACH)

install: build
	cmake --install $(BUILD) --prefix $(PREFIX)

# In a folder of its own: what is packed needs neither tests nor benchmarks.
package:
	@scripts/install_dependencies --package
	@cmake --preset release -B build/package -D BUILD_TESTING=OFF -D KILVO_BUILD_BENCHMARKS=OFF -D CMAKE_INSTALL_PREFIX=/usr --log-level=WARNING
	@cmake --build build/package --target programs
	@scripts/make_manual --kilvo build/package/bin/kilvo --out build/package/manual
	@gzip -9nf build/package/manual/kilvo.1
	@cd build/package && cpack -G DEB
	@ls -l build/package/*.deb

clean:
	rm -rf build
