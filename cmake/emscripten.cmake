# For WebAssembly the core alone, with headers of Debian that need nothing else of the system. Its other headers must not
# be seen: emscripten has its own.
set(headers ${CMAKE_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${headers})
foreach(header tl xxhash.h)
  file(CREATE_LINK /usr/include/${header} ${headers}/${header} SYMBOLIC)
endforeach()
add_library(tl::expected INTERFACE IMPORTED)
target_include_directories(tl::expected SYSTEM INTERFACE ${headers})

# Sizes of 64 bits are checked against Limits before they become sizes of memory.
add_compile_options(-fno-exceptions -fno-rtti -msimd128 -Wno-shorten-64-to-32 -Wno-sign-conversion)
