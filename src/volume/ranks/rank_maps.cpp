#include "volume/ranks/rank_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include "base/bytes.h"
#include "volume/ranks/collective.h"
#include "volume/stream/numbered_arrays.h"

namespace maille {
namespace {

/// The least and the largest finite number of each component, of all ranks: a lattice must reach them, and a
/// sample may have missed them. Numbers are kept as their bytes, so that nothing is rounded.
class Extremes {
 public:
  explicit Extremes(const Array& like) : type_(like.type), number_(size_of(like.type)) {
    for (auto* side : {&low_, &high_}) side->resize(like.components);
  }
  void add(const std::byte* tuple) {
    for (size_t c = 0; c < low_.size(); ++c) add(c, tuple + c * number_);
  }
  void add_all(const Buffers& buffers) {
    for (const auto& buffer : buffers) {
      for (ByteReader in(buffer); in.remaining() > 0;) {
        const auto c = in.get<uint32_t>();
        add(c, in.get_bytes(number_).data());
      }
    }
  }
  // Components without a finite number are left out.
  std::vector<std::byte> packed() const {
    ByteWriter out;
    for (const auto* side : {&low_, &high_}) {
      for (uint32_t c = 0; c < side->size(); ++c) {
        if ((*side)[c].empty()) continue;
        out.put(c);
        out.put_bytes((*side)[c]);
      }
    }
    return out.take();
  }
  /// Appends them as two tuples more; 0 where there is none.
  void append_to(Array& sample) const {
    for (const auto* side : {&low_, &high_}) {
      for (const auto& number : *side) {
        sample.bytes.insert(sample.bytes.end(), number.begin(), number.end());
        sample.bytes.resize(sample.bytes.size() + number_ - number.size());
      }
    }
  }

 private:
  void add(size_t c, const std::byte* number) {
    const double value = number_as_double(type_, number);
    if (!std::isfinite(value)) return;
    if (low_[c].empty() || value < number_as_double(type_, low_[c].data()))
      low_[c].assign(number, number + number_);
    if (high_[c].empty() || value > number_as_double(type_, high_[c].data()))
      high_[c].assign(number, number + number_);
  }

  Scalar type_;
  size_t number_;
  std::vector<std::vector<std::byte>> low_, high_;
};

/// Whether values are the numbers of their elements, all less one number, modulo 2^64. This finds arrays of
/// one run with a single reduction; runs in general would need the order of all elements in one place.
class Offset {
 public:
  void add(uint64_t value, uint32_t number) {
    const uint64_t offset = value - number;
    most_ = std::max(most_, offset);
    least_ = std::min(least_, offset);
  }
  // One number for all if the largest and the least are the same. Ranks without elements have neither.
  std::optional<uint64_t> of_all(Ranks& ranks) const {
    std::array<uint64_t, 2> both = {most_, ~least_};
    ranks.largest(both);
    return both[0] == ~both[1] ? std::optional(both[0]) : std::nullopt;
  }

 private:
  // The least as the complement of the largest complement.
  uint64_t most_ = 0, least_ = ~uint64_t{0};
};

/// Array after array, so that the first rank holds one sample at a time.
class MapsChooser {
 public:
  MapsChooser(const RankPart& part, const PartLayout& layout, const PointDirectory& points,
              const Directory& cells, const StreamOptions& stream, uint64_t sample_bytes, Ranks& ranks)
      : part_(part),
        layout_(layout),
        points_(points),
        cells_(cells),
        stream_(stream),
        sample_bytes_(std::max<uint64_t>(1, sample_bytes)),
        ranks_(ranks) {}

  Result<ArrayMapsList> run() {
    Result<ArrayMapsList> list = ArrayMapsList();
    size_t offset = add(layout_.empty.points, stream_.positions, 0, nullptr, list);
    size_t next = 0, of_cells = 0;
    const std::vector<const Array*> mine = cell_arrays();
    for (const Array& array : layout_.empty.arrays) {
      if (array.domain == Domain::mesh) continue;
      const Array* const values = array.domain == Domain::cell && !mine.empty() ? mine[of_cells++] : nullptr;
      offset = add(array, stream_.arrays[next++], offset, values, list);
    }
    ArrayMapsList all = MAILLE_TRY(broadcast(std::move(list)));
    set_numbered(numbered_, all);
    return all;
  }

 private:
  /// None in a rank without cells.
  std::vector<const Array*> cell_arrays() const {
    std::vector<const Array*> arrays;
    for (const Array& array : part_.mesh->arrays) {
      if (array.domain == Domain::cell && !cells_.numbers().empty()) arrays.push_back(&array);
    }
    return arrays;
  }

  /// Chooses the map of one array and returns where the next array of points begins in a tuple. All ranks
  /// send what the stride selects, by number: which tuples are looked at depends neither on ranks nor on who
  /// has them.
  size_t add(const Array& like, const StreamArray& asked, size_t offset, const Array* of_cells,
             Result<ArrayMapsList>& list) {
    const bool of_points = like.domain == Domain::point;
    const uint64_t count = of_points ? points_.directory().total() : cells_.total();
    const size_t size = like.tuple_size();
    // At most about `sample_bytes` go to the first rank.
    const uint64_t stride = count * size / sample_bytes_ + 1;
    const bool needs_range = stride > 1 && asked.tolerance.kind != Tolerance::Kind::lossless;
    ByteWriter mine;
    Extremes extremes(like);
    // The same in all ranks: each of these follows from layout and options, so that all take part in the
    // reduction below or none does.
    const bool may_be_numbered = !stream_.any_order && &like != &layout_.empty.points &&
                                 like.components == 1 && number_reader(like.type) != nullptr &&
                                 count >= fewest_numbered;
    Offset numbers;
    const auto take = [&](uint32_t number, const std::byte* tuple) {
      if (may_be_numbered) numbers.add(number_reader(like.type)(tuple), number);
      if (needs_range) extremes.add(tuple);
      if (number % stride != 0) return;
      mine.put(number);
      mine.put_bytes(Bytes(tuple, size));
    };
    for (size_t i = 0; of_points && i < points_.directory().count(); ++i)
      take(static_cast<uint32_t>(points_.directory().first() + i), points_.tuple(i) + offset);
    for (size_t i = 0; of_cells != nullptr && i < cells_.numbers().size(); ++i)
      take(cells_.numbers()[i], of_cells->bytes.data() + i * size);
    if (may_be_numbered) {
      if (const auto first = numbers.of_all(ranks_))
        numbered_.push_back({static_cast<size_t>(&asked - stream_.arrays.data()), {{count, *first}}});
    }
    Array sample = sorted(like, to_first(ranks_, mine.take()));
    if (needs_range) extremes.add_all(to_first(ranks_, extremes.packed()));
    if (needs_range) extremes.append_to(sample);
    if (ranks_.rank() == 0 && list) choose(std::move(sample), asked, stride > 1, list);
    return offset + (of_points ? size : 0);
  }

  /// Tuples by number, as they would stand in one mesh. A cell or point comes from one rank only.
  static Array sorted(const Array& like, const Buffers& buffers) {
    std::vector<std::pair<uint32_t, const std::byte*>> tuples;
    const size_t size = like.tuple_size();
    for (const auto& buffer : buffers) {
      for (ByteReader in(buffer); in.remaining() > 0;) {
        const auto number = in.get<uint32_t>();
        tuples.emplace_back(number, in.get_bytes(size).data());
      }
    }
    std::sort(tuples.begin(), tuples.end());
    Array all = like;
    all.resize(tuples.size());
    std::byte* out = all.bytes.data();
    for (const auto& [number, tuple] : tuples) out = std::copy_n(tuple, size, out);
    return all;
  }

  /// Chooses as for a mesh of this array alone; an error stays in `list`, and is told to all in broadcast().
  static void choose(Array sample, const StreamArray& asked, bool is_sample, Result<ArrayMapsList>& list) {
    const bool positions = list->maps.empty();
    Mesh mesh;
    StreamOptions one;
    if (positions) {
      mesh.points = std::move(sample);
      one.positions = asked;
    } else {
      mesh.arrays.push_back(std::move(sample));
      one.arrays = {asked};
    }
    Result<ArrayMapsList> found = choose_stream_maps(mesh, one);
    if (!found) {
      list = std::move(found);
      return;
    }
    std::vector<NumberMap>& maps = found->maps.back();
    // A sample does not tell how small numbers are.
    if (is_sample && maps[0].kind == NumberMap::Kind::logarithm) {
      if (const auto any = logarithm_of_any(asked.type, asked.tolerance.value))
        maps.assign(maps.size(), *any);
    }
    list->maps.push_back(std::move(maps));
    list->bounds.push_back(found->bounds.back());
    list->extents.push_back(found->extents.back());
  }

  /// The header of a stream has all that a map is, so it serves as the message; extents have no place in it.
  Result<ArrayMapsList> broadcast(Result<ArrayMapsList> list) const {
    ByteWriter out;
    if (ranks_.rank() == 0 && list) {
      PieceCoding coding;
      coding.stream = stream_;
      coding.maps = *list;
      Result<std::vector<std::byte>> header = encode_header(header_of(coding));
      if (header) {
        for (const double extent : list->extents) out.put(extent);
        out.put_bytes(*header);
      } else {
        list = tl::unexpected(header.error());
      }
    }
    MAILLE_CHECK(agree(ranks_, std::move(list)));
    const std::vector<std::byte> told = from_first(ranks_, out.bytes());
    ByteReader in(told);
    ArrayMapsList all;
    for (size_t i = 0; i <= stream_.arrays.size(); ++i) all.extents.push_back(in.get<double>());
    StreamHeader header = MAILLE_TRY(decode_header(in.get_bytes(in.remaining()), plain_memory({})));
    all.maps = std::move(header.maps);
    all.bounds = std::move(header.bounds);
    return all;
  }

  const RankPart& part_;
  const PartLayout& layout_;
  const PointDirectory& points_;
  const Directory& cells_;
  const StreamOptions& stream_;
  uint64_t sample_bytes_;
  Ranks& ranks_;
  std::vector<NumberedArray> numbered_;
};

}  // namespace

Result<ArrayMapsList> choose_maps_among_ranks(const RankPart& part, const PartLayout& layout,
                                              const PointDirectory& points, const Directory& cells,
                                              const StreamOptions& stream, uint64_t sample_bytes,
                                              Ranks& ranks) {
  return MapsChooser(part, layout, points, cells, stream, sample_bytes, ranks).run();
}

}  // namespace maille
