#pragma once

#include <maille/executor.h>
#include <maille/folder.h>
#include <maille/http.h>
#include <maille/mesh.h>
#include <maille/source.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "options.h"
#include "progress.h"

// Inputs and outputs as the command line names them: a path, or "-" for a standard stream.
namespace maille::tool {

/// How messages call a path or address: itself, or "standard input" / "standard output".
std::string input_name(const std::string& path);
std::string output_name(const std::string& path);

/// Where the name begins in a path, behind the folders.
size_t begin_of_name(const std::string& path);

/// The path with another extension (".maille"), ".gz" and the old one removed; of an address, its last name.
std::string with_extension(const std::string& path, const std::string& extension);

/// Something to read, opened.
struct Input {
  std::string path;
  std::string format;  ///< as given; empty: recognised by extension and first bytes
  std::unique_ptr<Source> source;
  bool is_maille = false;              ///< by its first bytes, or by `format`
  const HttpSource* remote = nullptr;  ///< `source`, where it is an address
  std::optional<uint64_t> step = {};   ///< of a file that has several: read_series_entry()
};

/// How much of what an address names may be fetched: all of it, as it is all wanted.
constexpr uint64_t no_fetch_limit = std::numeric_limits<uint64_t>::max();

/// Opens a path or an address or, for "-", reads standard input to its end. Errors: cannot_read, network;
/// usage when standard input is a terminal.
Result<Input> open_input(const std::string& path, const std::string& format = {},
                         uint64_t fetch_limit = no_fetch_limit);

/// The same for a source that is open already.
Input make_input(std::unique_ptr<Source> source, const std::string& path, const std::string& format = {});

/// Error: usage, where an input is plainly something else than a .maille file.
Result<> check_maille(const Input& input);
/// Opens a path that has to be a .maille file. Errors as above, and those of open_input().
Result<Input> open_maille(const std::string& path, uint64_t fetch_limit = no_fetch_limit);

/// "12 kB in 3 requests, 2 round trips"; empty for what is no address.
std::string fetched_text(const Input& input);

struct LoadedMesh {
  Mesh mesh;
  std::vector<std::string> notes;
  std::vector<std::string> files_beside = {};  ///< as in ReadResult
};

/// Reads a mesh of any format, .maille included; prints the notes and, with -v, the time.
Result<LoadedMesh> load(const Input& input, const CommonOptions& common, ProgressDisplay& progress);

/// The executor asked for by -T, kept alive by the holder.
class Threads {
 public:
  explicit Threads(unsigned count);
  Executor* executor() const { return executor_; }

 private:
  std::unique_ptr<Executor> owned_;
  Executor* executor_;
};

struct OutputRequest {
  std::string path;
  std::string input;    ///< must not be the same file
  bool force = false;   ///< overwrite, write binary to a terminal
  bool binary = true;   ///< the bytes would upset a terminal
  bool folder = false;  ///< a mesh of OpenFOAM: polymesh_sink()
};

/// Error: usage, where the answer (--json) and the output ("-") would both go to standard output.
Result<> check_json_output(const CommonOptions& common, const std::string& output);
/// Checks that writing makes sense: errors as of open_output().
Result<> check_output(const OutputRequest& request);
/// Checks that writing makes sense, then opens the output. Errors: usage (same file as the input, exists
/// already, terminal), write_failed.
Result<std::unique_ptr<Sink>> open_output(const OutputRequest& request);

/// The foreign format the extension of a path stands for, such as "ply"; nothing is read.
std::optional<std::string> foreign_format(const std::string& path);

/// The format to write: `format` if given, "maille" or what the path's extension says, else `fallback`.
/// A folder called polyMesh, or with OpenFOAM's folders in it, says polymesh. Error: usage when nothing says
/// it and there is no fallback.
Result<std::string> output_format(const std::string& path, const std::string& format,
                                  const std::string& fallback);
/// Whether a format is a folder of files.
bool is_folder_format(const std::string& format);
/// Whether files of this format are more than plain text.
bool is_binary(const std::string& format, bool ascii);

/// Counts what goes through to another sink.
class CountingSink final : public FolderSink {
 public:
  explicit CountingSink(Sink& sink) : sink_(sink) {}
  Result<> write(Bytes bytes) override;
  Result<> begin_file(const std::string& file) override;
  Result<bool> begin_case_file(const std::string& path) override;
  Result<> commit() override { return sink_.commit(); }
  std::string name() const override { return sink_.name(); }
  uint64_t count() const { return count_; }

 private:
  Sink& sink_;
  uint64_t count_ = 0;
};

}  // namespace maille::tool
