#include <maille/file.h>

#include "files.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

Result<int> run(const InfoOptions& options) {
  const Input input = TOOL_TRY(open_maille(options.input, options.fetch_limit));
  const FileInfo info = TOOL_TRY(inspect(*input.source));
  const std::string name = input_name(options.input);
  TOOL_CHECK(answer(options.common.json ? dump(info_json(info, name))
                                        : info_text(info, name, options.tree, options.chunks)));
  for (const std::string& problem : info.problems) complain(name + ": " + problem);
  return info.problems.empty() ? 0 : static_cast<int>(ErrorCode::corrupt);
}

Result<int> run(const PrintText& options) {
  TOOL_CHECK(answer(options.text));
  return 0;
}

}  // namespace maille::tool
