// MZ3, the surfaces of Surf Ice and NiiVue: a header of 16 bytes, then faces, points, colours and scalars,
// each where a bit of the header says so; mostly packed by gzip as a whole.
#include <cstring>

#include "base/bytes.h"
#include "base/result.h"
#include "io/budget.h"
#include "io/format.h"
#include "io/reading.h"

namespace maille {
namespace {

// The header is "MZ", the bits below, the numbers of faces and points, and the number of bytes to skip behind
// it.
constexpr size_t header_bytes = 16;
enum Content : uint16_t { faces = 1, points = 2, colours = 4, floats = 8, doubles = 16, lookup = 64 };
// Bit 32 is allowed, but nothing is read for it. A file with any other bit is not taken for MZ3: two letters
// alone would fit too much else.
constexpr uint16_t known = faces | points | colours | floats | doubles | 32 | lookup;

bool recognise_mz3(Bytes bytes) {
  if (bytes.size() < header_bytes || std::memcmp(bytes.data(), "MZ", 2) != 0) return false;
  const auto content = load<uint16_t>(bytes.data() + 2);
  return content != 0 && (content & ~known) == 0;
}

/// Takes what comes next in the file as an array.
class Parts {
 public:
  Parts(std::string name, Bytes rest, const ReadOptions& options)
      : name_(std::move(name)), rest_(rest), budget_(name_, rest.size(), options.limits) {}

  Result<Array> take(Array array, uint64_t tuples) {
    // Divided, not multiplied: a count of the header times a size may be more than 64 bits in hostile files.
    if (tuples > rest_.size() / array.tuple_size()) {
      return failure(ErrorCode::malformed_input, name_ + ": it ends inside \"" + array.name +
                                                     "\", of which it has " + std::to_string(tuples) +
                                                     " by its header");
    }
    const size_t size = tuples * array.tuple_size();
    MAILLE_CHECK(budget_.take(size, 1));
    const Bytes bytes = rest_.first(size);
    array.bytes.assign(bytes.begin(), bytes.end());
    rest_ = rest_.subspan(size);
    return array;
  }
  size_t left() const { return rest_.size(); }

 private:
  std::string name_;
  Bytes rest_;
  Budget budget_;
};

Result<> add_scalars(Parts& parts, Scalar type, uint64_t count, Mesh& mesh) {
  // As many as there are: series have one for each time, and the header does not count them. With no points
  // the size is zero, and the loop would never end.
  const uint64_t size = count * size_of(type);
  for (unsigned i = 0; size != 0 && parts.left() >= size; ++i) {
    const std::string name = i == 0 ? "scalar" : "scalar_" + std::to_string(i);
    mesh.arrays.push_back(MAILLE_TRY(parts.take(make_array(name, Domain::point, type, 1), count)));
  }
  return {};
}

Result<ReadResult> read_mz3(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  const Bytes bytes = input.bytes();
  if (!recognise_mz3(bytes)) {
    return failure(
        ErrorCode::malformed_input,
        source.name() + ": it does not begin with the header of an MZ3 file (\"MZ\", what it holds)");
  }
  const auto content = load<uint16_t>(bytes.data() + 2);
  const uint64_t face_count = load<uint32_t>(bytes.data() + 4),
                 point_count = load<uint32_t>(bytes.data() + 8);
  const uint64_t skipped = load<uint32_t>(bytes.data() + 12);
  if ((content & points) == 0)
    return failure(ErrorCode::unsupported,
                   source.name() + ": it has values for a mesh in another file, but no points");
  Parts parts(source.name(), bytes.subspan(header_bytes), options);
  ReadResult result;
  // Bytes to skip are a table of colours where the header says so, otherwise unknown.
  const Array text = MAILLE_TRY(parts.take(make_array("lookup", Domain::mesh, Scalar::u8, 1), skipped));
  if ((content & lookup) != 0)
    result.mesh.metadata.emplace_back(
        "mz3.lookup", std::string(reinterpret_cast<const char*>(text.bytes.data()), text.bytes.size()));
  if ((content & faces) != 0 && face_count != 0) {
    const Array corners =
        MAILLE_TRY(parts.take(make_array("faces", Domain::mesh, Scalar::u32, 3), face_count));
    CellBlock block;
    block.type = CellType::triangle;
    block.connectivity.assign(corners.values<uint32_t>().begin(), corners.values<uint32_t>().end());
    result.mesh.blocks.push_back(std::move(block));
  }
  result.mesh.points = MAILLE_TRY(parts.take(std::move(result.mesh.points), point_count));
  if ((content & colours) != 0) {
    Array colour = make_array("colour", Domain::point, Scalar::u8, 4, Role::colour);
    result.mesh.arrays.push_back(MAILLE_TRY(parts.take(std::move(colour), point_count)));
  }
  if ((content & floats) != 0) MAILLE_CHECK(add_scalars(parts, Scalar::f32, point_count, result.mesh));
  if ((content & doubles) != 0) MAILLE_CHECK(add_scalars(parts, Scalar::f64, point_count, result.mesh));
  if (parts.left() != 0)
    result.notes.push_back(counted(parts.left(), "byte") +
                           " at its end left out: they belong to nothing it names");
  // Corners may name points that are not there; validate() finds them.
  if (auto ok = validate(result.mesh); !ok)
    return failure(ErrorCode::malformed_input, source.name() + ": " + ok.error().message);
  return result;
}

Result<std::vector<std::string>> write_mz3(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::usage, sink.name() + ": MZ3 files cannot be written; write .ply or .stl");
}

}  // namespace

const Format& mz3_format() {
  static const Format format{
      {"mz3", {".mz3"}, "MZ3, surfaces of Surf Ice and NiiVue; reading only", false, false},
      recognise_mz3,
      read_mz3,
      write_mz3};
  return format;
}

}  // namespace maille
