# For Windows the core alone, cross-compiled with mingw-w64 (docs/platforms.md), and what scripts/test-windows runs.
include(cmake/debian_headers.cmake)
maille_debian_headers(tl xxhash.h)
set(ZLIB_USE_STATIC_LIBS ON)
find_package(ZLIB REQUIRED)
add_executable(maille_mesh_checksums web/test/mesh_checksums.cc)
target_link_libraries(maille_mesh_checksums PRIVATE maille::decoder ZLIB::ZLIB)
add_executable(maille_determinism tests/golden/determinism.cpp tests/support/shapes.cpp tests/support/pathologies.cpp
  tests/support/random_arrays.cpp tests/support/random_mesh.cpp tests/support/random_volume.cpp)
target_include_directories(maille_determinism PRIVATE src tests)
target_link_libraries(maille_determinism PRIVATE maille::core)
