#include <maille/file.h>

#include "base/result.h"
#include "container/file_reader.h"

namespace maille {

Result<std::vector<std::string>> verify_checksums(const Source& source) {
  const FileReader reader = MAILLE_TRY(FileReader::open(source));
  std::vector<std::string> damage;
  for (const std::string& problem : reader.problems()) damage.push_back(source.name() + ": " + problem);
  // All chunks, also those that no decoder asks for: who verifies wants to know that no bit has changed.
  for (const ChunkRecord& record : reader.records()) {
    const auto content = reader.read_chunk(record);
    if (content) continue;
    if (content.error().code != ErrorCode::corrupt) return tl::unexpected(content.error());
    damage.push_back(content.error().message);
  }
  return damage;
}

}  // namespace maille
