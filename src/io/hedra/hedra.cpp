// .hedra, cinolib's polyhedra as text: numbers of points, faces and cells; the points; each face as a list of
// points from 1 on; each cell as a list of faces from 1 on, negative where the face is turned over.
#include <algorithm>
#include <unordered_map>

#include "base/hash.h"
#include "io/buffered_writer.h"
#include "io/cell_faces.h"
#include "io/cell_store.h"
#include "io/format.h"
#include "io/notes.h"
#include "io/token_reader.h"

namespace maille {
namespace {

/// Appends a face turned over, which keeps its first corner.
void append_turned(std::span<const uint32_t> face, std::vector<uint32_t>& out) {
  if (face.empty()) return;
  out.push_back(face[0]);
  for (size_t i = face.size(); i > 1; --i) out.push_back(face[i - 1]);
}

class HedraReader {
 public:
  HedraReader(const Source& source, std::string_view text, const ReadOptions& options)
      : in_(text, source.name(), '#'),
        budget_(source.name(), text.size(), options.limits),
        pace_(budget_, options.progress, text.size()) {}

  Result<ReadResult> read() {
    const uint64_t points = MAILLE_TRY(in_.count("points"));
    const uint64_t faces = MAILLE_TRY(in_.count("faces"));
    const uint64_t cells = MAILLE_TRY(in_.count("cells"));
    if (points > max_points) return in_.malformed("there are 2^32 points or more");
    MAILLE_CHECK(read_points(points));
    MAILLE_CHECK(read_faces(faces, points));
    for (uint64_t i = 0; i < cells; ++i) {
      MAILLE_CHECK(pace_.step(i, cells, sizeof(uint64_t), in_.scanner.position()));
      MAILLE_CHECK(read_cell());
    }
    if (!in_.at_end()) return in_.malformed("the file goes on behind its last cell");
    ReadResult result;
    result.mesh.points = positions_.take("position", Domain::point, 3);
    result.mesh.blocks = cells_.take();
    const auto unused = std::count(used_.begin(), used_.end(), false);
    if (unused != 0)
      result.notes.push_back(counted(static_cast<uint64_t>(unused), "face") + " of no cell left out");
    return result;
  }

 private:
  Result<> read_points(uint64_t points) {
    for (uint64_t i = 0; i < points; ++i) {
      MAILLE_CHECK(pace_.step(i, points, 3 * sizeof(double), in_.scanner.position()));
      for (int k = 0; k < 3; ++k) {
        Number number;
        if (!in_.number(number)) return in_.expected("a coordinate of point " + std::to_string(i + 1));
        positions_.add(number);
      }
    }
    return {};
  }
  // Faces are kept as one list of corners and the end of each: cells name them by number and in any order.
  Result<> read_faces(uint64_t faces, uint64_t points) {
    for (uint64_t i = 0; i < faces; ++i) {
      MAILLE_CHECK(pace_.step(i, faces, sizeof(uint64_t), in_.scanner.position()));
      const uint64_t size = MAILLE_TRY(in_.count("corners"));
      for (uint64_t k = 0; k < size; ++k) {
        int64_t point = 0;
        if (!in_.integer(point)) return in_.expected("a point of face " + std::to_string(i + 1));
        if (point < 1 || static_cast<uint64_t>(point) > points)
          return in_.malformed("face " + std::to_string(i + 1) + " uses point " + std::to_string(point) +
                               ", but they are 1 to " + std::to_string(points));
        corners_.push_back(static_cast<uint32_t>(point - 1));
      }
      ends_.push_back(corners_.size());
    }
    used_.resize(faces);
    return {};
  }
  Result<> read_cell() {
    const uint64_t size = MAILLE_TRY(in_.count("faces of a cell"));
    for (uint64_t k = 0; k < size; ++k) {
      int64_t signed_face = 0;
      if (!in_.integer(signed_face))
        return in_.expected("a face of cell " + std::to_string(cells_.count() + 1));
      // Negated as an unsigned number, since the least integer has no positive counterpart.
      const auto number = static_cast<uint64_t>(signed_face);
      const uint64_t face = signed_face < 0 ? 0 - number : number;
      if (face < 1 || face > ends_.size())
        return in_.malformed("cell " + std::to_string(cells_.count() + 1) + " uses face " +
                             std::to_string(signed_face) + ", but they are 1 to " +
                             std::to_string(ends_.size()));
      const uint64_t begin = face == 1 ? 0 : ends_[face - 2];
      const auto corners = std::span(corners_).subspan(begin, ends_[face - 1] - begin);
      // One face may be named by many cells, so a small file could ask for much memory: what is copied is
      // taken from the budget.
      MAILLE_CHECK(budget_.take(corners.size() + 1, sizeof(uint32_t)));
      if (signed_face < 0) {
        append_turned(corners, cells_.nodes);
      } else {
        cells_.nodes.insert(cells_.nodes.end(), corners.begin(), corners.end());
      }
      cells_.face_sizes.push_back(static_cast<uint32_t>(corners.size()));
      used_[face - 1] = true;
    }
    cells_.end_cell(CellType::polyhedron);
    return {};
  }

  TokenReader in_;
  Budget budget_;
  ReadingPace pace_;
  RealColumn positions_;
  std::vector<uint32_t> corners_;
  std::vector<uint64_t> ends_;
  std::vector<bool> used_;
  CellStore cells_;
};

Result<ReadResult> read_hedra(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  return HedraReader(source, input.text(), options).read();
}

/// Numbers faces as they come. The second cell at a face names it negative when it has the first one's face
/// turned over. A face that comes again with the same turn is named positive: two cells then lie on the same
/// side of it, which is kept as it is.
class FaceNumbers {
 public:
  /// The number from 1 on with its sign.
  int64_t add(std::span<const uint32_t> face) {
    std::vector<uint32_t> turned;
    append_turned(face, turned);
    if (const int64_t known = find(turned); known != 0) return -known;
    if (const int64_t known = find(face); known != 0) return known;
    corners.insert(corners.end(), face.begin(), face.end());
    ends.push_back(corners.size());
    numbers_.emplace(hash_of(face), ends.size());
    return static_cast<int64_t>(ends.size());
  }

  std::vector<uint32_t> corners;
  std::vector<uint64_t> ends;

 private:
  // The hash depends on the order of the corners; faces of equal hashes are compared corner by corner in
  // find().
  static uint64_t hash_of(std::span<const uint32_t> face) {
    uint64_t hash = face.size();
    for (const uint32_t corner : face) hash = hash_mix(hash, corner);
    return hash;
  }
  int64_t find(std::span<const uint32_t> face) const {
    const auto [first, last] = numbers_.equal_range(hash_of(face));
    for (auto entry = first; entry != last; ++entry) {
      const uint64_t begin = entry->second == 1 ? 0 : ends[entry->second - 2];
      const auto known = std::span(corners).subspan(begin, ends[entry->second - 1] - begin);
      if (std::equal(known.begin(), known.end(), face.begin(), face.end()))
        return static_cast<int64_t>(entry->second);
    }
    return 0;
  }

  std::unordered_multimap<uint64_t, uint64_t> numbers_;
};

/// Begins at the smallest corner. Faces that differ in their first corner only are still the same. A turned
/// face keeps its first corner, so this holds for both sides.
std::vector<uint32_t> rotated(std::span<const uint32_t> face) {
  std::vector<uint32_t> result(face.begin(), face.end());
  if (!result.empty())
    std::rotate(result.begin(), std::min_element(result.begin(), result.end()), result.end());
  return result;
}

/// Cells by the numbers of their faces, which cells share.
struct HedraCells {
  explicit HedraCells(const Mesh& mesh) {
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) add(block, i);
    }
  }
  void add(const CellBlock& block, uint64_t i) {
    const size_t at = lists.size();
    lists.push_back(0);
    const bool polyhedron = block.type_of(i) == CellType::polyhedron;
    // Faces made up for other cells begin anywhere, those of polyhedra as the cell says: these are not
    // rotated, so that a file read and written again has the same lists.
    // The place for the number of faces is taken first and given back when the cell has no faces of its own.
    if (!for_each_linear_face(block, i, [&](std::span<const uint32_t> face) {
          lists.push_back(polyhedron ? faces.add(face) : faces.add(rotated(face)));
        })) {
      lists.pop_back();
      return;
    }
    lists[at] = static_cast<int64_t>(lists.size() - at - 1);
    ++count;
    if (!polyhedron) ++converted;
  }

  FaceNumbers faces;
  std::vector<int64_t> lists;  ///< number of faces, then the faces, of each cell
  uint64_t count = 0;
  uint64_t converted = 0;  ///< of another type
};

void put_faces(BufferedWriter& out, const FaceNumbers& faces) {
  uint64_t begin = 0;
  for (const uint64_t end : faces.ends) {
    out.put_number(end - begin);
    for (; begin < end; ++begin) {
      out.put(' ');
      out.put_number(uint64_t{faces.corners[begin]} + 1);
    }
    out.put('\n');
  }
}

void put_cells(BufferedWriter& out, const std::vector<int64_t>& lists) {
  for (size_t at = 0; at < lists.size();) {
    const auto size = static_cast<size_t>(lists[at]);
    for (size_t k = 0; k <= size; ++k) {
      out.put_number(lists[at++]);
      out.put(k == size ? '\n' : ' ');
    }
  }
}

std::vector<std::string> notes_of(const Mesh& mesh, const HedraCells& cells) {
  std::vector<std::string> notes;
  if (cells.converted != 0)
    notes.push_back(counted(cells.converted, "cell") + " became " +
                    (cells.converted == 1 ? "a polyhedron" : "polyhedra"));
  if (cells.count != mesh.cell_count())
    notes.push_back(counted(mesh.cell_count() - cells.count, "cell") +
                    " left out: .hedra holds linear volume cells only");
  note_block_names(mesh, notes);
  for (const Array& array : mesh.arrays) note_array(array, notes);
  for (const auto& [key, value] : mesh.metadata) note_metadata(key, value, notes);
  note_nan_payloads(mesh, notes);
  return notes;
}

Result<std::vector<std::string>> write_hedra(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  const HedraCells cells(mesh);
  if (cells.count == 0)
    return failure(ErrorCode::usage, sink.name() + ": .hedra holds volume cells, but the mesh has none");
  BufferedWriter out(sink);
  out.put(std::to_string(mesh.point_count()) + " " + std::to_string(cells.faces.ends.size()) + " " +
          std::to_string(cells.count) + "\n");
  for (uint64_t i = 0; i < mesh.point_count(); ++i) {
    put_scalars(out, mesh.points.bytes.data() + i * mesh.points.tuple_size(), mesh.points.type, 3);
    out.put('\n');
  }
  put_faces(out, cells.faces);
  put_cells(out, cells.lists);
  MAILLE_CHECK(out.finish());
  return notes_of(mesh, cells);
}

}  // namespace

const Format& hedra_format() {
  static const Format format{
      {"hedra", {".hedra"}, "cinolib's polyhedra, text", true}, nullptr, read_hedra, write_hedra};
  return format;
}

}  // namespace maille
