// Any bytes as a small mesh with options: what is encoded comes back, and gives the same file again.

#include <maille/compare.h>

#include "base/bytes.h"
#include "fuzzing.h"

namespace maille::fuzzing {
namespace {

constexpr CellType types[] = {CellType::triangle, CellType::quad,           CellType::polygon,
                              CellType::polygon,  CellType::triangle,       CellType::line,
                              CellType::mixed,    CellType::triangle_strip, CellType::tetrahedron};

CellBlock read_block(ByteReader& in, uint32_t points) {
  CellBlock block;
  block.type = types[in.get<uint8_t>() % std::size(types)];
  const bool varies = nodes_of(block.type) == 0;
  if (varies) block.offsets.push_back(0);
  for (unsigned left = in.get<uint8_t>() % 64; left > 0 && in.ok(); --left) {
    CellType type = block.type;
    if (type == CellType::mixed) {
      type = types[in.get<uint8_t>() % 6];
      block.types.push_back(static_cast<uint8_t>(type));
    }
    unsigned nodes = nodes_of(type);
    if (nodes == 0) nodes = in.get<uint8_t>() % 12;
    while (nodes-- > 0) block.connectivity.push_back(in.get<uint8_t>() % points);
    if (varies) block.offsets.push_back(block.connectivity.size());
  }
  return block;
}

void fill(Array& array, uint64_t tuples, ByteReader& in) {
  array.resize(tuples);
  // The last bytes of the numbers first, so that few input bytes make sensible numbers.
  for (size_t i = 0; i < array.bytes.size() && in.remaining() > 0; ++i) {
    if (i % size_of(array.type) >= size_of(array.type) - 2) array.bytes[i] = in.get<std::byte>();
  }
}

EncodeOptions read_options(ByteReader& in) {
  EncodeOptions options;
  const auto bits = in.get<uint8_t>();
  options.effort = 1 + bits % 9;
  if ((bits & 16) != 0) options.order = Order::keep;
  options.positions.kind = static_cast<Tolerance::Kind>(bits >> 6);
  // Bounds as coarse as the mesh itself change its size, so that a second encoding takes another lattice.
  const double number = 1 + in.get<uint8_t>() % 24;
  options.positions.value = options.positions.kind == Tolerance::Kind::bits       ? 5 + number
                            : options.positions.kind == Tolerance::Kind::relative ? 0.01 / number
                                                                                  : 1 / number;
  return options;
}

Mesh read_mesh(ByteReader& in) {
  Mesh mesh;
  mesh.points =
      make_array("position", Domain::point, static_cast<Scalar>(in.get<uint8_t>() % scalar_count), 3);
  const uint32_t points = 1 + in.get<uint8_t>() % 64;
  for (unsigned blocks = 1 + in.get<uint8_t>() % 3; blocks > 0; --blocks) {
    mesh.blocks.push_back(read_block(in, points));
  }
  unsigned arrays = in.get<uint8_t>() % 4;
  fill(mesh.points, points, in);
  for (; arrays > 0; --arrays) {
    Array& array = mesh.arrays.emplace_back(
        make_array("a" + std::to_string(arrays), static_cast<Domain>(in.get<uint8_t>() % domain_count),
                   static_cast<Scalar>(in.get<uint8_t>() % scalar_count), 1 + in.get<uint8_t>() % 5,
                   static_cast<Role>(in.get<uint8_t>() % 5)));
    fill(array, array.domain == Domain::mesh ? in.get<uint8_t>() : mesh.count_of(array.domain), in);
  }
  return mesh;
}

void run(Bytes input) {
  ByteReader in(input);
  EncodeOptions options = read_options(in);
  const Mesh mesh = read_mesh(in);
  require(validate(mesh).has_value(), "the mesh is valid");
  const bool lossless = options.positions.kind == Tolerance::Kind::lossless;
  if (!lossless && !mesh.arrays.empty()) options.arrays["a1"] = options.positions;
  const auto file = encoded(mesh, options);
  if (!file) return require_kind(file.error(), {ErrorCode::usage, ErrorCode::error_bound});
  const auto back = decoded(*file, uint64_t{1} << 30);
  require(back.has_value(), "what was encoded can be decoded");
  if (lossless) {
    CompareOptions compare_options;
    compare_options.same_order = options.order == Order::keep;
    const Comparison comparison = compare(mesh, *back, compare_options);
    for (const std::string& words : comparison.differences) std::fprintf(stderr, "%s\n", words.c_str());
    require(comparison.equal, "what was decoded is what was encoded");
  }
  const auto again = encoded(*back, options);
  require(again.has_value(), "what was decoded can be encoded");
  // Mostly it is the same file: docs/encoder.md names when it is not. Its mesh is the same where the bound
  // does not depend on the box of the points, which rounding moves.
  const auto twice = decoded(*again, uint64_t{1} << 30);
  require(twice.has_value(), "what was encoded again can be decoded");
  if (lossless || options.positions.kind == Tolerance::Kind::absolute)
    require(compare(*back, *twice).equal, "encoding what was decoded changes nothing");
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  maille::fuzzing::run(std::as_bytes(std::span(data, size)));
  return 0;
}
