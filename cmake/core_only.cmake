# The core alone, with whatever compiler, flags and machine the cache names: scripts/check-determinism compares what they write.
include(cmake/debian_headers.cmake)
maille_debian_headers(tl xxhash.h)
include(cmake/determinism.cmake)
if(NOT EMSCRIPTEN)  # it has none
  find_package(Threads REQUIRED)
  target_link_libraries(maille_determinism PRIVATE Threads::Threads)
endif()
