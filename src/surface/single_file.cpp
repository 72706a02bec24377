// encode(), decode() and inspect() for files of mode `single`: a description, the patches, and what joins
// them.
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/version.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <string>

#include "base/result.h"
#include "container/file_reader.h"
#include "container/file_writer.h"
#include "surface/description.h"
#include "surface/element_order.h"
#include "surface/joins.h"
#include "surface/merge_parts.h"
#include "surface/partition.h"
#include "surface/patch_streams.h"

namespace maille {
namespace {

constexpr StreamKey description_key{"DESC"};
constexpr StreamKey joins_key{"JOIN"};
constexpr StreamKey order_key{"ORDR"};
constexpr std::string_view known_types[] = {"DESC", "TOPO", "POSI", "ARRY", "JOIN", "ORDR"};

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
  if (options.most_cells_per_part == 0) return failure(ErrorCode::usage, "parts must have a cell at least");
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

/// How the elements of the decoded mesh stood in `mesh`.
ElementOrder original_order(const Mesh& mesh, std::span<const EncodedPatch> patches,
                            const JoinedPoints& joined) {
  struct CodedCell {
    uint32_t cell;
    uint32_t first_corner;
  };
  std::vector<uint32_t> block_of;
  std::vector<uint64_t> corner_of;
  uint64_t corner = 0;
  for (uint32_t b = 0; b < mesh.blocks.size(); ++b) {
    for (uint64_t i = 0; i < mesh.blocks[b].size(); ++i) {
      block_of.push_back(b);
      corner_of.push_back(corner);
      corner += mesh.blocks[b].cell(i).size();
    }
  }
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
    return block_of[a.cell] < block_of[b.cell];
  });
  for (const CodedCell& c : coded) {
    order.cells.push_back(c.cell);
    order.rotation.push_back(static_cast<uint32_t>(c.first_corner - corner_of[c.cell]));
  }
  return order;
}

Tolerance tolerance_of(const EncodeOptions& options, const std::string& name) {
  const auto found = options.arrays.find(name);
  return found == options.arrays.end() ? Tolerance{} : found->second;
}

/// One position as the decoder will have it.
std::array<std::byte, 24> decoded_position(const ArrayToCode& positions, uint64_t point) {
  const Array& array = *positions.array;
  const size_t size = size_of(array.type);
  std::array<std::byte, 24> decoded{};
  for (size_t k = 0; k < 3; ++k) {
    const uint64_t place = 3 * point + k;
    const std::byte* number = array.bytes.data() + place * size;
    const std::vector<uint64_t>& exceptions = positions.maps.exceptions;
    if (positions.maps.lossless || std::binary_search(exceptions.begin(), exceptions.end(), place)) {
      std::copy_n(number, size, decoded.begin() + static_cast<ptrdiff_t>(k * size));
    } else {
      const NumberMap& map = positions.maps.maps[k];
      map.store_number(array.type, map.code_of(array.type, number), decoded.data() + k * size);
    }
  }
  return decoded;
}

/// For cutting: what is not finite lies at 0, and what is beyond floats at their ends.
std::vector<float> decoded_floats(const ArrayToCode& positions) {
  const Scalar type = positions.array->type;
  constexpr double most = 3e38;
  std::vector<float> floats;
  floats.reserve(positions.array->count() * 3);
  for (uint64_t point = 0; point < positions.array->count(); ++point) {
    const auto position = decoded_position(positions, point);
    for (size_t k = 0; k < 3; ++k) {
      const double number = number_as_double(type, position.data() + k * size_of(type));
      floats.push_back(number - number == 0 ? static_cast<float>(std::clamp(number, -most, most)) : 0.0f);
    }
  }
  return floats;
}

Place place_of(const std::byte* position, Scalar type) {
  Place place{};
  for (size_t k = 0; k < 3; ++k) std::memcpy(&place[k], position + k * size_of(type), size_of(type));
  return place;
}

/// Patches work at once, and each tells what it does; the caller hears of finished patches, from one thread
/// at a time.
class PatchProgress {
 public:
  PatchProgress(const Progress& progress, size_t patches) : progress_(progress), patches_(patches) {}

  Progress of_patch() {
    return [this](const ProgressReport&) { return report(); };
  }
  void finish_patch() {
    ++done_;
    report();
  }

 private:
  bool report() {
    if (progress_ && !busy_.test_and_set()) {
      const double fraction = static_cast<double>(done_) / static_cast<double>(patches_);
      if (!progress_({"patches", fraction})) stopped_ = true;
      busy_.clear();
    }
    return !stopped_;
  }

  const Progress& progress_;
  size_t patches_;
  std::atomic<size_t> done_ = 0;
  std::atomic<bool> stopped_ = false;
  std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

template <class Options>
Executor& executor_of(const Options& options) {
  return options.executor != nullptr ? *options.executor : serial_executor();
}

/// Calls work(i, options) for each patch, at once where there is an executor for it; gives all results, or
/// the error of the first patch that has one.
template <class Value, class Options, class Work>
Result<std::vector<Value>> for_each_patch(size_t count, const Options& options, Work work) {
  std::vector<Result<Value>> results(count);
  PatchProgress progress(options.progress, count);
  Options of_patch = options;
  of_patch.executor = nullptr;
  if (count > 1) of_patch.progress = progress.of_patch();
  executor_of(options).parallel_for(count, [&](size_t i) {
    results[i] = work(static_cast<uint32_t>(i), of_patch);
    if (count > 1) progress.finish_patch();
  });
  std::vector<Value> values;
  for (Result<Value>& result : results) {
    if (!result) return tl::unexpected(std::move(result).error());
    values.push_back(std::move(*result));
  }
  return values;
}

Result<std::vector<ArrayToCode>> map_arrays(const Mesh& mesh, const EncodeOptions& options) {
  std::vector<ArrayToCode> arrays;
  arrays.push_back({&mesh.points, MAILLE_TRY(choose_maps(mesh.points, options.positions, true))});
  for (const Array& array : mesh.arrays) {
    arrays.push_back({&array, MAILLE_TRY(choose_maps(array, tolerance_of(options, array.name), false))});
  }
  return arrays;
}

PartDescription describe(const Mesh& part) {
  PartDescription description;
  description.points = static_cast<uint32_t>(part.point_count());
  description.corners = part.corner_count();
  for (const CellBlock& block : part.blocks) description.cells.push_back(block.size());
  return description;
}

struct EncodedParts {
  std::vector<PartDescription> descriptions;  ///< empty: the mesh is one patch
  std::vector<EncodedPatch> patches;
  std::vector<std::byte> joins;
  JoinedPoints joined;
};

/// What joins the parts, and the numbers that the decoder will give their points.
Result<> join(const ArrayToCode& positions, uint32_t points, EncodedParts& parts) {
  std::vector<std::vector<uint32_t>> whole;
  std::vector<uint32_t> sizes;
  for (const EncodedPatch& patch : parts.patches) {
    whole.push_back(patch.sources.points);
    sizes.push_back(static_cast<uint32_t>(patch.sources.points.size()));
  }
  const SharedPoints shared = find_shared_points(whole, points);
  SharedPlaces places(shared.size());
  for (size_t p = 0; p < shared.size(); ++p) {
    for (const uint32_t i : shared[p]) {
      places[p].push_back(place_of(decoded_position(positions, whole[p][i]).data(), positions.array->type));
    }
  }
  parts.joins = encode_joins(shared, places, whole);
  parts.joined = MAILLE_TRY(decode_joins(parts.joins, sizes, shared, places));
  return {};
}

Result<EncodedParts> encode_parts(const Mesh& mesh, std::span<const ArrayToCode> arrays,
                                  const EncodeOptions& options) {
  EncodedParts encoded;
  std::vector<MeshPart> parts;
  if (mesh.cell_count() > options.most_cells_per_part) {
    parts = take_parts(mesh, partition_cells(mesh, decoded_floats(arrays[0]), options.most_cells_per_part));
  }
  if (parts.size() < 2) {
    encoded.patches.push_back(MAILLE_TRY(encode_patch(mesh, nullptr, 0, arrays, options)));
    const auto points = static_cast<uint32_t>(mesh.point_count());
    encoded.joined = {{JoinedPart{points, 0, {}, {}}}, points};
    return encoded;
  }
  for (const MeshPart& part : parts) encoded.descriptions.push_back(describe(part.mesh));
  encoded.patches = MAILLE_TRY((for_each_patch<EncodedPatch>(
      parts.size(), options, [&](uint32_t i, const EncodeOptions& of_patch) -> Result<EncodedPatch> {
        const MeshPart part = std::move(parts[i]);
        return encode_patch(part.mesh, &part.numbers, i, arrays, of_patch);
      })));
  MAILLE_CHECK(join(arrays[0], static_cast<uint32_t>(mesh.point_count()), encoded));
  return encoded;
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
  EncodeReport report;
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

Result<EncodeReport> encode(const Mesh& mesh, Sink& sink, const EncodeOptions& options) {
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

Result<Mesh> decode_parts(const FileReader& reader, const Description& description,
                          const DecodeOptions& options, bool& known_valid) {
  std::vector<DecodedPatch> patches = MAILLE_TRY((for_each_patch<DecodedPatch>(
      description.parts.size(), options, [&](uint32_t i, const DecodeOptions& of_patch) {
        return decode_patch(reader, description.of_part(i), i, of_patch);
      })));
  std::vector<uint32_t> sizes;
  for (const PartDescription& part : description.parts) sizes.push_back(part.points);
  const std::vector<std::byte> bytes = MAILLE_TRY(reader.read_stream(joins_key));
  const SharedPoints shared = MAILLE_TRY(decode_shared_points(bytes, sizes));
  SharedPlaces places(shared.size());
  std::vector<Mesh> parts;
  known_valid = true;
  for (size_t p = 0; p < patches.size(); ++p) {
    known_valid = known_valid && patches[p].known_valid;
    const Array& positions = parts.emplace_back(std::move(patches[p].mesh)).points;
    for (const uint32_t i : shared[p]) {
      places[p].push_back(place_of(positions.bytes.data() + i * positions.tuple_size(), positions.type));
    }
  }
  const JoinedPoints joined = MAILLE_TRY(decode_joins(bytes, sizes, shared, places));
  if (joined.count != description.points)
    return failure(ErrorCode::corrupt, "the parts have not the points of the mesh");
  return merge_parts(std::move(parts), joined, executor_of(options));
}

Result<Mesh> decode_mesh(const FileReader& reader, const DecodeOptions& options) {
  const Description description =
      MAILLE_TRY(decode_description(MAILLE_TRY(reader.read_stream(description_key)), options.limits));
  Mesh mesh;
  bool known_valid = false;
  if (description.parts.empty()) {
    DecodedPatch patch = MAILLE_TRY(decode_patch(reader, description, 0, options));
    mesh = std::move(patch.mesh);
    known_valid = patch.known_valid;
  } else {
    mesh = MAILLE_TRY(decode_parts(reader, description, options, known_valid));
  }
  mesh.metadata = description.metadata;
  if (description.order == Order::keep) {
    const ElementOrder order =
        MAILLE_TRY(decode_order(MAILLE_TRY(reader.read_stream(order_key)), description.points,
                                static_cast<uint32_t>(description.cells())));
    mesh = MAILLE_TRY(restore_order(std::move(mesh), order));
    known_valid = false;
  }
  // A look at every corner takes time.
  if (known_valid) return mesh;
  // Whatever was wrong should have been found before. If not, it is the file that is wrong, not an input.
  if (auto valid = validate(mesh); !valid)
    return failure(ErrorCode::corrupt, std::move(valid).error().message);
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
  Result<Mesh> mesh = decode_mesh(reader, options);
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
  info.parts = std::max<uint64_t>(description.parts.size(), 1);
  for (const BlockDescription& block : description.blocks) {
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
