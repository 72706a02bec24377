#include "support/codec.h"

#include "support/cases.h"
#include "support/random_mesh.h"
#include "surface/patch_topology.h"

#include <set>
#include <sstream>

namespace maille::testing {

namespace {

void describe_array(std::ostream& out, const Array& array) {
  out << "  " << name_of(array.domain) << " \"" << array.name << "\" " << name_of(array.type) << " x "
      << array.components << ", " << array.count() << " tuples:";
  for (size_t i = 0; i < array.bytes.size() && i < 96; ++i) {
    static constexpr char digits[] = "0123456789abcdef";
    if (i % size_of(array.type) == 0) out << ' ';
    out << digits[std::to_integer<unsigned>(array.bytes[i]) >> 4]
        << digits[std::to_integer<unsigned>(array.bytes[i]) & 15];
  }
  out << (array.bytes.size() > 96 ? " ...\n" : "\n");
}

}  // namespace

Result<Encoded> encode_bytes(const Mesh& mesh, const EncodeOptions& options) {
  Encoded encoded;
  const auto sink = memory_sink(encoded.bytes);
  auto report = encode(mesh, *sink, options);
  if (!report) return tl::unexpected(report.error());
  encoded.report = *report;
  return encoded;
}

Result<Mesh> decode_bytes(const std::vector<std::byte>& bytes, const DecodeOptions& options) {
  return decode(*memory_source(Bytes(bytes)), options);
}

std::string differences_between(const Mesh& a, const Mesh& b, bool same_order) {
  CompareOptions options;
  options.same_order = same_order;
  options.compare_metadata = true;
  std::string text;
  for (const std::string& difference : compare(a, b, options).differences)
    text += (text.empty() ? "" : "; ") + difference;
  return text;
}

bool is_glued_by_choice(const Mesh& mesh) {
  const SimpleFaces faces = collect_faces(mesh);
  return glue(faces.view(static_cast<uint32_t>(mesh.point_count()))).chosen;
}

bool has_twins(const Mesh& decoded) {
  const size_t size = decoded.points.tuple_size();
  std::set<std::string> places;
  for (uint64_t i = 0; i < decoded.point_count(); ++i)
    places.emplace(reinterpret_cast<const char*>(decoded.points.bytes.data()) + i * size, size);
  return places.size() < decoded.point_count();
}

std::string describe(const Mesh& mesh) {
  std::ostringstream out;
  out << mesh.point_count() << " points, " << mesh.cell_count() << " cells, " << mesh.corner_count()
      << " corners\n";
  if (mesh.corner_count() > 60 || mesh.cell_count() > 30) return out.str();
  for (const CellBlock& block : mesh.blocks) {
    out << "  block \"" << block.name << "\" (" << name_of(block.type) << "):";
    for (uint64_t i = 0; i < block.size(); ++i) {
      out << " (";
      const auto cell = block.cell(i);
      for (size_t k = 0; k < cell.size(); ++k) out << (k > 0 ? " " : "") << cell[k];
      out << ")";
    }
    out << "\n";
  }
  describe_array(out, mesh.points);
  for (const Array& array : mesh.arrays) describe_array(out, array);
  return out.str();
}

std::string check_random_surfaces(uint64_t first, uint64_t count, const RandomMeshOptions& options,
                                  const Property& property) {
  for (uint64_t seed = first; seed < first + cases(count); ++seed) {
    const std::string wrong = property(random_surface(seed, options));
    if (wrong.empty()) continue;
    std::string text = "seed " + std::to_string(seed) + ": " + wrong;
    for (uint32_t faces = 1; faces < options.faces; faces *= 2) {
      RandomMeshOptions small = options;
      small.faces = faces;
      for (uint64_t other = 0; other < 300; ++other) {
        const Mesh mesh = random_surface(other, small);
        const std::string why = property(mesh);
        if (why.empty()) continue;
        return text + "\nsmaller: faces " + std::to_string(faces) + ", seed " + std::to_string(other) + ": " +
               why + "\n" + describe(mesh);
      }
    }
    return text;
  }
  return {};
}

}  // namespace maille::testing
