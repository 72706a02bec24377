#include "volume/pieces/piece_layout.h"

#include <maille/with_type.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "container/plain_fields.h"
#include "entropy/byte_model.h"
#include "entropy/rans.h"
#include "volume/pieces/number_runs.h"
#include "volume/values/value_range.h"

namespace maille {
namespace {

template <class Visitor, class Field>
// Fields of the index in their order, for reader and writer; docs/format.md, 16.14, PIDX.
void visit_field(Visitor& v, Field& field) {
  v.list(field.components, [&](auto& component) {
    v.fixed(component.low);
    v.fixed(component.high);
    v.fixed(component.mean);
  });
  v.count(field.nans, ~uint64_t{0});
  v.list(field.coarse, [&](auto& number) { v.fixed(number); });
}

template <class Visitor, class Fields>
void visit_fields(Visitor& v, Fields& fields) {
  v.list(fields, [&](auto& field) { visit_field(v, field); });
}

/// Numbers of points and cells fit 32 bits: they are numbers of one mesh in pieces.
template <class Visitor, class Record>
void visit_record(Visitor& v, Record& record) {
  v.count(record.cells, 0xffffffff);
  v.count(record.points, 0xffffffff);
  for (auto& number : record.low) v.fixed(number);
  for (auto& number : record.high) v.fixed(number);
  v.count(record.first_cell, 0xffffffff);
  v.count(record.last_cell, 0xffffffff);
  v.list(record.coded_bytes, [&](auto& bytes) { v.count(bytes, ~uint64_t{0}); });
  visit_fields(v, record.fields);
  v.list(record.coarse, [&](auto& number) { v.fixed(number); });
}

template <class Record, class Visit>
std::vector<std::byte> encode_page(const std::vector<Record>& records, Visit visit) {
  PlainWriter writer;
  writer.list(records, [&](const Record& record) { visit(writer, record); });
  ByteWriter packed;
  packed.put_count(writer.out().size());
  packed.put_bytes(encode_bytes(writer.out().bytes()));
  return packed.take();
}

/// Limits come before anything is decoded: 16 MiB a page, 4,096 records. Nothing is reserved for lists; they
/// grow as their bytes are read.
template <class Record, class Visit>
Result<IndexPage<Record>> decode_page(Bytes bytes, uint64_t most_memory, Visit visit) {
  constexpr const char* damaged = "the index of pieces is damaged";
  ByteReader in(bytes);
  const uint64_t size = in.get_count();
  if (!in.ok() || size > most_plain_bytes) return failure(ErrorCode::corrupt, damaged);
  const auto too_large = [] {
    return failure(ErrorCode::memory_bound, "the index of pieces takes more memory than allowed");
  };
  if (size > most_memory) return too_large();
  const std::vector<std::byte> plain = decode_bytes(in.get_bytes(in.remaining()), size);
  PlainReader reader(plain, most_memory - size);
  IndexPage<Record> page;
  reader.list(page.records, [&](Record& record) { visit(reader, record); });
  if (reader.is_over()) return too_large();
  if (plain.size() != size || !reader.ok() || !reader.at_end() || page.records.size() > pieces_per_page)
    return failure(ErrorCode::corrupt, damaged);
  page.memory = reader.memory();
  return page;
}

/// The nearest float that is not above (or not below) the number, so that a range of floats holds all doubles
/// that it stands for.
float below(double number) {
  constexpr float most = std::numeric_limits<float>::max(), infinite = std::numeric_limits<float>::infinity();
  if (number < -static_cast<double>(most)) return -infinite;
  if (number > static_cast<double>(most)) return most;
  const auto nearest = static_cast<float>(number);
  return static_cast<double>(nearest) <= number ? nearest : std::nextafter(nearest, -infinite);
}
float above(double number) {
  return -below(-number);
}

/// Means of the finite numbers of each component, or of all where there is one mean; 0 where there is no
/// number. Sums run in the order of the tuples, so that the file does not depend on threads.
template <class T>
std::vector<double> means_of(const Array& array, size_t means) {
  std::vector<double> sums(means);
  std::vector<uint64_t> counts(means);
  const size_t count = array.bytes.size() / sizeof(T);
  for (size_t i = 0, c = 0; i < count; ++i, c = c + 1 == means ? 0 : c + 1) {
    const auto value = static_cast<double>(load<T>(array.bytes.data() + i * sizeof(T)));
    const bool finite = std::isfinite(value);
    sums[c] += finite ? value : 0;
    counts[c] += finite ? 1 : 0;
  }
  for (size_t c = 0; c < means; ++c) sums[c] = counts[c] == 0 ? 0 : sums[c] / static_cast<double>(counts[c]);
  return sums;
}

template <class T>
// By number type outside of the loop, which runs over all points of a piece.
void find_finite_range(Bytes positions, std::array<double, 3>& low, std::array<double, 3>& high) {
  for (size_t at = 0; at < positions.size(); at += 3 * sizeof(T)) {
    for (size_t k = 0; k < 3; ++k) {
      const auto x = static_cast<double>(load<T>(positions.data() + at + k * sizeof(T)));
      if (!std::isfinite(x)) continue;
      low[k] = std::min(low[k], x);
      high[k] = std::max(high[k], x);
    }
  }
}

// How far a decoded number may be from `number`. With bounds by size the ends of a range are the ones that
// can move farthest outwards.
double away(PieceBound bound, double number) {
  return bound.by_size ? bound.bound * std::abs(number) : bound.bound;
}

}  // namespace

// The file comes last and has no length: it goes to the end of the chunk.
std::vector<std::byte> encode_piece(const CodedPiece& piece) {
  ByteWriter out;
  out.put_count(piece.blocks.size());
  for (const uint32_t block : piece.blocks) out.put_count(block);
  out.put_count(piece.shared.size());
  out.put_bytes(piece.shared);
  out.put_bytes(inverted(piece.file));
  return out.take();
}

/// Blocks rise, so that none comes twice. The list ends with the bytes at the latest. The file takes the room
/// of the bytes: a piece of a mesh with many arrays has megabytes, which need not be there twice.
Result<CodedPiece> decode_piece(std::vector<std::byte> bytes) {
  ByteReader in(bytes);
  CodedPiece piece;
  for (uint64_t left = in.get_count(); left > 0 && in.ok(); --left) {
    const uint64_t block = in.get_count();
    const bool rises = block <= 0xffffffff && (piece.blocks.empty() || block > piece.blocks.back());
    if (!rises) return failure(ErrorCode::corrupt, "the blocks of a piece are damaged");
    piece.blocks.push_back(static_cast<uint32_t>(block));
  }
  const Bytes shared = in.get_bytes(in.get_count());
  piece.shared.assign(shared.begin(), shared.end());
  if (!in.ok()) return failure(ErrorCode::corrupt, "the head of a piece is damaged");
  bytes.erase(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(in.position()));
  piece.file = inverted(std::move(bytes));
  return piece;
}

std::vector<std::byte> inverted(std::vector<std::byte> bytes) {
  for (std::byte& byte : bytes) byte = ~byte;
  return bytes;
}

std::vector<std::byte> encode_index(const std::vector<PieceRecord>& records) {
  return encode_page(records, [](auto& v, auto& record) { visit_record(v, record); });
}

Result<IndexPage<PieceRecord>> decode_index(Bytes bytes, uint64_t most_memory) {
  return decode_page<PieceRecord>(bytes, most_memory, [](auto& v, auto& record) { visit_record(v, record); });
}

std::vector<std::byte> encode_step_index(const std::vector<std::vector<PieceField>>& fields) {
  return encode_page(fields, [](auto& v, auto& piece) { visit_fields(v, piece); });
}

Result<IndexPage<std::vector<PieceField>>> decode_step_index(Bytes bytes, uint64_t most_memory) {
  return decode_page<std::vector<PieceField>>(bytes, most_memory,
                                              [](auto& v, auto& piece) { visit_fields(v, piece); });
}

// One coder for both lists, with fresh models for the second.
std::vector<std::byte> encode_numbers(const PieceNumbers& numbers) {
  RansEncoder coder;
  encode_rising(coder, numbers.cells);
  encode_rising(coder, numbers.points);
  return coder.finish();
}

/// Runs are decoded only as far as there are cells and points, whose counts the index has been held against.
Result<PieceNumbers> decode_numbers(Bytes bytes, uint64_t cells, uint64_t points) {
  PieceNumbers numbers;
  RansDecoder coder(bytes);
  if (!decode_rising(coder, numbers.cells, cells) || !decode_rising(coder, numbers.points, points) ||
      coder.exhausted())
    return failure(ErrorCode::corrupt, "the numbers of a piece are damaged");
  return numbers;
}

PieceField describe_field(const Array& array, PieceBound bound) {
  ValueRange range;
  widen(range, array.type, array.components, array.bytes);
  PieceField field;
  field.nans = range.nans;
  const std::vector<double> means = with_type(
      array.type, [&](auto zero) { return means_of<decltype(zero)>(array, range.components.size()); });
  for (size_t c = 0; c < range.components.size(); ++c) {
    PieceField::Component& component = field.components.emplace_back();
    const ValueRange::Component& found = range.components[c];
    // No number: low > high says so.
    if (!found.any) continue;
    component.low = below(found.low - away(bound, found.low));
    component.high = above(found.high + away(bound, found.high));
    component.mean = static_cast<float>(means[c]);
  }
  return field;
}

void enclose(const Array& positions, PieceBound bound, PieceRecord& record) {
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  with_type(positions.type,
            [&](auto zero) { find_finite_range<decltype(zero)>(positions.bytes, low, high); });
  for (unsigned k = 0; k < 3; ++k) {
    if (low[k] > high[k]) return;
  }
  for (unsigned k = 0; k < 3; ++k) {
    record.low[k] = below(low[k] - away(bound, low[k]));
    record.high[k] = above(high[k] + away(bound, high[k]));
  }
}

}  // namespace maille
