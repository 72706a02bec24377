#pragma once

#include <maille/mesh_source.h>
#include <maille/stream.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/bytes.h"
#include "code/efforts.h"
#include "container/plain_fields.h"
#include "volume/cells/decisions.h"
#include "volume/values/tuple_values.h"
#include "volume/values/value_range.h"

namespace maille {

// What stands in the chunks of mode stream besides coded cells and numbers. docs/format.md, 16.1.

/// Numbers in the tables of all maps, 8 MiB of doubles: a damaged file must not ask for more.
inline constexpr uint64_t most_table_numbers = 1 << 20;

/// Arrays whose numbers are coded by MixedValueCoder, if they have few components.
enum class MixedValues : uint8_t { none, bounded, all };
inline constexpr unsigned mixed_values_count = 3;

/// DESC: what is known before the first cell. It determines all models of the stream, so that encoder and
/// decoder make the same ones from it.
struct StreamHeader {
  StreamDescription description;
  Mixing mixing = Mixing::none;  ///< of slow decisions
  MixedValues mixed_values = MixedValues::none;
  bool gated = false;  ///< cells come at gates
  /// Of positions, then of each array.
  std::vector<std::vector<NumberMap>> maps;
  std::vector<double> bounds;
  uint64_t memory = 0;  ///< what a decoded header takes, in bytes

  /// What coders of values are made from; of array i of the description below.
  StreamedArray positions() const;
  StreamedArray array(size_t i) const;
  // Whether an array is mixed, and expected from where points are, follows from the header alone.
  StreamedArray with_models(StreamedArray array) const;
};
/// Error: unsupported, where texts take more than a file holds.
Result<std::vector<std::byte>> encode_header(const StreamHeader& header);
/// Safe on any bytes. `most_memory`: what the header may take, in bytes. Errors: corrupt, memory_bound.
Result<StreamHeader> decode_header(Bytes bytes, uint64_t most_memory);

/// Where a block of cells begins.
struct BlockStart {
  uint64_t records_before = 0;  ///< within the batch
  std::string name;
  CellType type = CellType::mixed;
};

/// The head of a CELL chunk. Its counts bound the loops of a decoder; nothing is reserved by them.
struct BatchHeader {
  uint64_t records = 0;  ///< cells, isolated points, and ends of points
  uint64_t cells = 0;
  uint64_t points = 0;
  uint64_t cell_bytes = 0;  ///< of the first coder; the rest is the second one's
  std::vector<BlockStart> blocks;
  uint64_t memory = 0;  ///< what decoded blocks take, in bytes
};
/// A chunk of cells takes part in no more records than this; 64 KiB of a perfectly regular mesh hold about as
/// many. It also bounds the time that one damaged chunk can take.
inline constexpr uint64_t most_records_per_batch = uint64_t{1} << 26;
/// The head, with its length before it; coded cells follow.
void write_batch_header(ByteWriter& out, const BatchHeader& header);
/// `most_memory`: what blocks may take, in bytes. Errors: corrupt, memory_bound.
Result<BatchHeader> read_batch_header(ByteReader& in, uint64_t most_memory);

/// TAIL: what is known after the last cell. Points, cells and batches are checked against what was read; the
/// rest is for information, and for writers that must know sizes beforehand.
struct StreamTail {
  struct Block {
    std::string name;
    CellType type = CellType::mixed;
    uint64_t cells = 0;
  };
  uint64_t points = 0;
  uint64_t cells = 0;
  uint64_t corners = 0;
  uint64_t batches = 0;
  uint64_t most_live_points = 0;
  uint64_t most_live_cells = 0;
  std::vector<Block> blocks;
  // What `info` tells, and writers of files in parts need beforehand.
  std::vector<std::pair<CellType, uint64_t>> types;  ///< cells, by type, ascending
  MeshDescription::Polyhedra polyhedra;
  /// Of positions, then of each array, as they were given.
  std::vector<ValueRange> ranges;
  /// The largest error of each of these after decoding, as the encoder met them; none where all are exact.
  std::vector<double> errors;
  uint64_t memory = 0;  ///< what a decoded one takes, in bytes
};
/// Counts one more. `points`: the corners of its faces, which are put in order.
void count_polyhedron(std::vector<uint64_t>& points, size_t faces, MeshDescription::Polyhedra& polyhedra);
/// Unlike the description it is not coded further.
std::vector<std::byte> encode_tail(const StreamTail& tail);
/// `most_memory`: what it may take, in bytes. Errors: corrupt, memory_bound.
Result<StreamTail> decode_tail(Bytes bytes, uint64_t most_memory);

/// How the values of an array of a step are told.
struct StepCoding {
  enum Method : uint8_t {
    alone,
    as_mesh,     ///< by array `of` of the mesh, which keeps the bound
    as_before,   ///< by array `of` of the step before; that of the first step is the mesh
    difference,  ///< codes less those of array `of` of the step before
    following,   ///< as alone, but expected from that array, too; mixed values only
  };
  Method method = alone;
  uint32_t of = 0;
};

/// Free text of solvers: neither keys nor values need be unique.
/// Keys and values, in their order.
using Metadata = std::vector<std::pair<std::string, std::string>>;

/// An entry of a step's metadata: told whole, or by one of the list before, which is that of the step before
/// or, where a step has to do without, of the mesh. Texts of a solver are mostly the same from time to time.
struct StepEntry {
  enum Method : uint8_t { whole, same, same_key };
  Method method = whole;
  uint64_t of = 0;  ///< in the list before; greater than that of any entry before this one
  std::string key, value;
};

/// STEP: arrays with their values at one time.
struct StepHeader {
  double time = 0;
  std::vector<StreamArray> arrays;
  std::vector<std::vector<NumberMap>> maps;
  std::vector<double> bounds;
  std::vector<StepCoding> codings;
  std::vector<double> errors;  ///< the largest of each array, after decoding
  /// Without a value: that of the mesh.
  std::optional<std::vector<StepEntry>> metadata;
  uint64_t memory = 0;  ///< what a decoded header takes, in bytes

  /// Whether any array refers to the step before.
  bool needs_before() const;
  /// What is coded of array i, if anything. `mesh`: the header of the stream.
  StreamedArray array(size_t i, const StreamHeader& mesh) const;
};
/// The same domain, type and number of components.
inline bool are_alike(const StreamArray& a, const StreamArray& b) {
  return a.domain == b.domain && a.type == b.type && a.components == b.components;
}
/// Differences of the codes of an array with a bound, as numbers of their own.
StreamedArray differences_of(const StreamArray& array, const StreamHeader& mesh);
/// Error: unsupported, where texts take more than a file holds.
Result<std::vector<std::byte>> encode_step(const StepHeader& header);
/// `arrays`: of the mesh. `most_memory`: what it may take, in bytes. Errors: corrupt, memory_bound.
Result<StepHeader> decode_step(Bytes bytes, const std::vector<StreamArray>& arrays, uint64_t most_memory);
/// `metadata` told by the list before, and the other way round; docs/format.md, 16.9. Error: corrupt (also
/// lists of more than 16 MiB).
std::vector<StepEntry> entries_of(const Metadata& metadata, const Metadata& before);
Result<Metadata> metadata_of(const std::vector<StepEntry>& entries, const Metadata& before);

// Slots of points that ended are free again between blocks, so it is part of the format. Larger blocks keep
// more slots taken; blocks of 512 or 1,024 cells were not faster (docs/history.md, "Lattice runs").
inline constexpr uint32_t cells_per_block = 4096;
inline Mixing mixing_at(int effort) {
  return effort_of(effort).mixed_cells ? Mixing::mixed : Mixing::none;
}
inline bool mixes_values(int effort, bool fast) {
  const Effort::Mixed values = effort_of(effort).mixed_values;
  return values == Effort::Mixed::always || (values == Effort::Mixed::where_fast && fast);
}
inline MixedValues mixed_values_at(int effort, bool fast, bool bounded_fast) {
  if (mixes_values(effort, fast)) return MixedValues::all;
  return mixes_values(effort, bounded_fast) ? MixedValues::bounded : MixedValues::none;
}
/// Numbers with a bound take a quarter to a half less when mixed (docs/fields.md), so they may take longer:
/// half a second.
inline constexpr uint64_t most_bounded_mixed = uint64_t{1} << 19;
/// Whether mixing of values takes a tenth of a second at most. Where cells do not come in the order of a
/// sweep (`scattered`) these take long themselves: there a fifth of a second is allowed, or what few points
/// take, as tetrahedra have. The limits are in docs/encoder.md ("Mixing").
inline bool mixing_is_fast(uint64_t numbers, uint64_t cells, bool scattered) {
  constexpr uint64_t few = uint64_t{1} << 17;
  return numbers <= few || (scattered && (numbers <= 2 * few || numbers <= 3 * cells));
}

}  // namespace maille
