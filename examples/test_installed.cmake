# Installs from BUILD into a scratch folder, then builds and runs SOURCE with find_package and with pkg-config.
set(scratch ${BUILD}/installed-example)
set(prefix ${scratch}/prefix)

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${scratch})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})

file(WRITE ${scratch}/tetrahedron.off "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${scratch}/cmake -G Ninja -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_CXX_COMPILER=${CXX})
run(${CMAKE_COMMAND} --build ${scratch}/cmake)
run(${scratch}/cmake/roundtrip ${scratch}/tetrahedron.off)

set(ENV{PKG_CONFIG_PATH} ${prefix}/${LIBDIR}/pkgconfig)
execute_process(COMMAND pkg-config --cflags --libs maille OUTPUT_VARIABLE found COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(found UNIX_COMMAND "${found}")
run(${CXX} -std=c++20 ${SOURCE}/roundtrip.cpp -o ${scratch}/with-pkg-config ${found})
run(${scratch}/with-pkg-config ${scratch}/tetrahedron.off)

# A program that only decodes has no encoder: with it, it would be twice as large.
run(${CMAKE_COMMAND} -S ${SOURCE}/../decode -B ${scratch}/decode -G Ninja -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${scratch}/decode)
run(${scratch}/decode/decode ${GOLDEN})
find_program(strip strip)
if(CONFIG STREQUAL Release AND strip)
  run(${strip} ${scratch}/decode/decode)
  file(SIZE ${scratch}/decode/decode size)
  if(size GREATER 2000000)
    message(FATAL_ERROR "a program that only decodes takes ${size} bytes, not less than 2 MB")
  endif()
endif()

if(NOT C_SOURCE)
  return()
endif()
# The library for C, shared and static, by CMake and by pkg-config.
run(${CMAKE_COMMAND} -S ${C_SOURCE} -B ${scratch}/c -G Ninja -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${CXX}
    -DCMAKE_C_COMPILER=${CC})
run(${CMAKE_COMMAND} --build ${scratch}/c)
set(ENV{LD_LIBRARY_PATH} ${prefix}/${LIBDIR})
foreach(name maille-c maille-c-static)
  execute_process(COMMAND pkg-config --cflags --libs ${name} OUTPUT_VARIABLE found COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(found UNIX_COMMAND "${found}")
  run(${CC} -std=c11 -Wall -Wextra -Werror ${C_SOURCE}/roundtrip.c -o ${scratch}/c/${name} ${found})
endforeach()
foreach(program roundtrip roundtrip_static maille-c maille-c-static)
  run(${scratch}/c/${program} ${scratch}/tetrahedron.off)
endforeach()
foreach(program heat heat_static)
  execute_process(COMMAND ${scratch}/c/${program} ${scratch}/heat.maille OUTPUT_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
  if(NOT said MATCHES "bytes for 6 times; the corner has 125 cells, in 1 of 8 pieces; it is [0-9]+ degrees warm")
    message(FATAL_ERROR "${program} said: ${said}")
  endif()
endforeach()
