#include "description/description.h"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "base/bytes.h"
#include "base/result.h"
#include "code/efforts.h"
#include "container/plain_fields.h"
#include "entropy/byte_model.h"
#include "mesh/none.h"

namespace maille {
namespace {

// Below this the fast levels write descriptions as they are: decoding one takes 3.5 of the 70 microseconds of
// a mesh of 4,000 triangles (230f8d1). A larger bound would cost bytes that small files notice.
constexpr size_t short_bytes = 96;

/// What an array is but for where its tuples belong.
struct UsualArray {
  std::string_view name;
  Scalar type;
  uint32_t components;
  Role role;
};
/// Arrays as readers of OBJ, PLY, STL and glTF make them, which nearly all small meshes have: a byte each
/// instead of 11 to 14, of about 70 for a whole triangle. docs/format.md, 11.1, numbers them from 1.
constexpr UsualArray usual_arrays[] = {
    {"position", Scalar::f32, 3, Role::none},
    {"position", Scalar::f64, 3, Role::none},
    {"normal", Scalar::f32, 3, Role::normal},
    {"normal", Scalar::f64, 3, Role::normal},
    {"texcoord", Scalar::f32, 2, Role::texture_coordinate},
    {"texcoord", Scalar::f64, 2, Role::texture_coordinate},
    {"colour", Scalar::u8, 3, Role::colour},
    {"colour", Scalar::u8, 4, Role::colour},
    {"colour", Scalar::f32, 3, Role::colour},
    {"colour", Scalar::f32, 4, Role::colour},
    {"tangent", Scalar::f32, 4, Role::tangent},
    {"joints", Scalar::u8, 4, Role::none},
    {"joints", Scalar::u16, 4, Role::none},
    {"weights", Scalar::f32, 4, Role::none},
};

/// 0: it has to be spelled.
unsigned usual_of(const ArrayDescription& array) {
  const auto same = [&](const UsualArray& usual) {
    return array.labels.empty() && array.name == usual.name && array.type == usual.type &&
           array.components == usual.components && array.role == usual.role;
  };
  const auto found = std::find_if(std::begin(usual_arrays), std::end(usual_arrays), same);
  return found == std::end(usual_arrays) ? 0 : static_cast<unsigned>(found - std::begin(usual_arrays)) + 1;
}

void make_usual(ArrayDescription& array, unsigned number) {
  if (number > std::size(usual_arrays)) return;  // the reader has refused it
  const UsualArray& usual = usual_arrays[number - 1];
  array.name = usual.name;
  array.type = usual.type;
  array.components = usual.components;
  array.role = usual.role;
}

/// Where tuples belong, arrays by twin behind the domains, and which of the usual arrays it is.
template <class Visitor, class Array>
unsigned visit_head(Visitor& v, Array& array) {
  constexpr unsigned places = domain_count + 1;
  const unsigned place = array.by_twin ? domain_count : static_cast<unsigned>(array.domain);
  auto head = static_cast<uint8_t>(place + places * usual_of(array));
  v.byte(head, places * (static_cast<unsigned>(std::size(usual_arrays)) + 1));
  if constexpr (!std::is_const_v<Array>) {
    array.by_twin = head % places == domain_count;
    array.domain = array.by_twin ? Domain::corner : static_cast<Domain>(head % places);
  }
  return head / places;
}

/// The one list of an array's fields, for writer and reader (docs/format.md, 11.1). Bounds are part
/// of the format.
template <class Visitor, class Array>
void visit_array(Visitor& v, Array& array) {
  if (const unsigned usual = visit_head(v, array); usual == 0) {
    v.text(array.name);
    v.choice(array.type, scalar_count);
    v.count(array.components, 0xffff);
    v.choice(array.role, role_count);
    v.list(array.labels, [&](auto& label) { v.text(label); });
  } else if constexpr (!std::is_const_v<Array>) {
    make_usual(array, usual);
  }
  if (array.domain == Domain::mesh) v.count(array.mesh_tuples, none - 1);
  // Only what was asked, no measured error: a mesh that is decoded and encoded again must give the same
  // bytes.
  v.choice(array.asked.kind, Tolerance::kind_count);
  if (array.asked.kind == Tolerance::Kind::lossless) return;
  v.real(array.asked.value);
  v.real(array.bound);
  v.real(array.step);
}

template <class Visitor, class Block>
void visit_block(Visitor& v, Block& block) {
  v.text(block.name);
  v.choice(block.shape.type, 256);
  v.count(block.shape.cells, none - 1);
  if (block.shape.type != CellType::mixed) return;
  v.list(block.types, [&](auto& type) {
    v.choice(type.first, 256);
    v.count(type.second, none - 1);
  });
}

void visit_block_cells(PlainWriter& v, const std::vector<BlockCells>& cells, uint64_t blocks) {
  put_block_cells(cells, blocks, [&](uint64_t count) { v.count(count, none - 1); });
}
void visit_block_cells(PlainReader& v, std::vector<BlockCells>& cells, uint64_t blocks) {
  const auto get = [&] {
    uint64_t count = 0;
    v.count(count, none - 1);
    return count;
  };
  const auto add = [&](uint32_t block, uint64_t count) {
    BlockCells* const here = v.add(cells);
    if (here != nullptr) *here = {block, count};
    return here != nullptr;
  };
  v.require(get_block_cells(
      blocks, get, [&] { return v.ok(); }, add));
}

template <class Visitor, class Part>
void visit_part(Visitor& v, Part& part, uint64_t blocks) {
  v.count(part.points, max_points);
  v.count(part.corners, none - 1);
  visit_block_cells(v, part.cells, blocks);
}

template <class Visitor, class Whole>
void visit_form(Visitor& v, Whole& description) {
  auto form =
      static_cast<uint8_t>(static_cast<unsigned>(description.order) | unsigned{description.welded} << 1);
  v.byte(form, 4);
  if constexpr (!std::is_const_v<Whole>) {
    description.order = static_cast<Order>(form & 1);
    description.welded = (form & 2) != 0;
  }
}

/// The one list of all fields. A reader that has visited it trusts no sum yet: decode_description() checks
/// what belongs together.
template <class Visitor, class Whole>
void visit(Visitor& v, Whole& description) {
  v.byte(description.effort, 10);
  visit_form(v, description);
  v.count(description.points, max_points);
  if (description.welded) v.count(description.split_points, max_points);
  v.count(description.corners, none - 1);
  v.list(description.blocks, [&](auto& block) { visit_block(v, block); });
  v.list(description.parts, [&](auto& part) { visit_part(v, part, description.blocks.size()); });
  visit_array(v, description.positions);
  v.list(description.arrays, [&](auto& array) { visit_array(v, array); });
  v.list(description.metadata, [&](auto& entry) {
    v.text(entry.first);
    v.text(entry.second);
  });
  v.text(description.provenance);
}

/// Twins have a corner each, and are fewer points as coded than in the mesh. The second bound is what makes
/// split_points safe to allocate: corners are counted by the streams.
bool twins_fit(const Description& description) {
  bool by_twin = description.positions.by_twin;
  for (const ArrayDescription& array : description.arrays) by_twin = by_twin || array.by_twin;
  if (!description.welded) return !by_twin;
  return !description.positions.by_twin && description.parts.empty() &&
         description.split_points > description.points &&
         description.split_points <= description.points + description.corners;
}

/// Whether the parts make up the whole. Each point of a part is a corner of its cells, or belongs to no cell
/// at all, which bounds their sum. Sums are compared as they grow, so nothing wraps.
bool parts_fit(const Description& description) {
  if (description.parts.empty()) return true;
  uint64_t corners = 0;
  uint64_t points = 0;
  std::vector<uint64_t> cells(description.blocks.size());
  for (const PartDescription& part : description.parts) {
    if (part.points > description.points) return false;
    points += part.points;
    corners += part.corners;
    for (const BlockCells& here : part.cells) cells[here.block] += here.cells;
    if (points > description.points + description.corners || corners > description.corners) return false;
  }
  for (size_t b = 0; b < cells.size(); ++b) {
    if (cells[b] != description.blocks[b].shape.cells) return false;
  }
  return corners == description.corners && points >= description.points;
}

bool is_known(CellType type) {
  return std::string_view(name_of(type)) != "unknown";
}

/// Whether the types of a block are ones that these files hold. Polyhedra are not: their faces are not in
/// these files. Blocks that are only cut off from others say nothing of types. Types rise, so each is there
/// once.
bool types_fit(const CodedBlock& block) {
  if (!is_known(block.shape.type) || block.shape.type == CellType::polyhedron) return false;
  uint64_t cells = 0;
  int before = 0;
  for (const auto& [type, count] : block.types) {
    const bool rises = static_cast<int>(type) > before;
    before = static_cast<int>(type);
    if (!rises || !is_known(type) || type == CellType::mixed || type == CellType::polyhedron) return false;
    cells += count;
  }
  return block.types.empty() || cells == block.shape.cells;
}

// Before anything is allocated for the mesh.
Result<> check_size(const Description& description, const Limits& limits) {
  const double bytes = memory_of(description);
  if (bytes > static_cast<double>(limits.mesh_bytes)) {
    return failure(ErrorCode::memory_bound,
                   "the mesh takes " + std::to_string(static_cast<uint64_t>(bytes / 1048576)) +
                       " MiB, more than the " + std::to_string(limits.mesh_bytes / 1048576) + " MiB allowed");
  }
  return {};
}

}  // namespace

bool is_wanted(const DecodeOptions& options, const std::string& name) {
  return !options.arrays ||
         std::find(options.arrays->begin(), options.arrays->end(), name) != options.arrays->end();
}

double memory_of(const Description& description) {
  // 4 bytes for each corner and 8 for each cell's offset, as a Mesh takes them where cells differ.
  auto bytes = static_cast<double>(description.corners) * 4 + static_cast<double>(description.cells()) * 8;
  const auto add = [&](const ArrayDescription& array) {
    // Welded arrays are there twice for a moment: as coded and as split.
    const bool split = description.welded && (array.by_twin || array.domain == Domain::point);
    const uint64_t tuples = description.tuples(array) + (split ? description.split_points : 0);
    bytes += static_cast<double>(tuples) * static_cast<double>(array.components) *
             static_cast<double>(size_of(array.type));
  };
  add(description.positions);
  for (const ArrayDescription& array : description.arrays) add(array);
  return bytes;
}

uint64_t Description::cells() const {
  uint64_t count = 0;
  for (const CodedBlock& block : blocks) count += block.shape.cells;
  return count;
}

uint64_t Description::tuples(const ArrayDescription& array) const {
  switch (array.domain) {
    case Domain::point:
      return points;
    case Domain::corner:
      return corners;
    case Domain::cell:
      return cells();
    case Domain::mesh:
      break;
  }
  return array.mesh_tuples;
}

std::vector<BlockShape> Description::shapes() const {
  std::vector<BlockShape> shapes;
  for (const CodedBlock& block : blocks) shapes.push_back(block.shape);
  return shapes;
}

std::vector<uint32_t> Description::block_numbers() const {
  std::vector<uint32_t> numbers;
  for (const CodedBlock& block : blocks) numbers.push_back(block.number);
  return numbers;
}

// As PlainReader counts them: short names need no memory of their own.
uint64_t Description::block_memory() const {
  const size_t short_name = std::string().capacity();
  uint64_t bytes = blocks.capacity() * sizeof(CodedBlock);
  for (const CodedBlock& block : blocks) {
    bytes += block.types.capacity() * sizeof(block.types[0]);
    if (block.name.size() > short_name) bytes += block.name.size() + 1;
  }
  return bytes;
}

// Field by field: a copy of all parts and blocks for each of them would take their square.
Description Description::of_part(size_t part) const {
  Description description;
  description.effort = effort;
  description.welded = welded;
  description.split_points = split_points;
  description.positions = positions;
  description.arrays = arrays;
  description.metadata = metadata;
  description.provenance = provenance;
  description.memory = memory;
  description.take_part(*this, part);
  if (part == 0) return description;
  for (ArrayDescription& array : description.arrays) array.mesh_tuples = 0;
  return description;
}

void Description::take_part(const Description& whole, size_t part) {
  points = whole.parts[part].points;
  corners = whole.parts[part].corners;
  blocks = blocks_of_part(whole.blocks, whole.parts[part].cells);
}

std::vector<CodedBlock> blocks_of_part(const std::vector<CodedBlock>& whole,
                                       const std::vector<BlockCells>& cells) {
  std::vector<CodedBlock> blocks;
  blocks.reserve(cells.size());
  for (const BlockCells& here : cells) {
    blocks.push_back({{}, {whole[here.block].shape.type, here.cells}, {}, here.block});
  }
  return blocks;
}

Result<std::vector<std::byte>> encode_description(const Description& description) {
  PlainWriter writer;
  visit(writer, description);
  if (writer.out().size() > most_plain_bytes) {
    return failure(ErrorCode::unsupported,
                   "names, labels and metadata take more than the 16 MiB a file holds");
  }
  const Bytes plain = writer.out().bytes();
  const std::vector<std::byte> coded = encode_bytes(plain);
  // Coded to as many bytes it could not be told from a plain one: the reader compares lengths.
  const bool as_it_is = coded.size() >= plain.size() ||
                        (effort_of(description.effort).plain_description && plain.size() <= short_bytes);
  ByteWriter out;
  out.put_count(plain.size());
  out.put_bytes(as_it_is ? plain : Bytes(coded));
  return out.take();
}

Result<Description> decode_description(Bytes bytes, const Limits& limits) {
  ByteReader in(bytes);
  const uint64_t size = in.get_count();
  const uint64_t most_memory = plain_memory(limits);
  if (size > std::min(most_plain_bytes, most_memory))
    return failure(ErrorCode::memory_bound, texts_too_large);
  const Bytes coded = in.get_bytes(in.remaining());
  // As many bytes as there should be are these themselves.
  const std::vector<std::byte> plain =
      coded.size() == size ? std::vector(coded.begin(), coded.end()) : decode_bytes(coded, size);
  Description description;
  PlainReader reader(plain, most_memory - size);
  visit(reader, description);
  if (reader.is_over()) return failure(ErrorCode::memory_bound, texts_too_large);
  // What the blocks take is known apart, as parts have some of them.
  description.memory = reader.memory() - std::min(reader.memory(), description.block_memory());
  bool sensible = reader.ok() && reader.at_end() && plain.size() == size &&
                  description.positions.components == 3 && description.positions.domain == Domain::point &&
                  description.cells() < none && parts_fit(description) && twins_fit(description);
  for (const CodedBlock& block : description.blocks) sensible = sensible && types_fit(block);
  for (const ArrayDescription& array : description.arrays) sensible = sensible && array.components > 0;
  if (!sensible) return failure(ErrorCode::corrupt, "the description of the mesh is damaged");
  MAILLE_CHECK(check_size(description, limits));
  return description;
}

}  // namespace maille
