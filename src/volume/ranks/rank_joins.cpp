#include "volume/ranks/rank_joins.h"

#include <algorithm>

#include "base/bytes.h"
#include "base/sort_unique.h"
#include "volume/ranks/collective.h"

namespace maille {
namespace {

/// A shared point of a piece, in the order in which the piece has them.
struct Shared {
  uint32_t number = 0;  ///< in the whole mesh
  Place place{};
};

/// Writes the shared points of a coded piece in its order, with their places as decoders will have them;
/// returns their numbers in the piece.
std::vector<uint32_t> coded_numbers(const PieceJoin& join, const PieceInWork& piece, ByteWriter& out) {
  std::vector<uint32_t> numbers;
  out.put(join.piece);
  out.put_count(join.shared.size());
  for (uint32_t i = 0; i < piece.coded_points.size(); ++i) {
    const auto at = std::lower_bound(join.shared.begin(), join.shared.end(), piece.coded_points[i]);
    if (at == join.shared.end() || *at != piece.coded_points[i]) continue;
    numbers.push_back(i);
    out.put(*at);
    const Place& place =
        piece.places.empty() ? join.places[static_cast<size_t>(at - join.shared.begin())] : piece.places[i];
    for (const uint64_t bits : place) out.put(bits);
  }
  return numbers;
}

/// By piece its shared points: pieces of all ranks, in the first one.
std::vector<std::vector<Shared>> unpack(const Buffers& buffers, uint32_t pieces) {
  std::vector<std::vector<Shared>> all(pieces);
  for (const auto& buffer : buffers) {
    for (ByteReader in(buffer); in.remaining() > 0;) {
      std::vector<Shared>& of_piece = all[in.get<uint32_t>()];
      of_piece.resize(in.get_count());
      for (Shared& shared : of_piece) {
        shared.number = in.get<uint32_t>();
        for (uint64_t& bits : shared.place) bits = in.get<uint64_t>();
      }
    }
  }
  return all;
}

/// By piece the copy of each shared point. find_shared() counts over numbers of the whole mesh, so numbers
/// are made dense first.
std::vector<std::vector<SharedPoint>> find_copies(const std::vector<std::vector<Shared>>& pieces) {
  // Numbers among the shared points rise as numbers in the mesh do.
  std::vector<uint32_t> numbers;
  for (const auto& piece : pieces) {
    for (const Shared& shared : piece) numbers.push_back(shared.number);
  }
  sort_unique(numbers);
  std::vector<std::vector<uint32_t>> points;
  std::vector<Place> places(numbers.size());
  for (const auto& piece : pieces) {
    std::vector<uint32_t>& of_piece = points.emplace_back();
    for (const Shared& shared : piece) {
      const auto at = std::lower_bound(numbers.begin(), numbers.end(), shared.number) - numbers.begin();
      of_piece.push_back(static_cast<uint32_t>(at));
      places[static_cast<size_t>(at)] = shared.place;
    }
  }
  const std::vector<std::span<const uint32_t>> spans(points.begin(), points.end());
  return find_shared(spans, static_cast<uint32_t>(numbers.size()),
                     [&](uint32_t point) { return places[point]; });
}

}  // namespace

// Places without loss; where positions have a bound, those of the coded piece replace them.
std::vector<PieceJoin> joins_of(const std::vector<PieceOfRank>& pieces) {
  std::vector<PieceJoin> joins;
  for (const PieceOfRank& piece : pieces) {
    PieceJoin& join = joins.emplace_back();
    join.piece = piece.number;
    join.shared = piece.shared;
    for (const uint32_t point : piece.shared) {
      const std::vector<uint32_t>& points = piece.sub.points;
      const auto at = std::lower_bound(points.begin(), points.end(), point) - points.begin();
      join.places.push_back(place_of(piece.sub.mesh.points, static_cast<uint32_t>(at)));
    }
  }
  return joins;
}

void join_among_ranks(const std::vector<PieceJoin>& joins, uint32_t pieces, std::vector<PieceInWork>& coded,
                      Ranks& ranks) {
  ByteWriter mine;
  std::vector<std::vector<uint32_t>> numbers;
  for (size_t i = 0; i < coded.size(); ++i) numbers.push_back(coded_numbers(joins[i], coded[i], mine));
  const Buffers found = to_first(ranks, mine.take());
  Buffers answers(ranks.size());
  if (ranks.rank() == 0) {
    const auto shared = find_copies(unpack(found, pieces));
    std::vector<ByteWriter> out(ranks.size());
    for (uint32_t p = 0; p < pieces; ++p) {
      for (const SharedPoint& point : shared[p]) out[rank_of_piece(p, pieces, ranks.size())].put(point.copy);
    }
    for (unsigned r = 0; r < ranks.size(); ++r) answers[r] = out[r].take();
  }
  // Pieces stand in the order of their numbers in both directions, so that answers need no keys.
  const std::vector<std::byte> answer = ranks.exchange(std::move(answers))[0];
  ByteReader in(answer);
  for (size_t i = 0; i < coded.size(); ++i) {
    std::vector<SharedPoint> shared;
    for (const uint32_t number : numbers[i]) shared.push_back({number, in.get<uint32_t>()});
    const auto points = static_cast<uint32_t>(coded[i].coded_points.size());
    coded[i].coded.shared = encode_shared(shared, points, coded[i].border, coded[i].on_side);
  }
}

}  // namespace maille
