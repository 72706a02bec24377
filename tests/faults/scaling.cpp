// Odd meshes of n and 4n elements: bytes of files, memory and work to encode and decode them must grow about
// as they do, and decoders keep to what they are allowed. scaling [ELEMENTS, default 25600] [--time] [--only
// NAME] [--keep FOLDER]: work is counted by allocations and their bytes; with --time also by the time of the
// processor, the least of three runs, which needs a quiet machine. --keep writes the files of 4n elements,
// for profilers.

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "faults/counting_memory.h"
#include "support/codec.h"
#include "support/files.h"
#include "support/random.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

/// Of issue 22. What is constant at first, such as tables, is below that.
constexpr double most_exponent = 1.3;

/// What a decoder may take beyond its limit (docs/reliability.md). It is also what scratch memory may waste:
/// from 256 KiB on it is in large pages of 2 MiB, so that memory below this says nothing of how it grows.
constexpr double slack = 8 << 20;
/// A file below this share of its mesh is small whatever the exponent is: more efforts than one leave mixing,
/// which finds what comes again, to small meshes.
constexpr double small_share = 0.25;

using Generator = std::function<Mesh(uint32_t)>;
struct Pathology {
  const char* name;
  Generator make;
};

std::array<double, 3> place(Random& random) {
  const double x = random.unit(), y = random.unit();
  return {x, y, random.unit()};
}

/// n cells of one type with random corners among `points` points.
Mesh soup(CellType type, unsigned corners, uint32_t n, uint32_t points) {
  Random random(n);
  Surface surface;
  for (uint32_t i = 0; i < std::max(points, corners); ++i) surface.points.push_back(place(random));
  Mesh mesh = to_mesh(surface);
  CellBlock block;
  block.type = type;
  for (uint32_t i = 0; i < n * corners; ++i)
    block.connectivity.push_back(random.below(static_cast<uint32_t>(surface.points.size())));
  mesh.blocks = {block};
  return mesh;
}
uint32_t root(uint32_t n) {
  return static_cast<uint32_t>(std::sqrt(n));
}

/// The points of a surface in any order.
Mesh shuffled(Surface surface) {
  Random random(1);
  std::vector<uint32_t> place_of(surface.points.size());
  std::iota(place_of.begin(), place_of.end(), 0u);
  shuffle(place_of, random);
  const auto points = surface.points;
  for (size_t i = 0; i < points.size(); ++i) surface.points[place_of[i]] = points[i];
  for (auto& face : surface.faces) {
    for (uint32_t& corner : face) corner = place_of[corner];
  }
  return to_mesh(surface);
}

Surface strip(uint32_t n) {
  Surface surface;
  for (uint32_t i = 0; i < n + 2; ++i)
    surface.points.push_back({static_cast<double>(i / 2), static_cast<double>(i % 2), 0});
  for (uint32_t i = 0; i < n; ++i) surface.faces.push_back({i, i + 1, i + 2});
  return surface;
}

/// n times `part`, moved, or at one place.
Surface copies(const Surface& part, uint32_t n, double step) {
  Surface surface;
  for (uint32_t i = 0; i < n; ++i) append(surface, part, {step * i, 0, 0});
  return surface;
}

Surface one_face(uint32_t corners) {
  Surface surface = shapes::fan(corners, true);
  surface.points.erase(surface.points.begin());
  surface.faces.assign(1, std::vector<uint32_t>(corners));
  std::iota(surface.faces[0].begin(), surface.faces[0].end(), 0u);
  return surface;
}

/// Each face `times` times.
Surface repeated(Surface surface, uint32_t times) {
  const auto faces = surface.faces;
  for (uint32_t i = 1; i < times; ++i) surface.faces.insert(surface.faces.end(), faces.begin(), faces.end());
  return surface;
}

/// Points of a mesh at one place, in a row, or anywhere.
template <class Place>
Surface placed(Surface surface, Place place_of) {
  for (size_t i = 0; i < surface.points.size(); ++i) surface.points[i] = place_of(i);
  return surface;
}
Surface flipped_at_random(Surface surface) {
  Random random(2);
  for (auto& face : surface.faces) {
    if (random.chance(50)) std::reverse(face.begin(), face.end());
  }
  return surface;
}
Surface shuffled_faces(Surface surface) {
  Random random(3);
  shuffle(surface.faces, random);
  return surface;
}
/// All faces share point 0 in place of one of theirs.
Surface pinched(Surface surface) {
  for (auto& face : surface.faces) face[0] = 0;
  return surface;
}

/// One block a face.
Mesh in_blocks(Mesh mesh) {
  std::vector<CellBlock> blocks;
  const CellBlock all = mesh.blocks.at(0);
  for (size_t i = 0; i + 3 <= all.connectivity.size(); i += 3) {
    CellBlock block;
    block.type = CellType::triangle;
    block.name = std::to_string(i);
    block.connectivity.assign(all.connectivity.begin() + static_cast<ptrdiff_t>(i),
                              all.connectivity.begin() + static_cast<ptrdiff_t>(i) + 3);
    blocks.push_back(block);
  }
  mesh.blocks = blocks;
  return mesh;
}

Array ramp(const std::string& name, Domain domain, uint64_t count, uint32_t components) {
  Array array = make_array(name, domain, Scalar::f32, components);
  array.resize(count);
  for (size_t i = 0; i < count * components; ++i) array.values<float>()[i] = static_cast<float>(i % 97);
  return array;
}
/// Few points with many arrays, or many components.
Mesh with_arrays(uint32_t arrays, uint32_t components) {
  Mesh mesh = to_mesh(triangulated(shapes::tetrahedron()));
  for (uint32_t i = 0; i < arrays; ++i)
    mesh.arrays.push_back(ramp("a" + std::to_string(i), Domain::point, mesh.point_count(), components));
  return mesh;
}

/// Empty texts, which take a byte or less in a file: labels of an array, or metadata.
Mesh with_texts(uint32_t labels, uint32_t metadata) {
  Mesh mesh = with_arrays(1, 1);
  mesh.arrays[0].labels.resize(labels);
  mesh.metadata.resize(metadata);
  return mesh;
}

/// Arrays whose numbers have any size, and lower bits that are the same for all of one size.
Mesh with_bits_again(uint32_t arrays) {
  Mesh mesh = to_mesh(strip(400));
  Random random(4);
  for (uint32_t i = 0; i < arrays; ++i) {
    Array array = make_array("a" + std::to_string(i), Domain::point, Scalar::i32, 3);
    array.resize(mesh.point_count());
    for (int32_t& value : array.values<int32_t>())
      value = static_cast<int32_t>((uint32_t{1} << random.below(31)) | 0x155);
    mesh.arrays.push_back(std::move(array));
  }
  return mesh;
}

Surface grid_of(uint32_t n) {
  return shapes::grid(root(n), root(n));
}
Surface triangles_of(uint32_t n) {
  return triangulated(shapes::grid(root(n / 2), root(n / 2)));
}

std::vector<Pathology> pathologies() {
  const auto at_one_place = [](size_t) { return std::array<double, 3>{1, 2, 3}; };
  const auto in_a_row = [](size_t i) { return std::array<double, 3>{static_cast<double>(i), 0, 0}; };
  const auto anywhere = [](size_t i) {
    Random random(i);
    return place(random);
  };
  return {
      {"grid", [](uint32_t n) { return to_mesh(grid_of(n)); }},
      {"triangles", [](uint32_t n) { return to_mesh(triangles_of(n)); }},
      {"triangles over few points", [](uint32_t n) { return soup(CellType::triangle, 3, n, root(n)); }},
      {"triangles over 300 points", [](uint32_t n) { return soup(CellType::triangle, 3, n, 300); }},
      {"triangles over n points", [](uint32_t n) { return soup(CellType::triangle, 3, n, n); }},
      {"triangles over 3n points", [](uint32_t n) { return soup(CellType::triangle, 3, n, 3 * n); }},
      {"quads over few points", [](uint32_t n) { return soup(CellType::quad, 4, n, root(n)); }},
      {"quads over n points", [](uint32_t n) { return soup(CellType::quad, 4, n, n); }},
      {"tetrahedra over few points", [](uint32_t n) { return soup(CellType::tetrahedron, 4, n, root(n)); }},
      {"tetrahedra over n points", [](uint32_t n) { return soup(CellType::tetrahedron, 4, n, n); }},
      {"hexahedra over few points", [](uint32_t n) { return soup(CellType::hexahedron, 8, n, root(n)); }},
      {"hexahedra over n points", [](uint32_t n) { return soup(CellType::hexahedron, 8, n, n); }},
      {"wedges over few points", [](uint32_t n) { return soup(CellType::wedge, 6, n, root(n)); }},
      {"lines over few points", [](uint32_t n) { return soup(CellType::line, 2, n, root(n)); }},
      {"lines over n points", [](uint32_t n) { return soup(CellType::line, 2, n, n); }},
      {"vertices over few points", [](uint32_t n) { return soup(CellType::vertex, 1, n, root(n)); }},
      {"quadratic triangles", [](uint32_t n) { return soup(CellType::quadratic_triangle, 6, n, root(n)); }},
      {"quadratic tetrahedra",
       [](uint32_t n) { return soup(CellType::quadratic_tetrahedron, 10, n, root(n)); }},
      {"fan", [](uint32_t n) { return to_mesh(shapes::fan(n, true)); }},
      {"open fan", [](uint32_t n) { return to_mesh(shapes::fan(n, false)); }},
      {"shuffled fan", [](uint32_t n) { return shuffled(shapes::fan(n, true)); }},
      {"fan in any order", [](uint32_t n) { return to_mesh(shuffled_faces(shapes::fan(n, true))); }},
      {"sphere of slices", [](uint32_t n) { return to_mesh(shapes::sphere(n / 2, 2)); }},
      {"book", [](uint32_t n) { return to_mesh(triangulated(shapes::book(n))); }},
      {"strip", [](uint32_t n) { return to_mesh(strip(n)); }},
      {"strip over shuffled points", [](uint32_t n) { return shuffled(strip(n)); }},
      {"strip in any order", [](uint32_t n) { return shuffled(shuffled_faces(strip(n))); }},
      {"shuffled triangles", [](uint32_t n) { return shuffled(shuffled_faces(triangles_of(n))); }},
      {"one face n times", [](uint32_t n) { return to_mesh(repeated(one_face(3), n)); }},
      {"each face twice", [](uint32_t n) { return to_mesh(repeated(triangles_of(n / 2), 2)); }},
      {"one face of n corners", [](uint32_t n) { return to_mesh(one_face(n)); }},
      {"faces of root n corners", [](uint32_t n) { return to_mesh(copies(one_face(root(n)), root(n), 2)); }},
      {"faces apart", [](uint32_t n) { return to_mesh(copies(one_face(3), n, 2)); }},
      {"faces apart at one place", [](uint32_t n) { return to_mesh(copies(one_face(3), n, 0)); }},
      {"cubes apart", [](uint32_t n) { return to_mesh(copies(shapes::cube(), n / 6, 2)); }},
      {"cubes at one place", [](uint32_t n) { return to_mesh(copies(shapes::cube(), n / 6, 0)); }},
      {"flipped at random", [](uint32_t n) { return to_mesh(flipped_at_random(triangles_of(n))); }},
      {"pinched", [](uint32_t n) { return to_mesh(pinched(triangles_of(n))); }},
      {"at one place", [=](uint32_t n) { return to_mesh(placed(triangles_of(n), at_one_place)); }},
      {"in a row", [=](uint32_t n) { return to_mesh(placed(triangles_of(n), in_a_row)); }},
      {"anywhere", [=](uint32_t n) { return to_mesh(placed(triangles_of(n), anywhere)); }},
      {"one block a face", [](uint32_t n) { return in_blocks(to_mesh(strip(n / 4))); }},
      {"arrays", [](uint32_t n) { return with_arrays(n / 10, 1); }},
      {"components", [](uint32_t n) { return with_arrays(1, n / 50); }},
      {"empty labels", [](uint32_t n) { return with_texts(40 * n, 0); }},
      {"empty metadata", [](uint32_t n) { return with_texts(0, 20 * n); }},
      {"arrays whose bits come again", [](uint32_t n) { return with_bits_again(n / 100); }},
      {"points without cells", [](uint32_t n) { return soup(CellType::triangle, 3, 1, n); }},
      {"cylinder of two rings", [](uint32_t n) { return to_mesh(shapes::cylinder(n / 2, 2)); }},
      {"Klein bottle",
       [](uint32_t n) { return to_mesh(triangulated(shapes::klein_bottle(root(n), root(n)))); }},
  };
}

double processor_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// What one run takes.
struct Cost {
  double bytes = 0, most = 0, allocations = 0, seconds = 0;
};
template <class Work>
Cost measure(bool timed, Work work) {
  Cost cost;
  cost.seconds = 1e9;
  for (int run = 0; run < (timed ? 3 : 1); ++run) {
    const uint64_t before = memory().live;
    watch_memory();
    const double start = processor_seconds();
    cost.bytes = work();
    cost.seconds = std::min(cost.seconds, processor_seconds() - start);
    cost.most = static_cast<double>(memory().most - before);
    cost.allocations = static_cast<double>(memory().allocations);
  }
  return cost;
}

double bytes_of(const Mesh& mesh) {
  size_t bytes = mesh.points.bytes.size() + mesh.corner_count() * sizeof(uint32_t);
  for (const Array& array : mesh.arrays) bytes += array.bytes.size();
  return static_cast<double>(bytes);
}

/// Of a figure that is `small` at first and `large` with four times as much. `floor`: what may be constant.
double exponent(double small, double large, double floor) {
  return std::log(std::max(large, floor) / std::max(small, floor)) / std::log(4.0);
}

struct Options {
  /// Fewer than 6,400: charts and full points begin between n and 4n, in one step. Below 25,600 what large
  /// pages waste hides how memory grows.
  uint32_t elements = 25600;
  bool timed = false;
  std::string only;  ///< pathologies whose name has this
  std::string keep;  ///< folder for files, if any
};

class Scaling {
 public:
  explicit Scaling(const Options& options) : options_(options) {}

  void check(const Pathology& pathology, Mode mode, int effort, std::optional<uint64_t> pieces,
             const std::string& what) {
    std::array<Cost, 2> encoding, decoding;
    std::array<double, 2> mesh_bytes{};
    Result<Encoded> file;
    for (const unsigned i : {0u, 1u}) {
      const Mesh mesh = pathology.make(options_.elements * (i == 0 ? 1 : 4));
      mesh_bytes[i] = bytes_of(mesh);
      EncodeOptions options;
      options.mode = mode;
      options.effort = effort;
      options.most_cells_per_part = pieces;
      file = encode_bytes(mesh, options);
      if (!file) {
        if (file.error().code != ErrorCode::unsupported) complain(what, file.error().message);
        return;
      }
      encoding[i] = measure(options_.timed, [&] {
        file = encode_bytes(mesh, options);
        return static_cast<double>(file->bytes.size());
      });
      decoding[i] = measure(options_.timed, [&] { return decode_bytes(file->bytes) ? 0.0 : 1.0; });
      if (decoding[i].bytes != 0) complain(what, "cannot be decoded");
    }
    if (!options_.keep.empty()) keep(file->bytes, what);
    check_limits(file->bytes, mode, what);
    ++checked_;
    compare(what + ", file", std::max(encoding[0].bytes, small_share * mesh_bytes[0]),
            std::max(encoding[1].bytes, small_share * mesh_bytes[1]), 1000);
    compare_work(what + ", encode", encoding);
    compare_work(what + ", decode", decoding);
  }
  int end() const {
    std::printf(
        "%u pathologies and modes; highest exponent %.2f; most memory beyond a limit: %.1f MiB in mode "
        "stream, %.1f MiB in others; problems: %u\n",
        checked_, highest_, stream_over_ / 1048576, others_over_ / 1048576, problems_);
    return problems_ == 0 ? 0 : 1;
  }

 private:
  void keep(const std::vector<std::byte>& file, const std::string& what) const {
    write_bytes(options_.keep + "/" + what + ".maille", file);
  }
  void complain(const std::string& what, const std::string& message) {
    ++problems_;
    std::printf("%s: %s\n", what.c_str(), message.c_str());
  }
  /// What decoding takes where so much is allowed, whether it is enough or not.
  void check_limits(const std::vector<std::byte>& file, Mode mode, const std::string& what) {
    for (uint64_t limit = uint64_t{1} << 18; limit <= uint64_t{1} << 26; limit *= 2) {
      DecodeOptions options;
      options.limits.mesh_bytes = limit;
      const uint64_t before = memory().live;
      watch_memory();
      const auto mesh = decode_bytes(file, options);
      const double most = static_cast<double>(memory().most - before), allowed = static_cast<double>(limit);
      if (!mesh && mesh.error().code != ErrorCode::memory_bound) complain(what, mesh.error().message);
      double& over = mode == Mode::stream ? stream_over_ : others_over_;
      over = std::max(over, most - allowed);
      if (most > allowed + slack) {
        complain(what + ", " + std::to_string(limit >> 10) + " KiB allowed",
                 std::to_string(most / 1024) + " KiB taken");
      }
      if (mesh) return;
    }
  }
  void compare(const std::string& what, double small, double large, double floor) {
    const double found = exponent(small, large, floor);
    highest_ = std::max(highest_, found);
    if (found <= most_exponent) return;
    complain(what, "exponent " + std::to_string(found) + ", " + std::to_string(small) + " and " +
                       std::to_string(large));
  }
  void compare_work(const std::string& what, const std::array<Cost, 2>& cost) {
    compare(what + ", memory", cost[0].most, cost[1].most, slack);
    compare(what + ", allocations", cost[0].allocations, cost[1].allocations, 2000);
    if (options_.timed) compare(what + ", time", cost[0].seconds, cost[1].seconds, 0.01);
  }

  Options options_;
  unsigned checked_ = 0, problems_ = 0;
  double highest_ = 0, stream_over_ = 0, others_over_ = 0;
};

}  // namespace
}  // namespace maille::testing

int main(int count, char** arguments) {
  using namespace maille::testing;
  Options options;
  for (int i = 1; i < count; ++i) {
    if (std::strcmp(arguments[i], "--time") == 0) {
      options.timed = true;
    } else if (std::strcmp(arguments[i], "--only") == 0 && i + 1 < count) {
      options.only = arguments[++i];
    } else if (std::strcmp(arguments[i], "--keep") == 0 && i + 1 < count) {
      options.keep = arguments[++i];
    } else {
      options.elements = static_cast<uint32_t>(std::strtoul(arguments[i], nullptr, 10));
    }
  }
  static constexpr struct {
    maille::Mode mode;
    int effort;
    const char* name;
    std::optional<uint64_t> pieces = {};
  } modes[] = {{maille::Mode::single, 1, "single -1"},      {maille::Mode::single, 5, "single -5"},
               {maille::Mode::single, 9, "single -9"},      {maille::Mode::stream, 1, "stream -1"},
               {maille::Mode::stream, 5, "stream -5"},      {maille::Mode::random, 5, "random -5"},
               {maille::Mode::single, 5, "parts -5", 2000}, {maille::Mode::stream, 5, "pieces -5", 2000}};
  Scaling scaling(options);
  for (const Pathology& pathology : pathologies()) {
    if (std::string(pathology.name).find(options.only) == std::string::npos) continue;
    for (const auto& mode : modes)
      scaling.check(pathology, mode.mode, mode.effort, mode.pieces,
                    std::string(pathology.name) + ", " + mode.name);
  }
  return scaling.end();
}
