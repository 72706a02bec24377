#include "surface/parts/merge_parts.h"

#include <algorithm>
#include <cstring>

#include "base/pages.h"

namespace maille {
namespace {

/// What merging needs to know all the time. Parts write at different places, so they can do it at once;
/// memory of a part goes as soon as it is merged.
struct Merger {
  std::vector<PartToMerge>& parts;
  std::span<const CodedBlock> blocks;
  const std::vector<BlockOfPart> order;
  const JoinedPoints& joined;
  Executor& executor;

  /// One part after the other? Then arrays grow along with them, and are touched once.
  bool in_order() const { return &executor == &serial_executor(); }
  template <class Vector>
  void prepare(Vector& vector, size_t count) const {
    vector.reserve(count);
    if (in_order()) return;
    prepare_pages(vector.data(), count * sizeof(*vector.data()));
    vector.resize(count);
  }
  template <class Work>
  void for_each_part(Work work) const {
    executor.parallel_for(parts.size(), work);
  }
};

/// Corners are numbered anew in pieces of 16 kB that stay in the cache, instead of being filled with zeros
/// first: 3 % of all time (dragon and the iso-surface, 230f8d1). The size was not swept.
constexpr size_t piece_corners = size_t{1} << 12;

Array like(const Array& array) {
  Array result = make_array(array.name, array.domain, array.type, array.components, array.role);
  result.labels = array.labels;
  return result;
}

/// The new points of a part follow one another in the mesh: calls copy(begin, end) for what lies between
/// joined ones.
template <class Copy>
void copy_new_points(const JoinedPart& part, Copy copy) {
  size_t next = 0;
  for (const uint32_t point : part.joined) {
    if (point > next) copy(next, size_t{point});
    next = size_t{point} + 1;
  }
  if (part.points > next) copy(next, size_t{part.points});
}

template <class ArrayOf>
Array merge_point_array(const Merger& merger, ArrayOf array_of) {
  Array result = like(array_of(merger.parts[0].mesh));
  const size_t size = result.tuple_size();
  merger.prepare(result.bytes, merger.joined.count * size);
  merger.for_each_part([&](size_t p) {
    const JoinedPart& part = merger.joined.parts[p];
    const Buffer<std::byte> from = std::move(array_of(merger.parts[p].mesh).bytes);
    size_t out = part.first_new * size;
    if (merger.in_order())
      prepare_pages(result.bytes.data() + out, (part.points - part.joined.size()) * size);
    copy_new_points(part, [&](size_t begin, size_t end) {
      const std::byte* const first = from.data() + begin * size;
      const size_t bytes = (end - begin) * size;
      if (merger.in_order()) {
        result.bytes.insert(result.bytes.end(), first, first + bytes);
      } else {
        std::memcpy(result.bytes.data() + out, first, bytes);
      }
      out += bytes;
    });
  });
  return result;
}

/// Tuples of cells or corners: those of a block in part after part. `count_of` gives how many a block has.
template <class ArrayOf, class CountOf>
Array merge_cell_array(const Merger& merger, ArrayOf array_of, CountOf count_of) {
  Array result = like(array_of(merger.parts[0].mesh));
  const size_t size = result.tuple_size();
  size_t bytes = 0;
  for (PartToMerge& part : merger.parts) bytes += array_of(part.mesh).bytes.size();
  result.bytes.reserve(bytes);
  // Blocks of one part come up in their order.
  std::vector<size_t> taken(merger.parts.size());
  for (const BlockOfPart& here : merger.order) {
    Mesh& part = merger.parts[here.part].mesh;
    const auto first = array_of(part).bytes.begin() + static_cast<ptrdiff_t>(taken[here.part]);
    const size_t of_block = count_of(part.blocks[here.block]) * size;
    result.bytes.insert(result.bytes.end(), first, first + static_cast<ptrdiff_t>(of_block));
    taken[here.part] += of_block;
  }
  return result;
}

/// By domain: points are joined, cells and corners follow one another, and what belongs to the mesh is in the
/// first part.
Array merge_array(const Merger& merger, size_t i) {
  const auto array_of = [i](Mesh& mesh) -> Array& { return mesh.arrays[i]; };
  switch (array_of(merger.parts[0].mesh).domain) {
    case Domain::point:
      return merge_point_array(merger, array_of);
    case Domain::cell:
      return merge_cell_array(merger, array_of, [](const CellBlock& block) { return block.size(); });
    case Domain::corner:
      return merge_cell_array(merger, array_of,
                              [](const CellBlock& block) { return block.connectivity.size(); });
    case Domain::mesh:
      break;
  }
  return std::move(array_of(merger.parts[0].mesh));
}

/// Blocks without their connectivity; `corners` gets by part, then by its block, the place of the block's
/// corners in that of the whole.
std::vector<CellBlock> merge_offsets(const Merger& merger, std::vector<std::vector<uint64_t>>& corners) {
  std::vector<CellBlock> blocks(merger.blocks.size());
  std::vector<uint64_t> corners_of(blocks.size());
  corners.resize(merger.parts.size());
  for (const BlockOfPart& here : merger.order) {
    CellBlock& merged = blocks[here.number];
    const CellBlock& block = merger.parts[here.part].mesh.blocks[here.block];
    const uint64_t before = corners_of[here.number];
    corners[here.part].push_back(before);
    merged.types.insert(merged.types.end(), block.types.begin(), block.types.end());
    // The first offset of a further part is the last of the one before.
    for (size_t i = merged.offsets.empty() ? 0 : 1; i < block.offsets.size(); ++i) {
      merged.offsets.push_back(before + block.offsets[i]);
    }
    corners_of[here.number] += block.connectivity.size();
  }
  for (size_t b = 0; b < blocks.size(); ++b) {
    blocks[b].name = merger.blocks[b].name;
    blocks[b].type = merger.blocks[b].shape.type;
    merger.prepare(blocks[b].connectivity, corners_of[b]);
  }
  return blocks;
}

std::vector<CellBlock> merge_blocks(const Merger& merger) {
  std::vector<std::vector<uint64_t>> corners;
  std::vector<CellBlock> blocks = merge_offsets(merger, corners);
  merger.for_each_part([&](size_t p) {
    // A table of the part's points; looking up ranks for each corner would take longer.
    const std::vector<uint32_t> numbers = merger.joined.parts[p].all_numbers();
    PartToMerge& part = merger.parts[p];
    for (size_t b = 0; b < part.block_numbers.size(); ++b) {
      CellBlock& from = part.mesh.blocks[b];
      Buffer<uint32_t>& to = blocks[part.block_numbers[b]].connectivity;
      const uint64_t first = corners[p][b];
      if (merger.in_order()) prepare_pages(to.data() + first, from.connectivity.size() * sizeof(uint32_t));
      for (size_t begin = 0; begin < from.connectivity.size(); begin += piece_corners) {
        const size_t end = std::min(from.connectivity.size(), begin + piece_corners);
        if (merger.in_order()) to.resize(first + end);
        uint32_t* const out = to.data() + first;
        for (size_t i = begin; i < end; ++i) out[i] = numbers[from.connectivity[i]];
      }
      from = {};
    }
  });
  return blocks;
}

}  // namespace

/// Points first, whose arrays are the largest, so that parts give their memory back early.
Mesh merge_parts(std::vector<PartToMerge> parts, std::span<const CodedBlock> blocks,
                 const JoinedPoints& joined, Executor& executor) {
  const Merger merger{parts, blocks, blocks_in_order(parts), joined, executor};
  Mesh result;
  result.points = merge_point_array(merger, [](Mesh& mesh) -> Array& { return mesh.points; });
  for (size_t i = 0; i < parts[0].mesh.arrays.size(); ++i) result.arrays.push_back(merge_array(merger, i));
  result.blocks = merge_blocks(merger);
  return result;
}

}  // namespace maille
