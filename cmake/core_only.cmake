# The core alone, with whatever compiler, flags and machine the cache names: scripts/check-determinism compares what they write.
include(cmake/debian_headers.cmake)
maille_debian_headers(tl xxhash.h)
add_executable(maille_determinism tests/golden/determinism.cpp tests/support/shapes.cpp tests/support/pathologies.cpp
  tests/support/random_arrays.cpp tests/support/random_mesh.cpp tests/support/random_volume.cpp)
target_include_directories(maille_determinism PRIVATE src tests)
target_link_libraries(maille_determinism PRIVATE maille::core)
if(NOT EMSCRIPTEN)  # it has none
  find_package(Threads REQUIRED)
  target_link_libraries(maille_determinism PRIVATE Threads::Threads)
endif()
