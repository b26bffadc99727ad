# One word per task; each does all its own set-up.
#   make build      the program: build/release/bin/kilvo
#   make demo       simulate a small room, run on it, evaluate, show it
#   make test       build and run every test
#   make bench      time the functions; RECORDINGS=DIR: time and judge whole recordings as well
#   make tables     RECORDINGS=DIR: every modality on every recording, as Markdown
#   make check      layout, walls, sizes, headers, clang-tidy (files that changed since they last passed; ALL=1: every file)
#   make format     rewrite the sources in the one layout
#   make fuzz       fuzz the readers, SECONDS_EACH=60 each
#   make install    into PREFIX=/usr/local
#   make clean      remove build/
.PHONY: build demo test bench tables check format fuzz install clean dependencies dependencies-dev configure
.NOTPARALLEL:
.DEFAULT_GOAL := build

BUILD := build/release
KILVO := $(BUILD)/bin/kilvo
PREFIX ?= /usr/local
SECONDS_EACH ?= 60
SOURCES = $(shell find kilvo lab apps tests bench -name '*.hpp' -o -name '*.cpp')

dependencies:
	@scripts/install_dependencies

dependencies-dev:
	@scripts/install_dependencies --dev

configure: dependencies
	cmake --preset release

build: configure
	cmake --build --preset release

demo: build
	$(KILVO) demo

test: build
	ctest --preset release

bench: build
	$(BUILD)/bench/micro/kilvo_bench_micro
ifdef RECORDINGS
	bench/macro/run --kilvo $(KILVO) $(RECORDINGS)
endif

tables: build
	@bench/macro/tables --kilvo $(KILVO) $(or $(RECORDINGS),$(error RECORDINGS=DIR says where the recordings are))

check: dependencies-dev configure
	@scripts/check_modules
	@scripts/check_sizes
	@clang-format-14 --dry-run --Werror $(SOURCES)
	cmake --build --preset release --target all_verify_interface_header_sets
	@scripts/check_tidy --build $(BUILD) $(if $(ALL),--all)

format: dependencies-dev
	clang-format-14 -i $(SOURCES)

fuzz: dependencies-dev
	cmake --preset fuzz
	cmake --build --preset fuzz
	scripts/run_fuzzers build/fuzz $(SECONDS_EACH)

install: build
	cmake --install $(BUILD) --prefix $(PREFIX)

clean:
	rm -rf build
