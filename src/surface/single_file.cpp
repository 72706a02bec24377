// Files of mode `single`: a description, the patches, and what joins them.
#include "surface/single_file.h"

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/version.h>

#include <algorithm>
#include <string>

#include "base/result.h"
#include "container/file_reader.h"
#include "container/file_writer.h"
#include "surface/array_report.h"
#include "surface/coded_parts.h"
#include "surface/description.h"
#include "surface/element_order.h"

namespace maille {
namespace {

constexpr StreamKey description_key{"DESC"};
constexpr StreamKey joins_key{"JOIN"};
constexpr StreamKey order_key{"ORDR"};
constexpr std::string_view known_types[] = {"DESC", "TOPO", "POSI", "ARRY", "JOIN", "ORDR"};

ArrayReport report_of(const Array& array, const ArrayMaps& maps, size_t coded_bytes) {
  ArrayReport report = report_of(array);
  report.coded_bytes = coded_bytes;
  report.lossless = maps.lossless;
  report.bound = maps.bound;
  report.maximum_error = maps.maximum_error;
  report.step = maps.step;
  return report;
}

ArrayDescription describe(const Array& array, const ArrayMaps& maps, const Tolerance& asked) {
  ArrayDescription description;
  description.name = array.name;
  description.domain = array.domain;
  description.type = array.type;
  description.components = array.components;
  description.role = array.role;
  description.labels = array.labels;
  if (array.domain == Domain::mesh) description.mesh_tuples = array.count();
  if (!maps.lossless) description.asked = asked;
  description.bound = maps.bound;
  description.step = maps.step;
  return description;
}

Description describe(const Mesh& mesh, const EncodeOptions& options) {
  Description description;
  description.effort = static_cast<uint8_t>(options.effort);
  description.order = options.order;
  description.points = static_cast<uint32_t>(mesh.point_count());
  description.corners = mesh.corner_count();
  for (const CellBlock& block : mesh.blocks)
    description.blocks.push_back({block.name, {block.type, block.size()}});
  description.metadata = mesh.metadata;
  description.provenance = options.provenance;
  return description;
}

Result<> check_options(const Mesh& mesh, const EncodeOptions& options) {
  if (options.effort < 1 || options.effort > 9)
    return failure(ErrorCode::usage, "the effort must be from 1 to 9");
  if (options.most_cells_per_part == 0) return failure(ErrorCode::usage, "parts must have a cell at least");
  for (const auto& [name, tolerance] : options.arrays) {
    const auto same_name = [&name = name](const Array& array) { return array.name == name; };
    if (std::none_of(mesh.arrays.begin(), mesh.arrays.end(), same_name)) {
      return failure(ErrorCode::usage, "the mesh has no array named \"" + name + "\"");
    }
  }
  for (const CellBlock& block : mesh.blocks) {
    if (!block.face_sizes.empty()) {
      return failure(ErrorCode::unsupported, "mode \"single\" does not hold polyhedra");
    }
  }
  for (const Array& array : mesh.arrays) {
    if (array.components > 0xffff || array.count() >= none) {
      return failure(ErrorCode::unsupported,
                     "array \"" + array.name + "\" is too large for a file of mode single");
    }
  }
  return {};
}

/// How the elements of the decoded mesh stood in `mesh`.
ElementOrder original_order(const Mesh& mesh, std::span<const EncodedPatch> patches,
                            const JoinedPoints& joined) {
  struct CodedCell {
    uint32_t cell;
    uint32_t first_corner;
  };
  const CellTable cells = table_cells(mesh);
  ElementOrder order;
  order.points.resize(joined.count);
  std::vector<CodedCell> coded;
  for (size_t p = 0; p < patches.size(); ++p) {
    const PatchSources& sources = patches[p].sources;
    const std::vector<uint32_t> numbers = joined.parts[p].all_numbers();
    for (size_t i = 0; i < numbers.size(); ++i) order.points[numbers[i]] = sources.points[i];
    for (size_t i = 0; i < sources.cells.size(); ++i)
      coded.push_back({sources.cells[i], sources.first_corner[i]});
  }
  // The decoder writes block after block, in each of them patch after patch, each in coded order.
  std::stable_sort(coded.begin(), coded.end(), [&](const CodedCell& a, const CodedCell& b) {
    return cells.block[a.cell] < cells.block[b.cell];
  });
  for (const CodedCell& c : coded) {
    order.cells.push_back(c.cell);
    order.rotation.push_back(c.first_corner - cells.corner[c.cell]);
  }
  return order;
}

Tolerance tolerance_of(const EncodeOptions& options, const std::string& name) {
  const auto found = options.arrays.find(name);
  return found == options.arrays.end() ? Tolerance{} : found->second;
}

Result<std::vector<ArrayToCode>> map_arrays(const Mesh& mesh, const EncodeOptions& options) {
  std::vector<ArrayToCode> arrays;
  arrays.push_back({&mesh.points, MAILLE_TRY(choose_maps(mesh.points, options.positions, true))});
  for (const Array& array : mesh.arrays) {
    arrays.push_back({&array, MAILLE_TRY(choose_maps(array, tolerance_of(options, array.name), false))});
  }
  return arrays;
}

Description describe(const Mesh& mesh, std::span<const ArrayToCode> arrays, const EncodeOptions& options) {
  Description description = describe(mesh, options);
  description.positions = describe(mesh.points, arrays[0].maps, options.positions);
  for (const ArrayToCode& coded : arrays.subspan(1)) {
    description.arrays.push_back(
        describe(*coded.array, coded.maps, tolerance_of(options, coded.array->name)));
  }
  return description;
}

EncodeReport report_of(const Mesh& mesh, std::span<const ArrayToCode> arrays, const EncodedParts& encoded) {
  EncodeReport report = report_of(mesh);
  report.connectivity.coded_bytes = encoded.joins.size();
  std::vector<size_t> bytes(arrays.size());
  for (const EncodedPatch& patch : encoded.patches) {
    report.connectivity.coded_bytes += patch.topology.bytes.size();
    for (size_t i = 0; i < arrays.size(); ++i) bytes[i] += patch.arrays[i].bytes.size();
  }
  report.positions = report_of(*arrays[0].array, arrays[0].maps, bytes[0]);
  for (size_t i = 1; i < arrays.size(); ++i) {
    report.arrays.push_back(report_of(*arrays[i].array, arrays[i].maps, bytes[i]));
  }
  return report;
}

Result<> write_patch(FileWriter& writer, const EncodedPatch& patch) {
  MAILLE_CHECK(writer.write_stream(patch.topology.key, patch.topology.bytes));
  for (const CodedStream& stream : patch.arrays) {
    // Arrays of the mesh as a whole are in one patch only.
    const bool elsewhere = stream.bytes.empty() && std::string_view(stream.key.type) == "ARRY";
    if (!elsewhere) MAILLE_CHECK(writer.write_stream(stream.key, stream.bytes));
  }
  return {};
}

}  // namespace

Result<EncodeReport> encode_single(const Mesh& mesh, Sink& sink, const EncodeOptions& options) {
  MAILLE_CHECK(validate(mesh));
  MAILLE_CHECK(check_options(mesh, options));
  const std::vector<ArrayToCode> arrays = MAILLE_TRY(map_arrays(mesh, options));
  const EncodedParts encoded = MAILLE_TRY(encode_parts(mesh, arrays, options));
  Description description = describe(mesh, arrays, options);
  description.parts = encoded.descriptions;
  EncodeReport report = report_of(mesh, arrays, encoded);

  const std::vector<std::byte> description_bytes = MAILLE_TRY(encode_description(description));
  FileWriter writer = MAILLE_TRY(FileWriter::begin(sink, {.major = format_major, .minor = format_minor}));
  MAILLE_CHECK(writer.write_stream(description_key, description_bytes));
  for (const EncodedPatch& patch : encoded.patches) MAILLE_CHECK(write_patch(writer, patch));
  if (encoded.patches.size() > 1) MAILLE_CHECK(writer.write_stream(joins_key, encoded.joins));
  if (options.order == Order::keep) {
    const std::vector<std::byte> order = encode_order(original_order(mesh, encoded.patches, encoded.joined));
    report.order_bytes = order.size();
    MAILLE_CHECK(writer.write_stream(order_key, order));
  }
  report.file_bytes = MAILLE_TRY(writer.finish());
  MAILLE_CHECK(sink.commit());
  report.other_bytes =
      report.file_bytes - report.connectivity.coded_bytes - report.order_bytes - report.positions.coded_bytes;
  for (const ArrayReport& array : report.arrays) report.other_bytes -= array.coded_bytes;
  return report;
}

namespace {

Result<FileReader> open_file(const Source& source) {
  FileReader reader = MAILLE_TRY(FileReader::open(source, known_types));
  if (reader.header().mode != Mode::single) {
    return failure(ErrorCode::unsupported,
                   source.name() + ": this version reads only files of mode \"single\"");
  }
  return reader;
}

/// Errors from inside a patch do not know the file they are about.
Error with_name(Error error, const Source& source) {
  const bool named = error.message.compare(0, source.name().size(), source.name()) == 0;
  if (!named && (error.code == ErrorCode::corrupt || error.code == ErrorCode::memory_bound)) {
    error.message = source.name() + ": " + error.message;
  }
  return error;
}

Result<Mesh> decode_mesh(const FileReader& reader, const DecodeOptions& options) {
  const Description description =
      MAILLE_TRY(decode_description(MAILLE_TRY(reader.read_stream(description_key)), options.limits));
  DecodedPatch decoded;
  if (description.parts.empty()) {
    decoded = MAILLE_TRY(decode_patch(reader, description, 0, options));
  } else {
    const std::vector<std::byte> joins = MAILLE_TRY(reader.read_stream(joins_key));
    decoded = MAILLE_TRY(decode_parts(reader, description, joins, options));
  }
  Mesh& mesh = decoded.mesh;
  mesh.metadata = description.metadata;
  if (description.order == Order::keep) {
    const ElementOrder order =
        MAILLE_TRY(decode_order(MAILLE_TRY(reader.read_stream(order_key)), description.points,
                                static_cast<uint32_t>(description.cells())));
    mesh = MAILLE_TRY(restore_order(std::move(mesh), order));
    decoded.known_valid = false;
  }
  // A look at every corner takes time.
  if (decoded.known_valid) return std::move(mesh);
  // Whatever was wrong should have been found before. If not, it is the file that is wrong, not an input.
  if (auto valid = validate(mesh); !valid)
    return failure(ErrorCode::corrupt, std::move(valid).error().message);
  return std::move(mesh);
}

ArrayInfo info_of(const Description& description, const ArrayDescription& array, uint64_t coded_bytes) {
  ArrayInfo info;
  info.name = array.name;
  info.domain = array.domain;
  info.type = array.type;
  info.components = array.components;
  info.role = array.role;
  info.count = description.tuples(array);
  info.coded_bytes = coded_bytes;
  info.lossless = array.asked.kind == Tolerance::Kind::lossless;
  info.asked = array.asked;
  info.step = array.step;
  info.bound = array.bound;
  return info;
}

}  // namespace

Result<Mesh> decode_single(const Source& source, const DecodeOptions& options) {
  const FileReader reader = MAILLE_TRY(open_file(source));
  MAILLE_CHECK(reader.check_complete());
  Result<Mesh> mesh = decode_mesh(reader, options);
  if (!mesh) return tl::unexpected(with_name(std::move(mesh).error(), source));
  return mesh;
}

Result<FileInfo> inspect_single(const Source& source) {
  const FileReader reader = MAILLE_TRY(open_file(source));
  auto described = decode_description(MAILLE_TRY(reader.read_stream(description_key)), {});
  if (!described) return tl::unexpected(with_name(std::move(described).error(), source));
  const Description& description = *described;
  FileInfo info;
  info.format_major = reader.header().major;
  info.format_minor = reader.header().minor;
  info.mode = reader.header().mode;
  info.effort = description.effort;
  info.order = description.order;
  info.file_bytes = source.size();
  info.points = description.points;
  info.cells = description.cells();
  info.corners = description.corners;
  info.parts = std::max<uint64_t>(description.parts.size(), 1);
  for (const CodedBlock& block : description.blocks) {
    const std::string type = std::string("(") + name_of(block.shape.type) + ")";
    info.blocks.emplace_back(block.name.empty() ? type : block.name + " " + type, block.shape.cells);
  }
  info.connectivity.name = "connectivity";
  info.connectivity.domain = Domain::corner;
  info.connectivity.type = Scalar::u32;
  info.connectivity.count = description.corners;
  info.connectivity.coded_bytes = reader.stream_bytes(joins_key);
  std::vector<uint64_t> coded(description.arrays.size() + 1);
  for (uint32_t patch = 0; patch < info.parts; ++patch) {
    const PatchSizes sizes = sizes_of_patch(reader, patch, description.arrays.size());
    info.connectivity.coded_bytes += sizes.topology;
    for (size_t i = 0; i < coded.size(); ++i) coded[i] += sizes.arrays[i];
  }
  info.positions = info_of(description, description.positions, coded[0]);
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    info.arrays.push_back(info_of(description, description.arrays[i], coded[i + 1]));
  }
  info.metadata = description.metadata;
  info.provenance = description.provenance;
  info.chunks = reader.chunks();
  info.problems = reader.problems();
  return info;
}

}  // namespace maille
