#pragma once

#include <cstdint>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/source.h>
#include <vector>

namespace maille {

/// What the first bytes of a file say. docs/format.md, "Header".
struct FileHeader {
  uint16_t major = 0;
  uint16_t minor = 0;
  uint32_t required_features = 0;  ///< an unknown bit: the reader refuses the file
  uint32_t optional_features = 0;  ///< an unknown bit: ignored
  Mode mode = Mode::single;
};

/// Names one coded stream: its chunk type, the patch it belongs to and its number within the patch. A stream of more than
/// one chunk is cut into parts, numbered from 0.
struct StreamKey {
  char type[5];         ///< four letters; upper-case first letter: critical, lower-case: may be skipped by older readers
  uint32_t patch = 0;
  uint32_t number = 0;
};

/// Writes header, chunks, index, footer, front to back, to any sink.
class FileWriter {
 public:
  /// Writes the header.
  static Result<FileWriter> begin(Sink& sink, const FileHeader& header);
  /// Cuts `bytes` into chunks of at most max_chunk_bytes and writes them.
  Result<> write_stream(const StreamKey& key, Bytes bytes);
  /// Writes index and footer. Does not commit the sink. Returns the size of the file.
  Result<uint64_t> finish();
  /// Bytes so far spent on chunk headers (for reports).
  uint64_t overhead_bytes() const;
};

}  // namespace maille
