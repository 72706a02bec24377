#include <fmt/format.h>
#include <maille/compare.h>

#include "differences.h"
#include "files.h"
#include "result.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

Result<LoadedMesh> load_one(const std::string& path, const DiffOptions& options) {
  const Input input = TOOL_TRY(open_input(path, options.input_format));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  return load(input, options.common, progress);
}

std::string text_of(const Comparison& comparison, const DiffOptions& options) {
  const std::string names = fmt::format("{} and {}", input_name(options.a), input_name(options.b));
  if (comparison.equal) {
    return fmt::format("{} are equal{}\n", names,
                       options.same_order ? ", in the same order" : " up to the order of points and faces");
  }
  std::string text = fmt::format("{} differ\n", names);
  for (const std::string& difference : comparison.differences) text += fmt::format("  {}\n", difference);
  return text;
}

}  // namespace

Result<int> run(const DiffOptions& options) {
  if (options.a == "-" && options.b == "-") {
    return failure(ErrorCode::usage, "both meshes are standard input; name a file for one of them");
  }
  const LoadedMesh a = TOOL_TRY(load_one(options.a, options));
  const LoadedMesh b = TOOL_TRY(load_one(options.b, options));
  const Comparison comparison = compare(a.mesh, b.mesh,
                                        {.same_order = options.same_order,
                                         .compare_arrays = options.arrays,
                                         .compare_metadata = options.metadata});
  std::vector<ArrayDifference> by_order;
  if (options.same_order && !comparison.equal) {
    // Meshes of different sizes have no differences by order; the comparison has said so already.
    if (auto differences = differences_by_order(a.mesh, b.mesh)) by_order = *std::move(differences);
  }
  if (options.common.json) {
    TOOL_CHECK(answer(dump({{"a", input_name(options.a)},
                            {"b", input_name(options.b)},
                            {"equal", comparison.equal},
                            {"same_order", options.same_order},
                            {"differences", comparison.differences},
                            {"arrays", differences_json(by_order)}})));
  } else if (!options.common.quiet) {
    TOOL_CHECK(answer(text_of(comparison, options) + (by_order.empty() ? "" : differences_text(by_order))));
  }
  return comparison.equal ? 0 : static_cast<int>(ErrorCode::differs);
}

}  // namespace maille::tool
