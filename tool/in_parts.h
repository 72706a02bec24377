#pragma once

#include <maille/generate.h>
#include <maille/out_of_core.h>
#include <maille/stream.h>

#include <memory>
#include <optional>
#include <string>

#include "files.h"
#include "options.h"

// Meshes larger than memory: read, compressed and written in parts.
namespace maille::tool {

/// A mesh that compress can read in parts: a volume, or a surface for mode random.
struct InputInParts {
  std::unique_ptr<Source> source;
  std::unique_ptr<MeshSource> mesh;
  uint64_t bytes = 0;
};
/// Nothing where the input has to be read whole: another format, another mode, or a mesh so small that the
/// best order is found in memory.
Result<std::optional<InputInParts>> open_in_parts(const CompressOptions& options, ProgressDisplay& progress);
/// Error: memory_bound, for a mesh in memory whose levels of detail would take more than is allowed.
Result<> check_memory(const Mesh& mesh, Mode mode, const CommonOptions& common, const std::string& name);
Result<EncodeReport> compress_in_parts(InputInParts& input, Sink& sink, const EncodeOptions& encoding,
                                       const CompressOptions& options, ProgressDisplay& progress);

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

/// What the files of a mesh of OpenFOAM take, by its folder, a file in it, or its case.
uint64_t bytes_of_case(const std::string& path);
/// Is it a file, which can be opened again?
bool is_regular(const std::string& path);

/// Whether decompress can write the output in parts.
bool can_write_in_parts(const std::string& format, const std::string& output, bool ascii);
struct PartsWritten {
  uint64_t points = 0, cells = 0, input_bytes = 0, output_bytes = 0;
};
/// An input whose end can be read first: standard input goes through a temporary file, a pipe under a name
/// into memory.
Result<std::unique_ptr<Source>> open_for_parts(const std::string& path, const std::string& output);
/// Nothing where the mesh has to be written whole.
Result<std::optional<PartsWritten>> decompress_in_parts(const DecompressOptions& options,
                                                        const Source& source, const MeshDescription& mesh,
                                                        const std::string& output, const std::string& format);

/// Writes a generated mesh as it comes: one block, and an array of labels that tells zones and patches.
Result<StreamReport> generate_stream(const BlockDescription& description, const GenerateOptions& options,
                                     Sink& sink, ProgressDisplay& progress);

}  // namespace maille::tool
