// The last step taken away again: a file with steps ends like the one before each was appended.
// docs/format.md, 6 and 16.9.
#include <maille/source.h>
#include <maille/stream.h>

#include "base/result.h"
#include "container/file_reader.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

/// Where the file ended before the last step: each step is written with an index and a footer of its own, so
/// chunks that do not follow one another have a footer between them (docs/format.md, 6).
uint64_t end_before_last_step(const FileReader& file) {
  const std::vector<ChunkRecord>& records = file.records();
  size_t first = records.size() - 1;
  while (first > 0 &&
         records[first - 1].offset + chunk_total_bytes(records[first - 1].header) == records[first].offset)
    --first;
  return first == 0 ? 0 : records[first].offset;
}

}  // namespace

Result<StepReport> remove_last_step(const std::string& path) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  const FileReader file = MAILLE_TRY(FileReader::open(*source));
  MAILLE_CHECK(file.check_complete());
  StepReport report;
  report.number = count_steps(file);
  if (report.number == 0)
    return failure(ErrorCode::usage, path + ": has no steps of time behind its mesh; nothing can be removed");
  report.file_bytes = end_before_last_step(file);
  // A file of another program may have several steps before one footer: what is left has to be a whole file.
  const auto rest = MAILLE_TRY(part_source(*source, 0, report.file_bytes));
  const auto left = FileReader::open(*rest);
  if (!left || !left->problems().empty() || count_steps(*left) + 1 != report.number) {
    return failure(ErrorCode::unsupported, path + ": step " + std::to_string(report.number) +
                                               " was not appended by itself, so it cannot be removed alone");
  }
  const std::unique_ptr<Sink> sink = MAILLE_TRY(append_sink(path, report.file_bytes));
  MAILLE_CHECK(sink->commit());
  return report;
}

}  // namespace maille
