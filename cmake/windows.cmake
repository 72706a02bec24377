# For Windows, cross-compiled with mingw-w64 (docs/platforms.md): what Debian has no libraries for is left out, and says so.
set(MAILLE_HTTP OFF)
set(MAILLE_HDF5 OFF)
set(maille_has_xml OFF)
set(MAILLE_SERVE OFF)
add_compile_options(-Wa,-mbig-obj)  # several files as one have more sections than an object of Windows holds otherwise

include(cmake/debian_headers.cmake)
maille_debian_headers(tl xxhash.h fast_float tsl nlohmann CLI fmt tiny_gltf.h)
foreach(library CLI11::CLI11 nlohmann_json::nlohmann_json fmt::fmt)
  add_library(${library} INTERFACE IMPORTED GLOBAL)
  target_link_libraries(${library} INTERFACE tl::expected)
endforeach()
target_compile_definitions(fmt::fmt INTERFACE FMT_HEADER_ONLY)
set(ZLIB_USE_STATIC_LIBS ON)
find_package(ZLIB REQUIRED)

# Debian's library of tinygltf is its header, compiled once. The command decodes no images.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/tinygltf.cpp CONTENT "#define TINYGLTF_IMPLEMENTATION\n#include <tiny_gltf.h>\n")
add_library(maille_tinygltf STATIC ${CMAKE_BINARY_DIR}/tinygltf.cpp)
target_compile_definitions(maille_tinygltf PRIVATE TINYGLTF_NO_STB_IMAGE TINYGLTF_NO_STB_IMAGE_WRITE)
target_compile_options(maille_tinygltf PRIVATE -w)
target_link_libraries(maille_tinygltf PUBLIC tl::expected)
install(TARGETS maille_tinygltf EXPORT maille-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
add_library(TinyGLTF::TinyGLTF ALIAS maille_tinygltf)

# What scripts/test-windows runs beside the command.
add_executable(maille_mesh_checksums web/test/mesh_checksums.cc)
target_link_libraries(maille_mesh_checksums PRIVATE maille::decoder ZLIB::ZLIB)
include(cmake/determinism.cmake)
