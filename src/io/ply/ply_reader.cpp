#include <algorithm>
#include <map>
#include "base/bytes.h"
#include "io/budget.h"
#include "io/buffered_writer.h"
#include "io/format.h"
#include "io/ply/ply_table.h"
#include "io/ply/ply_writer.h"

namespace maille {
namespace {

/// Reads a whole file: one table for each element in the order of the header, then cells from faces, strips
/// and edges together. Arrays stay in lists of their own until all elements are read, as a cell array has to
/// cover the cells of all of them. Whatever the model of meshes has no place for is remembered as metadata
/// "ply.", from which the writer makes the same header again.
class PlyReader {
 public:
  PlyReader(const Source& source, Bytes bytes, const ReadOptions& options)
      : bytes_(bytes),
        watch_(source, bytes.size(), options),
        budget_(source.name(), bytes.size(), options.limits) {}

  Result<ReadResult> read() {
    TextScanner scanner(std::string_view(reinterpret_cast<const char*>(bytes_.data()), bytes_.size()));
    scanner.skip_byte_order_mark();
    header_ = MAILLE_TRY(parse_ply_header(scanner, watch_.name()));
    take_comments();
    if (const PlyElement* vertex = element("vertex")) point_count_ = vertex->count;
    if (point_count_ > max_points) {
      return failure(ErrorCode::unsupported, watch_.name() + ": " + std::to_string(point_count_) +
                                                 " vertices are more than the 2^32 - 2 a mesh can have");
    }
    uint64_t at = scanner.position();
    for (const PlyElement& element : header_.elements) {
      PlyTable table = MAILLE_TRY(prepare(element));
      // What stands beside the mesh counts, too: faces and their arrays move into it only at the end.
      const uint64_t used = size_in_memory(mesh()) + bytes_read_;
      if (header_.encoding == PlyEncoding::ascii) {
        MAILLE_CHECK(table.read_text(scanner, watch_, used));
        too_small_ += table.too_small;
      } else {
        MAILLE_CHECK(
            table.read_binary(bytes_, at, header_.encoding == PlyEncoding::big_endian, watch_, used));
      }
      MAILLE_CHECK(take(element, std::move(table)));
    }
    note_trailing(scanner, at);
    if (too_small_ != 0) {
      result_.notes.push_back(
          counted(too_small_, "number") +
          " too small for the float that the header declares: zero, or with fewer digits");
    }
    MAILLE_CHECK(assemble_cells());
    attach_labels();
    MAILLE_CHECK(watch_.at(bytes_.size(), size_in_memory(mesh())));
    return std::move(result_);
  }

 private:
  Mesh& mesh() { return result_.mesh; }
  const PlyElement* element(std::string_view name) const {
    for (const PlyElement& element : header_.elements) {
      if (element.name == name) return &element;
    }
    return nullptr;
  }
  void remember(const std::string& key, std::string value) {
    mesh().metadata.emplace_back(key, std::move(value));
  }

  static bool holds_faces(const PlyElement& element) {
    return element.name == "face" && find_vertex_indices(element).has_value();
  }
  static bool is_whole(const PlyElement& element, std::string_view name) {
    const auto at = element.find(name);
    return at && !element.properties[*at].list && !is_float(element.properties[*at].type);
  }
  static bool holds_edges(const PlyElement& element) {
    return element.name == "edge" && is_whole(element, "vertex1") && is_whole(element, "vertex2");
  }
  static bool holds_strips(const PlyElement& element) {
    return element.name == "tristrips" && find_vertex_indices(element).has_value();
  }

  /// Sorts the comments into arrays' descriptions, labels, metadata of other formats, and what people wrote.
  void take_comments() {
    for (const auto& [keyword, text] : header_.comments) {
      if (keyword == "comment") {
        if (auto hint = parse_ply_hint(text)) {
          hints_.push_back(std::move(*hint));
          continue;
        }
        if (auto label = parse_ply_label(text)) {
          labels_[{label->domain, label->array}].push_back(std::move(label->text));
          continue;
        }
        if (auto pair = parse_ply_metadata(text)) {
          mesh().metadata.push_back(std::move(*pair));
          continue;
        }
      }
      remember(keyword, text);
    }
  }

  Result<PlyTable> prepare(const PlyElement& element) {
    std::vector<std::string_view> taken;
    std::optional<size_t> indices;
    std::vector<PlyColumn> first;
    if (element.name == "vertex") {
      taken = {"x", "y", "z"};
      MAILLE_CHECK(plan_positions(element, first));
    } else if (holds_faces(element)) {
      indices = find_vertex_indices(element);
      taken = {element.properties[*indices].name};
      remember_indices(element.properties[*indices]);
    } else if (holds_edges(element)) {
      taken = {"vertex1", "vertex2"};
      for (const std::string_view name : taken) {
        const size_t at = *element.find(name);
        first.push_back({std::string(name), element.properties[at].type, 1, Role::none, false, {at}, false});
      }
    }
    auto columns = plan_ply_columns(element, hints_, taken);
    columns.insert(columns.begin(), first.begin(), first.end());
    return PlyTable(element, std::move(columns), indices, point_count_);
  }

  /// One column when x, y and z have one type, otherwise three, which take_positions() joins as f64.
  Result<> plan_positions(const PlyElement& element, std::vector<PlyColumn>& columns) const {
    std::vector<size_t> at;
    for (const char* name : {"x", "y", "z"}) {
      const auto found = element.find(name);
      if (!found || element.properties[*found].list) {
        return failure(ErrorCode::malformed_input,
                       watch_.name() + ": element vertex has no property \"" + name + "\"");
      }
      at.push_back(*found);
    }
    const auto type = [&](size_t i) { return element.properties[at[i]].type; };
    if (type(0) == type(1) && type(0) == type(2)) {
      columns.push_back({"position", type(0), 3, Role::none, false, at, false});
    } else {
      for (size_t i = 0; i < 3; ++i)
        columns.push_back({"position", type(i), 1, Role::none, false, {at[i]}, false});
    }
    return {};
  }

  void remember_indices(const PlyProperty& property) {
    // What the writer would choose by itself need not be remembered.
    const std::string text = std::string(ply_name_of(property.count_type)) + " " +
                             ply_name_of(property.type) + " " + property.name;
    if (text != "uchar int vertex_indices") remember("ply.indices", text);
  }

  Result<> take(const PlyElement& element, PlyTable table) {
    if (element.name == "vertex") {
      take_positions(table);
      add_arrays(element, table, Domain::point, mesh().arrays);
    } else if (holds_faces(element)) {
      faces_ = std::move(table.cells);
      add_arrays(element, table, Domain::cell, face_arrays_);
    } else if (holds_edges(element)) {
      MAILLE_CHECK(take_edges(table));
      add_arrays(element, table, Domain::cell, edge_arrays_);
    } else if (holds_strips(element)) {
      MAILLE_CHECK(take_strips(element, table));
    } else {
      // An element of arrays that hints describe was written by maille for arrays of the mesh; it comes back
      // by itself.
      const bool own =
          !table.values.empty() && std::all_of(table.values.begin(), table.values.end(),
                                               [](const PlyValues& values) { return values.column.hinted; });
      if (!own) remember_element(element);
      add_arrays(element, table, Domain::mesh, mesh().arrays);
    }
    bytes_read_ = faces_.bytes() + edges_.size() * sizeof(uint32_t);
    for (const auto* arrays : {&face_arrays_, &edge_arrays_}) {
      for (const Array& array : *arrays) bytes_read_ += array.bytes.size();
    }
    return {};
  }

  void remember_element(const PlyElement& element) {
    remember("ply.element", element.name + " " + std::to_string(element.count));
    const auto ordered = [](const auto& pair) { return pair.first == "ply.order"; };
    if (std::any_of(mesh().metadata.begin(), mesh().metadata.end(), ordered)) return;
    std::string order;
    for (const PlyElement& each : header_.elements) order += (order.empty() ? "" : " ") + each.name;
    remember("ply.order", order);
  }

  void take_positions(PlyTable& table) {
    if (table.values.front().column.components == 3) {
      mesh().points.type = table.values.front().column.type;
      mesh().points.bytes = std::move(table.values.front().bytes);
      table.values.erase(table.values.begin());
      return;
    }
    mesh().points = make_array("position", Domain::point, Scalar::f64, 3);
    mesh().points.resize(point_count_);
    const auto to = mesh().points.values<double>();
    for (size_t i = 0; i < 3; ++i) {
      const PlyValues& column = table.values[i];
      with_type(column.column.type, [&](auto zero) {
        using T = decltype(zero);
        for (uint64_t p = 0; p < point_count_; ++p) {
          to[p * 3 + i] = static_cast<double>(load<T>(column.bytes.data() + p * sizeof(T)));
        }
      });
    }
    table.values.erase(table.values.begin(), table.values.begin() + 3);
    result_.notes.push_back("x, y and z have different types; they were all made f64");
  }

  static int64_t whole_at(const PlyValues& column, uint64_t row) {
    return with_type(column.column.type, [&](auto zero) {
      using T = decltype(zero);
      return static_cast<int64_t>(load<T>(column.bytes.data() + row * sizeof(T)));
    });
  }

  Result<> take_edges(PlyTable& table) {
    const uint64_t count = table.values[0].bytes.size() / size_of(table.values[0].column.type);
    for (uint64_t edge = 0; edge < count; ++edge) {
      for (size_t end = 0; end < 2; ++end) {
        const int64_t index = whole_at(table.values[end], edge);
        if (index < 0 || static_cast<uint64_t>(index) >= point_count_) return bad_vertex("edge", edge, index);
        edges_.push_back(static_cast<uint32_t>(index));
      }
    }
    table.values.erase(table.values.begin(), table.values.begin() + 2);
    return {};
  }

  tl::unexpected<Error> bad_vertex(const std::string& element, uint64_t row, int64_t index) const {
    return failure(ErrorCode::malformed_input,
                   watch_.name() + ": " + element + " " + std::to_string(row) + ": vertex " +
                       std::to_string(index) + " does not exist, there are " + std::to_string(point_count_));
  }

  /// Strips become triangles; a negative number ends a strip within a list. A triangle that names a vertex
  /// twice only joins two strips.
  Result<> take_strips(const PlyElement& element, const PlyTable& table) {
    uint64_t joints = 0;
    uint64_t made = 0;
    for (const PlyValues& column : table.values) {
      if (column.column.properties.front() != *find_vertex_indices(element)) {
        result_.notes.push_back("property \"" + column.column.name +
                                "\" of the triangle strips was left out");
        continue;
      }
      for (uint64_t list = 0; list < column.lengths.count(); ++list) {
        uint64_t in_strip = 0;
        int64_t last[3] = {-1, -1, -1};
        for (uint64_t i = 0; i < column.lengths.length(list); ++i) {
          const int64_t index = whole_at(column, column.lengths.begin(list) + i);
          in_strip = index < 0 ? 0 : in_strip + 1;
          if (index < 0) continue;
          if (static_cast<uint64_t>(index) >= point_count_) return bad_vertex("tristrips", list, index);
          last[0] = last[1];
          last[1] = last[2];
          last[2] = index;
          if (in_strip < 3) continue;
          if (last[0] == last[1] || last[1] == last[2] || last[0] == last[2]) {
            ++joints;
            continue;
          }
          // Every second triangle of a strip is turned, so its first two corners change places.
          const bool odd = in_strip % 2 == 0;
          for (const unsigned corner : {odd ? 1u : 0u, odd ? 0u : 1u, 2u}) {
            strip_nodes_.push_back(static_cast<uint32_t>(last[corner]));
          }
          ++made;
        }
      }
    }
    result_.notes.push_back("triangle strips were turned into " + counted(made, "triangle") +
                            (joints == 0 ? ""
                                         : "; " + counted(joints, "triangle") +
                                               " without area that only join "
                                               "strips left out"));
    return {};
  }

  /// Adds the arrays made from an element's columns.
  void add_arrays(const PlyElement& element, PlyTable& table, Domain domain, std::vector<Array>& arrays) {
    const std::string prefix = domain == Domain::mesh ? element.name + "." : "";
    for (PlyValues& values : table.values) {
      const PlyColumn& column = values.column;
      if (column.list) {
        if (domain == Domain::cell && add_corner_array(element, values)) continue;
        add_list(element, values, domain, prefix, arrays);
        continue;
      }
      Array array = make_array((column.hinted ? "" : prefix) + column.name, domain, column.type,
                               column.components, column.role);
      array.bytes = std::move(values.bytes);
      if (domain == Domain::point && is_exact_position(column)) {
        mesh().points = std::move(array);
        continue;
      }
      remember_group(element, column);
      arrays.push_back(std::move(array));
    }
  }

  /// 64-bit positions stand beside x, y and z, which are rounded to double for other programs. They replace
  /// them here.
  static bool is_exact_position(const PlyColumn& column) {
    return column.hinted && column.name == "position" && column.components == 3 &&
           (column.type == Scalar::i64 || column.type == Scalar::u64);
  }

  /// The names of a texture coordinate's properties, when they are not "s" and "t".
  void remember_group(const PlyElement& element, const PlyColumn& column) {
    const std::string& first = element.properties[column.properties.front()].name;
    if (column.role == Role::texture_coordinate && (first == "u" || first == "texture_u")) {
      remember("ply.texcoord",
               element.name + " " + first + " " + element.properties[column.properties.back()].name);
    }
  }

  /// A list with a fixed number of values per corner of each face: texture coordinates, or what a hint says.
  bool add_corner_array(const PlyElement& element, PlyValues& values) {
    const PlyProperty& property = element.properties[values.column.properties.front()];
    Array array = make_array("texcoord", Domain::corner, property.type, 2, Role::texture_coordinate);
    uint64_t per_corner = 2;
    const auto hint = std::find_if(hints_.begin(), hints_.end(), [&](const PlyHint& h) {
      return h.element == "corner" && h.properties.front() == property.name;
    });
    if (hint != hints_.end()) {
      // A hint of 64-bit integers over a list of 32-bit ones: two numbers for each component.
      const bool halves = size_of(hint->type) == 2 * size_of(property.type) && !is_float(hint->type);
      if (!halves && hint->type != property.type) return false;
      per_corner = uint64_t{hint->components} * (halves ? 2 : 1);
      array = make_array(hint->name, Domain::corner, hint->type, hint->components, hint->role);
    } else if (property.name != "texcoord" || !is_float(property.type)) {
      return false;
    }
    if (values.lengths.count() != faces_.count()) return false;
    for (uint64_t face = 0; face < faces_.count(); ++face) {
      if (values.lengths.length(face) != faces_.lengths.length(face) * per_corner) return false;
    }
    if (property.count_type != Scalar::u8) {
      remember("ply.list", "corner " + to_word(array.name) + " " + ply_name_of(property.count_type) + " " +
                               ply_name_of(property.type));
    }
    array.bytes = std::move(values.bytes);
    face_arrays_.push_back(std::move(array));
    return true;
  }

  void add_list(const PlyElement& element, PlyValues& values, Domain domain, const std::string& prefix,
                std::vector<Array>& arrays) {
    const PlyProperty& property = element.properties[values.column.properties.front()];
    const std::string name = prefix + values.column.name;
    const Lengths& lengths = values.lengths;
    remember("ply.list", element.name + " " + to_word(name) + " " + ply_name_of(property.count_type) + " " +
                             ply_name_of(property.type));
    if (lengths.uniform() && lengths.length(0) > 0 && lengths.length(0) <= 0xffffffffu) {
      Array array = make_array(name, domain, property.type, static_cast<uint32_t>(lengths.length(0)));
      array.bytes = std::move(values.bytes);
      arrays.push_back(std::move(array));
      return;
    }
    Array counts = make_array(name + ".count", domain, property.count_type, 1);
    counts.resize(lengths.count());
    uint64_t longest = 0;
    const size_t count_size = size_of(property.count_type);
    for (uint64_t i = 0; i < lengths.count(); ++i) {
      const uint64_t length = lengths.length(i);
      longest = std::max(longest, length);
      // Little-endian: the low bytes come first, and the count fits its type, as it was read from it.
      std::memcpy(counts.bytes.data() + i * count_size, &length, count_size);
    }
    arrays.push_back(std::move(counts));
    // Padded lists follow their element when the order changes. Padding may cost up to four times the values
    // (chosen, not swept: most lists are nearly of one length), and a little more for small files.
    if (longest != 0 && domain != Domain::mesh && longest * lengths.count() <= 4 * lengths.total() + 64) {
      arrays.push_back(padded(name, domain, property.type, values, longest));
    } else if (longest != 0) {
      Array array = make_array(name, Domain::mesh, property.type, 1);
      array.bytes = std::move(values.bytes);
      mesh_arrays_.push_back(std::move(array));
      if (domain != Domain::mesh) {
        result_.notes.push_back("the lists \"" + name +
                                "\" differ much in length; their values are kept in file order");
      }
    }
  }

  static Array padded(const std::string& name, Domain domain, Scalar type, const PlyValues& values,
                      uint64_t longest) {
    Array array = make_array(name, domain, type, static_cast<uint32_t>(longest));
    array.resize(values.lengths.count());
    const size_t size = size_of(type);
    for (uint64_t i = 0; i < values.lengths.count(); ++i) {
      const size_t length = static_cast<size_t>(values.lengths.length(i)) * size;
      if (length == 0) continue;
      std::memcpy(array.bytes.data() + i * longest * size,
                  values.bytes.data() + values.lengths.begin(i) * size, length);
    }
    return array;
  }

  void note_trailing(TextScanner& scanner, uint64_t at) {
    if (header_.encoding == PlyEncoding::ascii) {
      scanner.skip_white();
      at = scanner.position();
    }
    if (at < bytes_.size()) {
      result_.notes.push_back(counted(bytes_.size() - at, "byte") + " behind the last element left out");
    }
  }

  /// Faces, then the triangles of strips, then edges, in blocks, with the arrays of all of them.
  Result<> assemble_cells() {
    faces_.nodes.insert(faces_.nodes.end(), strip_nodes_.begin(), strip_nodes_.end());
    faces_.lengths.add_run(strip_nodes_.size() / 3, 3);
    const uint64_t face_count = faces_.count();
    const uint64_t edge_count = edges_.size() / 2;
    if (face_count != 0) mesh().blocks.push_back(faces_.take_faces());
    if (edge_count != 0) {
      CellBlock block;
      block.type = CellType::line;
      block.connectivity = std::move(edges_);
      mesh().blocks.push_back(std::move(block));
    }
    both_ = face_count != 0 && edge_count != 0;
    MAILLE_CHECK(pad_face_arrays());
    MAILLE_CHECK(merge_edge_arrays(face_count));
    for (auto* arrays : {&face_arrays_, &edge_arrays_, &mesh_arrays_}) {
      std::move(arrays->begin(), arrays->end(), std::back_inserter(mesh().arrays));
    }
    return {};
  }

  /// Arrays of the face element get zeros for the triangles of strips and the edges.
  Result<> pad_face_arrays() {
    for (Array& array : face_arrays_) {
      const uint64_t count = mesh().count_of(array.domain);
      MAILLE_CHECK(budget_.take(count, array.tuple_size()));
      array.resize(count);
      if (both_ && array.domain == Domain::cell && find_like(edge_arrays_, array) == nullptr) {
        remember("ply.only", "face " + to_word(array.name));
      }
    }
    return {};
  }

  /// Arrays of the edge element continue the faces' array of the same description, or get zeros for the
  /// faces.
  Result<> merge_edge_arrays(uint64_t face_count) {
    for (Array& array : edge_arrays_) {
      const uint64_t offset = face_count * array.tuple_size();
      if (Array* const like = find_like(face_arrays_, array)) {
        std::copy(array.bytes.begin(), array.bytes.end(),
                  like->bytes.begin() + static_cast<ptrdiff_t>(offset));
        array.components = 0;
        continue;
      }
      const auto taken = [&](const Array& a) { return a.domain == Domain::cell && a.name == array.name; };
      while (std::any_of(face_arrays_.begin(), face_arrays_.end(), taken)) array.name += "_edge";
      if (both_) remember("ply.only", "edge " + to_word(array.name));
      MAILLE_CHECK(budget_.take(mesh().cell_count(), array.tuple_size()));
      array.bytes.insert(array.bytes.begin(), offset, std::byte{0});
    }
    std::erase_if(edge_arrays_, [](const Array& array) { return array.components == 0; });
    return {};
  }

  static Array* find_like(std::vector<Array>& arrays, const Array& like) {
    for (Array& array : arrays) {
      if (array.domain == like.domain && array.name == like.name && array.type == like.type &&
          array.components == like.components)
        return &array;
    }
    return nullptr;
  }

  void attach_labels() {
    for (Array& array : mesh().arrays) {
      const auto labels = labels_.find({array.domain, array.name});
      if (array.role == Role::label && labels != labels_.end()) array.labels = labels->second;
    }
  }

  Bytes bytes_;
  Watch watch_;
  // For arrays that grow because not all cells have them: all others hold no more than the file has bytes
  // for.
  Budget budget_;  // of arrays that grow because not all cells have them
  ReadResult result_;
  PlyHeader header_;
  std::vector<PlyHint> hints_;
  std::map<std::pair<Domain, std::string>, std::vector<std::string>> labels_;
  uint64_t point_count_ = 0;
  uint64_t bytes_read_ = 0;  // of what is not in the mesh yet
  uint64_t too_small_ = 0;   // numbers
  CellCollector faces_;
  std::vector<uint32_t> strip_nodes_;
  std::vector<uint32_t> edges_;
  std::vector<Array> face_arrays_;  // also those on corners
  std::vector<Array> edge_arrays_;
  bool both_ = false;  // faces and edges
  std::vector<Array> mesh_arrays_;
};

bool recognise(Bytes first) {
  return first.size() >= 4 && std::memcmp(first.data(), "ply", 3) == 0 &&
         (first[3] == std::byte{'\n'} || first[3] == std::byte{'\r'} || first[3] == std::byte{' '});
}

Result<ReadResult> read(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  return PlyReader(source, input.bytes(), options).read();
}

}  // namespace

const Format& ply_format() {
  static const Format format{{"ply", {".ply"}, "PLY, Stanford polygon format; every property kept", true},
                             recognise,
                             read,
                             write_ply};
  return format;
}

}  // namespace maille
