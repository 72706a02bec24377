#include <gtest/gtest.h>
#include <maille/io.h>

#include "io/gzip.h"
#include "io/same_mesh.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using testing::expect_same_mesh;

Bytes bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::vector<std::byte> packed(std::string_view text) {
  std::vector<std::byte> bytes;
  const auto below = memory_sink(bytes);
  const auto sink = gzip_sink(*below);
  EXPECT_TRUE(sink->write(bytes_of(text)));
  EXPECT_TRUE(sink->commit());
  return bytes;
}

/// A sink with a name, as a file has.
class NamedSink final : public Sink {
 public:
  explicit NamedSink(std::string name) : name_(std::move(name)) {}
  Result<> write(Bytes bytes) override {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<> commit() override { return {}; }
  std::string name() const override { return name_; }
  std::vector<std::byte> bytes_;

 private:
  std::string name_;
};

/// A source whose bytes cannot be seen without copying.
class OpaqueSource final : public Source {
 public:
  explicit OpaqueSource(std::string text, std::string name)
      : text_(std::move(text)), name_(std::move(name)) {}
  uint64_t size() const override { return text_.size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    std::memcpy(out.data(), text_.data() + offset, out.size());
    return {};
  }
  std::string name() const override { return name_; }

 private:
  std::string text_;
  std::string name_;
};

constexpr const char* triangle_obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST(Formats, AreAllListed) {
  std::vector<std::string> names;
  for (const FormatInfo& info : formats()) {
    names.push_back(info.name);
    EXPECT_FALSE(info.extensions.empty()) << info.name;
    EXPECT_FALSE(info.description.empty()) << info.name;
  }
  for (const char* name : {"ply", "obj", "off", "stl", "glb", "gltf", "wrl", "vtp"}) {
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  }
}

TEST(FormatOf, GoesByTheExtension) {
  EXPECT_EQ(*format_of("dragon.ply"), "ply");
  EXPECT_EQ(*format_of("folder.obj/dragon.ply.gz"), "ply");
  EXPECT_EQ(*format_of("PART.STL"), "stl");
  EXPECT_EQ(*format_of("a.b.off"), "off");
  EXPECT_EQ(*format_of("model.glb"), "glb");
  EXPECT_EQ(*format_of("model.gltf"), "gltf");
}

TEST(FormatOf, LooksIntoFilesWithoutOne) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(*format_of(folder.write("nameless", "ply\nformat ascii 1.0\n")), "ply");
  EXPECT_EQ(*format_of(folder.write("nameless", "# a comment\nSTCNOFF\n0 0 0\n")), "off");
  EXPECT_EQ(*format_of(folder.write("nameless", "solid part\n")), "stl");
  EXPECT_EQ(*format_of(folder.write("nameless", "# Blender\n\no thing\nv 1 2 3\n")), "obj");
  EXPECT_EQ(*format_of(folder.write("nameless", text_of(packed(triangle_obj)))), "obj");
}

TEST(FormatOf, ListsWhatIsKnown) {
  const auto format = format_of("dragon.xyz");
  ASSERT_FALSE(format);
  EXPECT_EQ(format.error().code, ErrorCode::usage);
  EXPECT_NE(format.error().message.find("dragon.xyz"), std::string::npos);
  EXPECT_NE(format.error().message.find("ply"), std::string::npos);
}

TEST(ReadMesh, SkipsAByteOrderMark) {
  const std::string mark = "\xef\xbb\xbf";
  for (const std::string& text : {mark + triangle_obj, mark + "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                                  mark + "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                         "property float y\nproperty float z\nelement face 1\n"
                                         "property list uchar int vertex_indices\nend_header\n"
                                         "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"}) {
    const auto result = read_mesh(*memory_source(bytes_of(text)), {});
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->mesh.point_count(), 3u);
    EXPECT_EQ(result->mesh.cell_count(), 1u);
    EXPECT_TRUE(result->notes.empty());
  }
}

TEST(ReadMesh, SaysWhatToDoWithAPackedMailleFile) {
  const std::vector<std::byte> file = packed("\x89MAI\r\n\x1a\n and more");
  const auto result = read_mesh(*memory_source(file, "bunny.maille.gz"), {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::usage);
  EXPECT_EQ(result.error().message,
            "bunny.maille.gz: a .maille file packed with gzip; unpack it first, e.g. with gunzip");
  const auto plain = read_mesh(*memory_source(bytes_of("\x89MAI\r\n\x1a\n and more"), "bunny"), {});
  ASSERT_FALSE(plain);
  EXPECT_EQ(plain.error().message, "bunny: a .maille file, not one of a foreign format");
}

TEST(ReadMesh, NamesAnUnknownFormat) {
  const auto source = memory_source(bytes_of("what is this"));
  const auto result = read_mesh(*source, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::usage);
  ReadOptions options;
  options.format = "docx";
  EXPECT_EQ(read_mesh(*source, options).error().code, ErrorCode::usage);
}

TEST(ReadMesh, NamesTheFormatOfARenamedFile) {
  const std::string ply = "ply\nformat ascii 1.0\nend_header\n";
  const auto as_obj = read_mesh(*memory_source(bytes_of(ply), "a.obj"), {});
  ASSERT_FALSE(as_obj.has_value());
  EXPECT_NE(as_obj.error().message.find("Its first bytes are those of ply"), std::string::npos);
  const std::string neither = "eggs\n";
  const auto as_ply = read_mesh(*memory_source(bytes_of(neither), "a.ply"), {});
  ASSERT_FALSE(as_ply.has_value());
  EXPECT_EQ(as_ply.error().message.find("first bytes"), std::string::npos);
}

TEST(ReadMesh, SaysWhenAFileIsMissing) {
  const auto result = read_mesh("/no/such/file.ply");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::cannot_read);
}

TEST(ReadMesh, UnpacksGzipOfAnyNumberOfMembers) {
  std::vector<std::byte> bytes = packed("v 0 0 0\nv 1 0 0\n");
  const auto second = packed("v 0 1 0\nf 1 2 3\n");
  bytes.insert(bytes.end(), second.begin(), second.end());
  const auto source = memory_source(bytes, "two.obj.gz");
  const auto result = read_mesh(*source, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.point_count(), 3u);
  EXPECT_EQ(result->mesh.cell_count(), 1u);
}

TEST(ReadMesh, RejectsEveryTruncationOfGzip) {
  const std::vector<std::byte> bytes = packed(triangle_obj);
  for (size_t length = 3; length < bytes.size(); ++length) {
    const auto source = memory_source(Bytes(bytes).first(length), "short.obj.gz");
    const auto result = read_mesh(*source, {});
    ASSERT_FALSE(result) << length;
    EXPECT_EQ(result.error().code, ErrorCode::malformed_input);
    EXPECT_NE(result.error().message.find("short.obj.gz"), std::string::npos);
  }
}

TEST(ReadMesh, FindsDamageInGzip) {
  std::vector<std::byte> bytes = packed(std::string(5000, '#').append("\n").append(triangle_obj));
  bytes[bytes.size() - 6] ^= std::byte{1};  // the checksum
  const auto source = memory_source(bytes, "bad.obj.gz");
  const auto result = read_mesh(*source, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::malformed_input);
}

TEST(ReadMesh, BoundsWhatGzipUnpacksTo) {
  const std::vector<std::byte> bomb = packed(std::string(size_t{8} << 20, '\n'));
  EXPECT_LT(bomb.size(), 20000u);
  const auto source = memory_source(bomb, "bomb.obj.gz");
  ReadOptions options;
  options.limits.mesh_bytes = 1 << 20;
  const auto result = read_mesh(*source, options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::memory_bound);
}

TEST(ReadMesh, TakesSourcesWithoutAView) {
  const auto result = read_mesh(OpaqueSource(triangle_obj, "a.obj"), {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.cell_count(), 1u);
}

TEST(ReadMesh, KeepsToTheMemoryAllowed) {
  std::string text;
  for (int i = 0; i < 1000000; ++i) text += "v 1 2 3\n";
  const auto source = memory_source(bytes_of(text), "big.obj");
  ReadOptions options;
  options.limits.mesh_bytes = 1 << 20;
  const auto result = read_mesh(*source, options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::memory_bound);
}

TEST(ReadMesh, ReportsProgressAndCanBeCancelled) {
  std::string text;
  for (int i = 0; i < 2000000; ++i) text += "v 1 2 3\n";
  const auto source = memory_source(bytes_of(text), "big.obj");
  ReadOptions options;
  std::vector<double> fractions;
  options.progress = [&](const ProgressReport& report) {
    fractions.push_back(report.fraction);
    return true;
  };
  ASSERT_TRUE(read_mesh(*source, options));
  EXPECT_GE(fractions.size(), 3u);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.back(), 1);
  options.progress = [](const ProgressReport&) { return false; };
  const auto result = read_mesh(*source, options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::cancelled);
}

TEST(WriteMesh, PacksWhereTheNameSaysSo) {
  const Mesh mesh = testing::torus(5, 6);
  NamedSink packed_sink("torus.off.gz");
  ASSERT_TRUE(write_mesh(mesh, packed_sink, {}));
  EXPECT_TRUE(is_gzip(packed_sink.bytes_));
  NamedSink again("torus.off.gz");
  ASSERT_TRUE(write_mesh(mesh, again, {}));
  EXPECT_TRUE(packed_sink.bytes_ == again.bytes_);
  NamedSink plain("torus.off");
  ASSERT_TRUE(write_mesh(mesh, plain, {}));
  const auto unpacked = gunzip(packed_sink.bytes_, 1 << 20, "x");
  ASSERT_TRUE(unpacked);
  EXPECT_TRUE(*unpacked == plain.bytes_);
  const auto back = read_mesh(*memory_source(packed_sink.bytes_, "torus.off.gz"), {});
  ASSERT_TRUE(back);
  EXPECT_EQ(back->mesh.cell_count(), mesh.cell_count());
}

TEST(WriteMesh, WritesBinaryGlbAndTextGltfByName) {
  const Mesh mesh = testing::torus(3, 3);
  const auto first_byte = [&](const std::string& sink_name, const std::string& format) {
    NamedSink sink(sink_name);
    WriteOptions options;
    options.format = format;
    EXPECT_TRUE(write_mesh(mesh, sink, options));
    return sink.bytes_.empty() ? '?' : static_cast<char>(sink.bytes_[0]);
  };
  EXPECT_EQ(first_byte("-", "glb"), 'g');
  EXPECT_EQ(first_byte("-", "GLB"), 'g');
  EXPECT_EQ(first_byte("-", "gltf"), '{');
  EXPECT_EQ(first_byte("a.glb", ""), 'g');
  EXPECT_EQ(first_byte("a.GLTF", ""), '{');
  EXPECT_EQ(first_byte("a.gltf", "glb"), 'g');
  EXPECT_EQ(first_byte("a.glb", "gltf"), '{');
}

TEST(WriteMesh, NamesAnUnknownFormat) {
  NamedSink sink("torus.xyz");
  const auto result = write_mesh(testing::torus(3, 3), sink, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::usage);
}

TEST(WriteMesh, RejectsAMeshThatBreaksItsRules) {
  Mesh mesh = testing::torus(3, 3);
  mesh.blocks.front().connectivity.back() = 1000000;
  NamedSink sink("torus.ply");
  EXPECT_EQ(write_mesh(mesh, sink, {}).error().code, ErrorCode::malformed_input);
}

TEST(WriteMesh, PassesOnTheSinksError) {
  class FullSink final : public Sink {
   public:
    Result<> write(Bytes) override { return failure(ErrorCode::write_failed, "disk full"); }
    Result<> commit() override { return {}; }
    std::string name() const override { return "full"; }
  };
  for (const char* format : {"ply", "obj", "off", "stl"}) {
    FullSink sink;
    WriteOptions options;
    options.format = format;
    const auto result = write_mesh(testing::torus(200, 200), sink, options);
    ASSERT_FALSE(result) << format;
    EXPECT_EQ(result.error().code, ErrorCode::write_failed) << format;
  }
}

}  // namespace
}  // namespace maille
