#include "surface/patch_streams.h"

#include <algorithm>
#include <optional>
#include <string>

#include "base/result.h"
#include "code/efforts.h"
#include "description/element_order.h"
#include "description/remains.h"
#include "mesh/space_curve.h"
#include "numbers/number_maps.h"
#include "surface/arrays/array_around.h"
#include "surface/arrays/surface_normals.h"
#include "surface/arrays/twin_coder.h"
#include "surface/fans/fan_patch.h"
#include "surface/fans/fan_tables.h"
#include "surface/fans/positions.h"
#include "surface/fans/shared_fans.h"
#include "surface/left_out.h"
#include "surface/parts/shared_points.h"

namespace maille {
namespace {

// The number of TOPO and POSI says how they are coded (format, 11). Numbers are never used again for
// something else.
constexpr uint32_t front_coding = 0;
constexpr uint32_t fan_coding = 1;
constexpr uint32_t polygon_fan_coding = 2;  // of TOPO
constexpr uint32_t position_coding = 1;     // of POSI: positions.h
constexpr uint32_t shared_fan_coding = 3;
constexpr uint32_t last_coding = shared_fan_coding;

StreamKey topology_key(uint32_t patch, uint32_t coding) {
  return {"TOPO", patch, coding};
}
StreamKey positions_key(uint32_t patch, uint32_t coding) {
  return {"POSI", patch, coding};
}
using KeyOfCoding = StreamKey (*)(uint32_t, uint32_t);

/// Of several codings of one stream, which no writer makes, the highest number counts.
uint32_t coding_of(const StreamSource& streams, uint32_t patch, KeyOfCoding key) {
  uint32_t coding = last_coding;
  while (coding > front_coding && !streams.has_stream(key(patch, coding))) --coding;
  return coding;
}

/// The cells of a mesh in coded order. With fans the surface is not built yet.
struct PatchCells {
  EncodedTopology encoded;
  std::optional<FanSurface> fans;
  FanModels models = FanModels::fixed;
  std::vector<std::byte> positions;  ///< with shared tables
  uint32_t coding() const {
    if (!fans) return front_coding;
    if (models == FanModels::shared) return shared_fan_coding;
    return fans->offsets.empty() ? fan_coding : polygon_fan_coding;
  }
  void set(EncodedFanPatch patch) {
    encoded = {std::move(patch.patch.topology), std::move(patch.sources), std::move(patch.bytes)};
    fans = std::move(patch.patch.fans);
  }
};

/// Fans where they serve, else the front: mixing needs half-edges, and fans can number 2^28 points.
Result<PatchCells> encode_cells(const Mesh& mesh, bool mixed, std::optional<SharedFanPatch> shared) {
  PatchCells cells;
  if (shared) {
    cells.models = FanModels::shared;
    cells.positions = std::move(shared->positions);
    cells.set(std::move(shared->coded));
    return cells;
  }
  if (!mixed) {
    // None where there are more points than fans can number: the front takes these at any effort.
    auto patch = MAILLE_TRY(encode_fan_patch(mesh));
    if (patch) {
      cells.set(std::move(*patch));
      return cells;
    }
  }
  cells.encoded = MAILLE_TRY(encode_topology(mesh));
  return cells;
}

/// The sources of a part's elements, in the whole mesh.
PatchSources in_whole(PatchSources sources, const Mesh& part, const PartNumbers& numbers) {
  for (uint32_t& point : sources.points) point = numbers.points[point];
  if (sources.cells.empty()) return sources;
  const std::vector<uint32_t> corner_of = table_cells(part).corner;
  for (size_t i = 0; i < sources.cells.size(); ++i) {
    uint32_t& cell = sources.cells[i];
    sources.first_corner[i] += numbers.first_corner[cell] - corner_of[cell];
    cell = numbers.cells[cell];
  }
  if (sources.corners.empty()) return sources;
  const auto corners = static_cast<uint32_t>(part.corner_count());
  std::vector<uint32_t> whole = numbers.corners;
  whole.resize(corners);
  for (size_t cell = 0; numbers.corners.empty() && cell < corner_of.size(); ++cell) {
    const uint32_t end = cell + 1 < corner_of.size() ? corner_of[cell + 1] : corners;
    for (uint32_t c = corner_of[cell]; c < end; ++c)
      whole[c] = numbers.first_corner[cell] + c - corner_of[cell];
  }
  for (uint32_t& source : sources.corners) {
    if (source != none) source = whole[source];
  }
  return sources;
}

/// The elements of an array's domain in coded order, by their tuples; `all` is filled for those of the mesh
/// as a whole.
std::span<const uint32_t> sources_of(const PatchSources& sources, const Array& array,
                                     std::vector<uint32_t>& all) {
  switch (array.domain) {
    case Domain::point:
      return sources.points;
    case Domain::cell:
      return sources.cells;
    case Domain::corner:
      return sources.corners;
    case Domain::mesh:
      break;
  }
  all.resize(array.count());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  return all;
}

bool has_domain(std::span<const ArrayToCode> arrays, Domain domain) {
  return std::any_of(arrays.begin(), arrays.end(),
                     [&](const ArrayToCode& coded) { return coded.array->domain == domain; });
}

}  // namespace

bool needs_cells(std::span<const ArrayToCode> arrays, Order order) {
  return order == Order::keep || has_domain(arrays, Domain::cell) || has_domain(arrays, Domain::corner);
}

namespace {

/// The streams of a patch while they are made, in this order: find_sources(), points of no cell sorted,
/// positions, what arrays are predicted from, twins, arrays, finish(). After find_sources() the mesh's cells
/// are needed no more, so that a part's can go.
class PatchEncoder {
 public:
  PatchEncoder(PatchCells cells, uint32_t patch, const EncodeOptions& options, bool mixed)
      : cells_(std::move(cells)), patch_(patch), options_(options), mixed_(mixed) {}

  /// `corner_twin`: of a welded mesh, else empty.
  Result<> find_sources(const Mesh& mesh, const PartNumbers* numbers, std::span<const ArrayToCode> arrays,
                        std::span<const uint32_t> corner_twin) {
    if (!corner_twin.empty() || has_domain(arrays, Domain::corner)) {
      MAILLE_CHECK(build());
      find_corner_sources(mesh, cells_.encoded);
    }
    PatchSources& sources = cells_.encoded.sources;
    forget_cells(arrays, !corner_twin.empty());
    if (numbers != nullptr) {
      border_ = borders_of_coded(mesh, sources.points);
      sources = in_whole(std::move(sources), mesh, *numbers);
    }
    for (size_t i = 0; i < sources.corners.size() && !corner_twin.empty(); ++i)
      twin_of_.push_back(sources.corners[i] == none ? none : corner_twin[sources.corners[i]]);
    return {};
  }

  /// Each point that no cell has is predicted from the one before, and along a curve they lie close together:
  /// stanford-bunny, of whose points 3 % have no face, takes 2 % less, point clouds 10 to 40 % (5048567). By
  /// the positions that the decoder will have, so that a decoded mesh has the same order.
  void sort_unused_points(const ArrayToCode& positions) {
    PatchSources& sources = cells_.encoded.sources;
    const std::span unused = std::span(sources.points).last(sources.unused_points);
    sort_along_curve<uint32_t>(decoded_positions(*positions.array, positions.maps, unused), unused);
  }

  /// To be called once positions are kept. Fills `numbers` by corner of the mesh.
  CodedStream encode_twins(std::vector<uint32_t>& numbers) {
    twins_ = twin_of_;
    CodedStream stream{twins_key(patch_), maille::encode_twins(cells_.encoded.topology, positions_, twins_)};
    const std::vector<uint32_t>& corners = cells_.encoded.sources.corners;
    // Back to corners of the mesh, which is how the order of points is found later.
    for (size_t i = 0; i < corners.size(); ++i) {
      if (corners[i] == none) continue;
      if (corners[i] >= numbers.size()) numbers.resize(size_t{corners[i]} + 1);
      numbers[corners[i]] = twins_[i];
    }
    return stream;
  }

  Result<CodedStream> encode_positions(const ArrayToCode& positions) {
    if (!cells_.fans || !fits_positions(*positions.array, positions.maps)) {
      return encode_array(positions, positions_key(patch_, front_coding));
    }
    Pace pace(options_.progress, positions.array->name.c_str(), positions.array->count());
    if (!pace.report()) return cancelled();
    if (cells_.models == FanModels::shared)
      return CodedStream{positions_key(patch_, shared_fan_coding), std::move(cells_.positions)};
    return CodedStream{positions_key(patch_, position_coding),
                       maille::encode_positions(*cells_.fans, *positions.array, positions.maps,
                                                cells_.encoded.sources.points, effort_of(options_.effort))};
  }

  Result<CodedStream> encode_array(const ArrayToCode& coded, const StreamKey& key) {
    const Array& array = *coded.array;
    Pace pace(options_.progress, array.name.c_str(), array.count());
    if (!pace.report()) return cancelled();
    // Half-edges are built for what walks over them only: corners (whose numbers are theirs in the encoder),
    // normals, twins.
    const bool fans_alone =
        cells_.fans && array.domain != Domain::corner && array.role != Role::normal && !coded.by_twin;
    if (!fans_alone) MAILLE_CHECK(build());
    std::vector<uint32_t> all;
    const std::span<const uint32_t> sources =
        coded.by_twin ? twin_of_ : sources_of(cells_.encoded.sources, array, all);
    // Mixing is made for places in space.
    const bool positions = key.type == std::string_view("POSI");
    PatchElements elements = cells_.encoded.topology.elements();
    elements.positions = positions_;
    if (coded.by_twin) elements.twins = twins_;
    if (cells_.fans) elements.fans = &*cells_.fans;
    if (!positions) {
      if (!around_) around_.emplace(elements);
      elements.around = &*around_;
    }
    CodedStream stream{
        key, maille::encode_array(elements, array, coded.maps, sources, positions && mixed_, &pace)};
    if (pace.stopped()) return cancelled();
    return stream;
  }

  /// What arrays are predicted from.
  void keep_positions(const ArrayToCode& positions) {
    positions_ = decoded_positions(*positions.array, positions.maps, cells_.encoded.sources.points);
  }

  Result<EncodedPatch> finish(std::vector<CodedStream> arrays) {
    PatchSources sources = std::move(cells_.encoded.sources);
    std::vector<uint32_t>().swap(sources.corners);
    CodedStream topology{topology_key(patch_, cells_.coding()), std::move(cells_.encoded.bytes)};
    return EncodedPatch{std::move(topology), std::move(arrays), {}, {},
                        std::move(sources),  std::move(border_)};
  }

 private:
  /// Positions over fans need little of them.
  void forget_cells(std::span<const ArrayToCode> arrays, bool welded) {
    PatchSources& sources = cells_.encoded.sources;
    if (!needs_cells(arrays, options_.order) && !welded) {
      std::vector<uint32_t>().swap(sources.cells);
      std::vector<uint32_t>().swap(sources.first_corner);
    }
    if (cells_.fans && arrays.size() == 1 && !welded && fits_positions(*arrays[0].array, arrays[0].maps))
      std::vector<uint32_t>().swap(cells_.fans->corners);
  }
  Result<> build() {
    if (cells_.fans) MAILLE_CHECK(build_surface(*cells_.fans, cells_.encoded.topology));
    return {};
  }

  PatchCells cells_;
  uint32_t patch_;
  const EncodeOptions& options_;
  bool mixed_;
  std::vector<Vector3> positions_;
  std::optional<ArrayAround> around_;  ///< begins with the first array: it refers to what is above
  std::vector<uint32_t> twin_of_;      ///< by corner as in PatchElements: the point it had before welding
  std::vector<uint32_t> twins_;        ///< the same as the decoder numbers them
  std::vector<uint32_t> border_;
};

Array array_of(const ArrayDescription& description) {
  Array array = make_array(description.name, description.domain, description.type, description.components,
                           description.role);
  array.labels = description.labels;
  return array;
}

/// Is an array wanted whose tuples follow cells or corners, or are there twins, which do? Else nobody asks
/// where cells went.
bool needs_places(const Description& description, const DecodeOptions& options) {
  if (description.welded) return true;
  return std::any_of(description.arrays.begin(), description.arrays.end(),
                     [&](const ArrayDescription& array) {
                       return (array.domain == Domain::cell || array.domain == Domain::corner) &&
                              is_wanted(options, array.name);
                     });
}

/// Is an array wanted that may need half-edges?
bool wants_normals(const Description& description, const DecodeOptions& options) {
  return std::any_of(description.arrays.begin(), description.arrays.end(),
                     [&](const ArrayDescription& array) {
                       return array.role == Role::normal && is_wanted(options, array.name);
                     });
}

/// A patch while it is decoded: cells and positions first, then twins, then arrays one by one, then the mesh
/// is assembled. Every step checks its bytes; errors are corrupt or cancelled.
class PatchDecoder {
 public:
  PatchDecoder(const StreamSource& streams, const Description& description, uint32_t patch,
               const DecodeOptions& options, const SharedFanTables* tables, FanBuffers* buffers)
      : streams_(streams),
        description_(description),
        patch_(patch),
        options_(options),
        tables_(tables),
        buffers_(buffers),
        shapes_(description.shapes()),
        with_places_(needs_places(description, options)),
        with_normals_(wants_normals(description, options)) {}

  /// Cells, and positions, which are decoded along with fans.
  Result<> decode_cells(Array& positions) {
    const uint32_t coding = coding_of(topology_key);
    const StreamKey positions_of = positions_key(patch_, coding_of(positions_key));
    const std::vector<std::byte> bytes = MAILLE_TRY(streams_.read_stream(topology_key(patch_, coding)));
    if (coding != front_coding) {
      FanPatchDecoder decoder = MAILLE_TRY(begin_fans(bytes, coding));
      if (positions_of.number != front_coding) {
        // POSI 1 goes with TOPO 1 and 2, POSI 3 with TOPO 3, POSI 0 with all: format, 11.
        const bool alone = positions_of.number == position_coding && coding != shared_fan_coding;
        const bool shared = positions_of.number == shared_fan_coding && coding == shared_fan_coding;
        if (!shared && !alone) return without_fans();
        positions = MAILLE_TRY(decode_positions(decoder, positions_of));
      }
      FanPatch patch = MAILLE_TRY(decoder.finish(shapes_, description_.points, description_.corners));
      topology_ = std::move(patch.topology);
      fans_ = std::move(patch.fans);
    } else {
      if (charts_alone) return not_in_charts();
      topology_ =
          MAILLE_TRY(decode_topology(bytes, shapes_, description_.points, description_.corners, true));
    }
    if (positions_of.number == front_coding) {
      positions = MAILLE_TRY(decode_one(description_.positions, positions_of));
    } else if (coding == front_coding) {
      return without_fans();
    }
    return {};
  }

  /// What a small decoder was built without is refused with a code of its own (left_out.h), by which web
  /// pages load the full one.
  Result<FanPatchDecoder> begin_fans(Bytes bytes, uint32_t coding) const {
    if (coding == fan_coding) return FanPatchDecoder::begin(bytes, description_.points, description_.corners);
    if (coding == polygon_fan_coding) {
      if (charts_alone) return not_in_charts();
      return FanPatchDecoder::begin_polygons(bytes, description_.points, description_.corners);
    }
    // A file of mode single that claims TOPO 3 gets here.
    if (tables_ == nullptr) return failure(ErrorCode::corrupt, "the tables of the fans are missing");
    if (tables_->fans->polygons) {
      if (charts_alone) return not_in_charts();
      return FanPatchDecoder::begin_shared_polygons(bytes, *tables_->fans, description_.points,
                                                    description_.corners);
    }
    return FanPatchDecoder::begin_shared(bytes, *tables_->fans, description_.points, description_.corners,
                                         buffers_);
  }

  Result<Array> decode_positions(FanPatchDecoder& decoder, const StreamKey& key) {
    Pace pace(options_.progress, description_.positions.name.c_str(), description_.points);
    if (!pace.report()) return cancelled();
    Array array = array_of(description_.positions);
    const std::vector<std::byte> bytes = MAILLE_TRY(streams_.read_stream(key));
    FanDecoder& fans = *decoder.fans;
    if (key.number == shared_fan_coding) {
      const PositionTables& tables = *tables_->positions;
      MAILLE_CHECK(decode_shared_positions(fans, bytes, tables, description_.points, array));
    } else {
      MAILLE_CHECK(maille::decode_positions(fans, bytes, description_.points, array));
    }
    return array;
  }

  /// To be called once positions are kept.
  Result<> decode_twins() {
    if (charts_alone) return not_in_charts();
    if (fans_) MAILLE_CHECK(build_surface(*fans_, topology_));
    const std::vector<std::byte> bytes = MAILLE_TRY(streams_.read_stream(twins_key(patch_)));
    twins_ = MAILLE_TRY(maille::decode_twins(topology_, positions_, bytes));
    return {};
  }

  Result<Array> decode_one(const ArrayDescription& described, const StreamKey& key) {
    if (charts_alone) return not_in_charts();
    Pace pace(options_.progress, described.name.c_str(), description_.tuples(described));
    if (!pace.report()) return cancelled();
    Array array = array_of(described);
    const std::vector<std::byte> bytes = MAILLE_TRY(streams_.read_stream(key));
    if (fans_ && with_normals_) MAILLE_CHECK(build_surface(*fans_, topology_));
    PatchElements elements = topology_.elements();
    elements.positions = positions_;
    if (described.by_twin && !description_.welded) return failure(ErrorCode::corrupt, "twins are missing");
    if (described.by_twin) elements.twins = twins_;
    if (fans_) elements.fans = &*fans_;
    if (!around_) around_.emplace(elements);
    elements.around = &*around_;
    MAILLE_CHECK(decode_array(elements, bytes, described.mesh_tuples, array, &pace));
    return array;
  }

  /// What arrays are predicted from.
  void keep_positions(const Array& positions) { positions_ = positions_as_doubles(positions); }

  /// Has the decoder seen already what validate() would look for? Corners of fans and nodes of loose cells
  /// were below the number of points when they were decoded, and positions are as many. It saves a pass over
  /// all cells.
  bool knows_validity() const {
    if (!fans_ || shapes_.size() != 1 || !description_.arrays.empty()) return false;
    return shapes_[0].type == CellType::triangle ||
           (shapes_[0].type == CellType::polygon && topology_.loose.size() == 0);
  }

  /// Cells in their blocks, and arrays of cells and corners beside them.
  Result<> assemble(DecodedPatch& decoded) {
    Mesh& mesh = decoded.mesh;
    AssembledCells cells;
    if (fans_ && topology_.surface.half_edges.size() == 0) {
      cells = assemble_fans(std::move(*fans_), topology_, shapes_, with_places_);
    } else {
      if (charts_alone) return not_in_charts();
      cells = assemble_cells(std::move(topology_), shapes_, with_places_);
    }
    mesh.blocks = std::move(cells.blocks);
    for (size_t b = 0; b < mesh.blocks.size(); ++b) mesh.blocks[b].name = description_.blocks[b].name;
    // What was decoded must be what the description promised: callers have sized things by it.
    if (mesh.corner_count() != description_.corners || mesh.cell_count() != description_.cells()) {
      return failure(ErrorCode::corrupt, "the cells are not those of the description");
    }
    for (Array& array : mesh.arrays) {
      if (fans_ && cells.cell_place.empty()) break;
      if (array.domain == Domain::cell) move_tuples(array, cells.cell_place, mesh.cell_count());
      if (array.domain == Domain::corner) move_tuples(array, cells.corner_place, mesh.corner_count());
    }
    if (!twins_.empty()) decoded.twins.resize(mesh.corner_count());
    for (size_t i = 0; i < twins_.size(); ++i) {
      const uint32_t place = cells.corner_place.empty() ? static_cast<uint32_t>(i) : cells.corner_place[i];
      if (place != none) decoded.twins[place] = twins_[i];
    }
    return {};
  }

 private:
  uint32_t coding_of(KeyOfCoding key) const { return maille::coding_of(streams_, patch_, key); }

  static tl::unexpected<Error> without_fans() {
    return failure(ErrorCode::corrupt, "positions of fans without these fans");
  }
  tl::unexpected<Error> not_in_charts() const {
    return effort_of(description_.effort).mixed_surface ? left_out() : left_out_of_charts();
  }

  const StreamSource& streams_;
  const Description& description_;
  uint32_t patch_;
  const DecodeOptions& options_;
  const SharedFanTables* tables_;
  FanBuffers* buffers_;
  std::vector<BlockShape> shapes_;
  bool with_places_, with_normals_;
  PatchTopology topology_;
  std::optional<FanSurface> fans_;
  std::optional<ArrayAround> around_;
  std::vector<Vector3> positions_;
  std::vector<uint32_t> twins_;
};

/// The cells, after which the mesh is not needed any more.
Result<PatchEncoder> begin_patch(const Mesh& mesh, const PartNumbers* numbers, uint32_t patch,
                                 std::span<const ArrayToCode> arrays, const EncodeOptions& options,
                                 std::optional<SharedFanPatch> shared,
                                 std::span<const uint32_t> corner_twin) {
  if (!Pace(options.progress, "connectivity", 0).report()) return cancelled();
  const bool mixed = effort_of(options.effort).mixed_surface;
  const bool shared_tables = shared.has_value();  // positions are coded already
  PatchEncoder encoder(MAILLE_TRY(encode_cells(mesh, mixed, std::move(shared))), patch, options, mixed);
  MAILLE_CHECK(encoder.find_sources(mesh, numbers, arrays, corner_twin));
  if (options.order != Order::keep && !shared_tables) encoder.sort_unused_points(arrays[0]);
  return encoder;
}

/// Positions first, as all others may be predicted from them. Arrays of the mesh as a whole are in patch 0
/// only; other patches have an empty stream there.
Result<EncodedPatch> encode_arrays(PatchEncoder encoder, uint32_t patch, std::span<const ArrayToCode> arrays,
                                   std::span<const uint32_t> corner_twin) {
  std::vector<CodedStream> streams;
  streams.push_back(MAILLE_TRY(encoder.encode_positions(arrays[0])));
  if (arrays.size() > 1 || !corner_twin.empty()) encoder.keep_positions(arrays[0]);
  std::optional<CodedStream> twins;
  std::vector<uint32_t> twin_numbers;
  if (!corner_twin.empty()) twins = encoder.encode_twins(twin_numbers);
  for (size_t i = 1; i < arrays.size(); ++i) {
    if (patch > 0 && arrays[i].array->domain == Domain::mesh) {
      streams.push_back({array_key(patch, i - 1), {}});
    } else {
      streams.push_back(MAILLE_TRY(encoder.encode_array(arrays[i], array_key(patch, i - 1))));
    }
  }
  EncodedPatch encoded = MAILLE_TRY(encoder.finish(std::move(streams)));
  encoded.twins = std::move(twins);
  encoded.twin_numbers = std::move(twin_numbers);
  return encoded;
}

}  // namespace

Result<EncodedPatch> encode_patch(const Mesh& mesh, const PartNumbers* numbers, uint32_t patch,
                                  std::span<const ArrayToCode> arrays, const EncodeOptions& options,
                                  std::optional<SharedFanPatch> shared,
                                  std::span<const uint32_t> corner_twin) {
  PatchEncoder encoder =
      MAILLE_TRY(begin_patch(mesh, numbers, patch, arrays, options, std::move(shared), corner_twin));
  return encode_arrays(std::move(encoder), patch, arrays, corner_twin);
}

Result<EncodedPatch> encode_part(MeshPart part, uint32_t patch, std::span<const ArrayToCode> arrays,
                                 const EncodeOptions& options) {
  PatchEncoder encoder =
      MAILLE_TRY(begin_patch(part.mesh, &part.numbers, patch, arrays, options, std::nullopt, {}));
  // The cells of a part are let go of before positions take memory.
  part = {};
  return encode_arrays(std::move(encoder), patch, arrays, {});
}

std::vector<std::byte> encode_mesh_array(const ArrayToCode& coded) {
  const PatchTopology nowhere;
  std::vector<uint32_t> all;
  const auto sources = sources_of({}, *coded.array, all);
  return encode_array(nowhere.elements(), *coded.array, coded.maps, sources, false);
}

Result<> decode_mesh_array(Bytes bytes, uint64_t tuples, Array& array) {
  const PatchTopology nowhere;
  return decode_array(nowhere.elements(), bytes, tuples, array);
}

Result<DecodedPatch> decode_patch(const StreamSource& streams, const Description& description, uint32_t patch,
                                  const DecodeOptions& options, const SharedFanTables* tables,
                                  FanBuffers* buffers, LostArrays* lost) {
  DecodedPatch decoded;
  Mesh& mesh = decoded.mesh;
  if (!Pace(options.progress, "connectivity", 0).report()) return cancelled();
  PatchDecoder decoder(streams, description, patch, options, tables, buffers);
  MAILLE_CHECK(decoder.decode_cells(mesh.points));
  const bool welded = description.welded;
  if (welded) decoder.keep_positions(mesh.points);
  if (welded) MAILLE_CHECK(decoder.decode_twins());
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    const ArrayDescription& array = description.arrays[i];
    if (!is_wanted(options, array.name)) continue;
    if (mesh.arrays.empty() && !welded) decoder.keep_positions(mesh.points);
    const bool elsewhere = patch > 0 && array.domain == Domain::mesh;
    Result<Array> one = elsewhere ? array_of(array) : decoder.decode_one(array, array_key(patch, i));
    if (!one && lost != nullptr && is_loss(one.error())) {
      lost->insert(i);
      continue;
    }
    mesh.arrays.push_back(MAILLE_TRY(std::move(one)));
    decoded.by_twin.push_back(array.by_twin);
  }
  decoded.known_valid = decoder.knows_validity();
  MAILLE_CHECK(decoder.assemble(decoded));
  return decoded;
}

bool is_of_front(const StreamSource& streams, uint32_t patch) {
  return coding_of(streams, patch, topology_key) == front_coding ||
         coding_of(streams, patch, positions_key) == front_coding;
}

}  // namespace maille
