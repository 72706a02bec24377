// B3DM, a tile of 3D Tiles 1.0: a GLB file behind tables of its features. The tables are read for one thing
// only, the place of the tile; what they say of features is left out.
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/bytes.h"
#include "base/result.h"
#include "io/format.h"
#include "io/gltf/gltf.h"
#include "io/gltf/gltf_file.h"
#include "io/reading.h"

namespace maille {
namespace {

constexpr size_t header_bytes = 28;

bool recognise_b3dm(Bytes bytes) {
  return bytes.size() >= 4 && std::memcmp(bytes.data(), "b3dm", 4) == 0;
}

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Keeps the point to which positions are relative, as metadata: it is given in doubles, and floats would not
/// hold the sum.
void add_centre(std::string_view features, ReadResult& result) {
  if (json_too_deep(features)) {
    result.notes.push_back("the table of positions (feature table) left out: it is nested too deep");
    return;
  }
  const auto table = nlohmann::json::parse(features, nullptr, false);
  if (!table.is_object() || !table.contains("RTC_CENTER")) return;
  result.mesh.metadata.emplace_back("b3dm.rtc_center", table["RTC_CENTER"].dump());
  result.notes.push_back("positions are relative to the centre of the tile, which is kept as metadata");
}

Result<ReadResult> read_b3dm(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  const Bytes bytes = input.bytes();
  if (!recognise_b3dm(bytes) || bytes.size() < header_bytes)
    return failure(ErrorCode::malformed_input,
                   source.name() + ": it does not begin with the header of a B3DM file");
  // Seven 32-bit numbers: magic, version, bytes of the file, and of four tables (features and batches, JSON
  // and binary each).
  const auto number = [&](size_t i) { return uint64_t{load<uint32_t>(bytes.data() + 4 * i)}; };
  if (number(1) != 1) {
    return failure(ErrorCode::unsupported, source.name() + ": it is B3DM version " +
                                               std::to_string(number(1)) + "; only version 1 can be read");
  }
  // In 64 bits, so the sum of four 32-bit numbers cannot overflow.
  const uint64_t tables = number(3) + number(4) + number(5) + number(6);
  if (number(2) > bytes.size() || header_bytes + tables > number(2)) {
    return failure(ErrorCode::malformed_input, source.name() + ": its header says " +
                                                   std::to_string(number(2)) + " bytes with tables of " +
                                                   std::to_string(tables) + ", but it has " +
                                                   std::to_string(bytes.size()) + "; it is cut off");
  }
  const Bytes glb = bytes.first(number(2)).subspan(header_bytes + tables);
  ReadResult result = MAILLE_TRY(read_gltf(*memory_source(glb, source.name()), options));
  add_centre(text_of(bytes.subspan(header_bytes, number(3))), result);
  if (number(5) + number(6) != 0) result.notes.push_back("the table of features (batch table) left out");
  return result;
}

Result<std::vector<std::string>> write_b3dm(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::usage, sink.name() + ": B3DM files cannot be written; write .glb");
}

}  // namespace

const Format& b3dm_format() {
  static const Format format{{"b3dm", {".b3dm"}, "B3DM, a tile of 3D Tiles; reading only", false, false},
                             recognise_b3dm,
                             read_b3dm,
                             write_b3dm};
  return format;
}

}  // namespace maille
