// polyMesh in parts gives what is read whole.
#include <maille/out_of_core.h>

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "io/same_mesh.h"
#include "support/sample_mesh.h"
#include "support/temporary_folder.h"
#include "volume/stream/mesh_from_parts.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::HasSubstr;

/// The mesh as the reader of whole meshes has it.
Mesh collected(MeshSource& source, uint64_t step) {
  const MeshDescription& description = source.description();
  MeshFromParts sink(description);
  std::vector<std::byte> positions(description.points * 3 * size_of(description.point_type));
  EXPECT_TRUE(source.read_points(0, description.points, positions));
  EXPECT_TRUE(sink.write_points(0, positions));
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    std::vector<std::byte> values(description.count_of(description.arrays[i]) *
                                  description.arrays[i].tuple_size());
    EXPECT_TRUE(source.read_array(i, 0, description.count_of(description.arrays[i]), values));
    EXPECT_TRUE(sink.write_array(i, 0, values));
  }
  CellPiece piece;
  for (uint64_t first = 0; first < description.cells; first += step) {
    const auto read = source.read_cells(first, std::min(step, description.cells - first), piece);
    EXPECT_TRUE(read);
    if (read) {
      EXPECT_TRUE(sink.write_cells(piece));
    }
  }
  EXPECT_TRUE(sink.commit());
  return std::move(sink.mesh);
}

void expect_same_in_parts(const std::string& path, uint64_t memory = 32 << 20) {
  const auto whole = read_mesh(path);
  ASSERT_TRUE(whole) << whole.error().message;
  const auto source = open_polymesh_source(path, {.memory = memory, .folder = {}, .progress = {}});
  ASSERT_TRUE(source) << source.error().message;
  expect_same_mesh(collected(**source, 7), whole->mesh);
  EXPECT_EQ((*source)->notes(), whole->notes);
}

TEST(PolyMeshSource, GivesInPartsWhatIsReadWhole) {
  expect_same_in_parts(sample_path("polymesh"));
  expect_same_in_parts(sample_path("polymesh/faces"), 256);
  expect_same_in_parts(sample_path("polymesh_zones"));
  expect_same_in_parts(sample_path("polymesh_zones"), 256);
  const auto packed = open_polymesh_source(sample_path("polymesh_binary"));
  ASSERT_FALSE(packed);
  EXPECT_EQ(packed.error().code, ErrorCode::unsupported);
}

struct Form {
  bool binary = false, wide_labels = false, single = false, compact = false, all_neighbours = false;
};

/// Faces of a grid of hexahedra some of which are joined to their neighbours, so that they are polyhedra.
class FoamCase {
 public:
  FoamCase(unsigned seed, unsigned size, bool in_order) : random_(seed), n_(size) {
    join_cells();
    add_faces(in_order);
  }
  const std::string& folder() const { return folder_.path(); }

  void write(const Form& form) {
    form_ = form;
    write_file("points", "vectorField", [&](std::ostream& out) { put_points(out); });
    write_file("faces", form.compact ? "faceCompactList" : "faceList",
               [&](std::ostream& out) { put_faces(out); });
    std::vector<int64_t> owner, neighbour;
    for (const Face& face : faces_) owner.push_back(face.owner);
    for (const Face& face : faces_) {
      if (face.neighbour >= 0 || form.all_neighbours) neighbour.push_back(face.neighbour);
    }
    write_file("owner", "labelList", [&](std::ostream& out) { put_list(out, owner); });
    write_file("neighbour", "labelList", [&](std::ostream& out) { put_list(out, neighbour); });
    write_boundary();
  }
  void replace(const std::string& name, const std::string& text, const std::string& kind = "labelList") {
    folder_.write(name, "FoamFile{format ascii;class " + kind + ";}\n" + text);
  }

 private:
  struct Face {
    std::array<int64_t, 4> points;
    int64_t owner, neighbour;
  };
  int64_t point(unsigned x, unsigned y, unsigned z) const { return (z * (n_ + 1) + y) * (n_ + 1) + x; }
  void join_cells() {
    cells_.resize(size_t{n_} * n_ * n_);
    int64_t next = 0;
    for (size_t i = 0; i < cells_.size(); ++i)
      cells_[i] = i > 0 && i % n_ != 0 && random_() % 8 == 0 ? cells_[i - 1] : next++;
  }
  void add_faces(bool in_order) {
    std::vector<Face> sides;
    for (unsigned axis = 0; axis < 3; ++axis) {
      for (unsigned i = 0; i < (n_ + 1) * n_ * n_; ++i) {
        const unsigned along = i % (n_ + 1), u = i / (n_ + 1) % n_, v = i / (n_ + 1) / n_;
        const auto at = [&](unsigned a, unsigned b, unsigned c) {
          std::array<unsigned, 3> x{};
          x[axis] = a, x[(axis + 1) % 3] = b, x[(axis + 2) % 3] = c;
          return x;
        };
        const auto corner = [&](unsigned b, unsigned c) {
          const auto x = at(along, u + b, v + c);
          return point(x[0], x[1], x[2]);
        };
        const auto cell = [&](unsigned a) {
          const auto x = at(a, u, v);
          return cells_[(x[2] * n_ + x[1]) * n_ + x[0]];
        };
        Face face = {{corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)}, 0, -1};
        const int64_t low = along > 0 ? cell(along - 1) : -1, high = along < n_ ? cell(along) : -1;
        if (low == high) continue;
        face.owner = low >= 0 ? low : high;
        face.neighbour = low >= 0 ? high : -1;
        if (low < 0) std::reverse(face.points.begin() + 1, face.points.end());
        (face.neighbour >= 0 ? faces_ : sides).push_back(face);
      }
    }
    if (in_order) {
      std::sort(faces_.begin(), faces_.end(), [](const Face& a, const Face& b) {
        return a.owner != b.owner ? a.owner < b.owner : a.neighbour < b.neighbour;
      });
    } else {
      std::shuffle(faces_.begin(), faces_.end(), random_);
    }
    inside_ = faces_.size();
    faces_.insert(faces_.end(), sides.begin(), sides.end());
  }

  template <class Put>
  void write_file(const std::string& name, const std::string& kind, Put put) {
    std::ofstream out(folder_.path(name), std::ios::binary);
    out << "FoamFile\n{\n  version 2.0;\n  format " << (form_.binary ? "binary" : "ascii") << ";\n  class "
        << kind << ";\n  arch \"LSB;label=" << (form_.wide_labels ? 64 : 32)
        << ";scalar=" << (form_.single ? 32 : 64) << "\";\n}\n// * * *\n/* made by\n a test */\n";
    put(out);
    out << "\n// ***\n";
  }
  template <class T>
  static void put_raw(std::ostream& out, T value) {
    out.write(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put_label(std::ostream& out, int64_t value) const {
    if (!form_.binary) {
      out << value << ' ';
    } else if (form_.wide_labels) {
      put_raw(out, value);
    } else {
      put_raw(out, static_cast<int32_t>(value));
    }
  }
  void put_list(std::ostream& out, const std::vector<int64_t>& values) const {
    out << values.size() << '(';
    for (const int64_t value : values) put_label(out, value);
    out << ')';
  }
  void put_points(std::ostream& out) {
    out << (n_ + 1) * (n_ + 1) * (n_ + 1) << "\n(";
    for (unsigned z = 0; z <= n_; ++z) {
      for (unsigned y = 0; y <= n_; ++y) {
        for (unsigned x = 0; x <= n_; ++x) {
          const std::array<double, 3> at = {x * 0.5, y / 3.0, z * 1e-3};
          if (!form_.binary) out << '(' << at[0] << ' ' << at[1] << ' ' << at[2] << ")\n";
          for (const double value : at) {
            if (form_.binary && form_.single) put_raw(out, static_cast<float>(value));
            if (form_.binary && !form_.single) put_raw(out, value);
          }
        }
      }
    }
    out << ')';
  }
  void put_faces(std::ostream& out) const {
    if (form_.compact) {
      std::vector<int64_t> places = {0}, points;
      for (const Face& face : faces_) {
        points.insert(points.end(), face.points.begin(), face.points.end());
        places.push_back(static_cast<int64_t>(points.size()));
      }
      put_list(out, places);
      out << '\n';
      put_list(out, points);
      return;
    }
    out << faces_.size() << "\n(\n";
    for (const Face& face : faces_) put_list(out, {face.points.begin(), face.points.end()});
    out << ')';
  }
  void write_boundary() {
    const size_t all = faces_.size() - inside_, first = all / 3;
    std::ofstream(folder_.path("boundary"))
        << "FoamFile { format ascii; class polyBoundaryMesh; }\n2\n(\ninlet { type patch; nFaces " << first
        << "; startFace " << inside_ << "; }\nwalls { type wall; inGroups 1(wall); nFaces " << all - first
        << "; startFace " << inside_ + first << "; }\n)\n";
  }

  testing::TemporaryFolder folder_;
  std::mt19937 random_;
  unsigned n_;
  std::vector<int64_t> cells_;
  std::vector<Face> faces_;
  size_t inside_ = 0;
  Form form_;
};

TEST(PolyMeshSource, ReadsAllForms) {
  const std::vector<Form> forms = {{},
                                   {.all_neighbours = true},
                                   {.compact = true},
                                   {.binary = true, .compact = true},
                                   {.binary = true, .wide_labels = true, .single = true, .compact = true},
                                   {.binary = true, .wide_labels = true}};
  unsigned seed = 0;
  for (const Form& form : forms) {
    for (const unsigned size : {1u, 4u, 11u}) {
      ++seed;
      FoamCase files(seed, size, seed % 2 == 0);
      files.write(form);
      expect_same_in_parts(files.folder(), size == 11 ? 40'000 : 1'000'000);
    }
  }
}

TEST(PolyMeshSource, IsCompressedAsTheMeshInMemory) {
  FoamCase files(100, 9, true);
  files.write({.binary = true, .compact = true});
  const auto source = open_polymesh_source(files.folder(), {.memory = 50'000, .folder = {}, .progress = {}});
  ASSERT_TRUE(source) << source.error().message;
  EncodeOptions options;
  options.mode = Mode::stream;
  options.order = Order::keep;
  std::vector<std::byte> parts, whole;
  ASSERT_TRUE(encode(**source, *memory_sink(parts), options));
  ASSERT_TRUE(encode(read_mesh(files.folder())->mesh, *memory_sink(whole), options));
  EXPECT_EQ(parts, whole);
}

TEST(PolyMeshSource, ReordersPolyhedra) {
  FoamCase files(101, 9, false);
  files.write({.binary = true, .compact = true});
  const auto source = open_polymesh_source(files.folder());
  ASSERT_TRUE(source) << source.error().message;
  const auto bits = incoherence(**source);  // of the hexahedra among them
  ASSERT_TRUE(bits);
  EXPECT_GT(*bits, 0);
  WorkingSpace space;
  space.memory = 100'000;
  const auto ordered = reordered(**source, space);
  ASSERT_TRUE(ordered) << ordered.error().message;
  const Mesh mesh = collected(**source, 100), other = collected(**ordered, 33);
  EXPECT_TRUE(validate(other));
  const auto cells_of = [](const Mesh& all) {
    std::vector<std::vector<uint32_t>> cells;
    for (const CellBlock& block : all.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) {
        std::vector<uint32_t> cell(block.cell(i).begin(), block.cell(i).end());
        if (block.type_of(i) == CellType::polyhedron)
          cell.insert(cell.end(), block.faces(i).begin(), block.faces(i).end());
        cells.push_back(cell);
      }
    }
    std::sort(cells.begin(), cells.end());
    return cells;
  };
  EXPECT_EQ(cells_of(mesh), cells_of(other));
}

TEST(PolyMeshSource, RefusesZonesOfWhatIsNotThere) {
  FoamCase foam(1, 2, true);
  foam.write({});
  ReadOptions options;
  options.format = "polymesh";
  for (const char* zones :
       {"1(a{type cellZone;cellLabels List<label> 1(999);})", "1(a{cellLabels 3{-1};})",
        "1(a{cellLabels List<label> 99999999999(0);})", "1(a{cellLabels List<label> 2(0 1", "1(a{cellLabels",
        "99999999999(", "1(a", "1(a{cellLabels List<label> 1(x);})"}) {
    foam.replace("cellZones", zones);
    EXPECT_FALSE(read_mesh(foam.folder(), options)) << zones;
    EXPECT_FALSE(open_polymesh_source(foam.folder())) << zones;
  }
}

TEST(PolyMeshSource, TellsWhatIsWrong) {
  const auto error = [](FoamCase& files) {
    const auto source = open_polymesh_source(files.folder());
    return source ? std::string() : source.error().message;
  };
  FoamCase files(102, 2, true);
  files.write({});
  files.replace("owner", "3(0 0 0)");
  EXPECT_THAT(error(files), HasSubstr("owners of 3"));
  files.replace("owner", "4000000000{0}");
  EXPECT_THAT(error(files), HasSubstr("owners of 4000000000"));
  files.write({});
  files.replace("faces", "2(4(0 1 2 900) 3(1 2 3))");
  EXPECT_THAT(error(files), ::testing::AnyOf(HasSubstr("point 900"), HasSubstr("owners of")));
  files.replace("faces", "1(900000000000{1})");
  EXPECT_FALSE(error(files).empty());
  // A list of equal values may claim any length: nothing goes through it.
  files.replace("faces", "9223372036854775807{0}\n9223372036854775807{0}", "faceCompactList");
  EXPECT_FALSE(error(files).empty());
  files.replace("owner", "9223372036854775806{0}");
  EXPECT_THAT(error(files), HasSubstr("without corners"));
  files.write({.binary = true});
  std::filesystem::resize_file(files.folder() + "/points", 400);
  EXPECT_THAT(error(files), HasSubstr("fewer points"));
}

TEST(VtuSink, WritesPolyhedraInParts) {
  FoamCase files(103, 6, true);
  files.write({.binary = true, .compact = true});
  const Mesh mesh = read_mesh(files.folder())->mesh;
  std::vector<std::byte> bytes;
  EncodeOptions options;
  options.mode = Mode::stream;
  options.order = Order::keep;
  ASSERT_TRUE(encode(mesh, *memory_sink(bytes), options));
  const auto packed = memory_source(Bytes(bytes));
  const std::string path = files.folder() + "/parts.vtu";
  const auto description = describe(*packed);
  ASSERT_TRUE(description) << description.error().message;
  const auto sink = vtu_sink(path, *description);
  ASSERT_TRUE(sink) << sink.error().message;
  const auto done = decode(*packed, **sink);
  ASSERT_TRUE(done) << done.error().message;
  const auto back = read_mesh(path);
  ASSERT_TRUE(back) << back.error().message;
  expect_same_mesh(back->mesh, mesh);
}

}  // namespace
}  // namespace maille
