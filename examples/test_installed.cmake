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
