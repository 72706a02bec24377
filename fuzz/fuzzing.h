#pragma once

#include <maille/decode.h>
#include <maille/encode.h>

#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <vector>

namespace maille::fuzzing {

/// Ends the program, which libFuzzer takes as a finding.
inline void require(bool claim, const char* words) {
  if (claim) return;
  std::fprintf(stderr, "not true: %s\n", words);
  std::abort();
}

inline void require_kind(const Error& error, std::initializer_list<ErrorCode> fitting) {
  bool fits = false;
  for (const ErrorCode code : fitting) fits |= code == error.code;
  if (!fits) std::fprintf(stderr, "error %d: %s\n", static_cast<int>(error.code), error.message.c_str());
  require(fits && !error.message.empty(), "the error is of a fitting kind");
}

inline Result<std::vector<std::byte>> encoded(const Mesh& mesh, const EncodeOptions& options) {
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  if (auto report = encode(mesh, *sink, options); !report) return tl::unexpected(report.error());
  return file;
}

inline Result<Mesh> decoded(Bytes file, uint64_t mesh_bytes) {
  const auto source = memory_source(file, "x.maille");
  DecodeOptions options;
  options.limits.mesh_bytes = mesh_bytes;
  return decode(*source, options);
}

}  // namespace maille::fuzzing
