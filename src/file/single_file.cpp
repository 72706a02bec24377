// Files of mode `single`: a description, the patches, and what joins them.
#include "file/single_file.h"

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/version.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "base/named_error.h"
#include "base/result.h"
#include "code/efforts.h"
#include "container/file_reader.h"
#include "container/packed_file.h"
#include "description/description.h"
#include "description/element_order.h"
#include "surface/arrays/array_report.h"
#include "surface/lost_arrays.h"
#include "surface/mesh_description.h"
#include "surface/parts/coded_parts.h"
#include "surface/patch_memory.h"
#include "surface/weld.h"

namespace maille {
namespace {

constexpr StreamKey description_key{"DESC"};
constexpr StreamKey joins_key{"JOIN"};
constexpr StreamKey order_key{"ORDR"};
constexpr std::string_view known_types[] = {"DESC", "TOPO", "POSI", "TWIN", "ARRY", "JOIN", "ORDR"};

/// A mesh in the streams of a file.
struct CodedMesh {
  std::vector<ArrayToCode> arrays;
  EncodedParts encoded;
  Description description;
  std::vector<std::byte> order;  ///< where it is kept

  size_t bytes() const {
    size_t sum = encoded.joins.size() + order.size();
    for (const EncodedPatch& patch : encoded.patches) sum += patch.bytes();
    return sum;
  }
};

Result<CodedMesh> code_mesh(const Mesh& mesh, std::vector<ArrayToCode> arrays, const EncodeOptions& options) {
  CodedMesh coded;
  coded.arrays = std::move(arrays);
  coded.encoded = MAILLE_TRY(encode_parts(mesh, coded.arrays, options));
  coded.description = describe(mesh, coded.arrays, options);
  coded.description.parts = coded.encoded.descriptions;
  return coded;
}

/// `points` and `positions` are those of the mesh that was welded.
Result<CodedMesh> code_welded(const WeldedMesh& welded, uint64_t points, const ArrayMaps& positions,
                              const EncodeOptions& options) {
  CodedMesh coded;
  coded.arrays = MAILLE_TRY(map_arrays(welded.mesh, options));
  coded.arrays[0].maps = welded_maps(welded, positions);
  for (size_t i = 0; i < welded.by_twin.size(); ++i) coded.arrays[i + 1].by_twin = welded.by_twin[i];
  coded.encoded = MAILLE_TRY(encode_parts(welded.mesh, coded.arrays, options, welded.corner_twin));
  coded.description = describe(welded.mesh, coded.arrays, options);
  coded.description.welded = true;
  coded.description.split_points = static_cast<uint32_t>(points);
  for (size_t i = 0; i < welded.by_twin.size(); ++i) coded.description.arrays[i].by_twin = welded.by_twin[i];
  return coded;
}

EncodeReport report_of(const Mesh& mesh, std::span<const ArrayToCode> arrays, const EncodedParts& encoded) {
  EncodeReport report = report_of(mesh);
  report.connectivity.coded_bytes = encoded.joins.size();
  std::vector<size_t> bytes(arrays.size());
  for (const EncodedPatch& patch : encoded.patches) {
    report.connectivity.coded_bytes += patch.topology.bytes.size();
    if (patch.twins) report.connectivity.coded_bytes += patch.twins->bytes.size();
    for (size_t i = 0; i < arrays.size(); ++i) bytes[i] += patch.arrays[i].bytes.size();
  }
  report.positions = report_of(mesh.points, arrays[0].maps, bytes[0]);
  for (size_t i = 1; i < arrays.size(); ++i) {
    report.arrays.push_back(report_of(mesh.arrays[i - 1], arrays[i].maps, bytes[i]));
  }
  return report;
}

std::vector<PatchSources> sources_of(EncodedParts& encoded) {
  std::vector<PatchSources> sources;
  for (EncodedPatch& patch : encoded.patches) sources.push_back(std::move(patch.sources));
  return sources;
}

/// Points at one place as one, or as they are: whichever is smaller. A mesh in several parts is not welded:
/// docs/format.md, 11.1.
Result<CodedMesh> code_with_order(const Mesh& mesh, const EncodeOptions& options) {
  std::vector<ArrayToCode> arrays = MAILLE_TRY(map_arrays(mesh, options));
  const bool whole = mesh.cell_count() <= most_cells_per_part(options, mesh.cell_count());
  std::optional<WeldedMesh> welded = whole ? weld(mesh, arrays[0]) : std::nullopt;
  CodedMesh coded = MAILLE_TRY(code_mesh(mesh, std::move(arrays), options));
  if (welded) {
    CodedMesh other = MAILLE_TRY(code_welded(*welded, mesh.point_count(), coded.arrays[0].maps, options));
    if (other.bytes() < coded.bytes()) {
      coded = std::move(other);
    } else {
      welded.reset();
    }
  }
  if (options.order != Order::keep) return coded;
  EncodedParts& encoded = coded.encoded;
  ElementOrder elements = original_order(welded ? welded->mesh : mesh, sources_of(encoded), encoded.joined);
  // The order is that of the points of the mesh, not of the fewer ones that were coded.
  if (welded) elements.points = original_points(*welded, elements, encoded.patches[0].twin_numbers);
  coded.order = encode_order(elements);
  return coded;
}

/// Where much is mixed, what lower efforts do may still be smaller, all counted: normals of facets and the
/// order that is kept cost more beside the front than mixing saves (73416, featuretype).
Result<CodedMesh> code_best(const Mesh& mesh, const EncodeOptions& options) {
  CodedMesh coded = MAILLE_TRY(code_with_order(mesh, options));
  if (!effort_of(options.effort).mixed_surface) return coded;
  EncodeOptions lower = options;
  while (effort_of(lower.effort).mixed_surface) --lower.effort;
  CodedMesh other = MAILLE_TRY(code_with_order(mesh, lower));
  if (other.bytes() >= coded.bytes()) return coded;
  // What was asked for, so that a decoded mesh encoded again goes the same way.
  other.description.effort = coded.description.effort;
  return other;
}

void add_patch(std::vector<NamedStream>& streams, const EncodedPatch& patch) {
  streams.push_back({patch.topology.key, patch.topology.bytes});
  if (patch.twins) streams.push_back({patch.twins->key, patch.twins->bytes});
  for (const CodedStream& stream : patch.arrays) {
    // Arrays of the mesh as a whole are in one patch only.
    const bool elsewhere = stream.bytes.empty() && std::string_view(stream.key.type) == "ARRY";
    if (!elsewhere) streams.push_back({stream.key, stream.bytes});
  }
}

}  // namespace

Result<EncodeReport> encode_single(const Mesh& mesh, Sink& sink, const EncodeOptions& options) {
  MAILLE_CHECK(validate(mesh));
  MAILLE_CHECK(check_options(mesh, options));
  const CodedMesh coded = MAILLE_TRY(code_best(mesh, options));
  const EncodedParts& encoded = coded.encoded;
  EncodeReport report = report_of(mesh, coded.arrays, encoded);

  const std::vector<std::byte> description_bytes = MAILLE_TRY(encode_description(coded.description));
  std::vector<NamedStream> streams = {{description_key, description_bytes}};
  for (const EncodedPatch& patch : encoded.patches) add_patch(streams, patch);
  if (encoded.patches.size() > 1) streams.push_back({joins_key, encoded.joins});
  report.order_bytes = coded.order.size();
  if (options.order == Order::keep) streams.push_back({order_key, coded.order});
  report.file_bytes = MAILLE_TRY(write_file(sink, {.major = format_major, .minor = format_minor}, streams));
  MAILLE_CHECK(sink.commit());
  set_other_bytes(report);
  return report;
}

namespace {

/// Unknown critical streams are refused here, before anything is allocated for those that are known.
Result<FileReader> open_file(const Source& source) {
  FileReader reader = MAILLE_TRY(FileReader::open(source, known_types));
  if (reader.header().mode != Mode::single) {
    return failure(ErrorCode::unsupported,
                   source.name() + ": this version reads only files of mode \"single\"");
  }
  return reader;
}

Result<Description> read_description(const FileReader& reader, const Limits& limits) {
  return decode_description(MAILLE_TRY(reader.read_stream(description_key)), limits);
}

/// Bytes of streams: connectivity with twins, positions, then each array.
struct StreamSizes {
  uint64_t topology = 0;
  std::vector<uint64_t> arrays;
};
/// Of all patches. Chunks are gone through once: patches times arrays may be claimed to be 10^12.
StreamSizes sizes_of_streams(const FileReader& reader, size_t arrays) {
  StreamSizes sizes;
  sizes.arrays.resize(arrays + 1);
  for (const ChunkRecord& record : reader.records()) {
    const ChunkHeader& header = record.header;
    const std::string_view type(header.type.data(), header.type.size());
    if (type == "TOPO" || type == "TWIN") sizes.topology += header.size;
    if (type == "POSI") sizes.arrays[0] += header.size;
    if (type == "ARRY" && header.number < arrays) sizes.arrays[header.number + size_t{1}] += header.size;
  }
  return sizes;
}

/// What each of so many patches is decoded from; patch 0 with what is of the mesh as a whole.
std::vector<double> bytes_of_patches(const FileReader& reader, size_t patches) {
  std::vector<double> bytes(patches);
  for (const ChunkRecord& record : reader.records()) {
    if (record.header.patch < patches) bytes[record.header.patch] += record.header.size;
  }
  return bytes;
}

/// How many patches may be decoded at once. Error: memory_bound.
Result<size_t> patches_at_once(const FileReader& reader, const Description& description,
                               const Limits& limits) {
  PatchesMemory memory;
  memory.add_description(description, 2);  // the mesh has it, too
  const std::vector<double> bytes = bytes_of_patches(reader, std::max<size_t>(description.parts.size(), 1));
  if (description.parts.empty()) {
    memory.add_patch(description, bytes[0], is_of_front(reader, 0));
  } else {
    Description of_part = description.of_part(0);
    for (uint32_t part = 0; part < description.parts.size() && !memory.is_over(limits); ++part) {
      of_part.take_part(description, part);
      memory.add_patch(of_part, bytes[part], is_of_front(reader, part));
    }
    memory.add_shared_points(description.points);
    memory.add_after(joining_memory(description));
  }
  if (description.order == Order::keep) memory.add_after(ordering_memory(description));
  return memory.at_once(limits);
}

/// Whatever was wrong should have been found before. If not, it is the file that is wrong, not an input.
Result<> check_valid(const Mesh& mesh) {
  auto valid = validate(mesh);
  if (!valid) return failure(ErrorCode::corrupt, std::move(valid).error().message);
  return {};
}

Result<Mesh> decode_mesh(const FileReader& reader, const DecodeOptions& options) {
  const Description description = MAILLE_TRY(read_description(reader, options.limits));
  const size_t at_once = MAILLE_TRY(patches_at_once(reader, description, options.limits));
  DecodedPatch decoded;
  if (description.parts.empty()) {
    decoded = MAILLE_TRY(decode_patch(reader, description, 0, options));
  } else {
    const std::vector<std::byte> joins = MAILLE_TRY(reader.read_stream(joins_key));
    decoded = MAILLE_TRY(decode_parts(reader, description, joins, at_once, options));
  }
  Mesh& mesh = decoded.mesh;
  mesh.metadata = description.metadata;
  if (description.welded) {
    mesh = MAILLE_TRY(split_twins(std::move(mesh), decoded.twins, decoded.by_twin, description.split_points));
    decoded.known_valid = false;
  }
  if (description.order == Order::keep) {
    const std::vector<std::byte> bytes = MAILLE_TRY(reader.read_stream(order_key));
    const ElementOrder order = MAILLE_TRY(decode_order(bytes, static_cast<uint32_t>(mesh.point_count()),
                                                       static_cast<uint32_t>(mesh.cell_count())));
    mesh = MAILLE_TRY(restore_order(std::move(mesh), order));
    decoded.known_valid = false;
  }
  // A look at every corner takes time.
  if (!decoded.known_valid) MAILLE_CHECK(check_valid(mesh));
  return std::move(mesh);
}

/// The only patch of a mesh. Without its twins points stay welded.
Result<Remains> salvage_patch(const FileReader& reader, Description description,
                              const DecodeOptions& options) {
  Remains remains;
  if (description.welded) {
    const auto twins = reader.read_stream(twins_key(0));
    if (!twins && !is_loss(twins.error())) return tl::unexpected(twins.error());
    description.welded = twins.has_value();
    if (!twins) remains.lost.push_back("which points are several at one place");
  }
  LostArrays lost;
  DecodedPatch decoded = MAILLE_TRY(decode_patch(reader, description, 0, options, nullptr, nullptr, &lost));
  remains.mesh = std::move(decoded.mesh);
  if (description.welded) {
    remains.mesh = MAILLE_TRY(
        split_twins(std::move(remains.mesh), decoded.twins, decoded.by_twin, description.split_points));
  }
  tell_lost_arrays(description, lost, remains);
  return remains;
}

Result<Remains> salvage_mesh(const FileReader& reader, const DecodeOptions& options) {
  const Description description = MAILLE_TRY(read_description(reader, options.limits));
  const size_t at_once = MAILLE_TRY(patches_at_once(reader, description, options.limits));
  Remains remains =
      MAILLE_TRY(description.parts.empty()
                     ? salvage_patch(reader, description, options)
                     : salvage_parts(reader, description, reader.read_stream(joins_key), at_once, options));
  remains.mesh.metadata = description.metadata;
  if (description.order == Order::keep) {
    const uint32_t points = description.welded ? description.split_points : description.points;
    MAILLE_CHECK(put_in_order(reader.read_stream(order_key), points, description.cells(), remains));
  }
  MAILLE_CHECK(check_valid(remains.mesh));
  return remains;
}

}  // namespace

Result<Mesh> decode_single(const Source& source, const DecodeOptions& options) {
  const FileReader reader = MAILLE_TRY(open_file(source));
  MAILLE_CHECK(reader.check_complete());
  return with_name(decode_mesh(reader, options), source.name());
}

Result<Remains> salvage_single(const Source& source, const DecodeOptions& options) {
  const FileReader reader = MAILLE_TRY(open_file(source));
  return with_name(salvage_mesh(reader, options), source.name());
}

Result<FileInfo> inspect_single(const Source& source, const Limits& limits) {
  const FileReader reader = MAILLE_TRY(open_file(source));
  const Description description = MAILLE_TRY(with_name(read_description(reader, limits), source.name()));
  FileInfo info = file_info(description);
  info.format_major = reader.header().major;
  info.format_minor = reader.header().minor;
  info.mode = reader.header().mode;
  info.file_bytes = source.size();
  const StreamSizes coded = sizes_of_streams(reader, description.arrays.size());
  info.connectivity.coded_bytes = reader.stream_bytes(joins_key) + coded.topology;
  info.positions = array_info(description, description.positions, coded.arrays[0]);
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    info.arrays.push_back(array_info(description, description.arrays[i], coded.arrays[i + 1]));
  }
  info.chunks = reader.chunks();
  info.problems = reader.problems();
  return info;
}

}  // namespace maille
