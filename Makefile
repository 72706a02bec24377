# Two commands do everything on a fresh Debian 12: `make demo` and `make test`.
PREFIX ?= /usr/local

FUZZ_SECONDS ?= 60

.PHONY: help demo test test-mpi test-foam sanitize web viewer bench scale fuzz format install clean

help:
	@echo "make demo     build, compress a real scan, bring it back, compare (MESH=path: a mesh of your own)"
	@echo "make test     build and run all tests"
	@echo "make test-mpi build maille-mpi and test it with 1, 2, 3 and 8 ranks"
	@echo "make test-foam run tutorials of OpenFOAM and bring their cases through .maille files (packages openfoam, openfoam-examples)"
	@echo "make sanitize the same with the sanitizers of clang and small meshes (.ci/run does both)"
	@echo "make web      build the WebAssembly decoder and test it, its JavaScript and the viewer, under node and in Chromium"
	@echo "make viewer   build the viewer of maille view and maille serve; make install takes it along"
	@echo "make bench    measure beside Draco, meshoptimizer, OpenCTM and xz; writes docs/benchmarks.md and the figures of README.md"
	@echo "make scale    measure peak memory of volumes larger than memory (CELLS=1e6: smaller ones than the full size)"
	@echo "make fuzz     feed damaged input to every reader and decoder, FUZZ_SECONDS each ($(FUZZ_SECONDS))"
	@echo "make format   clang-format on every source file"
	@echo "make install  install the command and the library below PREFIX ($(PREFIX))"
	@echo "make clean    remove what was built"

demo:
	@scripts/demo $(if $(MESH),"$(MESH)")

PRESETS ?= release

test:
	@scripts/test $(PRESETS)

test-mpi:
	@scripts/test-mpi

test-foam:
	@cmake --preset release > /dev/null && cmake --build --preset release --target maille_tool
	@scripts/check-foam

sanitize:
	@scripts/test sanitize

web:
	@scripts/test-web

viewer:
	@scripts/build-viewer

bench:
	@scripts/bench

scale:
	@cmake --preset release > /dev/null && cmake --build --preset release --target maille_tool
	@scripts/scale $(if $(CELLS),--cells $(CELLS) --shuffled $(CELLS) --pipe $(CELLS))

fuzz:
	@scripts/fuzz $(FUZZ_SECONDS)

format:
	@scripts/check-format --fix

install:
	cmake --preset release
	cmake --build --preset release --target maille maille_core maille_tool maille_manual
	cmake --install build/release --prefix "$(PREFIX)"

clean:
	rm -rf build install
