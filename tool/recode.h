#pragma once

#include <maille/encode.h>
#include <maille/out_of_core.h>
#include <maille/source.h>
#include <maille/stream.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "files.h"
#include "options.h"

// From stream to stream: a .maille file compressed again as it is read, with memory for the front only.
namespace maille::tool {

/// A stream of cells from a pipe or a file.
struct InputStream {
  std::unique_ptr<Source> source;  ///< none for a pipe
  StreamReader reader;
  std::shared_ptr<uint64_t> bytes_read;  ///< of a pipe, so far

  uint64_t bytes() const { return source ? source->size() : *bytes_read; }
};
/// Nothing where the input is no .maille file of mode stream. What was read from standard input to find that
/// out is in `begin`.
Result<std::optional<InputStream>> open_stream(const std::string& path, const CommonOptions& common,
                                               Executor* executor, std::vector<std::byte>& begin);
/// Standard input, of which `begin` was read.
Result<std::unique_ptr<Source>> rest_of_stdin(std::vector<std::byte> begin);

/// Compresses again what comes from a stream, `delay` cells held back.
Result<EncodeReport> compress_stream(InputStream& input, Sink& sink, const EncodeOptions& encoding,
                                     uint64_t delay, ProgressDisplay& progress);

/// What comes from a stream as a mesh that can be read in parts, in temporary files.
Result<std::unique_ptr<MeshSource>> spool_stream(InputStream& input, const WorkingSpace& space,
                                                 ProgressDisplay& progress);

}  // namespace maille::tool
