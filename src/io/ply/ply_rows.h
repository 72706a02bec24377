#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "io/buffered_writer.h"
#include "io/ply/ply.h"

// What a PLY file to be written consists of, and its rows.
namespace maille {

/// One or more properties of an element and where their values come from. Fields point into the mesh that is
/// written.
struct PlyField {
  enum class Kind : uint8_t {
    fixed,         ///< `numbers` numbers of every row
    fixed_list,    ///< the same as a list
    padded_list,   ///< as many as `counts` says, at a fixed distance
    running_list,  ///< the same, one row's behind the other's
    corners,       ///< a list: `numbers` numbers of every corner
    nodes,         ///< the list of point numbers
    ends,          ///< the two point numbers of an edge
  };
  Kind kind = Kind::fixed;
  const Array* array = nullptr;
  Scalar type = Scalar::f32;  ///< as written: u32 halves of 64-bit integers
  uint32_t numbers = 1;
  Scalar count_type = Scalar::u8;
  const Array* counts = nullptr;
};

/// An element with its rows: numbered ones (points, or tuples of arrays on the mesh), faces or edges, whose
/// rows are the cells of that kind in the order of the mesh.
struct PlyOutElement {
  enum class Rows : uint8_t { numbered, faces, edges };
  Rows rows = Rows::numbered;
  PlyElement element;
  std::vector<PlyField> fields;
  std::vector<PlyHint> hints;
  std::set<std::string> used;  // names of properties
};

/// How long the list of a row is, from an unsigned array; the writer has checked that it is one and fits.
uint64_t ply_count_at(const Array& counts, uint64_t row);

/// Writes rows in one of the three encodings. Rows must come in order: running lists go on where the row
/// before ended.
class PlyRowWriter {
 public:
  PlyRowWriter(BufferedWriter& out, PlyEncoding encoding) : out_(out), encoding_(encoding) {}

  /// `cell`: number of the row's cell or point; `corner`: of its first corner.
  void write(PlyOutElement& element, uint64_t row, uint64_t corner, std::span<const uint32_t> nodes);

 private:
  void numbers(const std::byte* from, Scalar type, uint64_t many);
  void count(uint64_t value, Scalar type);
  void indices(std::span<const uint32_t> nodes, Scalar type);
  void separate();

  BufferedWriter& out_;
  PlyEncoding encoding_;
  bool first_ = true;
  std::map<const PlyField*, uint64_t> running_;
};

}  // namespace maille
