// encode(), decode() and inspect() for files of mode `single`: a description, the topology, positions,
// arrays, one stream each.
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/version.h>

#include <algorithm>
#include <string>

#include "base/result.h"
#include "container/file_reader.h"
#include "container/file_writer.h"
#include "surface/description.h"
#include "surface/element_order.h"
#include "surface/mixed_array.h"
#include "surface/patch_topology.h"

namespace maille {
namespace {

constexpr StreamKey description_key{"DESC"};
constexpr StreamKey topology_key{"TOPO"};
constexpr StreamKey positions_key{"POSI"};
constexpr StreamKey order_key{"ORDR"};
StreamKey array_key(size_t i) {
  return {"ARRY", 0, static_cast<uint32_t>(i)};
}
constexpr std::string_view known_types[] = {"DESC", "TOPO", "POSI", "ORDR", "ARRY"};

ArrayReport report_of(const Array& array, const ArrayMaps& maps, size_t coded_bytes) {
  ArrayReport report;
  report.name = array.name;
  report.domain = array.domain;
  report.type = array.type;
  report.components = array.components;
  report.elements = array.count();
  report.raw_bytes = array.bytes.size();
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
  if (options.mode != Mode::single) {
    return failure(ErrorCode::unsupported, "only mode \"single\" can be written by this version");
  }
  if (options.effort < 1 || options.effort > 9)
    return failure(ErrorCode::usage, "the effort must be from 1 to 9");
  for (const auto& [name, tolerance] : options.arrays) {
    const auto same_name = [&name = name](const Array& array) { return array.name == name; };
    if (std::none_of(mesh.arrays.begin(), mesh.arrays.end(), same_name)) {
      return failure(ErrorCode::usage, "the mesh has no array named \"" + name + "\"");
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

/// The elements of `domain` in coded order, by their tuples in the mesh.
std::vector<uint32_t> sources_of(const Mesh& mesh, EncodedTopology& encoded, const Array& array) {
  if (array.domain == Domain::point) return encoded.sources.points;
  if (array.domain == Domain::cell) return encoded.sources.cells;
  if (array.domain == Domain::corner) {
    if (encoded.sources.corners.empty()) find_corner_sources(mesh, encoded);
    return encoded.sources.corners;
  }
  std::vector<uint32_t> all(array.count());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  return all;
}

/// Cells of the decoded mesh in its order, as numbers of coded cells; the same for the corners they start
/// with.
ElementOrder original_order(const Mesh& mesh, const EncodedTopology& encoded) {
  ElementOrder order;
  order.points = encoded.sources.points;
  std::vector<uint64_t> block_of;
  std::vector<uint64_t> corner_of;
  uint64_t corner = 0;
  for (uint32_t b = 0; b < mesh.blocks.size(); ++b) {
    for (uint64_t i = 0; i < mesh.blocks[b].size(); ++i) {
      block_of.push_back(b);
      corner_of.push_back(corner);
      corner += mesh.blocks[b].cell(i).size();
    }
  }
  // The decoder writes block after block, each in coded order.
  std::vector<uint32_t> coded(encoded.sources.cells.size());
  for (uint32_t i = 0; i < coded.size(); ++i) coded[i] = i;
  std::stable_sort(coded.begin(), coded.end(), [&](uint32_t a, uint32_t b) {
    return block_of[encoded.sources.cells[a]] < block_of[encoded.sources.cells[b]];
  });
  for (const uint32_t i : coded) {
    const uint32_t cell = encoded.sources.cells[i];
    order.cells.push_back(cell);
    order.rotation.push_back(static_cast<uint32_t>(encoded.sources.first_corner[i] - corner_of[cell]));
  }
  return order;
}

Tolerance tolerance_of(const EncodeOptions& options, const std::string& name) {
  const auto found = options.arrays.find(name);
  return found == options.arrays.end() ? Tolerance{} : found->second;
}

uint32_t pivot_window(int effort) {
  return effort >= 7 ? 24 : 4;
}

}  // namespace

Result<EncodeReport> encode(const Mesh& mesh, Sink& sink, const EncodeOptions& options) {
  MAILLE_CHECK(validate(mesh));
  MAILLE_CHECK(check_options(mesh, options));
  if (!Pace(options.progress, "connectivity", 0).report()) return cancelled();
  EncodedTopology encoded =
      MAILLE_TRY(encode_topology(mesh, pivot_window(options.effort), options.effort >= least_mixed_effort));
  const PatchElements elements = encoded.topology.elements();

  Description description = describe(mesh, options);
  EncodeReport report;
  std::vector<std::vector<std::byte>> streams;
  const auto encode_one = [&](const Array& array, const Tolerance& tolerance, ArrayDescription& described,
                              ArrayReport& reported) -> Result<> {
    Pace pace(options.progress, array.name.c_str(), array.count());
    if (!pace.report()) return cancelled();
    const ArrayMaps maps = MAILLE_TRY(choose_maps(array, tolerance, &array == &mesh.points));
    // Mixing is made for places in space.
    const int effort =
        &array == &mesh.points ? options.effort : std::min(options.effort, least_mixed_effort - 1);
    streams.push_back(encode_array(elements, array, maps, sources_of(mesh, encoded, array), effort, &pace));
    if (pace.stopped()) return cancelled();
    described = describe(array, maps, tolerance);
    reported = report_of(array, maps, streams.back().size());
    return {};
  };
  MAILLE_CHECK(encode_one(mesh.points, options.positions, description.positions, report.positions));
  for (const Array& array : mesh.arrays) {
    MAILLE_CHECK(encode_one(array, tolerance_of(options, array.name), description.arrays.emplace_back(),
                            report.arrays.emplace_back()));
  }

  const std::vector<std::byte> description_bytes = MAILLE_TRY(encode_description(description));
  FileWriter writer = MAILLE_TRY(FileWriter::begin(sink, {.major = format_major, .minor = format_minor}));
  MAILLE_CHECK(writer.write_stream(description_key, description_bytes));
  MAILLE_CHECK(writer.write_stream(topology_key, encoded.bytes));
  MAILLE_CHECK(writer.write_stream(positions_key, streams[0]));
  for (size_t i = 0; i < mesh.arrays.size(); ++i)
    MAILLE_CHECK(writer.write_stream(array_key(i), streams[i + 1]));
  if (options.order == Order::keep) {
    const std::vector<std::byte> order = encode_order(original_order(mesh, encoded));
    report.order_bytes = order.size();
    MAILLE_CHECK(writer.write_stream(order_key, order));
  }
  report.file_bytes = MAILLE_TRY(writer.finish());
  MAILLE_CHECK(sink.commit());

  report.points = mesh.point_count();
  report.cells = mesh.cell_count();
  report.connectivity.name = "connectivity";
  report.connectivity.domain = Domain::cell;
  report.connectivity.type = Scalar::u32;
  report.connectivity.elements = mesh.cell_count();
  for (const CellBlock& block : mesh.blocks) {
    report.connectivity.raw_bytes +=
        block.connectivity.size() * 4 + block.offsets.size() * 8 + block.types.size();
  }
  report.connectivity.coded_bytes = encoded.bytes.size();
  report.other_bytes = report.file_bytes - report.connectivity.coded_bytes - report.order_bytes;
  for (const auto& stream : streams) report.other_bytes -= stream.size();
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

Array array_of(const ArrayDescription& description) {
  Array array = make_array(description.name, description.domain, description.type, description.components,
                           description.role);
  array.labels = description.labels;
  return array;
}

bool is_wanted(const DecodeOptions& options, const std::string& name) {
  return !options.arrays ||
         std::find(options.arrays->begin(), options.arrays->end(), name) != options.arrays->end();
}

/// Is an array wanted whose tuples follow cells or corners?
bool needs_places(const Description& description, const DecodeOptions& options) {
  return std::any_of(description.arrays.begin(), description.arrays.end(),
                     [&](const ArrayDescription& array) {
                       return (array.domain == Domain::cell || array.domain == Domain::corner) &&
                              is_wanted(options, array.name);
                     });
}

Result<Mesh> decode_patch(const FileReader& reader, const DecodeOptions& options) {
  const Description description =
      MAILLE_TRY(decode_description(MAILLE_TRY(reader.read_stream(description_key)), options.limits));
  Mesh mesh;
  mesh.metadata = description.metadata;
  if (!Pace(options.progress, "connectivity", 0).report()) return cancelled();
  const std::vector<BlockShape> shapes = description.shapes();
  const bool with_places = needs_places(description, options);
  PatchTopology topology = MAILLE_TRY(decode_topology(MAILLE_TRY(reader.read_stream(topology_key)), shapes,
                                                      description.points, description.corners, with_places));
  const PatchElements elements = topology.elements();
  const auto decode_one = [&](const ArrayDescription& described, const StreamKey& key) -> Result<Array> {
    Pace pace(options.progress, described.name.c_str(), description.tuples(described));
    if (!pace.report()) return cancelled();
    Array array = array_of(described);
    MAILLE_CHECK(
        decode_array(elements, MAILLE_TRY(reader.read_stream(key)), described.mesh_tuples, array, &pace));
    return array;
  };
  mesh.points = MAILLE_TRY(decode_one(description.positions, positions_key));
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    if (!is_wanted(options, description.arrays[i].name)) continue;
    mesh.arrays.push_back(MAILLE_TRY(decode_one(description.arrays[i], array_key(i))));
  }
  AssembledCells cells = assemble_cells(std::move(topology), shapes, with_places);
  mesh.blocks = std::move(cells.blocks);
  for (size_t b = 0; b < mesh.blocks.size(); ++b) mesh.blocks[b].name = description.blocks[b].name;
  if (mesh.corner_count() != description.corners || mesh.cell_count() != description.cells()) {
    return failure(ErrorCode::corrupt, "the cells are not those of the description");
  }
  for (Array& array : mesh.arrays) {
    if (array.domain == Domain::cell) move_tuples(array, cells.cell_place, mesh.cell_count());
    if (array.domain == Domain::corner) move_tuples(array, cells.corner_place, mesh.corner_count());
  }
  if (description.order == Order::keep) {
    const ElementOrder order =
        MAILLE_TRY(decode_order(MAILLE_TRY(reader.read_stream(order_key)), description.points,
                                static_cast<uint32_t>(description.cells())));
    mesh = MAILLE_TRY(restore_order(std::move(mesh), order));
  }
  MAILLE_CHECK(validate(mesh));
  return mesh;
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

Result<Mesh> decode(const Source& source, const DecodeOptions& options) {
  const FileReader reader = MAILLE_TRY(open_file(source));
  MAILLE_CHECK(reader.check_complete());
  Result<Mesh> mesh = decode_patch(reader, options);
  if (!mesh) return tl::unexpected(with_name(std::move(mesh).error(), source));
  return mesh;
}

Result<FileInfo> inspect(const Source& source) {
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
  for (const BlockDescription& block : description.blocks) {
    const std::string type = std::string("(") + name_of(block.shape.type) + ")";
    info.blocks.emplace_back(block.name.empty() ? type : block.name + " " + type, block.shape.cells);
  }
  info.connectivity.name = "connectivity";
  info.connectivity.domain = Domain::corner;
  info.connectivity.type = Scalar::u32;
  info.connectivity.count = description.corners;
  info.connectivity.coded_bytes = reader.stream_bytes(topology_key);
  info.positions = info_of(description, description.positions, reader.stream_bytes(positions_key));
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    info.arrays.push_back(info_of(description, description.arrays[i], reader.stream_bytes(array_key(i))));
  }
  info.metadata = description.metadata;
  info.provenance = description.provenance;
  info.chunks = reader.chunks();
  info.problems = reader.problems();
  return info;
}

}  // namespace maille
