#include "exact.h"

#include <fmt/format.h>
#include <maille/compare.h>
#include <maille/io.h>
#include <maille/random_access.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "base/result.h"
#include "container/file_reader.h"
#include "measures.h"
#include "mesh/mesh_as_source.h"
#include "random/mesh_geometry.h"
#include "random/random_file.h"

namespace maille {
namespace {

/// What was found of a file: an empty text where all is as it was.
struct Checked {
  uint64_t single = 0, random = 0;
  uint64_t charts = 0;
  size_t levels = 0;
  std::string whole, order, part, lost, windows;
  double seconds = 0;

  bool exact() const {
    const auto fine = [](const std::string& text) { return text.empty() || text == "-"; };
    return fine(whole) && fine(order) && fine(part) && fine(lost) && fine(windows);
  }
};

std::string difference(const Mesh& mesh, const Result<Mesh>& other, bool same_order = false) {
  if (!other) return other.error().message;
  CompareOptions options;
  options.same_order = same_order;
  const Comparison found = compare(mesh, *other, options);
  if (found.equal) return "";
  return found.differences.empty() ? "differs" : found.differences.front();
}

Result<std::vector<std::byte>> encoded(const Mesh& mesh, Mode mode, const ExactOptions& options,
                                       Order order = Order::canonical) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  EncodeOptions encoding;
  encoding.mode = mode;
  encoding.effort = options.effort;
  encoding.order = order;
  MAILLE_CHECK(encode(mesh, *sink, encoding));
  return bytes;
}

Result<Mesh> decoded(Bytes bytes) {
  const auto source = memory_source(bytes);
  return decode(*source, {});
}

/// A box around the mesh's middle point, of a third of its extent.
Region middle_of(const Mesh& mesh) {
  std::array<std::vector<double>, 3> numbers;
  for (uint64_t i = 0; i < mesh.point_count(); ++i) {
    const Vector3 place = point_position(mesh.points, i);
    for (unsigned k = 0; k < 3; ++k) {
      if (std::isfinite(place[k])) numbers[k].push_back(place[k]);
    }
  }
  Region region;
  region.box.emplace();
  for (unsigned k = 0; k < 3 && !numbers[k].empty(); ++k) {
    std::sort(numbers[k].begin(), numbers[k].end());
    const double extent = numbers[k].back() - numbers[k].front();
    const double middle = numbers[k][numbers[k].size() / 2];
    region.box->low[k] = middle - extent / 6;
    region.box->high[k] = middle + extent / 6;
  }
  return region;
}

Result<Mesh> extracted(Bytes bytes, const Region& region) {
  const auto source = memory_source(bytes);
  File file = MAILLE_TRY(File::open(*source));
  return clip(MAILLE_TRY(file.extract(MAILLE_TRY(file.select(region, Detail::full())))), region);
}

/// The file with damaged directory and index.
Result<std::vector<std::byte>> without_index(std::vector<std::byte> bytes) {
  std::vector<uint64_t> places;
  {
    const auto source = memory_source(Bytes(bytes));
    const FileReader reader = MAILLE_TRY(FileReader::open(*source));
    for (const ChunkRecord& chunk : reader.records()) {
      const std::string_view type(chunk.header.type.data(), chunk.header.type.size());
      if (type == "CDIR" || type == "CIDX")
        places.push_back(chunk.offset + chunk_total_bytes(chunk.header) - chunk_checksum_bytes - 1);
    }
  }
  for (const uint64_t place : places) bytes[place] ^= std::byte{0x55};
  return bytes;
}

std::string check_windows(const Mesh& mesh, const ExactOptions& options) {
  const auto on_corners = [](const Array& array) { return array.domain == Domain::corner; };
  if (mesh.blocks.size() != 1 || std::any_of(mesh.arrays.begin(), mesh.arrays.end(), on_corners)) return "-";
  SourceBuilding building;
  building.space.memory = uint64_t{2} << 30;
  building.window_faces = std::max<uint64_t>(mesh.cell_count() / 5, 1000);
  EncodeOptions encoding;
  encoding.mode = Mode::random;
  encoding.effort = options.effort;
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto report = encode_random(*mesh_as_source(mesh), *sink, encoding, building);
  if (!report) return report.error().message;
  return difference(mesh, decoded(bytes));
}

Result<Checked> check_one(const Mesh& mesh, const ExactOptions& options) {
  Checked checked;
  const double begin = cpu_seconds();
  checked.single = MAILLE_TRY(encoded(mesh, Mode::single, options)).size();
  const std::vector<std::byte> bytes = MAILLE_TRY(encoded(mesh, Mode::random, options));
  checked.random = bytes.size();
  const auto source = memory_source(Bytes(bytes));
  const FileInfo info = MAILLE_TRY(inspect(*source));
  checked.charts = info.charts_of_level[0];
  checked.levels = info.charts_of_level.size();
  const Result<Mesh> whole = decoded(bytes);
  checked.whole = difference(mesh, whole);
  if (!whole) return checked;
  const Result<Mesh> again = decoded(MAILLE_TRY(without_index(bytes)));
  checked.lost = difference(*whole, again, true);
  checked.order =
      difference(mesh, decoded(MAILLE_TRY(encoded(mesh, Mode::random, options, Order::keep))), true);
  const Region region = middle_of(mesh);
  checked.part = difference(clip(mesh, region), extracted(bytes, region));
  checked.windows = options.windows ? check_windows(mesh, options) : "-";
  checked.seconds = cpu_seconds() - begin;
  return checked;
}

std::string kinds_of_arrays(const Mesh& mesh) {
  std::array<unsigned, 4> counts{};
  for (const Array& array : mesh.arrays) ++counts[static_cast<size_t>(array.domain)];
  std::string text;
  for (size_t k = 0; k < counts.size(); ++k) {
    if (counts[k] > 0) text += fmt::format("{}{}", counts[k], "pcfm"[k]);
  }
  return text.empty() ? "-" : text;
}

void print_row(const std::string& path, const Mesh& mesh, const Checked& checked) {
  const auto bytes = [&](uint64_t size) {
    return static_cast<double>(size) / static_cast<double>(std::max<uint64_t>(mesh.cell_count(), 1));
  };
  const auto said = [](const std::string& text) {
    return text.empty() ? "yes" : text == "-" ? "-" : "**no**";
  };
  fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {} | {} | {} | {} | {} | {} | {} | {:.1f} |\n",
             path.substr(path.rfind('/') + 1), mesh.cell_count(), kinds_of_arrays(mesh),
             bytes(checked.single), bytes(checked.random), checked.charts, checked.levels,
             said(checked.whole), said(checked.order), said(checked.part), said(checked.lost),
             said(checked.windows), checked.seconds);
  std::fflush(stdout);
  for (const auto& [what, text] :
       {std::pair("whole", &checked.whole), std::pair("order kept", &checked.order),
        std::pair("part", &checked.part), std::pair("index lost", &checked.lost),
        std::pair("in windows", &checked.windows)}) {
    if (!text->empty() && *text != "-") fmt::print(stderr, "{}: {}: {}\n", path, what, *text);
  }
}

/// Around a point of the mesh, with sides of 1/500 to a half of its extent, each with a size of its own.
Region random_box(const Mesh& mesh, const std::array<double, 3>& extent, std::mt19937_64& random) {
  std::uniform_int_distribution<uint64_t> any_point(0, mesh.point_count() - 1);
  std::uniform_real_distribution<double> exponent(std::log(1.0 / 500), std::log(0.5));
  const Vector3 middle = point_position(mesh.points, any_point(random));
  Region region;
  region.box.emplace();
  for (unsigned k = 0; k < 3; ++k) {
    const double half = std::exp(exponent(random)) * extent[k] / 2;
    region.box->low[k] = middle[k] - half;
    region.box->high[k] = middle[k] + half;
  }
  return region;
}

std::array<double, 3> extent_of(const Mesh& mesh) {
  std::array<double, 3> low{}, high{}, extent{};
  for (uint64_t i = 0; i < mesh.point_count(); ++i) {
    const Vector3 place = point_position(mesh.points, i);
    for (unsigned k = 0; k < 3; ++k) {
      if (!std::isfinite(place[k])) continue;
      low[k] = i == 0 ? place[k] : std::min(low[k], place[k]);
      high[k] = i == 0 ? place[k] : std::max(high[k], place[k]);
      extent[k] = high[k] - low[k];
    }
  }
  return extent;
}

/// What was found of the boxes of one mesh.
struct CheckedBoxes {
  unsigned equal = 0, empty = 0, differ = 0;
  uint64_t faces = 0;
};

Result<CheckedBoxes> check_boxes_of(const std::string& path, const Mesh& mesh, unsigned boxes) {
  const std::vector<std::byte> bytes = MAILLE_TRY(encoded(mesh, Mode::random, {}));
  const std::array<double, 3> extent = extent_of(mesh);
  std::mt19937_64 random(1);
  CheckedBoxes checked;
  for (unsigned i = 0; i < boxes; ++i) {
    const Region region = random_box(mesh, extent, random);
    const Mesh part = clip(mesh, region);
    const std::string found = difference(part, extracted(bytes, region));
    checked.faces += part.cell_count();
    checked.empty += part.cell_count() == 0 ? 1 : 0;
    ++(found.empty() ? checked.equal : checked.differ);
    if (!found.empty()) fmt::print(stderr, "{}: box {}: {}\n", path, i, found);
  }
  return checked;
}

}  // namespace

Result<uint64_t> check_boxes(const std::vector<std::string>& paths, unsigned boxes) {
  fmt::print(
      "| file | faces | arrays | boxes equal | of them without faces | faces in them | boxes that differ |\n"
      "|---|--:|---|--:|--:|--:|--:|\n");
  uint64_t wrong = 0;
  for (const std::string& path : paths) {
    const Mesh mesh = MAILLE_TRY(read_mesh(path)).mesh;
    const CheckedBoxes checked = MAILLE_TRY(check_boxes_of(path, mesh, mesh.point_count() > 0 ? boxes : 0));
    fmt::print("| {} | {} | {} | {} | {} | {} | {} |\n", path.substr(path.rfind('/') + 1), mesh.cell_count(),
               kinds_of_arrays(mesh), checked.equal, checked.empty, checked.faces, checked.differ);
    std::fflush(stdout);
    wrong += checked.differ;
  }
  return wrong;
}

Result<uint64_t> check_exact(const std::vector<std::string>& paths, const ExactOptions& options) {
  fmt::print(
      "| file | faces | arrays | single, bytes a face | random | charts | levels | whole | order kept | part "
      "| "
      "index lost | in windows | CPU seconds |\n|---|--:|---|--:|--:|--:|--:|---|---|---|---|---|--:|\n");
  uint64_t wrong = 0;
  for (const std::string& path : paths) {
    const auto read = read_mesh(path);
    if (!read) {
      fmt::print(stderr, "{}\n", read.error().message);
      continue;
    }
    const auto checked = check_one(read->mesh, options);
    if (!checked) {
      ++wrong;
      fmt::print(stderr, "{}: {}\n", path, checked.error().message);
      continue;
    }
    print_row(path, read->mesh, *checked);
    wrong += checked->exact() ? 0 : 1;
  }
  return wrong;
}

}  // namespace maille
