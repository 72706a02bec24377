#include "volume/pieces/packed_cells.h"

#include <algorithm>

namespace maille {
namespace {

/// Corner k of a cell is near corner k of the cell before, if that has as many, else near corner k - 1. The
/// corners below k are those of the cell itself already.
uint64_t near(const std::vector<uint64_t>& nodes, size_t k, bool as_many) {
  return as_many ? nodes[k] : k > 0 ? nodes[k - 1] : 0;
}

}  // namespace

void CellPacker::pack(uint64_t number, uint32_t block, uint8_t type, std::span<const uint64_t> nodes,
                      std::span<const uint32_t> faces, ByteWriter& out) {
  const bool as_many = nodes.size() == before_.nodes.size();
  const bool alike =
      as_many && block == before_.block && type == before_.type && faces.size() == before_.faces.size();
  // The lowest bit says whether block, type and counts are told again.
  out.put_count((number - next_) << 1 | (alike ? 0u : 1u));
  if (!alike) {
    out.put_count(block);
    out.put(type);
    out.put_count(nodes.size());
    out.put_count(faces.size());
  }
  before_.nodes.resize(nodes.size());
  for (size_t k = 0; k < nodes.size(); ++k) {
    // The difference wraps, so that any numbers will do.
    out.put_zigzag(static_cast<int64_t>(nodes[k] - near(before_.nodes, k, as_many)));
    before_.nodes[k] = nodes[k];
  }
  for (const uint32_t size : faces) out.put_count(size);
  before_.block = block;
  before_.type = type;
  before_.faces.resize(faces.size());
  next_ = number + 1;
}

// The same steps in the same order as pack().
const PackedCell& CellUnpacker::unpack(ByteReader& in) {
  const uint64_t head = in.get_count();
  bool as_many = true;
  if ((head & 1) != 0) {
    cell_.block = static_cast<uint32_t>(in.get_count());
    cell_.type = in.get<uint8_t>();
    const uint64_t nodes = in.get_count(), faces = in.get_count();
    as_many = nodes == cell_.nodes.size();
    cell_.nodes.resize(nodes);
    cell_.faces.resize(faces);
  }
  for (size_t k = 0; k < cell_.nodes.size(); ++k)
    cell_.nodes[k] = near(cell_.nodes, k, as_many) + static_cast<uint64_t>(in.get_zigzag());
  for (uint32_t& size : cell_.faces) size = static_cast<uint32_t>(in.get_count());
  cell_.number = next_ + (head >> 1);
  next_ = cell_.number + 1;
  return cell_;
}

}  // namespace maille
