#include "random/chart_index.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/bytes.h"

namespace maille {
namespace {

// Steps of 16 bits over the frame, which encloses the mesh, and of 8 bits over the radius of a chart: the
// parts of the format that keep a chart at some 20 bytes (docs/format.md, 17.2).
constexpr double sphere_steps = 65535;
constexpr double half_steps = 255;
// A sphere is rounded to a step along each axis; its radius grows by as much: sqrt(3) < 2 steps, and one for
// itself.
constexpr double rounding = 3;

/// As it stands in the file: in steps of the frame.
struct PackedSphere {
  std::array<uint16_t, 3> centre;
  uint16_t radius;

  template <class Self, class Visitor>
  static void visit(Self& sphere, Visitor& visitor) {
    for (auto& c : sphere.centre) visitor(c);
    visitor(sphere.radius);
  }
};

/// `visit` lists the fields once, for the writer and the reader.
struct PackedChart {
  PackedSphere sphere;
  std::array<uint8_t, 3> half;  ///< of the box around the same centre, in parts of the radius
  uint32_t producer;            ///< less the group's own number; 0: none
  uint32_t faces, bytes, check;

  template <class Self, class Visitor>
  static void visit(Self& chart, Visitor& visitor) {
    PackedSphere::visit(chart.sphere, visitor);
    for (auto& c : chart.half) visitor(c);
    visitor.count(chart.producer);
    visitor.count(chart.faces);
    visitor.count(chart.bytes);
    visitor(chart.check);
  }
};

struct PackedGroup {
  uint8_t level;
  float view_error, bound;
  PackedSphere sphere;
  uint64_t offset;
  uint32_t replaces, charts;

  template <class Self, class Visitor>
  static void visit(Self& group, Visitor& visitor) {
    visitor(group.level);
    visitor(group.view_error);
    visitor(group.bound);
    PackedSphere::visit(group.sphere, visitor);
    visitor(group.offset);
    visitor.count(group.replaces);
    visitor.count(group.charts);
  }
};

struct Writer {
  ByteWriter& out;
  template <class T>
  void operator()(const T& value) {
    out.put(value);
  }
  void count(const uint32_t& value) { out.put_count(value); }
};

/// ByteReader remembers that it ran out; `in_range` remembers a count that 32 bits cannot hold. Both are
/// asked once for each group and chart, before anything of it is used.
struct Reader {
  ByteReader& in;
  bool in_range = true;
  template <class T>
  void operator()(T& value) {
    value = in.get<T>();
  }
  void count(uint32_t& value) {
    const uint64_t found = in.get_count();
    in_range = in_range && found <= 0xffffffff;
    value = static_cast<uint32_t>(found);
  }
};

template <class T>
/// A conversion of a double that does not fit an integer is undefined, and a mesh may have any numbers.
T clamped(double x) {
  return static_cast<T>(std::clamp(x, 0.0, static_cast<double>(std::numeric_limits<T>::max())));
}

PackedSphere pack(const IndexFrame& frame, const Sphere& sphere) {
  const double step = frame.size / sphere_steps;
  PackedSphere packed{};
  for (unsigned k = 0; k < 3; ++k) {
    packed.centre[k] = clamped<uint16_t>(std::floor((sphere.centre[k] - frame.low[k]) / step + 0.5));
  }
  packed.radius = clamped<uint16_t>(std::ceil(sphere.radius / step) + rounding);
  return packed;
}

Sphere unpack(const IndexFrame& frame, const PackedSphere& packed) {
  const double step = frame.size / sphere_steps;
  Sphere sphere;
  for (unsigned k = 0; k < 3; ++k) sphere.centre[k] = frame.low[k] + step * packed.centre[k];
  sphere.radius = step * packed.radius;
  return sphere;
}

PackedChart pack(const IndexFrame& frame, const IndexedChart& chart, uint32_t group) {
  PackedChart packed{};
  packed.sphere = pack(frame, chart.sphere);
  const Sphere around = unpack(frame, packed.sphere);
  const double step = around.radius / half_steps;
  for (unsigned k = 0; k < 3; ++k) {
    // The box shares the rounded centre of the sphere, so its half sizes are measured from there. The small
    // addition makes up for the rounding of the division: a box may be too large, never too small.
    const double half = std::max(around.centre[k] - chart.box.low[k], chart.box.high[k] - around.centre[k]);
    packed.half[k] = step > 0 ? clamped<uint8_t>(std::ceil(half / step + 1e-6)) : uint8_t{255};
  }
  packed.producer = chart.producer == no_group ? 0 : chart.producer - group;
  packed.faces = chart.faces;
  packed.bytes = chart.bytes;
  packed.check = chart.check;
  return packed;
}

IndexedChart unpack(const IndexFrame& frame, const PackedChart& packed, uint32_t group) {
  IndexedChart chart;
  chart.sphere = unpack(frame, packed.sphere);
  const double step = chart.sphere.radius / half_steps;
  for (unsigned k = 0; k < 3; ++k) {
    chart.box.low[k] = chart.sphere.centre[k] - step * packed.half[k];
    chart.box.high[k] = chart.sphere.centre[k] + step * packed.half[k];
  }
  chart.producer = packed.producer == 0 ? no_group : group + packed.producer;
  chart.faces = packed.faces;
  chart.bytes = packed.bytes;
  chart.check = packed.check;
  return chart;
}

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("chart index: ") + what);
}

}  // namespace

// Errors are promises, so they are rounded up.
float float_not_less(double x) {
  const auto nearest = static_cast<float>(x);
  return static_cast<double>(nearest) >= x ? nearest
                                           : std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

std::vector<std::byte> encode_index_page(const IndexFrame& frame, std::span<const IndexedGroup> groups,
                                         uint32_t first) {
  ByteWriter out;
  Writer writer{out};
  for (size_t i = 0; i < groups.size(); ++i) {
    const IndexedGroup& group = groups[i];
    const PackedGroup packed{static_cast<uint8_t>(group.level),
                             float_not_less(group.view_error),
                             float_not_less(group.bound),
                             pack(frame, group.sphere),
                             group.offset,
                             group.replaces,
                             static_cast<uint32_t>(group.charts.size())};
    PackedGroup::visit(packed, writer);
    for (const IndexedChart& chart : group.charts) {
      const PackedChart packed_chart = pack(frame, chart, first + static_cast<uint32_t>(i));
      PackedChart::visit(packed_chart, writer);
    }
  }
  return out.take();
}

Result<std::vector<IndexedGroup>> decode_index_page(const IndexFrame& frame, Bytes bytes, uint32_t first,
                                                    uint32_t group_count) {
  if (first >= group_count) return corrupt("a page beyond the last group");
  ByteReader in(bytes);
  Reader reader{in};
  std::vector<IndexedGroup> groups;
  for (uint32_t number = first; number < std::min(group_count, first + groups_per_index_page); ++number) {
    PackedGroup packed;
    PackedGroup::visit(packed, reader);
    if (!in.ok() || !reader.in_range) return corrupt("a group that is not whole");
    if (std::isnan(packed.view_error) || std::isnan(packed.bound))
      return corrupt("an error that is no number");
    IndexedGroup& group = groups.emplace_back();
    group.level = packed.level;
    group.view_error = static_cast<double>(packed.view_error);
    group.bound = static_cast<double>(packed.bound);
    group.sphere = unpack(frame, packed.sphere);
    group.offset = packed.offset;
    group.replaces = packed.replaces;
    for (uint32_t i = 0; i < packed.charts; ++i) {
      PackedChart chart;
      PackedChart::visit(chart, reader);
      if (!in.ok() || !reader.in_range) return corrupt("a chart that is not whole");
      // Producers have higher numbers than their groups, so following them always ends.
      if (chart.producer >= group_count - number) return corrupt("a chart of a group that is not there");
      // Charts are added as they are read: a claimed number of them reserves nothing.
      group.charts.push_back(unpack(frame, chart, number));
    }
  }
  if (in.remaining() > 0) return corrupt("bytes behind the last group");
  return groups;
}

}  // namespace maille
