#include <maille/file.h>
#include <maille/random_access.h>

#include "files.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

/// Where a mesh of mode random lies, for --box and --sphere of extract: the root of its levels knows.
std::optional<Sphere> sphere_of(const Source& source, const FileInfo& info) {
  if (info.mode != Mode::random) return {};
  const auto file = File::open(source);
  return file && file->levels() > 0 ? std::optional(file->sphere()) : std::nullopt;
}

}  // namespace

Result<int> run(const InfoOptions& options) {
  const Input input = TOOL_TRY(open_maille(options.input, options.fetch_limit));
  const FileInfo info = TOOL_TRY(inspect(*input.source));
  const std::string name = input_name(options.input);
  const std::optional<Sphere> sphere = sphere_of(*input.source, info);
  TOOL_CHECK(answer(options.common.json ? dump(info_json(info, name, sphere))
                                        : info_text(info, name, sphere, options.tree, options.chunks)));
  for (const std::string& problem : info.problems) complain(name + ": " + problem);
  return info.problems.empty() ? 0 : static_cast<int>(ErrorCode::corrupt);
}

Result<int> run(const PrintText& options) {
  TOOL_CHECK(answer(options.text));
  return 0;
}

}  // namespace maille::tool
