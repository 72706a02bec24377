#pragma once

#include <maille/error.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace maille {

/// Names one coded stream: its chunk type, the patch it belongs to and its number within the patch. A stream
/// of more than one chunk is cut into parts, numbered from 0.
struct StreamKey {
  char type[5];  ///< four letters (digits allowed after the first); upper-case first letter: critical,
                 ///< lower-case: may be skipped by older readers. "INDX" is the container's own.
  uint32_t patch = 0;
  uint32_t number = 0;
};

/// Where coded streams are read from: a file, or a page of one. Calls may come from several threads.
class StreamSource {
 public:
  virtual ~StreamSource() = default;
  virtual bool has_stream(const StreamKey& key) const = 0;
  /// Error: corrupt, naming what is missing or damaged; cannot_read.
  virtual Result<std::vector<std::byte>> read_stream(const StreamKey& key) const = 0;
};

}  // namespace maille
