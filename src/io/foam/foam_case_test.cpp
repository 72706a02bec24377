// Cases of OpenFOAM: fields of times into a mesh, through a file, and back into a case.
#include <gmock/gmock.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/folder.h>
#include <maille/series.h>
#include <maille/stream.h>

#include <filesystem>

#include "io/foam/foam_case.h"
#include "io/foam/foam_field.h"
#include "support/sample_mesh.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string header(const std::string& type, const std::string& name, const std::string& time,
                   const std::string& format = "ascii") {
  return "FoamFile\n{\n    version     2.0;\n    format      " + format + ";\n    class       " + type +
         ";\n" + (format == "binary" ? "    arch        \"LSB;label=32;scalar=64\";\n" : "") +
         "    location    \"" + time + "\";\n    object      " + name + ";\n}\n// * * //\n\n";
}

constexpr char banner[] = "/*---*\\\n  A solver\n\\*---*/\n";

std::string raw(const std::vector<double>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double)};
}

/// A case around the sample mesh, which has 3 cells, 2 faces inside, and the patches inlet (1 face), walls
/// (11), outlet (1) and defaultFaces (none).
class FoamCaseFields : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_.path("case/constant"));
    std::filesystem::copy(sample_path("polymesh"), folder_.path("case/constant/polyMesh"));
  }
  void put(const std::string& path, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(folder_.path("case/" + path)).parent_path());
    folder_.write("case/" + path, text);
  }
  std::string pressure(const std::string& time) const {
    return banner + header("volScalarField", "p", time) +
           "dimensions      [0 2 -2 0 0 0 0];\n\ninternalField   nonuniform List<scalar> 3(0.5 -1.25e-07 "
           "1e+06);\n\n"
           "boundaryField\n{\n    inlet\n    {\n        type            fixedValue;\n        value           "
           "uniform 2.50;\n    }\n    walls\n    {\n        type            mixed;\n        refValue        "
           "nonuniform List<scalar> \n11\n(\n1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n11\n)\n;\n        value          "
           " "
           "nonuniform List<scalar> \n11\n(\n0.1\n0.2\n0.3\n0.4\n0.5\n0.6\n0.7\n0.8\n0.9\n1\n1.1\n)\n;\n    "
           "}\n"
           "    outlet\n    {\n        type            zeroGradient; // open\n    }\n    defaultFaces\n    "
           "{\n"
           "        type            empty;\n        value           nonuniform 0();\n    }\n}\n";
  }
  std::string velocity(const std::string& time) const {
    return banner + header("volVectorField", "U", time, "binary") +
           "dimensions      [0 1 -1 0 0 0 0];\ninternalField   nonuniform List<vector> \n3\n(" +
           raw({1, 2, 3, 0.1, -0.0, 1e-300, 7, 8, 9}) +
           ");\nboundaryField\n{\n    walls\n    {\n        type "
           "noSlip;\n    }\n    inlet\n    {\n        type calculated;\n        value           nonuniform "
           "List<vector> \n1\n(" +
           raw({4, 5, 6}) + ");\n        weights nonuniform List<label> \n2\n(" +
           std::string("\1\0\0\0;\0\0\0", 8) + ");\n    }\n}\n";
  }
  std::string flux(const std::string& time) const {
    return header("surfaceScalarField", "phi", time) +
           "dimensions      [0 3 -1 0 0 0 0];\noriented        oriented;\ninternalField   nonuniform "
           "List<scalar> 2(0.25 -3);\nboundaryField\n{\n    inlet\n    {\n        type            "
           "calculated;\n"
           "        value           uniform -1;\n    }\n    walls\n    {\n        type            "
           "calculated;\n"
           "        value           uniform 0;\n    }\n    outlet\n    {\n        type            "
           "calculated;\n"
           "        value           nonuniform List<scalar> 1(1.5);\n    }\n}\n";
  }
  /// What stands in a file of the case, or of the one that was written.
  std::string text(const std::string& path) const { return folder_.read("case/" + path); }
  std::string again(const std::string& path) const { return folder_.read("again/" + path); }

  Result<std::vector<std::string>> write(const std::vector<Mesh>& times, bool ascii = false) const {
    const auto sink = polymesh_sink(folder_.path("again"));
    if (!sink) return tl::unexpected(sink.error());
    auto writer = CaseWriter::begin(times[0], **sink, ascii);
    if (!writer) return tl::unexpected(writer.error());
    for (size_t i = 1; i < times.size(); ++i) {
      if (const auto added = writer->add(times[i]); !added) return tl::unexpected(added.error());
    }
    if (const auto done = (*sink)->commit(); !done) return tl::unexpected(done.error());
    return writer->notes();
  }
  std::string complaint(const std::string& path) const {
    const auto read = read_mesh(folder_.path(path));
    return read ? "" : read.error().message;
  }

  TemporaryFolder folder_;
};

TEST_F(FoamCaseFields, AreArraysOfCellsAndOfPatches) {
  put("0.5/p", pressure("0.5"));
  const auto read = read_mesh(folder_.path("case"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->notes.empty());
  const Array* const p = read->mesh.find("p", Domain::cell);
  ASSERT_NE(p, nullptr);
  const auto values = p->values<double>();
  ASSERT_EQ(values.size(), 16u);
  EXPECT_THAT(values.first(4), ElementsAre(0.5, -1.25e-7, 1e6, 2.5));
  EXPECT_EQ(values[4], 0.1);
  EXPECT_EQ(values[14], 1.1);
  EXPECT_THAT(values.first(3), Contains(values[15]));  // the outlet says nothing: that of its cell
  const Array* const other = read->mesh.find("p:refValue", Domain::cell);
  ASSERT_NE(other, nullptr);
  EXPECT_EQ(other->values<double>()[14], 11);
  EXPECT_EQ(other->values<double>()[0], 0);
}

TEST_F(FoamCaseFields, ComeBackByteForByte) {
  put("0/p", pressure("0"));
  put("0/U", velocity("0"));
  put("0/phi", flux("0"));
  put("0/uniform/time", "value 0;\nname \"0\";\n");
  put("system/controlDict", "application icoFoam;\n");
  const auto read = read_mesh(folder_.path("case"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->mesh.find("phi", Domain::cell)->components, 1u);
  const auto notes = write({read->mesh});
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, ElementsAre());
  for (const char* file : {"0/p", "0/U", "0/phi", "0/uniform/time", "system/controlDict"})
    EXPECT_EQ(again(file), text(file)) << file;
}

TEST_F(FoamCaseFields, OfAllTimesGoThroughAFile) {
  for (const char* time : {"0", "0.1", "1e-05", "0.30000000000000004"}) {
    put(std::string(time) + "/p", pressure(time));
    if (time[1] != 0) put(std::string(time) + "/phi", flux(time));  // begins later
  }
  put("0.1/U", velocity("0.1"));  // and is there once
  const auto series = read_series(folder_.path("case"));
  ASSERT_TRUE(series);
  ASSERT_EQ(series->size(), 4u);
  EXPECT_EQ((*series)[1].time, 1e-5);
  const std::string path = folder_.path("flow.maille");
  for (size_t i = 0; i < series->size(); ++i) {
    const auto read = read_series_entry((*series)[i]);
    ASSERT_TRUE(read) << read.error().message;
    const auto sink = i == 0 ? file_sink(path) : Result<std::unique_ptr<Sink>>(nullptr);
    EncodeOptions options;
    options.mode = Mode::stream;
    options.order = Order::keep;
    if (i == 0) {
      ASSERT_TRUE(encode(read->mesh, **sink, options));
    }
    ASSERT_TRUE(append_step(path, (*series)[i].time, read->mesh));
  }
  const auto source = file_source(path);
  std::vector<Mesh> times;
  for (uint64_t step = 0; step <= 4; ++step) {
    DecodeOptions options;
    options.step = step;
    auto mesh = decode(**source, options);
    ASSERT_TRUE(mesh) << mesh.error().message;
    times.push_back(*std::move(mesh));
  }
  ASSERT_TRUE(write(times));
  for (const char* time : {"0", "0.1", "1e-05", "0.30000000000000004"}) {
    for (const char* name : {"p", "phi", "U"}) {
      const std::string file = std::string(time) + "/" + name;
      EXPECT_EQ(again(file), text(file)) << file;
    }
  }
}

TEST_F(FoamCaseFields, AreTextWhereAsked) {
  put("0/U",
      "FoamFile { format binary; class volVectorField; location \"0\"; object U; }\ninternalField nonuniform "
      "List<vector> \n3\n(" +
          raw({1, 2, 3, 0.1, 1e-5, 123456789, 7, 8, 9}) + ");\n");
  const auto read = read_mesh(folder_.path("case/0"));
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_TRUE(write({read->mesh}, true));
  EXPECT_EQ(
      again("0/U"),
      "FoamFile { format ascii; class volVectorField; location \"0\"; object U; }\ninternalField nonuniform "
      "List<vector> 3((1 2 3) (0.1 1e-05 1.23456789e+08) (7 8 9));\n");
}

TEST_F(FoamCaseFields, UniformOnesFollowTheirValues) {
  put("0/p", header("volScalarField", "p", "0") +
                 "internalField uniform 1.0;\nboundaryField { inlet { type a; value uniform 2; } }\n");
  auto read = read_mesh(folder_.path("case"));
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_TRUE(write({read->mesh}));
  EXPECT_EQ(again("0/p"), text("0/p"));
  const auto values = read->mesh.arrays.back().values<double>();
  values[0] = values[1] = values[2] = 3.5;
  ASSERT_TRUE(write({read->mesh}));
  EXPECT_THAT(again("0/p"),
              HasSubstr("internalField uniform 3.5;\nboundaryField { inlet { type a; value uniform 2; }"));
  values[1] = 4;
  values[3] = 5;
  ASSERT_TRUE(write({read->mesh}));
  EXPECT_THAT(again("0/p"),
              HasSubstr("internalField nonuniform List<scalar> 3(3.5 4 3.5);\nboundaryField { inlet { "
                        "type a; value uniform 5; }"));
}

TEST_F(FoamCaseFields, MayNameTheirValueByVariables) {
  put("0/p", header("volScalarField", "p", "0") +
                 "level 12.5;\ninternalField uniform $level;\nboundaryField { \".*\" { type a; value "
                 "$internalField; } }\n");
  const auto read = read_mesh(folder_.path("case"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->mesh.find("p", Domain::cell)->values<double>()[2], 12.5);
  ASSERT_TRUE(write({read->mesh}));
  EXPECT_EQ(again("0/p"), text("0/p"));
}

TEST_F(FoamCaseFields, OfPointsAndThoseThatOpenFoamComputesComeBack) {
  std::string points;
  for (int i = 0; i < 14; ++i) points += std::to_string(i) + ".5\n";
  put("0/D", header("pointScalarField", "D", "0") + "internalField nonuniform List<scalar> \n14\n(\n" +
                 points +
                 ")\n;\nboundaryField { inlet { type fixedValue; value uniform 7; g nonuniform List<scalar> "
                 "1(3); } }\n");
  put("0/p", header("volScalarField", "p", "0") +
                 "internalField #codeStream { code #{ x; #}; };\nboundaryField { inlet { type a; value "
                 "uniform 2; } }\n");
  const auto read = read_mesh(folder_.path("case"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->mesh.find("D", Domain::point)->values<double>()[13], 13.5);
  EXPECT_EQ(read->mesh.find("p", Domain::cell), nullptr);
  EXPECT_THAT(read->notes,
              ElementsAre(HasSubstr("0/p: its internalField is no value or list; kept as text only")));
  const auto notes = write({read->mesh});
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, ElementsAre(HasSubstr("there is code that OpenFOAM runs")));
  EXPECT_EQ(again("0/D"), text("0/D"));
  EXPECT_EQ(again("0/p"), text("0/p"));
}

TEST_F(FoamCaseFields, TextsThatDoNotFitTheArraysAreLeftOut) {
  put("0/p", pressure("0"));
  put("0/phi", flux("0"));
  const Mesh whole = read_mesh(folder_.path("case"))->mesh;
  const auto changed = [&](const std::string& from, const std::string& to) {
    Mesh mesh = whole;
    for (auto& [key, value] : mesh.metadata) {
      const size_t at = key == "openfoam.field.p" ? value.find(from) : std::string::npos;
      if (at != std::string::npos) value.replace(at, from.size(), to);
    }
    return mesh;
  };
  for (const Mesh& mesh :
       {changed("internalField   nonuniform List<scalar>", "internalField   nonuniform List<tensor>"),
        changed("volScalarField", "volTensorField"), changed("volScalarField", "pointScalarField"),
        changed("volScalarField", "surfaceScalarField"), changed("refValue", "value"),
        changed("refValue", "other"), changed("    walls", "    x { walls"), changed("@6", "@base64:!"),
        changed("@6", "@99999999999"), changed("{", ""),
        changed("refValue", "value nonuniform List<scalar> @6; refValue"),
        changed("boundaryField", "elsewhere")})
    ASSERT_TRUE(write({mesh}));
  Mesh few = whole;
  few.arrays.clear();
  const auto notes = write({few});
  ASSERT_TRUE(notes);
  EXPECT_THAT(*notes, Contains(HasSubstr("0/p: left out; its arrays are not there")));
}

TEST_F(FoamCaseFields, ThatDoNotFitNameFileAndLine) {
  const std::string begin = header("volScalarField", "p", "0");
  put("0/p", begin + "internalField nonuniform List<scalar> 4(1 2 3 4);\n");
  EXPECT_THAT(complaint("case"), HasSubstr("0/p: line 11: a field of 4 values, but"));
  put("0/p",
      begin +
          "internalField uniform 1;\nboundaryField {\n inlet { value nonuniform List<scalar> 2(1 2); } }\n");
  EXPECT_THAT(complaint("case"), HasSubstr("0/p: line 13: a list of 2 values, but patch inlet of"));
  put("0/p", begin + "internalField nonuniform List<scalar> 3(1 x 3);\n");
  EXPECT_THAT(complaint("case"), HasSubstr("line 11: there should be a number"));
  put("0/p", begin + "internalField nonuniform List<scalar> 3(1 2);\n");
  EXPECT_THAT(complaint("case"), HasSubstr("line 11: there should be a number"));
  put("0/p", begin + "internalField nonuniform List<scalar> 3(1 2 3 4);\n");
  EXPECT_THAT(complaint("case"), HasSubstr("longer or shorter than it says"));
  put("0/p", begin + "internalField nonuniform List<scalar> 3(1 2 3;\n");
  EXPECT_THAT(complaint("case"), HasSubstr("a list is not closed by )"));
  put("0/p", begin + "internalField nonuniform List<vector> 3((1 2 3) (1 2 3) (1 2 3));\n");
  EXPECT_THAT(complaint("case"), HasSubstr("a list of vector in a volScalarField"));
  put("0/p", begin + "boundaryField {");
  EXPECT_THAT(complaint("case"), HasSubstr("the file ends within boundaryField"));
  put("0/p", header("volScalarField", "p", "0", "binary") +
                 "internalField nonuniform List<scalar> \n1000000000\n(12);\n");
  EXPECT_THAT(complaint("case"), HasSubstr("but the file ends before"));
}

TEST_F(FoamCaseFields, AMeshThatChangesIsRefused) {
  put("0/p", pressure("0"));
  put("1/p", pressure("1"));
  put("1/polyMesh/points", "moved");
  EXPECT_THAT(complaint("case/1"), HasSubstr("1/polyMesh: the mesh is another one at this time"));
}

TEST_F(FoamCaseFields, WhatIsLeftOutIsTold) {
  put("0/p", pressure("0"));
  put("0/cloud", header("Cloud<basicParcel>", "cloud", "0") + std::string("\0\1", 2));
  put("0/lagrangian/spray/positions", "");
  put("constant/table", std::string("\0\1", 2));
  const auto read = read_mesh(folder_.path("case"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_THAT(read->notes, Contains(HasSubstr("0/cloud: left out")));
  EXPECT_THAT(read->notes, Contains(HasSubstr("0/lagrangian: left out")));
  EXPECT_THAT(read->notes, Contains(HasSubstr("constant/table: left out")));
}

TEST_F(FoamCaseFields, FilesOfTheUserStay) {
  put("0/p", pressure("0"));
  put("system/controlDict", "application icoFoam;\n");
  const auto read = read_mesh(folder_.path("case"));
  std::filesystem::create_directories(folder_.path("again/system"));
  folder_.write("again/system/controlDict", "mine");
  const auto notes = write({read->mesh});
  ASSERT_TRUE(notes);
  EXPECT_THAT(*notes, Contains(HasSubstr("system/controlDict")));
  EXPECT_EQ(again("system/controlDict"), "mine");
  EXPECT_EQ(again("0/p"), text("0/p"));
  const auto sink = polymesh_sink(folder_.path("again"), false);
  const auto refused = CaseWriter::begin(read->mesh, **sink);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("again/0/p: exists already; -f overwrites it"));
}

TEST_F(FoamCaseFields, OfATimeThatIsNoNumberAreLeftOutByItsName) {
  Mesh mesh = read_mesh(folder_.path("case"))->mesh;
  mesh.metadata.emplace_back("openfoam.time", "soon");
  const auto notes = write({mesh});
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, Contains("the fields of time \"soon\" left out: it is no number"));
}

TEST_F(FoamCaseFields, NothingIsWrittenElsewhere) {
  put("0/p", pressure("0"));
  const auto read = read_mesh(folder_.path("case"));
  Mesh mesh = read->mesh;
  mesh.metadata.emplace_back("openfoam.text.../../evil", "x");
  mesh.metadata.emplace_back("openfoam.case.system/../../evil", "x");
  mesh.metadata.emplace_back("openfoam.case./etc/evil", "x");
  mesh.metadata.emplace_back("openfoam.field.../evil", pressure("0"));
  mesh.metadata.emplace_back("openfoam.case.system/fvSchemes", "#calc \"1\"");
  const auto notes = write({mesh});
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, Contains(HasSubstr("system/fvSchemes (#calc)")));
  EXPECT_THAT(folder_.names(), ElementsAre("again", "case"));
}

TEST(FoamField, NoTruncationOrFlippedByteDoesHarm) {
  const std::string text =
      "FoamFile { format binary; class volVectorField; arch \"LSB;label=32;scalar=64\"; }\n"
      "internalField nonuniform List<vector> 2(" +
      raw({1, 2, 3, 4, 5, 6}) +
      ");\nboundaryField { a { value uniform (0 0 1); g nonuniform List<scalar> 1(12345678); } }\n";
  ASSERT_TRUE(scan_foam_field(text, "U"));
  for (size_t i = 0; i < text.size(); ++i) {
    for (const char flip : {char{1}, char{4}, char{32}}) {
      std::string damaged = text;
      damaged[i] = static_cast<char>(damaged[i] ^ flip);
      for (const std::string& bad : {damaged, text.substr(0, i)}) {
        const auto field = scan_foam_field(bad, "U");
        for (const FoamValues& list : field ? field->values : std::vector<FoamValues>()) {
          ASSERT_LE(list.end, bad.size());
          if (list.marked) continue;
          FoamValueReader reader(*field, list);
          std::vector<std::byte> tuple(9 * sizeof(double));
          for (uint64_t k = 0; reader.components() > 0 && k < list.count && reader.next(tuple.data()); ++k)
            continue;
        }
      }
    }
  }
}

TEST(FoamPaths, ArePlain) {
  for (const char* path :
       {"0.1/alpha.water", "system/fvSchemes", "1e-05/uniform/functionObjects/p(0)", "constant/g"})
    EXPECT_TRUE(is_plain_foam_path(path)) << path;
  for (const char* path : {"", "/etc/x", "..", "a/../b", "a//../b", ".hidden", "a/.git/x", "~/x", "-f", "a b",
                           "a\nb", "a;b", "$x"})
    EXPECT_FALSE(is_plain_foam_path(path)) << path;
  EXPECT_EQ(foam_time_of("1e-05"), 1e-5);
  for (const char* name : {"0.orig", "processor0", "nan", "inf", "1e999", "", "x1"})
    EXPECT_FALSE(foam_time_of(name)) << name;
}

}  // namespace
}  // namespace maille
