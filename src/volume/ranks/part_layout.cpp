#include "volume/ranks/part_layout.h"

#include <algorithm>
#include <map>
#include <set>

#include "base/bytes.h"
#include "volume/ranks/collective.h"

namespace maille {
namespace {

/// What must be alike in all ranks, as the message about a difference puts it.
std::string described(const Array& array) {
  return std::string(name_of(array.domain)) + " array \"" + array.name + "\" of " +
         std::to_string(array.components) + " " + name_of(array.type);
}

std::vector<std::string> described(const Mesh& mesh) {
  std::vector<std::string> all = {"positions of " + std::string(name_of(mesh.points.type))};
  for (const Array& array : mesh.arrays) {
    if (array.domain != Domain::mesh) all.push_back(described(array));
  }
  return all;
}

void put_array(ByteWriter& out, const Array& array) {
  out.put_string(array.name);
  out.put(static_cast<uint8_t>(array.domain));
  out.put(static_cast<uint8_t>(array.type));
  out.put_count(array.components);
  out.put(static_cast<uint8_t>(array.role));
  out.put_count(array.labels.size());
  for (const std::string& label : array.labels) out.put_string(label);
  const bool of_mesh = array.domain == Domain::mesh;
  out.put_count(of_mesh ? array.bytes.size() : 0);
  if (of_mesh) out.put_bytes(array.bytes);
}

/// Reads what another rank of the same program wrote; bounds are checked all the same, as ByteReader does.
Array get_array(ByteReader& in) {
  Array array;
  array.name = in.get_string();
  array.domain = static_cast<Domain>(in.get<uint8_t>());
  array.type = static_cast<Scalar>(in.get<uint8_t>());
  array.components = static_cast<uint32_t>(in.get_count());
  array.role = static_cast<Role>(in.get<uint8_t>());
  for (uint64_t left = in.get_count(); left > 0 && in.ok(); --left) array.labels.push_back(in.get_string());
  const Bytes bytes = in.get_bytes(in.get_count());
  array.bytes.assign(bytes.begin(), bytes.end());
  return array;
}

// What all ranks must know of arrays and metadata, without any values but those of the mesh as a whole.
std::vector<std::byte> pack(const Mesh& mesh) {
  ByteWriter out;
  put_array(out, make_array(mesh.points.name, Domain::point, mesh.points.type, 3, mesh.points.role));
  out.put_count(mesh.arrays.size());
  for (const Array& array : mesh.arrays) put_array(out, array);
  out.put_count(mesh.metadata.size());
  for (const auto& [key, value] : mesh.metadata) {
    out.put_string(key);
    out.put_string(value);
  }
  return out.take();
}

Mesh unpack(Bytes bytes) {
  ByteReader in(bytes);
  Mesh mesh;
  mesh.points = get_array(in);
  for (uint64_t left = in.get_count(); left > 0 && in.ok(); --left) mesh.arrays.push_back(get_array(in));
  for (uint64_t left = in.get_count(); left > 0 && in.ok(); --left) {
    std::string key = in.get_string();
    mesh.metadata.emplace_back(std::move(key), in.get_string());
  }
  return mesh;
}

// Everything after relies on parts being valid, as one process relies on validate().
Result<> check(const RankPart& part) {
  const auto bad = [](const std::string& what) { return failure(ErrorCode::malformed_input, what); };
  MAILLE_CHECK(validate(*part.mesh));
  if (part.point_ids.size() != part.mesh->point_count() || part.cell_ids.size() != part.mesh->cell_count())
    return bad("there should be a number for each point and each cell of the part");
  for (const Array& array : part.mesh->arrays) {
    if (array.domain == Domain::corner)
      return failure(ErrorCode::unsupported,
                     "array \"" + array.name + "\" is on corners, which mode stream has no place for");
  }
  return {};
}

/// The arrays are those of the first rank that has anything; those of others with points or cells must be the
/// same. Labels, metadata and arrays of the mesh are that rank's, too.
Result<> agree_on_arrays(const RankPart& part, Ranks& ranks, PartLayout& layout) {
  const bool nothing = part.mesh->point_count() == 0 && part.mesh->cell_count() == 0;
  std::vector<uint64_t> first = {nothing ? 0 : ranks.size() - ranks.rank()};
  ranks.largest(first);
  const auto model = static_cast<unsigned>(first[0] == 0 ? 0 : ranks.size() - first[0]);
  const Buffers packed = to_all(ranks, ranks.rank() == model ? Bytes(pack(*part.mesh)) : Bytes());
  layout.empty = unpack(packed[model]);
  if (nothing) return agree(ranks, {});
  const std::vector<std::string> mine = described(*part.mesh), theirs = described(layout.empty);
  Result<> alike;
  // The first difference is told, so that a user sees which array to mend.
  for (size_t i = 0; i < std::max(mine.size(), theirs.size()) && alike; ++i) {
    const std::string here = i < mine.size() ? mine[i] : "nothing more";
    const std::string there = i < theirs.size() ? theirs[i] : "nothing more";
    if (here == there) continue;
    alike = failure(ErrorCode::malformed_input, "its part has " + here + " where rank " +
                                                    std::to_string(model) + " has " + there +
                                                    "; all parts need the same arrays in the same order");
  }
  return agree(ranks, alike);
}

/// Blocks of different ranks are one if they have the same name and type; where no rank has more than one
/// block, and all have one name, they are one whatever their types.
using Key = std::pair<std::string, CellType>;

/// Blocks without cells are not told: they have no least number by which to stand in order.
void put_blocks(const RankPart& part, ByteWriter& out) {
  uint64_t first = 0;
  uint32_t number = 0;
  for (const CellBlock& block : part.mesh->blocks) {
    const uint64_t cells = block.size();
    const auto ids = part.cell_ids.subspan(first, cells);
    first += cells;
    ++number;
    if (cells == 0) continue;
    const auto [low, high] = std::minmax_element(ids.begin(), ids.end());
    out.put_string(block.name);
    out.put(static_cast<uint8_t>(block.type));
    out.put(static_cast<uint8_t>(!block.cell_faces.empty()));
    out.put(cells);
    out.put(*low);
    out.put(*high);
    out.put(number - 1);
  }
}

struct BlockOfRank {
  PartLayout::Block block;
  unsigned rank = 0;
  uint32_t number = 0;
};

// The blocks of all ranks that have cells, by rank: all ranks get the same list.
std::vector<BlockOfRank> all_blocks(const RankPart& part, Ranks& ranks) {
  ByteWriter mine;
  put_blocks(part, mine);
  const Buffers buffers = to_all(ranks, mine.bytes());
  std::vector<BlockOfRank> all;
  for (unsigned r = 0; r < buffers.size(); ++r) {
    ByteReader in(buffers[r]);
    while (in.remaining() > 0) {
      BlockOfRank& found = all.emplace_back();
      found.block.name = in.get_string();
      found.block.type = static_cast<CellType>(in.get<uint8_t>());
      found.block.has_faces = in.get<uint8_t>() != 0;
      found.block.cells = in.get<uint64_t>();
      found.block.first_id = in.get<uint64_t>();
      found.block.last_id = in.get<uint64_t>();
      found.number = in.get<uint32_t>();
      found.rank = r;
    }
  }
  return all;
}

/// Whether all blocks of all ranks are one: no rank has two, and all have one name.
bool is_one(const std::vector<BlockOfRank>& all) {
  std::set<unsigned> seen;
  return std::all_of(all.begin(), all.end(), [&](const BlockOfRank& found) {
    return found.block.name == all[0].block.name && seen.insert(found.rank).second;
  });
}

Result<> agree_on_blocks(const RankPart& part, Ranks& ranks, PartLayout& layout) {
  std::vector<BlockOfRank> all = all_blocks(part, ranks);
  const bool one = is_one(all);
  std::map<Key, PartLayout::Block> merged;
  const auto key_of = [&](const BlockOfRank& found) {
    return Key(found.block.name, one ? CellType::mixed : found.block.type);
  };
  for (const BlockOfRank& found : all) {
    const auto [at, is_new] = merged.emplace(key_of(found), found.block);
    if (is_new) continue;
    PartLayout::Block& block = at->second;
    if (block.type != found.block.type) block.type = CellType::mixed;
    block.has_faces = block.has_faces || found.block.has_faces;
    block.cells += found.block.cells;
    block.first_id = std::min(block.first_id, found.block.first_id);
    block.last_id = std::max(block.last_id, found.block.last_id);
  }
  // By their least cell, then by name and type: the order in which one process would have them.
  std::vector<std::pair<Key, PartLayout::Block>> sorted(merged.begin(), merged.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second.first_id < b.second.first_id; });
  layout.block_of.resize(part.mesh->blocks.size());
  for (auto& [key, block] : sorted) {
    for (const BlockOfRank& found : all) {
      if (found.rank == ranks.rank() && key_of(found) == key)
        layout.block_of[found.number] = static_cast<uint32_t>(layout.blocks.size());
    }
    block.first_key = layout.keys;
    // Keys of all blocks must fit 64 bits together, each block taking as many as its numbers are spread over.
    const uint64_t ids = block.last_id - block.first_id;
    if (ids >= ~uint64_t{0} - layout.keys)
      return failure(ErrorCode::malformed_input, "the numbers of cells are spread over more than 64 bits");
    layout.keys += ids + 1;
    layout.blocks.push_back(block);
  }
  return {};
}

}  // namespace

// An error of any rank is told to all before the next exchange.
Result<PartLayout> agree_on_layout(const RankPart& part, Ranks& ranks) {
  MAILLE_CHECK(agree(ranks, check(part)));
  PartLayout layout;
  MAILLE_CHECK(agree_on_arrays(part, ranks, layout));
  MAILLE_CHECK(agree_on_blocks(part, ranks, layout));  // from what all know: fails in all or in none
  return layout;
}

Tuples::Tuples(const Mesh& mesh, Domain domain) {
  if (domain == Domain::point) arrays_.push_back(&mesh.points);
  for (const Array& array : mesh.arrays) {
    if (array.domain == domain) arrays_.push_back(&array);
  }
  for (const Array* array : arrays_) size_ += array->tuple_size();
}

void Tuples::read(uint64_t element, std::byte* out) const {
  for (const Array* array : arrays_) {
    const size_t size = array->tuple_size();
    out = std::copy_n(array->bytes.data() + element * size, size, out);
  }
}

std::vector<Array*> Tuples::of(Mesh& mesh, Domain domain) {
  std::vector<Array*> arrays;
  if (domain == Domain::point) arrays.push_back(&mesh.points);
  for (Array& array : mesh.arrays) {
    if (array.domain == domain) arrays.push_back(&array);
  }
  return arrays;
}

void put_tuple(const std::vector<Array*>& arrays, uint64_t element, const std::byte* tuple) {
  for (Array* const array : arrays) {
    const size_t size = array->tuple_size();
    std::copy_n(tuple, size, array->bytes.data() + element * size);
    tuple += size;
  }
}

}  // namespace maille
