#pragma once

#include <maille/error.h>

#include <functional>
#include <string>
#include <vector>

#include "options.h"

// Many inputs on one command line, each of which becomes a file of its own.
namespace maille::tool {

/// The names of a verb with the arguments IN, OUT and more are all inputs if there are more than two, if an
/// output folder or -r is given, or if OUT is there and `is_input` of it (as in `maille compress *.ply` with
/// two meshes). Then they go into `batch`.
void take_inputs(Batch& batch, std::string& input, std::string& output,
                 const std::function<bool(const std::string& path)>& is_input);

struct BatchItem {
  std::string input;
  /// The output without its extension: in the output folder, or beside the input. Where two inputs would have
  /// the same, both keep their extensions.
  std::string stem;
};

/// The inputs, and with -r the files of folders and of those below that are `is_wanted` (cases of OpenFOAM as
/// a whole), by name. Errors (usage): standard input among them; one twice; a name that is no file and not
/// `is_wanted`; nothing in a folder.
Result<std::vector<BatchItem>> items_of(const Batch& batch,
                                        const std::function<bool(const std::string& path)>& is_wanted);

/// Runs a verb on each and makes folders for the outputs. What fails is said at once, and again after all;
/// the value is the largest exit code. `run_one` gives it, and the name of the output.
struct BatchAnswer {
  int code = 0;
  std::string output;
  uint64_t input_bytes = 0;  ///< of the file and of those that it names
};
int run_batch(const std::vector<BatchItem>& items, const CommonOptions& common,
              const std::function<Result<BatchAnswer>(const BatchItem&)>& run_one);

}  // namespace maille::tool
