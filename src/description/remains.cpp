#include "description/remains.h"

#include "base/result.h"
#include "description/element_order.h"

namespace maille {

std::string array_named(const std::string& name, Domain domain) {
  return "the array \"" + name + "\" (" + name_of(domain) + ")";
}

Result<> put_in_order(const Result<std::vector<std::byte>>& bytes, uint64_t points, uint64_t cells,
                      Remains& remains) {
  if (!bytes && !is_loss(bytes.error())) return tl::unexpected(bytes.error());
  Mesh& mesh = remains.mesh;
  if (bytes && mesh.point_count() == points && mesh.cell_count() == cells) {
    const auto order = decode_order(*bytes, static_cast<uint32_t>(points), static_cast<uint32_t>(cells));
    if (order) {
      mesh = MAILLE_TRY(restore_order(std::move(mesh), *order));
      return {};
    }
  }
  remains.lost.push_back("the input's order");
  return {};
}

std::string sentence_of(const Remains& remains) {
  constexpr size_t most_named = 8;
  std::string sentence;
  for (size_t i = 0; i < remains.lost.size() && i < most_named; ++i)
    sentence += (i == 0 ? "; lost: " : ", ") + remains.lost[i];
  if (remains.lost.size() > most_named)
    sentence += ", and " + std::to_string(remains.lost.size() - most_named) + " more";
  return sentence;
}

}  // namespace maille
