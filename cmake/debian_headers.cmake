# maille_debian_headers(NAMES...): for compilers of other systems a folder with these headers of Debian's alone, which need
# nothing else of the system. The headers beside them must not be seen: those compilers have their own.
function(maille_debian_headers)
  set(headers ${CMAKE_BINARY_DIR}/headers)
  file(MAKE_DIRECTORY ${headers})
  foreach(header IN LISTS ARGN)
    file(CREATE_LINK /usr/include/${header} ${headers}/${header} SYMBOLIC)
  endforeach()
  add_library(tl::expected INTERFACE IMPORTED GLOBAL)
  target_include_directories(tl::expected SYSTEM INTERFACE ${headers})
endfunction()
