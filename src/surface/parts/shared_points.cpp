#include "surface/parts/shared_points.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <tuple>

#include "base/result.h"
#include "entropy/bit_model.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"

namespace maille {
namespace {

/// Points on edges of one face: the neighbours along faces' sides cancel (exclusive or) where each side is
/// there twice. Both sides compute it from the decoded piece, so chance does no harm. `number` gives the
/// coded number of a point.
template <class Number>
std::vector<uint32_t> find_borders(const Mesh& mesh, Number number) {
  std::vector<uint32_t> neighbours(mesh.point_count());
  // Number 0 must count, too.
  const auto coded = [&](uint32_t point) { return number(point) + 1; };
  const auto add = [&](uint32_t before, uint32_t at, uint32_t next) { neighbours[at - 1] ^= before ^ next; };
  for (const CellBlock& block : mesh.blocks) {
    const Buffer<uint32_t>& corners = block.connectivity;
    for (size_t i = 0; block.type == CellType::triangle && i + 2 < corners.size(); i += 3) {
      const uint32_t a = coded(corners[i]), b = coded(corners[i + 1]), c = coded(corners[i + 2]);
      add(a, b, c);
      add(b, c, a);
      add(c, a, b);
    }
    for (uint64_t i = 0; block.type != CellType::triangle && i < block.size(); ++i) {
      const auto cell = block.cell(i);
      for (size_t k = 0; k < cell.size(); ++k)
        add(coded(cell[k > 0 ? k - 1 : cell.size() - 1]), coded(cell[k]),
            coded(cell[k + 1 < cell.size() ? k + 1 : 0]));
    }
  }
  std::vector<uint32_t> border;
  // Few are not 0.
  const auto count = static_cast<uint32_t>(neighbours.size());
  for (uint32_t i = 0; i < count; ++i) {
    for (uint64_t four[2]; i + 4 <= count; i += 4) {
      std::memcpy(four, &neighbours[i], sizeof four);
      if ((four[0] | four[1]) != 0) break;
    }
    if (i < count && neighbours[i] != 0) border.push_back(i);
  }
  return border;
}

/// Which points are shared, from where the piece's borders are: nearly all points on borders are, few
/// elsewhere. First come those elsewhere, as steps, then a decision for each point of the border, then
/// copies. One function for both directions; a decoder's `shared` is filled. False: they do not fit, and
/// nothing was reserved for more points than the piece has.
template <class Coder>
bool code_shared(Coder& coder, uint32_t points, const std::vector<uint32_t>& border,
                 std::span<const uint8_t> on_side, std::vector<SharedPoint>& shared, bool decoding) {
  std::vector<uint32_t> here, elsewhere;
  if (!decoding) {
    for (const SharedPoint& point : shared)
      (std::binary_search(border.begin(), border.end(), point.point) ? here : elsewhere)
          .push_back(point.point);
  }
  CountModel number, step;
  const uint32_t count = number.code(coder, static_cast<uint32_t>(elsewhere.size()));
  if (count > points) return false;
  uint64_t next = 0;
  for (uint32_t i = 0; i < count; ++i) {
    if (decoding) elsewhere.push_back(static_cast<uint32_t>(next));
    next += step.code(coder, elsewhere[i] - static_cast<uint32_t>(next));
    // Rising and below the number of points, so that any count ends.
    if (next >= points) return false;
    elsewhere[i] = static_cast<uint32_t>(next++);
  }
  // A border of the mesh itself is in long runs.
  std::array<std::array<BitModel, 2>, 2> there;
  std::array<bool, 2> before = {true, true};
  size_t at = 0;
  for (size_t i = 0; i < border.size(); ++i) {
    const uint8_t side = on_side.empty() ? uint8_t{0} : on_side[i];
    const bool is = there[side][before[side]].code(coder, at < here.size() && here[at] == border[i]);
    before[side] = is;
    if (decoding && is) here.push_back(border[i]);
    at += is;
  }
  if (decoding) {
    here.insert(here.end(), elsewhere.begin(), elsewhere.end());
    std::sort(here.begin(), here.end());
    // Damaged bytes may name a point of the border among those elsewhere, too.
    here.erase(std::unique(here.begin(), here.end()), here.end());
    for (const uint32_t point : here) shared.push_back({point, 0});
  }
  // So are copies, where a lattice is too coarse for the mesh.
  std::array<CountModel, 2> copy;
  bool copied = false;
  for (SharedPoint& point : shared) {
    point.copy = copy[copied].code(coder, point.copy);
    copied = point.copy != 0;
  }
  return true;
}

/// A shared point of a piece.
struct Member {
  Place place;
  uint32_t copy;
  uint32_t piece, point;
  bool operator<(const Member& o) const {
    return std::tie(place, copy, piece, point) < std::tie(o.place, o.copy, o.piece, o.point);
  }
  bool is(const Member& o) const { return place == o.place && copy == o.copy; }
};

/// Which of several points in one place each point is. These are numbered by the first piece that has each,
/// so that the decoded mesh, which is cut into the same pieces, has the same numbers.
class Copies {
 public:
  /// `points`: shared ones, in any order.
  explicit Copies(std::vector<std::pair<Place, uint32_t>> points) {
    std::sort(points.begin(), points.end());
    for (size_t begin = 0, end = 0; begin < points.size(); begin = end) {
      while (end < points.size() && points[end].first == points[begin].first) ++end;
      if (end - begin == 1) continue;
      for (size_t i = begin; i < end; ++i) twins_.push_back({points[i].second, places_, none});
      ++places_;
    }
    std::sort(twins_.begin(), twins_.end(), [](const Twin& a, const Twin& b) { return a.point < b.point; });
    counts_.resize(places_);
  }
  /// Points come as pieces have them, one piece after the other.
  uint32_t copy_of(uint32_t point) {
    const auto at = std::lower_bound(twins_.begin(), twins_.end(), point,
                                     [](const Twin& twin, uint32_t number) { return twin.point < number; });
    if (at == twins_.end() || at->point != point) return 0;
    if (at->copy == none) at->copy = counts_[at->place]++;
    return at->copy;
  }

 private:
  static constexpr uint32_t none = 0xffffffff;
  struct Twin {
    uint32_t point, place, copy;
  };
  std::vector<Twin> twins_;  ///< points that are not alone in their place, rising
  uint32_t places_ = 0;
  std::vector<uint32_t> counts_;  ///< by place
};

/// The number in the mesh of a point that is new with this part: new points follow one another, so joined
/// ones before it do not count.
uint32_t number_in_mesh(const JoinedPart& part, uint32_t point) {
  const auto before = std::lower_bound(part.joined.begin(), part.joined.end(), point) - part.joined.begin();
  return part.first_new + point - static_cast<uint32_t>(before);
}

}  // namespace

/// Numbers of fewer than 8 bytes leave the rest 0, so places compare as wholes.
Place place_of(const Array& positions, uint32_t point) {
  Place place{};
  const size_t size = size_of(positions.type);
  for (size_t k = 0; k < 3; ++k) {
    std::memcpy(&place[k], positions.bytes.data() + (size_t{3} * point + k) * size, size);
  }
  return place;
}

std::vector<uint32_t> points_on_borders(const Mesh& piece) {
  return find_borders(piece, [](uint32_t point) { return point; });
}

/// The encoder's mesh has other numbers; borders are wanted in those of the decoder, as find_borders()
/// depends on them by chance.
std::vector<uint32_t> borders_of_coded(const Mesh& piece, std::span<const uint32_t> points) {
  std::vector<uint32_t> number(points.size());
  for (uint32_t i = 0; i < points.size(); ++i) number[points[i]] = i;
  return find_borders(piece, [&](uint32_t point) { return number[point]; });
}

std::vector<std::vector<SharedPoint>> find_shared(std::span<const std::span<const uint32_t>> points,
                                                  uint32_t count,
                                                  const std::function<Place(uint32_t)>& place_of_point) {
  // Of each point whether no piece has it, one, or more.
  std::vector<uint8_t> pieces_with(count);
  for (const std::span<const uint32_t> piece : points) {
    for (const uint32_t point : piece)
      pieces_with[point] = static_cast<uint8_t>(pieces_with[point] == 0 ? 1 : 2);
  }
  std::vector<std::pair<Place, uint32_t>> placed;
  for (uint32_t point = 0; point < count; ++point) {
    if (pieces_with[point] > 1) placed.emplace_back(place_of_point(point), point);
  }
  Copies copies(std::move(placed));
  std::vector<std::vector<SharedPoint>> shared(points.size());
  for (uint32_t p = 0; p < points.size(); ++p) {
    for (uint32_t i = 0; i < points[p].size(); ++i) {
      const uint32_t point = points[p][i];
      if (pieces_with[point] > 1) shared[p].push_back({i, copies.copy_of(point)});
    }
  }
  return shared;
}

std::vector<std::byte> encode_shared(std::span<const SharedPoint> shared, uint32_t points,
                                     const std::vector<uint32_t>& border, std::span<const uint8_t> on_side) {
  const auto is_plain = [](const SharedPoint& point, uint32_t on_border) {
    return point.point == on_border && point.copy == 0;
  };
  if (std::equal(shared.begin(), shared.end(), border.begin(), border.end(), is_plain)) return {};
  std::vector<SharedPoint> all(shared.begin(), shared.end());
  RansEncoder encoder;
  code_shared(encoder, points, border, on_side, all, false);
  return encoder.finish();
}

Result<std::vector<SharedPoint>> decode_shared(Bytes bytes, uint32_t points,
                                               const std::vector<uint32_t>& border,
                                               std::span<const uint8_t> on_side) {
  std::vector<SharedPoint> shared;
  if (bytes.empty()) {
    for (const uint32_t point : border) shared.push_back({point, 0});
    return shared;
  }
  RansDecoder decoder(bytes);
  if (!code_shared(decoder, points, border, on_side, shared, true) || decoder.exhausted())
    return failure(ErrorCode::corrupt, "shared points that are not there");
  return shared;
}

/// Both lists are walked once: joined points rise.
std::vector<uint32_t> JoinedPart::all_numbers() const {
  std::vector<uint32_t> all(points);
  uint32_t next = first_new;
  uint32_t point = 0;
  for (size_t i = 0; i < joined.size(); ++i) {
    while (point < joined[i]) all[point++] = next++;
    all[point++] = numbers[i];
  }
  while (point < points) all[point++] = next++;
  return all;
}

/// Places of shared points only, as the positions of pieces may be gone when they are joined.
PieceOfPoints piece_of_points(uint32_t points, std::span<const SharedPoint> shared,
                              const std::function<Place(uint32_t)>& place_of_point) {
  PieceOfPoints piece = {points, shared};
  piece.places.reserve(shared.size());
  for (const SharedPoint& each : shared) piece.places.push_back(place_of_point(each.point));
  return piece;
}

PieceOfPoints piece_of_points(const Array& positions, std::span<const SharedPoint> shared) {
  return piece_of_points(static_cast<uint32_t>(positions.count()), shared,
                         [&](uint32_t point) { return place_of(positions, point); });
}

JoinedPoints join_points(std::span<const PieceOfPoints> pieces) {
  std::vector<Member> members;
  size_t count = 0;
  for (const PieceOfPoints& piece : pieces) count += piece.shared.size();
  members.reserve(count);  // of the largest there is, and grown it would be there three times
  for (uint32_t p = 0; p < pieces.size(); ++p) {
    for (size_t i = 0; i < pieces[p].shared.size(); ++i) {
      const SharedPoint& shared = pieces[p].shared[i];
      members.push_back({pieces[p].places[i], shared.copy, p, shared.point});
    }
  }
  // Places are compared as bits: any order will do that puts equal ones together, and then the first piece
  // first. Points of NaN or -0 join as well.
  std::sort(members.begin(), members.end());
  const auto is_first = [&](size_t i) { return i == 0 || !members[i].is(members[i - 1]); };
  JoinedPoints joined;
  for (const PieceOfPoints& piece : pieces) joined.parts.emplace_back().points = piece.points;
  for (size_t i = 0; i < members.size(); ++i) {
    if (!is_first(i)) joined.parts[members[i].piece].joined.push_back(members[i].point);
  }
  for (JoinedPart& part : joined.parts) {
    std::sort(part.joined.begin(), part.joined.end());
    part.numbers.resize(part.joined.size());
    part.first_new = joined.count;
    joined.count += part.points - static_cast<uint32_t>(part.joined.size());
  }
  uint32_t number = 0;
  for (size_t i = 0; i < members.size(); ++i) {
    JoinedPart& part = joined.parts[members[i].piece];
    if (is_first(i)) {
      number = number_in_mesh(part, members[i].point);
    } else {
      const auto at = std::lower_bound(part.joined.begin(), part.joined.end(), members[i].point);
      part.numbers[static_cast<size_t>(at - part.joined.begin())] = number;
    }
  }
  return joined;
}

}  // namespace maille
