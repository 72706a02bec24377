#include "surface/parts/joins.h"

#include <algorithm>
#include <tuple>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"
#include "surface/half_edges.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("joins of parts: ") + what);
}

/// The numbers of shared points, as steps.
template <class Coder>
class StepCoder {
 public:
  explicit StepCoder(Coder& coder) : coder_(coder) {}

  uint32_t code_count(uint32_t count) { return count_.code(coder_, count); }
  /// Points follow one another where the traversal runs along the cut.
  uint32_t code_step(uint32_t step) {
    step = step_[context_].code(coder_, step);
    context_ = std::min(bit_length(step), most_context);
    return step;
  }

 private:
  static constexpr unsigned most_context = 7;

  Coder& coder_;
  CountModel count_;
  std::array<CountModel, most_context + 1> step_;
  unsigned context_ = 0;
};

/// A shared point, and the index of the first one in its group that is the same.
struct Member {
  Place place;
  uint32_t part;
  uint32_t point;
  size_t first;
};

/// Sorted by place: those of one place are a group.
std::vector<Member> sort_members(const SharedPoints& shared, const SharedPlaces& places) {
  std::vector<Member> members;
  for (uint32_t part = 0; part < shared.size(); ++part) {
    for (size_t i = 0; i < shared[part].size(); ++i) {
      members.push_back({places[part][i], part, shared[part][i], 0});
    }
  }
  std::sort(members.begin(), members.end(), [](const Member& a, const Member& b) {
    return std::tie(a.place, a.part, a.point) < std::tie(b.place, b.part, b.point);
  });
  return members;
}

/// Which members of a group are one point: mostly all.
template <class Coder>
class GroupCoder {
 public:
  explicit GroupCoder(Coder& coder) : coder_(coder) {}

  /// `first` is set in the encoder, and is found in the decoder. False: a damaged stream.
  bool code(std::vector<Member>& members, size_t begin, size_t end) {
    if (end - begin == 1) {
      members[begin].first = begin;
      return true;
    }
    bool all_one = true;
    for (size_t i = begin; i < end; ++i) all_one = all_one && members[i].first == begin;
    if (all_one_.code(coder_, all_one)) {
      for (size_t i = begin; i < end; ++i) members[i].first = begin;
      return true;
    }
    for (size_t i = begin; i < end; ++i) {
      // How far back the first one is; 0: it is the first itself.
      const uint32_t back = back_.code(coder_, static_cast<uint32_t>(i - members[i].first));
      if (back > i - begin || coder_.exhausted()) return false;
      members[i].first = i - back;
      if (members[members[i].first].first != members[i].first) return false;
    }
    return true;
  }

 private:
  Coder& coder_;
  BitModel all_one_;
  CountModel back_;
};

template <class Coder>
bool code_groups(Coder& coder, std::vector<Member>& members) {
  GroupCoder<Coder> groups(coder);
  for (size_t begin = 0, end = 0; begin < members.size(); begin = end) {
    while (end < members.size() && members[end].place == members[begin].place) ++end;
    if (!groups.code(members, begin, end) || coder.exhausted()) return false;
  }
  return true;
}

/// The first of each group's members that are one point in the whole mesh. Groups are small but where many
/// points lie in one place; their numbers are sorted to find equal ones.
void find_firsts(std::vector<Member>& members, std::span<const std::span<const uint32_t>> whole) {
  const auto number = [&](size_t i) { return whole[members[i].part][members[i].point]; };
  std::vector<size_t> group;
  for (size_t begin = 0, end = 0; begin < members.size(); begin = end) {
    group.clear();
    for (; end < members.size() && members[end].place == members[begin].place; ++end) group.push_back(end);
    std::sort(group.begin(), group.end(),
              [&](size_t a, size_t b) { return std::pair(number(a), a) < std::pair(number(b), b); });
    for (size_t k = 0; k < group.size(); ++k) {
      const bool same = k > 0 && number(group[k]) == number(group[k - 1]);
      members[group[k]].first = same ? members[group[k - 1]].first : group[k];
    }
  }
}

std::vector<std::byte> encode_shared(const SharedPoints& shared) {
  RansEncoder encoder;
  StepCoder<RansEncoder> coder(encoder);
  for (const std::vector<uint32_t>& points : shared) {
    coder.code_count(static_cast<uint32_t>(points.size()));
    uint32_t next = 0;
    for (const uint32_t point : points) {
      coder.code_step(point - next);
      next = point + 1;
    }
  }
  return encoder.finish();
}

Result<std::pair<Bytes, Bytes>> sections_of(Bytes bytes) {
  ByteReader in(bytes);
  const Bytes shared = in.get_bytes(in.get_count());
  const Bytes groups = in.get_bytes(in.remaining());
  if (!in.ok()) return corrupt("the stream is too short");
  return std::pair(shared, groups);
}

/// A point that is not new, and the member that is the same in an earlier part.
struct Joined {
  uint32_t point;
  size_t first;
};

/// The number of a point in a part before.
uint32_t number_of(const JoinedPart& part, uint32_t point) {
  const auto place = std::lower_bound(part.joined.begin(), part.joined.end(), point);
  const auto before = static_cast<size_t>(place - part.joined.begin());
  if (place != part.joined.end() && *place == point) return part.numbers[before];
  return part.first_new + point - static_cast<uint32_t>(before);
}

Result<JoinedPoints> number_points(std::span<const uint32_t> part_points,
                                   const std::vector<Member>& members) {
  std::vector<std::vector<Joined>> joined(part_points.size());
  for (size_t i = 0; i < members.size(); ++i) {
    if (members[i].first == i) continue;
    // Members of one place are sorted by part, so the first is in the lowest.
    if (members[members[i].first].part >= members[i].part) return corrupt("two points of one part are one");
    joined[members[i].part].push_back({members[i].point, members[i].first});
  }
  JoinedPoints result;
  uint64_t count = 0;
  for (size_t p = 0; p < part_points.size(); ++p) {
    std::sort(joined[p].begin(), joined[p].end(),
              [](const Joined& a, const Joined& b) { return a.point < b.point; });
    JoinedPart part{part_points[p], static_cast<uint32_t>(count), {}, {}};
    for (const Joined& point : joined[p]) {
      part.joined.push_back(point.point);
      const Member& first = members[point.first];
      part.numbers.push_back(number_of(result.parts[first.part], first.point));
    }
    count += part_points[p] - part.joined.size();
    if (count >= none) return corrupt("more points than a mesh may have");
    result.parts.push_back(std::move(part));
  }
  result.count = static_cast<uint32_t>(count);
  return result;
}

}  // namespace

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

SharedPoints find_shared_points(std::span<const std::span<const uint32_t>> whole, uint32_t points,
                                Executor& executor) {
  std::vector<bool> seen(points);
  std::vector<bool> again(points);
  for (const std::span<const uint32_t> part : whole) {
    for (const uint32_t point : part) (seen[point] ? again : seen)[point] = true;
  }
  SharedPoints shared(whole.size());
  executor.parallel_for(whole.size(), [&](size_t part) {
    for (uint32_t i = 0; i < whole[part].size(); ++i) {
      if (again[whole[part][i]]) shared[part].push_back(i);
    }
  });
  return shared;
}

std::vector<std::byte> encode_joins(const SharedPoints& shared, const SharedPlaces& places,
                                    std::span<const std::span<const uint32_t>> whole) {
  std::vector<Member> members = sort_members(shared, places);
  find_firsts(members, whole);
  RansEncoder encoder;
  code_groups(encoder, members);
  ByteWriter out;
  const std::vector<std::byte> lists = encode_shared(shared);
  out.put_count(lists.size());
  out.put_bytes(lists);
  out.put_bytes(encoder.finish());
  return out.take();
}

Result<SharedPoints> decode_shared_points(Bytes bytes, std::span<const uint32_t> part_points) {
  const auto sections = MAILLE_TRY(sections_of(bytes));
  RansDecoder decoder(sections.first);
  StepCoder<RansDecoder> coder(decoder);
  SharedPoints shared(part_points.size());
  for (size_t part = 0; part < part_points.size(); ++part) {
    const uint32_t count = coder.code_count(0);
    uint64_t next = 0;
    for (uint32_t i = 0; i < count; ++i) {
      next += coder.code_step(0);
      if (decoder.exhausted() || next >= part_points[part]) return corrupt("a point that is not there");
      shared[part].push_back(static_cast<uint32_t>(next++));
    }
    if (decoder.exhausted()) return corrupt("the stream ends early");
  }
  return shared;
}

Result<JoinedPoints> decode_joins(Bytes bytes, std::span<const uint32_t> part_points,
                                  const SharedPoints& shared, const SharedPlaces& places) {
  const auto sections = MAILLE_TRY(sections_of(bytes));
  std::vector<Member> members = sort_members(shared, places);
  RansDecoder decoder(sections.second);
  if (!code_groups(decoder, members)) return corrupt("the stream is damaged");
  return number_points(part_points, members);
}

}  // namespace maille
