#include "surface/parts/coded_parts.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <optional>

#include "base/bytes.h"
#include "base/chunks.h"
#include "base/result.h"
#include "code/efforts.h"
#include "surface/lost_arrays.h"
#include "surface/parts/merge_parts.h"
#include "surface/parts/mesh_parts.h"
#include "surface/parts/partition.h"
#include "surface/patch_topology.h"

namespace maille {
namespace {

/// One position as the decoder will have it, in the array's type; 24 bytes are three doubles.
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

}  // namespace

uint64_t most_cells_per_part(const EncodeOptions& options, uint64_t cells) {
  static_assert(efforts.back().cells_per_part <= most_patch_corners / 4);
  if (options.most_cells_per_part) return *options.most_cells_per_part;
  // A mesh slightly larger than one part is cut into two halves, not left with a small rest: parts may have
  // half as many again, so that the dragon has two parts instead of four (f46b2b6).
  const uint64_t one_part = effort_of(options.effort).cells_per_part;
  return cells <= one_part ? one_part : std::min(cells - 1, one_part + one_part / 2);
}

std::vector<float> decoded_floats(const ArrayToCode& positions, Executor& executor) {
  const Scalar type = positions.array->type;
  // Below the largest float, so that conversions do not overflow.
  constexpr double most = 3e38;
  std::vector<float> floats(positions.array->count() * 3);
  for_each_chunk(executor, positions.array->count(), [&](size_t, size_t begin, size_t end) {
    for (size_t point = begin; point < end; ++point) {
      const auto position = decoded_position(positions, point);
      for (size_t k = 0; k < 3; ++k) {
        const double number = number_as_double(type, position.data() + k * size_of(type));
        // False for infinities and NaN, which stay at 0.
        if (number - number == 0) floats[3 * point + k] = static_cast<float>(std::clamp(number, -most, most));
      }
    }
  });
  return floats;
}

Place decoded_place(const ArrayToCode& positions, uint64_t point) {
  const auto position = decoded_position(positions, point);
  const size_t size = size_of(positions.array->type);
  Place place{};
  for (size_t k = 0; k < 3; ++k) std::memcpy(&place[k], position.data() + k * size, size);
  return place;
}

std::vector<Place> decoded_places(const ArrayToCode& positions) {
  std::vector<Place> places;
  for (uint64_t point = 0; point < positions.array->count(); ++point)
    places.push_back(decoded_place(positions, point));
  return places;
}

namespace {

/// Patches work at once, and each tells what it does; the caller hears of finished patches, from one thread
/// at a time. A thread that finds another one reporting goes on without: the next report says as much.
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
      if (!progress_({"faces", fraction})) stopped_ = true;
      busy_.clear();
    }
    return !stopped_;
  }

  const Progress& progress_;
  size_t patches_;
  std::atomic<size_t> done_ = 0;
  std::atomic<bool> stopped_ = false;
  std::atomic_flag busy_;  // clear, by C++20
};

template <class Options>
Executor& executor_of(const Options& options) {
  return options.executor != nullptr ? *options.executor : serial_executor();
}

/// Calls work(i, options) for each patch, so many at once where there is an executor for it; gives all
/// results, or of for_each_patch() the error of the first patch that has one.
template <class Value, class Options, class Work>
std::vector<std::optional<Result<Value>>> results_of_patches(size_t count, size_t at_once,
                                                             const Options& options, Work work) {
  // Made in place: without exceptions tl::expected 1.0 copies what it is assigned.
  std::vector<std::optional<Result<Value>>> results(count);
  PatchProgress progress(options.progress, count);
  Options of_patch = options;
  // Patches are tasks already; tasks within them would only wait for each other.
  of_patch.executor = nullptr;
  if (count > 1) of_patch.progress = progress.of_patch();
  for (size_t first = 0; first < count; first += at_once) {
    executor_of(options).parallel_for(std::min(at_once, count - first), [&](size_t next) {
      const size_t i = first + next;
      results[i].emplace(work(static_cast<uint32_t>(i), of_patch));
      if (count > 1) progress.finish_patch();
    });
  }
  return results;
}

template <class Value, class Options, class Work>
Result<std::vector<Value>> for_each_patch(size_t count, size_t at_once, const Options& options, Work work) {
  auto results = results_of_patches<Value>(count, at_once, options, work);
  std::vector<Value> values;
  for (std::optional<Result<Value>>& result : results) {
    if (!*result) return tl::unexpected(std::move(*result).error());
    values.push_back(std::move(**result));
  }
  return values;
}

PartDescription describe_part(const MeshPart& part) {
  return {static_cast<uint32_t>(part.mesh.point_count()), part.mesh.corner_count(), part.cells_by_block()};
}

/// What joins the parts, and the numbers that the decoder will give their points.
void join(const ArrayToCode& positions, uint32_t points, EncodedParts& parts) {
  std::vector<std::span<const uint32_t>> whole;
  for (const EncodedPatch& patch : parts.patches) whole.push_back(patch.sources.points);
  const auto place = [&](uint32_t point) { return decoded_place(positions, point); };
  const auto shared = find_shared(whole, points, place);
  ByteWriter out;
  std::vector<PieceOfPoints> pieces;
  for (size_t p = 0; p < shared.size(); ++p) {
    const auto count = static_cast<uint32_t>(whole[p].size());
    put_section(out, encode_shared(shared[p], count, parts.patches[p].border));
    pieces.push_back(
        piece_of_points(count, shared[p], [&](uint32_t point) { return place(whole[p][point]); }));
  }
  parts.joins = out.take();
  parts.joined = join_points(pieces);
}

}  // namespace

Result<EncodedParts> encode_parts(const Mesh& mesh, std::span<const ArrayToCode> arrays,
                                  const EncodeOptions& options, std::span<const uint32_t> corner_twin) {
  EncodedParts encoded;
  Executor& executor = executor_of(options);
  const auto points = static_cast<uint32_t>(mesh.point_count());
  std::vector<uint32_t> part_of;
  const uint64_t most_cells = most_cells_per_part(options, mesh.cell_count());
  if (corner_twin.empty() && mesh.cell_count() > most_cells) {
    const std::vector<float> positions = decoded_floats(arrays[0], executor);
    part_of = partition_cells(mesh, positions, most_cells, executor);
  }
  // No partition, or one that could not cut: cells of one place stay together.
  if (std::all_of(part_of.begin(), part_of.end(), [](uint32_t part) { return part == 0; })) {
    encoded.patches.push_back(
        MAILLE_TRY(encode_patch(mesh, nullptr, 0, arrays, options, std::nullopt, corner_twin)));
    encoded.joined = {{JoinedPart{points, 0, {}, {}}}, points};
    return encoded;
  }
  MeshParts parts(mesh, part_of, executor, needs_cells(arrays, options.order));
  std::vector<uint32_t>().swap(part_of);
  encoded.descriptions.resize(parts.count());
  encoded.patches = MAILLE_TRY(
      (for_each_patch<EncodedPatch>(parts.count(), parts.count(), options,
                                    [&](uint32_t i, const EncodeOptions& of_patch) -> Result<EncodedPatch> {
                                      MeshPart part = parts.take(i);
                                      encoded.descriptions[i] = describe_part(part);
                                      return encode_part(std::move(part), i, arrays, of_patch);
                                    })));
  join(arrays[0], points, encoded);
  return encoded;
}

namespace {

/// A part, its blocks' places among those of the mesh, and which of its points others have, too.
struct DecodedPart {
  DecodedPatch patch;
  std::vector<uint32_t> block_numbers;
  std::vector<SharedPoint> shared;
};

Result<DecodedPart> decode_part(const FileReader& reader, const Description& description, uint32_t part,
                                Bytes shared, const DecodeOptions& options, LostArrays* lost = nullptr) {
  DecodedPart decoded;
  decoded.patch = MAILLE_TRY(decode_patch(reader, description, part, options, nullptr, nullptr, lost));
  const Mesh& mesh = decoded.patch.mesh;
  // What joins parts relies on valid meshes, so each is checked before.
  if (!decoded.patch.known_valid) {
    if (auto valid = validate(mesh); !valid)
      return failure(ErrorCode::corrupt, std::move(valid).error().message);
  }
  decoded.block_numbers = description.block_numbers();
  decoded.shared = MAILLE_TRY(decode_shared(shared, description.points, points_on_borders(mesh)));
  return decoded;
}

/// A section for each part, and nothing behind them.
Result<std::vector<Bytes>> sections_of(Bytes bytes, size_t count) {
  ByteReader in(bytes);
  std::vector<Bytes> sections(count);
  for (Bytes& section : sections) section = in.get_bytes(in.get_count());
  if (!in.ok() || in.remaining() > 0) return failure(ErrorCode::corrupt, "joins of another number of parts");
  return sections;
}

JoinedPoints joined_points(std::span<const DecodedPart> parts) {
  std::vector<PieceOfPoints> pieces;
  for (const DecodedPart& part : parts)
    pieces.push_back(piece_of_points(part.patch.mesh.points, part.shared));
  return join_points(pieces);
}

Mesh merge(std::vector<DecodedPart> decoded, const Description& description, const JoinedPoints& joined,
           const DecodeOptions& options) {
  std::vector<PartToMerge> parts;
  for (DecodedPart& part : decoded)
    parts.push_back({std::move(part.patch.mesh), std::move(part.block_numbers)});
  return merge_parts(std::move(parts), description.blocks, joined, executor_of(options));
}

}  // namespace

Result<DecodedPatch> decode_parts(const FileReader& reader, const Description& description, Bytes joins,
                                  size_t at_once, const DecodeOptions& options) {
  const std::vector<Bytes> shared = MAILLE_TRY(sections_of(joins, description.parts.size()));
  std::vector<DecodedPart> decoded = MAILLE_TRY((for_each_patch<DecodedPart>(
      description.parts.size(), at_once, options, [&](uint32_t i, const DecodeOptions& of_patch) {
        return decode_part(reader, description.of_part(i), i, shared[i], of_patch);
      })));
  const JoinedPoints joined = joined_points(decoded);
  // Only now is it known how many points the parts have together.
  if (joined.count != description.points)
    return failure(ErrorCode::corrupt, "the parts have not the points of the mesh");
  return DecodedPatch{merge(std::move(decoded), description, joined, options), true, {}, {}};
}

namespace {

/// A part with those of its arrays that are whole.
struct SavedPart {
  DecodedPart part;
  uint32_t number = 0;
  LostArrays lost;
};

Result<SavedPart> save_part(const FileReader& reader, const Description& of_part, uint32_t part, Bytes shared,
                            const DecodeOptions& options) {
  SavedPart saved;
  saved.number = part;
  saved.part = MAILLE_TRY(decode_part(reader, of_part, part, shared, options, &saved.lost));
  return saved;
}

/// Those that are whole. Error: other than corrupt; corrupt, if there are none.
Result<std::vector<SavedPart>> whole_parts(const FileReader& reader, const Description& description,
                                           std::span<const Bytes> shared, size_t at_once,
                                           const DecodeOptions& options) {
  auto results = results_of_patches<SavedPart>(
      description.parts.size(), at_once, options, [&](uint32_t i, const DecodeOptions& of_patch) {
        return save_part(reader, description.of_part(i), i, shared[i], of_patch);
      });
  std::vector<SavedPart> saved;
  std::optional<Error> first;
  for (std::optional<Result<SavedPart>>& result : results) {
    if (*result) {
      saved.push_back(std::move(**result));
    } else if (!is_loss(result->error())) {
      return tl::unexpected(std::move(*result).error());
    } else if (!first) {
      first = std::move(*result).error();
    }
  }
  if (saved.empty()) return tl::unexpected(*std::move(first));
  return saved;
}

/// All parts' arrays that are whole in each, joined. `lost`: the others.
Mesh merge_saved(std::vector<SavedPart> saved, const Description& description, LostArrays& lost,
                 const DecodeOptions& options) {
  std::vector<DecodedPart> parts;
  for (SavedPart& each : saved) {
    lost.insert(each.lost.begin(), each.lost.end());
    parts.push_back(std::move(each.part));
  }
  for (DecodedPart& part : parts) drop_arrays(part.patch.mesh, description, lost);
  const JoinedPoints joined = joined_points(parts);
  return merge(std::move(parts), description, joined, options);
}

}  // namespace

Result<Remains> salvage_parts(const FileReader& reader, const Description& description,
                              const Result<std::vector<std::byte>>& joins, size_t at_once,
                              const DecodeOptions& options) {
  if (!joins && !is_loss(joins.error())) return tl::unexpected(joins.error());
  Remains remains;
  const size_t count = description.parts.size();
  Result<std::vector<Bytes>> shared = sections_of(joins ? Bytes(*joins) : Bytes(), count);
  if (!shared) remains.lost.push_back("which points the parts share (now those at one place)");
  if (!shared) shared.emplace(count);
  std::vector<SavedPart> saved = MAILLE_TRY(whole_parts(reader, description, *shared, at_once, options));
  if (saved.size() < count)
    remains.lost.push_back(std::to_string(count - saved.size()) + " of " + std::to_string(count) + " parts");
  const bool with_first = saved[0].number == 0;
  LostArrays lost;
  remains.mesh = merge_saved(std::move(saved), description, lost, options);
  for (Array& array : remains.mesh.arrays) {
    // Part 0 has them, and is lost.
    if (array.domain != Domain::mesh || with_first) continue;
    const Result<> read = read_mesh_array(reader, description, array);
    if (!read && !is_loss(read.error())) return tl::unexpected(read.error());
    if (!read) lost.insert(place_of(description, array));
  }
  drop_arrays(remains.mesh, description, lost);
  tell_lost_arrays(description, lost, remains);
  return remains;
}

}  // namespace maille
