# Two commands do everything on a fresh Debian 12: `make demo` and `make test`.
PREFIX ?= /usr/local

FUZZ_SECONDS ?= 60

.PHONY: help check-deep coverage demo test test-c test-mpi test-python test-foam test-readers test-vtk test-paraview test-windows sanitize web viewer bench scale fuzz fuzz-web format install package test-package clean

help:
	@echo "make demo     build, compress a real scan, bring it back, compare (MESH=path: a mesh of your own)"
	@echo "make test     build and run all tests"
	@echo "make test-c   build the library for C and run its tests (make test does, too)"
	@echo "make test-mpi build maille-mpi and test it with 1, 2, 3 and 8 ranks"
	@echo "make test-python build the wheel of the Python package and test it"
	@echo "make test-foam run tutorials of OpenFOAM and bring their cases through .maille files (packages openfoam, openfoam-examples)"
	@echo "make test-vtk build vtkMailleReader and vtkMailleWriter and test them against VTK's own readers"
	@echo "make test-paraview  fetch ParaView into a folder, build the plug-in and test it with pvbatch, 1 to 3 ranks"
	@echo "make test-readers  read what maille writes with VTK, meshio, gmsh, assimp and foamToVTK, and compare"
	@echo "make test-windows  cross-compile for Windows with mingw-w64, and decode the golden files under wine"
	@echo "make sanitize the same with the sanitizers of clang and small meshes (.ci/run does both)"
	@echo "make check-deep every allocation and call to the system fails in turn, kills, power losses, damaged files, races, other compilers and machines: docs/reliability.md"
	@echo "make coverage which lines of what decodes are run by tests"
	@echo "make web      build the WebAssembly decoder and test it, its JavaScript and the viewer, under node and in Chromium"
	@echo "make viewer   build the viewer of maille view and maille serve; make install takes it along"
	@echo "make bench    measure beside Draco, meshoptimizer, OpenCTM and xz; writes docs/benchmarks.md and the figures of README.md"
	@echo "make scale    measure peak memory of volumes larger than memory (CELLS=1e6: smaller ones than the full size)"
	@echo "make fuzz     feed damaged input to every reader and decoder, FUZZ_SECONDS each ($(FUZZ_SECONDS))"
	@echo "make fuzz-web damaged files through the WebAssembly decoders, beside the native one (FILES=100000)"
	@echo "make format   clang-format on every source file"
	@echo "make install  install the command and the library below PREFIX ($(PREFIX))"
	@echo "make package  a Debian package, an archive that runs from any folder, and the npm package, in build/packages"
	@echo "make test-package  install and try them"
	@echo "make clean    remove what was built"

demo:
	@scripts/demo $(if $(MESH),"$(MESH)")

PRESETS ?= release

test:
	@scripts/test $(PRESETS)

test-c:
	@scripts/setup
	@cmake --preset release > /dev/null && cmake --build --preset release --target maille_c maille_c_static maille_c_header test_c test_c_exceptions
	@ctest --test-dir build/release -R '^C\.' --output-on-failure --no-tests=error

test-mpi:
	@scripts/test-mpi

test-python:
	@scripts/test-python

test-foam:
	@cmake --preset release > /dev/null && cmake --build --preset release --target maille_tool
	@scripts/check-foam

test-vtk:
	@scripts/test-vtk

test-paraview:
	@scripts/test-paraview

test-readers:
	@cmake --preset release > /dev/null && cmake --build --preset release --target maille_tool
	@scripts/check-readers

test-windows:
	@scripts/test-windows

sanitize:
	@scripts/test sanitize

check-deep:
	@scripts/check-deep

coverage:
	@scripts/coverage

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

fuzz-web:
	@scripts/fuzz-web $(FILES)

format:
	@scripts/check-format --fix

install:
	cmake --preset release
	cmake --build --preset release --target maille maille_core maille_c maille_c_static maille_tool maille_manual
	cmake --install build/release --prefix "$(PREFIX)"

package:
	@scripts/package

test-package:
	@scripts/test-package

clean:
	rm -rf build install
