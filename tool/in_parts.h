#pragma once

#include <maille/out_of_core.h>

#include <memory>
#include <optional>
#include <set>
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

/// What work in parts may use. `reorder`: to put cells in order.
WorkingSpace space_for(const CommonOptions& common, const std::string& output, bool reorder);
/// Whether a volume can be held in memory with its order and its coders: then all its numbers can be looked
/// at before they are coded.
bool fits_in_memory(uint64_t points, uint64_t corners, uint64_t file_bytes, const CommonOptions& common);
/// What --pieces asks for; nothing: one stream.
std::optional<uint64_t> cells_of_piece(const std::string& pieces);

/// What the files of a mesh of OpenFOAM take, by its folder, a file in it, or its case.
uint64_t bytes_of_case(const std::string& path);
/// What the files take that a mesh was read from: one and those that it names, or those of a folder.
uint64_t bytes_of_input(const Input& input, const std::vector<std::string>& files_beside);
uint64_t bytes_of_files(const std::set<std::string>& paths);
/// What was written: a file, or a mesh of OpenFOAM.
uint64_t bytes_of_output(const std::string& path, bool folder);
/// The files in a folder, not those in folders below.
uint64_t bytes_of_folder(const std::string& path);
/// A disk or a server that fails, whatever is in the file: what is tried next might succeed, and give
/// something else.
inline bool is_unreadable(const Error& error) {
  return error.code == ErrorCode::cannot_read || error.code == ErrorCode::network;
}
/// Is it a file, which can be opened again?
bool is_regular(const std::string& path);

/// Whether decompress can write the output in parts.
bool can_write_in_parts(const std::string& format, const std::string& output, bool ascii);
/// After commit(): the notes of write_mesh().
std::vector<std::string> notes_of(const MeshSink& sink, const MeshDescription& mesh,
                                  const std::string& format);
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

}  // namespace maille::tool
