// Binary STL files, welded in temporary files without the corners of all facets in memory. The points come
// out in the same order as from the reader of whole files, as both number them by their first use.
#include <algorithm>
#include <array>
#include <bit>

#include "base/bytes.h"
#include "base/pace.h"
#include "io/converted_surface.h"
#include "io/reading.h"
#include "io/stl/stl.h"
#include "random/build/spilled_parts.h"

namespace maille {
namespace {

using Corner = std::array<std::byte, 12>;

/// A set of numbers that also tells how many of its members are below one. It takes a bit for each number,
/// and four bytes for each 512.
class MarkedNumbers {
 public:
  explicit MarkedNumbers(uint64_t numbers) : words_(numbers / 64 + 1), before_(words_.size() / 8 + 1) {}
  void mark(uint64_t number) { words_[number / 64] |= uint64_t{1} << (number % 64); }
  bool has(uint64_t number) const { return (words_[number / 64] >> (number % 64) & 1) != 0; }
  /// Once all are marked.
  uint64_t count() {
    uint64_t sum = 0;
    for (size_t w = 0; w < words_.size(); ++w) {
      if (w % 8 == 0) before_[w / 8] = static_cast<uint32_t>(sum);
      sum += static_cast<uint64_t>(std::popcount(words_[w]));
    }
    return sum;
  }
  uint32_t below(uint64_t number) const {
    const size_t word = number / 64;
    uint32_t sum = before_[word / 8];
    // At most seven words are counted for one answer.
    for (size_t w = word / 8 * 8; w < word; ++w) sum += static_cast<uint32_t>(std::popcount(words_[w]));
    const uint64_t rest = words_[word] & ((uint64_t{1} << (number % 64)) - 1);
    return sum + static_cast<uint32_t>(std::popcount(rest));
  }

 private:
  std::vector<uint64_t> words_;
  std::vector<uint32_t> before_;  ///< by eight words
};

// Corners are first spread by their place to find equal ones, then the first corner of each place is spread
// by the file's order; one more pass over the file writes points and faces in that order.
class StlConverter {
 public:
  StlConverter(const Source& source, const PartsOptions& options) : source_(source), options_(options) {}

  Result<ConvertedSurface> run() {
    MAILLE_CHECK(read_head());
    surface_.emplace(MAILLE_TRY(ConvertedSurface::create(options_.folder)));
    MAILLE_CHECK(find_equal_corners());
    MAILLE_CHECK(look_at_facets());
    MAILLE_CHECK(write());
    return *std::move(surface_);
  }

 private:
  // Facets read at once, 3.1 MiB; the number was chosen, not swept.
  static constexpr uint64_t facets_at_once = 1 << 16;
  /// Corners of a part, or of a stretch of the file, that are in memory: 16 MiB of records when the parts are
  /// equal. The number was chosen, not swept.
  static constexpr uint64_t corners_at_once = 1 << 20;

  Result<> read_head() {
    std::array<std::byte, stl_header_size> head{};
    if (source_.size() < head.size()) return not_in_parts(source_, "text");
    MAILLE_CHECK(source_.read_at(0, head));
    facets_ = load<uint32_t>(head.data() + 80);
    // A size that does not fit is text, or a damaged file; the reader of whole files finds out which.
    if (source_.size() - stl_header_size != facets_ * stl_facet_size) return not_in_parts(source_, "text");
    if (3 * facets_ > max_points) return not_in_parts(source_, "more than 2^32 corners");
    header_.assign(reinterpret_cast<const char*>(head.data()), 80);
    while (!header_.empty() && header_.back() == '\0') header_.pop_back();
    return {};
  }

  /// Calls visit(facet, bytes) for all.
  template <class Visit>
  Result<> for_each_facet(const char* stage, Visit visit) {
    Pace pace(options_.progress, stage, facets_);
    std::vector<std::byte> bytes;
    for (uint64_t first = 0; first < facets_; first += facets_at_once) {
      bytes.resize(std::min(facets_at_once, facets_ - first) * stl_facet_size);
      MAILLE_CHECK(source_.read_at(stl_header_size + first * stl_facet_size, bytes));
      for (size_t at = 0; at < bytes.size(); at += stl_facet_size) {
        MAILLE_CHECK(visit(first + at / stl_facet_size, bytes.data() + at));
        if (!pace.step()) return cancelled();
      }
    }
    return {};
  }

  /// For each corner the first one at its place, in stretches of the file.
  Result<> find_equal_corners() {
    const auto parts = static_cast<size_t>(3 * facets_ / corners_at_once + 1);
    // Parts by place hold all corners that could be equal: each is sorted on its own. 4 MiB of buffers,
    // chosen, not swept.
    SpilledParts by_place = MAILLE_TRY(SpilledParts::create(options_.folder, parts, uint64_t{4} << 20));
    MAILLE_CHECK(for_each_facet("reading", [&](uint64_t facet, const std::byte* bytes) -> Result<> {
      for (uint32_t k = 0; k < 3; ++k) {
        std::array<std::byte, 16> record;
        std::memcpy(record.data(), bytes + 12 + 12 * k, 12);
        const auto number = static_cast<uint32_t>(3 * facet + k);
        std::memcpy(record.data() + 12, &number, 4);
        MAILLE_CHECK(by_place.append(part_of(record.data(), parts), record));
      }
      return {};
    }));
    firsts_.emplace(MAILLE_TRY(SpilledParts::create(options_.folder, parts, uint64_t{4} << 20)));
    for (size_t part = 0; part < parts; ++part) MAILLE_CHECK(join(MAILLE_TRY(by_place.load(part))));
    return {};
  }
  // The multiplier is 2^64 divided by the golden ratio, which spreads close numbers; the upper half of the
  // product is scaled to the number of parts without a division.
  static size_t part_of(const std::byte* place, size_t parts) {
    uint64_t mixed = 0;
    for (size_t k = 0; k < 3; ++k) mixed = (mixed + load<uint32_t>(place + 4 * k)) * 0x9e3779b97f4a7c15;
    return static_cast<size_t>((mixed >> 32) * parts >> 32);
  }
  Result<> join(const std::vector<std::byte>& records) {
    std::vector<std::pair<Corner, uint32_t>> corners(records.size() / 16);
    for (size_t i = 0; i < corners.size(); ++i) {
      std::memcpy(corners[i].first.data(), records.data() + 16 * i, 12);
      corners[i].second = load<uint32_t>(records.data() + 16 * i + 12);
    }
    // The number of the corner is part of the order, so the first of equal ones is the first in the file.
    std::sort(corners.begin(), corners.end());
    uint32_t first = 0;
    for (size_t i = 0; i < corners.size(); ++i) {
      if (i == 0 || corners[i].first != corners[i - 1].first) first = corners[i].second;
      const std::array<uint32_t, 2> pair{corners[i].second, first};
      MAILLE_CHECK(firsts_->append(corners[i].second / corners_at_once, std::as_bytes(std::span(pair))));
    }
    return {};
  }

  /// What the reader of whole files keeps of normals and attribute bytes.
  Result<> look_at_facets() {
    return for_each_facet("looking at normals", [&](uint64_t, const std::byte* bytes) -> Result<> {
      std::array<std::array<float, 3>, 3> corners;
      std::memcpy(corners.data(), bytes + 12, sizeof corners);
      const std::array<float, 3> normal = facet_normal<float>(corners);
      computed_ = computed_ && std::memcmp(normal.data(), bytes, sizeof normal) == 0;
      const auto is_zero = [](std::byte b) { return b == std::byte{0}; };
      zero_ = zero_ && std::all_of(bytes, bytes + 12, is_zero);
      plain_ = plain_ && is_zero(bytes[48]) && is_zero(bytes[49]);
      return {};
    });
  }

  Result<> write() {
    MarkedNumbers firsts(3 * facets_);
    const auto parts = static_cast<size_t>(3 * facets_ / corners_at_once + 1);
    for (size_t part = 0; part < parts; ++part) {
      const std::vector<std::byte> pairs = MAILLE_TRY(firsts_->load(part));
      // A corner that is its own first makes a point; its number is how many such corners come before it.
      for (size_t at = 0; at < pairs.size(); at += 8) {
        if (load<uint32_t>(&pairs[at]) == load<uint32_t>(&pairs[at + 4]))
          firsts.mark(load<uint32_t>(&pairs[at]));
      }
    }
    write_header(firsts.count());
    std::vector<uint32_t> numbers(corners_at_once);
    std::vector<std::byte> row;
    return for_each_facet("welding", [&](uint64_t facet, const std::byte* bytes) -> Result<> {
      row.clear();
      put_number(row, uint8_t{3});
      for (uint64_t corner = 3 * facet; corner < 3 * facet + 3; ++corner) {
        // Entering the next stretch of the file: its pairs are loaded, and each corner gets the number of its
        // point.
        if (corner % corners_at_once == 0) {
          const std::vector<std::byte> pairs = MAILLE_TRY(firsts_->load(corner / corners_at_once));
          for (size_t at = 0; at < pairs.size(); at += 8)
            numbers[load<uint32_t>(&pairs[at]) % corners_at_once] =
                firsts.below(load<uint32_t>(&pairs[at + 4]));
        }
        put_number(row, numbers[corner % corners_at_once]);
        if (firsts.has(corner))
          MAILLE_CHECK(surface_->points.append(Bytes(bytes + 12 + 12 * (corner - 3 * facet), 12)));
      }
      if (!zero_ && !computed_) row.insert(row.end(), bytes, bytes + 12);
      if (!plain_) row.insert(row.end(), bytes + 48, bytes + 50);
      return surface_->faces.append(row);
    });
  }

  void write_header(uint64_t points) {
    PlyHeader& header = surface_->header;
    header.encoding = PlyEncoding::little_endian;
    const auto keep = [&](const char* key, const std::string& value) {
      header.comments.emplace_back("comment", format_ply_metadata(key, value));
    };
    if (!header_.empty()) keep("stl.header", to_word(header_));
    surface_->notes.push_back("welded " + counted(3 * facets_, "corner") + " into " +
                              counted(points, "point") + " (equal bit for bit)");
    PlyElement vertex{"vertex", points, {}};
    for (const char* name : {"x", "y", "z"})
      vertex.properties.push_back({name, Scalar::f32, false, Scalar::u8});
    PlyElement face{
        "face",
        facets_,
        {{"vertex_indices", points < uint64_t{1} << 31 ? Scalar::i32 : Scalar::u32, true, Scalar::u8}}};
    if (zero_ && facets_ > 0) {
      keep("stl.normals", "zero");
    } else if (!computed_) {
      for (const char* name : {"nx", "ny", "nz"})
        face.properties.push_back({name, Scalar::f32, false, Scalar::u8});
      header.comments.emplace_back(
          "comment", format_ply_hint({"face", "normal", Scalar::f32, 3, Role::normal, {"nx", "ny", "nz"}}));
    }
    if (!plain_) face.properties.push_back({"attribute", Scalar::u16, false, Scalar::u8});
    header.elements = {std::move(vertex), std::move(face)};
  }

  const Source& source_;
  const PartsOptions& options_;
  std::string header_;
  uint64_t facets_ = 0;
  std::optional<ConvertedSurface> surface_;
  std::optional<SpilledParts> firsts_;  ///< corner and the first at its place, by stretches of the file
  bool computed_ = true, zero_ = true, plain_ = true;
};

}  // namespace

Result<ConvertedSurface> convert_stl(const Source& source, const PartsOptions& options) {
  return StlConverter(source, options).run();
}

}  // namespace maille
