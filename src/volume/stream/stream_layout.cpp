#include "volume/stream/stream_layout.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "entropy/byte_model.h"
#include "numbers/number_maps.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/values/mixed_values.h"

namespace maille {
namespace {

// What codes of 32 and of 64 bits hold.
constexpr int most_digits(Scalar type) {
  return type == Scalar::f32 ? 7 : 15;
}

/// One list of fields for each chunk (the visit_ functions below) serves Writer and Reader, so that the two
/// cannot drift apart. Tables of maps stand before all else, since they are coded already.
class Writer : public PlainWriter {
 public:
  void map(const NumberMap& value, Scalar) {
    write_map(out(), value, &tables_);
    if (value.kind == NumberMap::Kind::ordered)
      out().put(static_cast<uint8_t>(value.exponent < 0 ? 128 - value.exponent : value.exponent));
  }
  /// What was written, coded as bytes, behind the tables. These are coded already, but where gaps come again
  /// coding them once more takes a tenth from them.
  Result<std::vector<std::byte>> pack(const char* what) {
    // A reader refuses more, as it has to hold all of it at once.
    if (out().size() > most_plain_bytes)
      return failure(ErrorCode::unsupported, std::string(what) + " take more than the 16 MiB a file holds");
    ByteWriter packed;
    packed.put_count(tables_.size());
    if (tables_.size() > 0) {
      const std::vector<std::byte> coded = encode_bytes(tables_.bytes());
      const Bytes smaller = coded.size() < tables_.size() ? Bytes(coded) : tables_.bytes();
      packed.put_count(smaller.size());
      packed.put_bytes(smaller);
    }
    packed.put_count(out().size());
    packed.put_bytes(encode_bytes(out().bytes()));
    return packed.take();
  }

 private:
  ByteWriter tables_;
};

/// Safe on any bytes: whatever does not fit makes ok() false, and the values read so far are thrown away by
/// the caller.
class Reader : public PlainReader {
 public:
  Reader(Bytes bytes, uint64_t most_memory, Bytes tables = {})
      : PlainReader(bytes, most_memory), tables_(tables) {}
  void map(NumberMap& value, Scalar type) {
    auto found = read_map(in(), type, &tables_);
    require(found.has_value());
    if (!found) return;
    value = *found;
    take(value.table.size() * sizeof(double));
    table_numbers_ += value.table.size();
    require(table_numbers_ <= most_table_numbers);
    if (value.kind != NumberMap::Kind::ordered) return;
    if (value.factor != 0) type = Scalar::f32;
    const int byte = in().get<uint8_t>();  // significant digits, or 128 + decimals
    value.exponent = byte > 128 ? 128 - byte : byte;
    require(value.exponent <= most_digits(type));
    require(byte <= 128 || (type == Scalar::f32 && byte <= 128 + DecimalFloats::most_decimals));
  }
  bool at_end() { return PlainReader::at_end() && tables_.ok() && tables_.remaining() == 0; }
  /// Errors: memory_bound; corrupt, in these words.
  Result<> check(bool sensible, const char* damaged) {
    if (is_over()) return failure(ErrorCode::memory_bound, texts_too_large);
    if (!ok() || !at_end() || !sensible) return failure(ErrorCode::corrupt, damaged);
    return {};
  }

 private:
  ByteReader tables_;
  uint64_t table_numbers_ = 0;
};

/// What Writer::pack() made. Both sizes are claimed by the file, so they are capped at 16 MiB and checked
/// against what decoding really gave.
struct Unpacked {
  std::vector<std::byte> tables, plain;
  uint64_t memory_left = 0;  ///< for what is read from them
};
Result<Unpacked> unpack(Bytes bytes, uint64_t most_memory, const char* damaged) {
  ByteReader in(bytes);
  Unpacked unpacked;
  const uint64_t table_bytes = in.get_count();
  if (table_bytes > most_plain_bytes) return failure(ErrorCode::corrupt, damaged);
  if (table_bytes > most_memory) return failure(ErrorCode::memory_bound, texts_too_large);
  if (table_bytes > 0) {
    const Bytes tables = in.get_bytes(in.get_count());
    unpacked.tables.assign(tables.begin(), tables.end());
    if (tables.size() < table_bytes) unpacked.tables = decode_bytes(tables, table_bytes);
  }
  const uint64_t size = in.get_count();
  if (!in.ok() || size > most_plain_bytes) return failure(ErrorCode::corrupt, damaged);
  if (size > most_memory - table_bytes) return failure(ErrorCode::memory_bound, texts_too_large);
  unpacked.plain = decode_bytes(in.get_bytes(in.remaining()), size);
  unpacked.memory_left = most_memory - table_bytes - size;
  if (unpacked.plain.size() != size || unpacked.tables.size() != table_bytes)
    return failure(ErrorCode::corrupt, damaged);
  return unpacked;
}

template <class Visitor, class Array>
// What 16.1 says of positions and of each array. `tolerance` is what was asked for, which only `info` and
// encoding again need; what holds is in maps and bounds.
void visit_array(Visitor& v, Array& array) {
  v.text(array.name);
  v.choice(array.domain, domain_count);
  v.choice(array.type, scalar_count);
  v.count(array.components, 0xffff);
  v.choice(array.role, role_count);
  v.list(array.labels, [&](auto& label) { v.text(label); });
  v.choice(array.tolerance.kind, Tolerance::kind_count);
  v.real(array.tolerance.value);
}

template <class Visitor, class Array>
// Arrays of the mesh as a whole are few numbers and stand here as they are. Their bytes are held against the
// size of a tuple in is_sensible().
void visit_mesh_array(Visitor& v, Array& array) {
  v.text(array.name);
  v.choice(array.type, scalar_count);
  v.count(array.components, 0xffff);
  v.choice(array.role, role_count);
  v.list(array.labels, [&](auto& label) { v.text(label); });
  v.bytes(array.bytes);
}

template <class Visitor, class Header>
// The fields of DESC in their order; docs/format.md, 16.1. A reader fills `header` from them, a writer passes
// a const one: the same lines for both.
void visit_header(Visitor& v, Header& header) {
  auto& description = header.description;
  v.count(description.effort, 9);
  v.flag(description.any_order);
  // Two flags in one byte: order apart, and arrays of numbers.
  uint8_t order = (description.order_apart ? 1 : 0) | (description.numbered.empty() ? 0 : 2);
  v.choice(order, 4);
  if constexpr (!std::is_const_v<Header>) description.order_apart = (order & 1) != 0;
  v.choice(header.mixing, mixing_count);
  v.choice(header.mixed_values, mixed_values_count);
  v.flag(header.gated);
  visit_array(v, description.positions);
  v.list(description.arrays, [&](auto& array) { visit_array(v, array); });
  v.list(description.mesh_arrays, [&](auto& array) { visit_mesh_array(v, array); });
  v.list(description.metadata, [&](auto& entry) {
    v.text(entry.first);
    v.text(entry.second);
  });
  v.text(description.provenance);
  size_t i = 0;
  v.list(header.maps, [&](auto& maps) {
    // The type of an array decides how its maps are read. Lists of maps longer than that of arrays are
    // refused later; until then any type will do.
    const bool known = i <= description.arrays.size();
    const Scalar type = !known   ? Scalar::u8
                        : i == 0 ? description.positions.type
                                 : description.arrays[i - 1].type;
    v.list(maps, [&](auto& map) { v.map(map, type); });
    ++i;
  });
  v.list(header.bounds, [&](auto& bound) { v.real(bound); });
  if (order < 2) return;
  v.list(description.numbered, [&](auto& numbered) {
    v.count(numbered.array, most_plain_bytes);
    v.list(numbered.runs, [&](auto& run) {
      v.count(run.count, ~uint64_t{0});
      v.count(run.first, ~uint64_t{0});
    });
  });
}

/// The time of the values stands behind all else, where it is known: a reader sees by what remains that it is
/// there.
template <class Visitor, class Header>
void visit_time(Visitor& v, Header& header) {
  v.real(*header.description.time);
}

/// Limits of what one chunk can claim: a record has at most 32 points here, or many in a loose cell;
/// cell_bytes is checked against what is there.
template <class Visitor, class Header>
void visit_batch(Visitor& v, Header& header) {
  v.count(header.records, most_records_per_batch);
  v.count(header.cells, most_records_per_batch);
  v.count(header.points, most_records_per_batch * 32);
  v.count(header.cell_bytes, uint64_t{1} << 32);
  v.list(header.blocks, [&](auto& block) {
    v.count(block.records_before, most_records_per_batch);
    v.text(block.name);
    v.choice(block.type, 256);
  });
}

template <class Visitor, class Tail>
// The fields of TAIL in their order. Counts are not bounded here: nothing is reserved by them, and those that
// matter are checked against what was read.
void visit_tail(Visitor& v, Tail& tail) {
  v.count(tail.points, ~uint64_t{0});
  v.count(tail.cells, ~uint64_t{0});
  v.count(tail.corners, ~uint64_t{0});
  v.count(tail.batches, ~uint64_t{0});
  v.count(tail.most_live_points, ~uint64_t{0});
  v.count(tail.most_live_cells, ~uint64_t{0});
  v.list(tail.blocks, [&](auto& block) {
    v.text(block.name);
    v.choice(block.type, 256);
    v.count(block.cells, ~uint64_t{0});
  });
  v.list(tail.types, [&](auto& count) {
    v.choice(count.first, 256);
    v.count(count.second, ~uint64_t{0});
  });
  v.count(tail.polyhedra.cells, ~uint64_t{0});
  v.count(tail.polyhedra.faces, ~uint64_t{0});
  v.count(tail.polyhedra.corners, ~uint64_t{0});
  v.count(tail.polyhedra.points, ~uint64_t{0});
  v.list(tail.ranges, [&](auto& range) {
    v.list(range.components, [&](auto& component) {
      v.flag(component.any);
      v.real(component.low);
      v.real(component.high);
    });
    v.count(range.nans, ~uint64_t{0});
  });
  v.list(tail.errors, [&](auto& error) { v.real(error); });
}

template <class Visitor, class Header>
// The fields of STEP in their order; docs/format.md, 16.9.
void visit_step(Visitor& v, Header& header) {
  v.real(header.time);
  v.list(header.arrays, [&](auto& array) { visit_array(v, array); });
  size_t i = 0;
  v.list(header.maps, [&](auto& maps) {
    const Scalar type = i < header.arrays.size() ? header.arrays[i].type : Scalar::u8;
    v.list(maps, [&](auto& map) { v.map(map, type); });
    ++i;
  });
  v.list(header.bounds, [&](auto& bound) { v.real(bound); });
  v.list(header.codings, [&](auto& coding) {
    // StepCoding::Method has five values; array numbers are checked where the step before is at hand.
    v.choice(coding.method, 5);
    v.count(coding.of, 0xffffffff);
  });
  v.list(header.errors, [&](auto& error) { v.real(error); });
}

/// The metadata of a step stand behind all else, where it has some of its own.
template <class Visitor, class Entries>
void visit_entries(Visitor& v, Entries& entries) {
  v.list(entries, [&](auto& entry) {
    v.choice(entry.method, 3);
    if (entry.method == StepEntry::whole) {
      v.text(entry.key);
    } else {
      v.count(entry.of, most_plain_bytes);
    }
    if (entry.method != StepEntry::same) v.text(entry.value);
  });
}

bool are_lattices(const std::vector<NumberMap>& maps) {
  return std::all_of(maps.begin(), maps.end(),
                     [](const NumberMap& map) { return map.kind == NumberMap::Kind::lattice; });
}

/// What a step's header must keep so that nothing reads out of bounds. What `of` names in a step before is
/// looked at where that step is at hand (ValueChain::of_step()).
bool is_sensible(const StepHeader& header, const std::vector<StreamArray>& arrays) {
  const size_t count = header.arrays.size();
  bool sensible = header.maps.size() == count && header.bounds.size() == count &&
                  header.codings.size() == count && header.errors.size() == count;
  for (size_t i = 0; sensible && i < count; ++i) {
    const StreamArray& array = header.arrays[i];
    const StepCoding& coding = header.codings[i];
    sensible = array.components > 0 && header.maps[i].size() == array.components &&
               (array.domain == Domain::point || array.domain == Domain::cell);
    if (coding.method == StepCoding::as_mesh)
      sensible = sensible && coding.of < arrays.size() && are_alike(arrays[coding.of], array);
    if (coding.method == StepCoding::difference) sensible = sensible && are_lattices(header.maps[i]);
  }
  return sensible;
}

/// Elements add up without overflow; whether there are as many as the mesh has is found out by who restores
/// them.
bool is_sensible(const NumberedArray& numbered, const StreamDescription& description) {
  if (numbered.array >= description.arrays.size() || numbered.runs.empty()) return false;
  if (description.any_order && !description.order_apart) return false;
  if (numbered.runs.size() > most_number_runs) return false;
  uint64_t elements = 0;
  for (const NumberedArray::Run& run : numbered.runs) {
    if (run.count == 0 || run.count > ~elements) return false;
    elements += run.count;
  }
  const StreamArray& array = description.arrays[numbered.array];
  return array.components == 1 && !is_float(array.type);
}

/// One map for each component, three for positions: coders index by these without further checks.
bool is_sensible(const StreamHeader& header) {
  const StreamDescription& description = header.description;
  bool sensible = description.positions.components == 3 && (!header.gated || description.any_order) &&
                  header.maps.size() == description.arrays.size() + 1 &&
                  header.bounds.size() == header.maps.size() && header.maps[0].size() == 3;
  for (size_t i = 0; sensible && i < description.arrays.size(); ++i) {
    const StreamArray& array = description.arrays[i];
    sensible = array.components > 0 && header.maps[i + 1].size() == array.components &&
               (array.domain == Domain::point || array.domain == Domain::cell);
  }
  for (const NumberedArray& numbered : description.numbered)
    sensible = sensible && is_sensible(numbered, description);
  for (const Array& array : description.mesh_arrays) {
    sensible = sensible && array.components > 0 && array.bytes.size() % array.tuple_size() == 0;
  }
  return sensible && (!description.time || std::isfinite(*description.time));
}

}  // namespace

StreamedArray StreamHeader::positions() const {
  StreamedArray positions = with_models({description.positions.type, 3, maps[0], bounds[0]});
  positions.mixed = mixed_values == MixedValues::all;
  // Positions cannot be expected from where points are.
  positions.placed = false;
  return positions;
}

StreamedArray StreamHeader::array(size_t i) const {
  return with_models(
      {description.arrays[i].type, description.arrays[i].components, maps[i + 1], bounds[i + 1]});
}

// The methods from as_before on refer to the step before.
bool StepHeader::needs_before() const {
  return std::any_of(codings.begin(), codings.end(),
                     [](const StepCoding& coding) { return coding.method >= StepCoding::as_before; });
}

/// As integers of the width of the type's codes, with the identity as map: differences of codes wrap as codes
/// do.
StreamedArray differences_of(const StreamArray& array, const StreamHeader& mesh) {
  const bool wide = size_of(array.type) == 8;
  StreamedArray differences = mesh.with_models({array.type, array.components, {}, 1});
  differences.type = wide ? Scalar::i64 : Scalar::i32;
  differences.maps.resize(array.components);
  differences.bound = 0;
  return differences;
}

// Whether values of a step are mixed follows from the mesh's header, so that all steps of a file are coded in
// one way.
StreamedArray StepHeader::array(size_t i, const StreamHeader& mesh) const {
  if (codings[i].method == StepCoding::difference) return differences_of(arrays[i], mesh);
  StreamedArray array = mesh.with_models({arrays[i].type, arrays[i].components, maps[i], bounds[i]});
  array.follows = codings[i].method == StepCoding::following;
  return array;
}

StreamedArray StreamHeader::with_models(StreamedArray array) const {
  const bool mixes =
      mixed_values == MixedValues::all || (mixed_values == MixedValues::bounded && array.bound > 0);
  array.mixed = mixes && array.components <= most_mixed_components;
  array.placed = array.mixed && is_float(array.type);
  return array;
}

Result<std::vector<std::byte>> encode_header(const StreamHeader& header) {
  Writer writer;
  visit_header(writer, header);
  if (header.description.time) visit_time(writer, header);
  return writer.pack("names, labels, metadata and arrays of the mesh");
}

/// Error: corrupt. The kind of error does not say which field, as one damaged count shifts all that follow.
Result<StreamHeader> decode_header(Bytes bytes, uint64_t most_memory) {
  constexpr const char* damaged = "the description of the stream is damaged";
  const Unpacked unpacked = MAILLE_TRY(unpack(bytes, most_memory, damaged));
  StreamHeader header;
  Reader reader(unpacked.plain, unpacked.memory_left, unpacked.tables);
  visit_header(reader, header);
  if (reader.ok() && reader.remaining() > 0) {
    header.description.time.emplace();
    visit_time(reader, header);
  }
  MAILLE_CHECK(reader.check(reader.ok() && is_sensible(header), damaged));
  for (Array& array : header.description.mesh_arrays) array.domain = Domain::mesh;
  header.memory = reader.memory();
  return header;
}

Result<std::vector<std::byte>> encode_step(const StepHeader& header) {
  Writer writer;
  visit_step(writer, header);
  if (header.metadata) visit_entries(writer, *header.metadata);
  return writer.pack("names and labels of arrays, and metadata");
}

Result<StepHeader> decode_step(Bytes bytes, const std::vector<StreamArray>& arrays, uint64_t most_memory) {
  constexpr const char* damaged = "the description of a step is damaged";
  const Unpacked unpacked = MAILLE_TRY(unpack(bytes, most_memory, damaged));
  StepHeader header;
  Reader reader(unpacked.plain, unpacked.memory_left, unpacked.tables);
  visit_step(reader, header);
  // Bytes behind the fields that are always there are the metadata; at_end() below finds anything else.
  if (reader.ok() && reader.remaining() > 0) visit_entries(reader, header.metadata.emplace());
  MAILLE_CHECK(reader.check(reader.ok() && is_sensible(header, arrays), damaged));
  header.memory = reader.memory();
  return header;
}

/// Each entry by the next one of the list before with its key, so that the places rise. 256 entries are
/// searched at most: lists of a solver differ in a few places, and an unknown key must not cost the whole
/// list.
std::vector<StepEntry> entries_of(const Metadata& metadata, const Metadata& before) {
  std::vector<StepEntry> entries;
  size_t next = 0;  // lists keep their order, or are told whole
  constexpr size_t most_left_out = 256;
  for (const auto& [key, value] : metadata) {
    const size_t end = std::min(before.size(), next + most_left_out);
    size_t k = next;
    while (k < end && before[k].first != key) ++k;
    if (k == end) {
      entries.push_back({StepEntry::whole, 0, key, value});
      continue;
    }
    const bool same = before[k].second == value;
    entries.push_back(
        {same ? StepEntry::same : StepEntry::same_key, k, std::string(), same ? std::string() : value});
    next = k + 1;
  }
  return entries;
}

/// No entry is taken twice, as places rise, so a list is no longer than the one before and its own bytes; 16
/// MiB at most.
Result<Metadata> metadata_of(const std::vector<StepEntry>& entries, const Metadata& before) {
  Metadata metadata;
  uint64_t next = 0, bytes = 0;
  for (const StepEntry& entry : entries) {
    const bool named = entry.method != StepEntry::whole;
    const bool known = !named || (entry.of >= next && entry.of < before.size());
    if (known && named) next = entry.of + 1;
    if (known)
      metadata.emplace_back(named ? before[entry.of].first : entry.key,
                            entry.method == StepEntry::same ? before[entry.of].second : entry.value);
    bytes += known ? metadata.back().first.size() + metadata.back().second.size() : 0;
    if (!known || bytes > most_plain_bytes)
      return failure(ErrorCode::corrupt, "the metadata of a step is damaged");
  }
  return metadata;
}

/// The head has its length before it, as the coded cells follow in the same chunk.
void write_batch_header(ByteWriter& out, const BatchHeader& header) {
  Writer writer;
  visit_batch(writer, header);
  out.put_count(writer.out().size());
  out.put_bytes(writer.out().bytes());
}

Result<BatchHeader> read_batch_header(ByteReader& in, uint64_t most_memory) {
  BatchHeader header;
  Reader reader(in.get_bytes(in.get_count()), most_memory);
  visit_batch(reader, header);
  header.memory = reader.memory();
  bool sensible = in.ok() && header.cell_bytes <= in.remaining();
  for (const BlockStart& block : header.blocks) {
    // Blocks may begin behind the last record: blocks without cells at the end of a batch. An unknown type
    // would reach callers as a number.
    sensible = sensible && block.records_before <= header.records &&
               std::string_view(name_of(block.type)) != "unknown";
  }
  MAILLE_CHECK(reader.check(sensible, "the head of a batch of cells is damaged"));
  return header;
}

void count_polyhedron(std::vector<uint64_t>& points, size_t faces, MeshDescription::Polyhedra& polyhedra) {
  ++polyhedra.cells;
  polyhedra.faces += faces;
  polyhedra.corners += points.size();
  std::sort(points.begin(), points.end());
  polyhedra.points += static_cast<uint64_t>(std::unique(points.begin(), points.end()) - points.begin());
}

std::vector<std::byte> encode_tail(const StreamTail& tail) {
  Writer writer;
  visit_tail(writer, tail);
  return writer.out().take();
}

Result<StreamTail> decode_tail(Bytes bytes, uint64_t most_memory) {
  StreamTail tail;
  Reader reader(bytes, most_memory);
  visit_tail(reader, tail);
  const MeshDescription::Polyhedra& polyhedra = tail.polyhedra;
  // Writers of formats with fixed places compute sizes from these: differences of them must not wrap.
  const bool sensible = polyhedra.corners <= tail.corners && polyhedra.points <= polyhedra.corners;
  MAILLE_CHECK(reader.check(sensible, "the end of the stream is damaged"));
  tail.memory = reader.memory();
  return tail;
}

}  // namespace maille
