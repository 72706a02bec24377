#pragma once

#include <maille/stream.h>

#include <optional>
#include <vector>

#include "numbers/number_map.h"

namespace maille {

/// Number maps of positions, then of each array of a stream, with the error each may have; and what else an
/// encoder that knows the mesh chooses before the first cell.
struct ArrayMapsList {
  std::vector<std::vector<NumberMap>> maps;
  std::vector<double> bounds;
  std::vector<double> extents;  ///< what relative bounds are parts of
  /// Not empty: the stream of the input's order, where cells are given in another one (mesh_order.h).
  std::vector<std::byte> order_apart;
  /// Not empty: cells come at gates, and these are the faces where no later cell is (gate_order.h).
  std::vector<uint8_t> borders;
  std::vector<NumberedArray> numbered;
  /// Mixed models of values take no long time here, as far as that is known.
  bool mixing_is_fast = false;
  /// Of arrays with a bound; as many as can be where that is not known.
  uint64_t bounded_numbers = UINT64_MAX;
};

/// Whether array i (0: positions) is exact, else its bound and its largest error.
void add_error(const ArrayMapsList& maps, const StreamReport& stream, const Tolerance& asked, size_t i,
               ArrayReport& report);

/// The maps with the smallest range of codes, found by a look at all numbers: for meshes in memory. Error:
/// usage.
Result<ArrayMapsList> choose_stream_maps(const Mesh& mesh, const StreamOptions& options);

/// Doubles that nearly all are floats, as those floats. An exception takes 64 bits: one in 128 half a bit a
/// number.
std::optional<Array> as_floats(const Array& array);

/// A lattice for a declared range, or the numbers as they are, by component. `diagonal`: what relative bounds
/// are parts of; `bound` gets the largest error in units of the array, 0 for none. Error: usage.
Result<std::vector<NumberMap>> declared_maps(const StreamArray& array, double diagonal, double& bound);
/// Of the range that was declared; 0 where none was.
double declared_width(const StreamArray& array);

/// Zeros in the stead of numbers have no bounds and no tables.
inline void set_maps_of_zeros(ArrayMapsList& list) {
  for (const NumberedArray& array : list.numbered) {
    list.maps[array.array + 1] = {{.kind = NumberMap::Kind::integer}};
    list.bounds[array.array + 1] = 0;
  }
}

/// `holder`: "stream" or "step". Errors: usage (components), unsupported (arrays on corners and the like).
Result<> check_stream_arrays(const std::vector<StreamArray>& arrays, const std::string& holder);
/// What can be told from the options alone. Error: usage, unsupported.
Result<> check_stream_options(const StreamOptions& options);
/// A writer with such maps, instead of those that can be told from the declarations alone.
Result<StreamWriter> begin_with_maps(Sink& sink, StreamOptions options, const ArrayMapsList& maps);

}  // namespace maille
