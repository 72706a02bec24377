// Binary .msh files of version 2.2 written in parts: a cell takes 24 bytes and 4 for each node, so with the
// counts known every section has its place before the first value comes.
#include <algorithm>
#include <map>

#include "base/bytes.h"
#include "base/region_file.h"
#include "base/result.h"
#include "io/buffered_writer.h"
#include "io/gmsh/gmsh.h"
#include "io/mesh_sources.h"

namespace maille {
namespace {

// In binary version 2.2 a node is its number (4 bytes) and three doubles. An element is written with a head
// of its own: type, 1, number of tags, its number, and two tags.
constexpr uint64_t node_bytes = 28;
constexpr uint64_t element_bytes = 24;  ///< and 4 for each node

class GmshSink final : public MeshSink {
 public:
  GmshSink(const std::string& path, const MeshDescription& description)
      : file_(path), description_(description) {}

  Result<> open();
  Result<> write_points(uint64_t first, Bytes positions) override;
  Result<> write_cells(const CellPiece& cells) override;
  Result<> write_array(size_t array, uint64_t first, Bytes tuples) override;
  Result<> commit() override;

 private:
  /// Where the values of an array go; tags go into the elements.
  struct Column {
    uint64_t at = 0;
    uint32_t components = 0;  ///< as Gmsh has them: 1, 3 or 9; 0: tags
  };
  // The tags of the stretch of cells that is written next. The caller writes the tag arrays of a stretch
  // before its cells, since tags stand inside the elements.
  struct Tags {
    uint64_t first = 0;
    std::vector<int64_t> values;
    int64_t of(uint64_t cell) const { return values.empty() ? 0 : values[cell - first]; }
  };

  Result<> check() const;
  Result<> choose_columns();
  Tags* tags_of(const Array& array);
  void put_names(std::string& head);
  std::string head_of(const Array& array, uint32_t components) const;
  Result<> put_text(uint64_t at, const std::string& text) {
    return file_.write_at(at, std::as_bytes(std::span(text.data(), text.size())));
  }
  Result<> write_values(const Array& array, const Column& column, uint64_t first, Bytes tuples);
  /// Must be asked for cells in rising order, as the block moves along with them.
  int32_t physical_of(uint64_t cell, CellType type);
  tl::unexpected<Error> unsupported(const std::string& what) const {
    return failure(ErrorCode::unsupported, file_.path() + ": " + what);
  }

  RegionFile file_;
  MeshDescription description_;
  std::map<std::pair<int, std::string>, int32_t> groups_;
  uint64_t nodes_at_ = 0, next_element_ = 0, elements_end_ = 0;
  std::vector<Column> columns_;
  Tags physical_, geometrical_;
  uint64_t cells_ = 0;
  /// The block that physical_of() is at is the one before `block_`, and `block_end_` is its end in cells.
  size_t block_ = 0;
  uint64_t block_end_ = 0;
};

GmshSink::Tags* GmshSink::tags_of(const Array& array) {
  if (array.domain != Domain::cell || array.components != 1 || is_float(array.type)) return nullptr;
  if (array.name == gmsh_physical_name) return &physical_;
  return array.name == gmsh_geometrical_name ? &geometrical_ : nullptr;
}

/// A group for each name of a block, in all dimensions its cells could have: what a mixed block holds is not
/// known before its cells come, so a group may stay empty. Groups of the file it came from keep their
/// numbers.
void GmshSink::put_names(std::string& head) {
  std::map<std::pair<int, int32_t>, std::string> names;
  int32_t last = 0;
  for (const auto& [key, name] : description_.metadata) {
    int dimension = 0, tag = 0;
    if (!key.starts_with(gmsh_names_prefix)) continue;
    const char* const rest = key.c_str() + std::string_view(gmsh_names_prefix).size();
    if (std::sscanf(rest, "%d.%d", &dimension, &tag) != 2) continue;
    names[{dimension, tag}] = name;
    groups_.try_emplace({dimension, name}, tag);
    last = std::max(last, tag);
  }
  for (const MeshDescription::Block& block : description_.blocks) {
    if (block.name.empty()) continue;
    for (int dimension = 0; dimension < 4; ++dimension) {
      if (block.type != CellType::mixed && dimension != dimension_of(block.type)) continue;
      if (groups_.try_emplace({dimension, block.name}, last + 1).second)
        names[{dimension, ++last}] = block.name;
    }
  }
  if (names.empty()) return;
  head += "$PhysicalNames\n" + std::to_string(names.size()) + "\n";
  for (const auto& [group, name] : names) {
    const std::string numbers = std::to_string(group.first) + " " + std::to_string(group.second);
    head += numbers + " \"" + gmsh_name(name) + "\"\n";
  }
  head += "$EndPhysicalNames\n";
}

std::string GmshSink::head_of(const Array& array, uint32_t components) const {
  return std::string(array.domain == Domain::point ? "$NodeData" : "$ElementData") + "\n1\n\"" +
         gmsh_name(array.name) + "\"\n1\n0\n3\n0\n" + std::to_string(components) + "\n" +
         std::to_string(description_.count_of(array)) + "\n";
}

const char* end_of(const Array& array) {
  return array.domain == Domain::point ? "\n$EndNodeData\n" : "\n$EndElementData\n";
}

Result<> GmshSink::choose_columns() {
  // Values follow the elements, one section for each array; with the counts known every section has a fixed
  // length.
  uint64_t at = elements_end_ + std::string_view("\n$EndElements\n").size();
  for (const Array& array : description_.arrays) {
    Column& column = columns_.emplace_back();
    if (tags_of(array) != nullptr) continue;
    if (array.components > 9)
      return unsupported("array \"" + array.name + "\" has more than nine components");
    // Gmsh knows values of 1, 3 and 9 numbers; what is missing is filled with zeros.
    column.components = array.components == 1 ? 1 : array.components <= 3 ? 3 : 9;
    const std::string head = head_of(array, column.components);
    column.at = at + head.size();
    MAILLE_CHECK(put_text(at, head));
    at = column.at + description_.count_of(array) * (4 + 8 * uint64_t{column.components});
    MAILLE_CHECK(put_text(at, end_of(array)));
    at += std::string_view(end_of(array)).size();
  }
  return {};
}

/// What needs a look at all of the mesh, or a note, is for the writer of whole meshes.
Result<> GmshSink::check() const {
  const auto has = [&](const char* name) {
    return std::any_of(description_.arrays.begin(), description_.arrays.end(),
                       [&](const Array& array) { return array.name == name; });
  };
  if (has(gmsh_node_name) || has(gmsh_element_name) || !description_.mesh_arrays.empty())
    return unsupported("numbers of nodes and elements, and arrays of the mesh, cannot be written in parts");
  // Mixed blocks: where it is known what all cells are, and Gmsh has them all.
  const auto& types = description_.types;
  const bool known = !types.empty() && std::all_of(types.begin(), types.end(), [](const auto& each) {
    return gmsh_type(each.first, nodes_of(each.first)) != nullptr;
  });
  for (const MeshDescription::Block& block : description_.blocks) {
    if (known || block.cells == 0) continue;
    if (gmsh_type(block.type, nodes_of(block.type)) == nullptr)
      return unsupported("blocks of type " + std::string(name_of(block.type)) +
                         " cannot be written in parts");
  }
  return {};
}

Result<> GmshSink::open() {
  MAILLE_CHECK(check());
  // Larger meshes are for the writer of whole meshes, which has version 4.1.
  if (description_.points > INT32_MAX || description_.cells > INT32_MAX)
    return unsupported("version 2.2 of the format has numbers of 31 bits");
  MAILLE_CHECK(file_.open());
  std::string head = "$MeshFormat\n2.2 1 8\n";
  const int32_t one = 1;
  head.append(reinterpret_cast<const char*>(&one), sizeof one);
  head += "\n$EndMeshFormat\n";
  put_names(head);
  head += "$Nodes\n" + std::to_string(description_.points) + "\n";
  nodes_at_ = head.size();
  MAILLE_CHECK(put_text(0, head));
  const std::string between = "\n$EndNodes\n$Elements\n" + std::to_string(description_.cells) + "\n";
  const uint64_t at = nodes_at_ + node_bytes * description_.points;
  MAILLE_CHECK(put_text(at, between));
  next_element_ = at + between.size();
  // The description has to know the number of corners for this; commit() finds out when it was wrong.
  elements_end_ = next_element_ + element_bytes * description_.cells + 4 * description_.corners;
  MAILLE_CHECK(put_text(elements_end_, "\n$EndElements\n"));
  return choose_columns();
}

Result<> GmshSink::write_points(uint64_t first, Bytes positions) {
  const size_t size = size_of(description_.point_type);
  const uint64_t count = positions.size() / (3 * size);
  if (count > description_.points || first > description_.points - count)
    return failure(ErrorCode::usage, file_.path() + ": more points than the mesh was described to have");
  ByteWriter out;
  for (uint64_t i = 0; i < count; ++i) {
    out.put(static_cast<int32_t>(first + i + 1));
    for (size_t k = 0; k < 3; ++k) {
      out.put(with_type(description_.point_type, [&](auto zero) {
        return static_cast<double>(load<decltype(zero)>(positions.data() + (3 * i + k) * size));
      }));
    }
  }
  return file_.write_at(nodes_at_ + node_bytes * first, out.bytes());
}

/// The array's, if there is one, else that of the block's name.
int32_t GmshSink::physical_of(uint64_t cell, CellType type) {
  while (block_ < description_.blocks.size() && block_end_ <= cell)
    block_end_ += description_.blocks[block_++].cells;
  if (!physical_.values.empty()) return static_cast<int32_t>(physical_.of(cell));
  const auto found =
      groups_.find({dimension_of(type), block_ == 0 ? "" : description_.blocks[block_ - 1].name});
  return found == groups_.end() ? 0 : found->second;
}

Result<> GmshSink::write_cells(const CellPiece& cells) {
  ByteWriter out;
  for (uint64_t i = 0; i < cells.size(); ++i, ++cells_) {
    const auto nodes =
        std::span(cells.connectivity).subspan(cells.offsets[i], cells.offsets[i + 1] - cells.offsets[i]);
    const GmshType* const type = gmsh_type(static_cast<CellType>(cells.types[i]), nodes.size());
    if (type == nullptr) {
      return unsupported("Gmsh has no cells of type " +
                         std::string(name_of(static_cast<CellType>(cells.types[i]))) + "; write .vtu");
    }
    const int32_t physical = physical_of(cells_, type->type);
    for (const int32_t value : {type->number, 1, 2, static_cast<int32_t>(cells_ + 1), physical,
                                static_cast<int32_t>(geometrical_.of(cells_))})
      out.put(value);
    // Writing goes the other way than reading: node k of the cell is put where `order` says it was read from.
    int32_t placed[27] = {};
    for (unsigned k = 0; k < type->nodes; ++k)
      placed[type->order.empty() ? k : type->order[k]] = static_cast<int32_t>(nodes[k] + 1);
    for (unsigned k = 0; k < type->nodes; ++k) out.put(placed[k]);
  }
  if (out.bytes().size() > elements_end_ - next_element_)
    return failure(ErrorCode::usage, file_.path() + ": more cells than the mesh was described to have");
  MAILLE_CHECK(file_.write_at(next_element_, out.bytes()));
  next_element_ += out.bytes().size();
  return {};
}

Result<> GmshSink::write_values(const Array& array, const Column& column, uint64_t first, Bytes tuples) {
  const size_t size = size_of(array.type), tuple = array.tuple_size();
  ByteWriter out;
  for (uint64_t i = 0; i < tuples.size() / tuple; ++i) {
    out.put(static_cast<int32_t>(first + i + 1));
    for (uint32_t k = 0; k < column.components; ++k) {
      out.put(k >= array.components ? 0.0 : with_type(array.type, [&](auto zero) {
        return static_cast<double>(load<decltype(zero)>(tuples.data() + i * tuple + k * size));
      }));
    }
  }
  return file_.write_at(column.at + first * (4 + 8 * uint64_t{column.components}), out.bytes());
}

// Tags wait in memory for the cells they belong to; other values go to their place in the file at once.
Result<> GmshSink::write_array(size_t array, uint64_t first, Bytes tuples) {
  const Array& described = description_.arrays[array];
  const uint64_t count = tuples.size() / described.tuple_size(), all = description_.count_of(described);
  if (count > all || first > all - count)
    return failure(ErrorCode::usage, file_.path() + ": more values than the mesh was described to have");
  Tags* const tags = tags_of(described);
  if (tags == nullptr) return write_values(described, columns_[array], first, tuples);
  tags->first = first;
  tags->values.clear();
  with_type(described.type, [&](auto zero) {
    for (uint64_t i = 0; i < count; ++i)
      tags->values.push_back(static_cast<int64_t>(load<decltype(zero)>(tuples.data() + i * sizeof(zero))));
  });
  return {};
}

Result<> GmshSink::commit() {
  if (cells_ != description_.cells || next_element_ != elements_end_)
    return failure(ErrorCode::usage, file_.path() + ": not as many cells were written as described");
  return file_.commit();
}

}  // namespace

Result<std::unique_ptr<MeshSink>> gmsh_sink(const std::string& path, const MeshDescription& description) {
  auto sink = std::make_unique<GmshSink>(path, description);
  MAILLE_CHECK(sink->open());
  return std::unique_ptr<MeshSink>(std::move(sink));
}

}  // namespace maille
