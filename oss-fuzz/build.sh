#!/bin/bash -eu
# Builds every fuzzer with its first inputs into $OUT, as OSS-Fuzz wants them: from the folder of the sources, with $CXX and
# $SANITIZER of the environment. With Debian's clang: OUT=/tmp/fuzzers oss-fuzz/build.sh
cd "$(dirname "$0")/.."
: "${OUT:?the folder for the fuzzers}" "${CXX:=clang++}"
mkdir -p "$OUT"
build=${WORK:-build}/oss-fuzz
# The flags of OSS-Fuzz would come twice: fuzz/CMakeLists.txt has its own, for the library and the fuzzers.
env -u CXXFLAGS -u CFLAGS cmake -S . -B "$build" -G Ninja -DCMAKE_CXX_COMPILER="$CXX" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DMAILLE_BUILD_FUZZ=ON -DMAILLE_BUILD_TESTS=OFF -DMAILLE_BUILD_TOOL=OFF ${STDLIB:+-DCMAKE_CXX_FLAGS=-stdlib=$STDLIB} >/dev/null
cmake --build "$build"
"$build/fuzz/fuzz_seeds" "$build/seeds"
for source in fuzz/*_fuzz.cpp; do
  name=$(basename "$source" .cpp)
  cp "$build/fuzz/$name" "$OUT/"
  if [ -d "$build/seeds/$name" ]; then
    (cd "$build/seeds/$name" && python3 -m zipfile -c "$OUT/${name}_seed_corpus.zip" ./*)
  fi
done
