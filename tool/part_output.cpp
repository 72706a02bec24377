#include "part_output.h"

#include <fmt/format.h>
#include <maille/io.h>

#include "result.h"
#include "text.h"

namespace maille::tool {

Result<std::string> part_format(const OutputOptions& options, const char* verb) {
  const bool is_stream = options.output == "-" || options.output.rfind("/dev/", 0) == 0;
  const std::string format =
      TOOL_TRY(output_format(options.output, options.output_format, is_stream ? "ply" : ""));
  if (format != "maille") return format;
  return failure(ErrorCode::usage,
                 fmt::format("{}: {} writes other formats; `maille compress` makes .maille of them",
                             options.output, verb));
}

Result<> write_part(const Mesh& part, const std::string& input, const OutputOptions& options,
                    const std::string& format, const CommonOptions& common) {
  const auto file = TOOL_TRY(open_output(
      {options.output, input, options.force, is_binary(format, options.ascii), is_folder_format(format)}));
  const std::vector<std::string> notes =
      TOOL_TRY(write_mesh(part, *file, {.format = format, .ascii = options.ascii}));
  TOOL_CHECK(file->commit());
  say_notes(output_name(options.output), notes, common.quiet);
  return {};
}

void add_fetched(const Input& input, Json& json) {
  if (input.remote == nullptr) return;
  const HttpStatistics fetched = input.remote->statistics();
  json["fetched"] = {{"bytes", fetched.bytes},
                     {"of_bytes", input.source->size()},
                     {"requests", fetched.requests},
                     {"round_trips", fetched.round_trips}};
}

void say_fetched(const Input& input) {
  if (input.remote == nullptr) return;
  say(fmt::format("fetched {}, of a file of {}", fetched_text(input),
                  human_bytes(static_cast<double>(input.source->size()))));
}

}  // namespace maille::tool
