#pragma once

#include <gtest/gtest.h>
#include <maille/io.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "io/format.h"

// For tests of formats: exact comparison, reading from text, writing into memory.

namespace maille::testing {

inline void expect_same_array(const Array& a, const Array& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_STREQ(name_of(a.domain), name_of(b.domain)) << a.name;
  EXPECT_STREQ(name_of(a.type), name_of(b.type)) << a.name;
  EXPECT_EQ(a.components, b.components) << a.name;
  EXPECT_STREQ(name_of(a.role), name_of(b.role)) << a.name;
  EXPECT_EQ(a.labels, b.labels) << a.name;
  EXPECT_TRUE(a.bytes == b.bytes) << a.name;
}

/// Everything, in the same order: points, blocks, arrays, metadata.
inline void expect_same_mesh(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.points.type, b.points.type);
  EXPECT_TRUE(a.points.bytes == b.points.bytes);
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (size_t i = 0; i < a.blocks.size(); ++i) {
    EXPECT_EQ(a.blocks[i].name, b.blocks[i].name);
    EXPECT_STREQ(name_of(a.blocks[i].type), name_of(b.blocks[i].type));
    EXPECT_EQ(a.blocks[i].types, b.blocks[i].types);
    EXPECT_EQ(a.blocks[i].offsets, b.blocks[i].offsets);
    EXPECT_EQ(a.blocks[i].connectivity, b.blocks[i].connectivity);
    EXPECT_EQ(a.blocks[i].face_sizes, b.blocks[i].face_sizes);
    EXPECT_EQ(a.blocks[i].cell_faces, b.blocks[i].cell_faces);
  }
  ASSERT_EQ(a.arrays.size(), b.arrays.size());
  for (size_t i = 0; i < a.arrays.size(); ++i) expect_same_array(a.arrays[i], b.arrays[i]);
  EXPECT_EQ(a.metadata, b.metadata);
}

inline Result<ReadResult> read_text(const Format& format, std::string_view text, std::string name = "test") {
  const auto source = memory_source(std::as_bytes(std::span(text.data(), text.size())), std::move(name));
  auto result = format.read(*source, {});
  if (result) {
    const auto valid = validate(result->mesh);
    EXPECT_TRUE(valid) << valid.error().message;
  }
  return result;
}

/// What must be readable; a failure and nothing where it is not.
inline ReadResult read_good_text(const Format& format, std::string_view text, std::string name) {
  auto result = read_text(format, text, std::move(name));
  EXPECT_TRUE(result) << result.error().message;
  return result ? std::move(*result) : ReadResult{};
}

/// What is said of a text that breaks the rules of its format.
inline std::string error_of_text(const Format& format, std::string_view text, std::string name) {
  const auto result = read_text(format, text, std::move(name));
  if (result) return "no error";
  EXPECT_EQ(result.error().code, ErrorCode::malformed_input);
  return result.error().message;
}

inline bool has_note(const std::vector<std::string>& notes, std::string_view part) {
  return std::any_of(notes.begin(), notes.end(),
                     [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

inline Result<ReadResult> read_file(const Format& format, const std::string& path) {
  const auto source = file_source(path);
  if (!source) return tl::unexpected(source.error());
  return format.read(**source, {});
}

/// All bytes of a file; a test fails where there are none, as one that damages them would test nothing.
inline std::string text_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  EXPECT_FALSE(text.empty()) << path;
  return text;
}

struct Written {
  std::string text;
  std::vector<std::string> notes;
};

inline Written write_text(const Format& format, const Mesh& mesh, const WriteOptions& options = {}) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  auto notes = format.write(mesh, *sink, options);
  EXPECT_TRUE(notes) << notes.error().message;
  return {std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()),
          notes ? *notes : std::vector<std::string>{}};
}

template <class T>
Array array_of(std::string name, Domain domain, Scalar type, uint32_t components,
               const std::vector<T>& values, Role role = Role::none) {
  Array array = make_array(std::move(name), domain, type, components, role);
  array.resize(values.size() / components);
  std::copy(values.begin(), values.end(), array.values<T>().begin());
  return array;
}

/// The numbers of an array; a failure and nothing where it is not there, or of another size.
template <class T>
std::vector<T> values_of(const Mesh& mesh, const std::string& name, Domain domain) {
  const Array* array = mesh.find(name, domain);
  if (array == nullptr || size_of(array->type) != sizeof(T)) {
    ADD_FAILURE() << "no array " << name;
    return {};
  }
  return {array->values<T>().begin(), array->values<T>().end()};
}

}  // namespace maille::testing
