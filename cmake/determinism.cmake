# What encoders write and decoders make of it, as hashes: for builds that have no tests of their own, on other machines and with
# other compilers (scripts/check-determinism, scripts/test-windows).
add_executable(maille_determinism tests/golden/determinism.cpp tests/support/shapes.cpp tests/support/pathologies.cpp
  tests/support/random_arrays.cpp tests/support/random_mesh.cpp tests/support/random_volume.cpp)
target_include_directories(maille_determinism PRIVATE src tests)
target_link_libraries(maille_determinism PRIVATE maille::core)
