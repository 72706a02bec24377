#include <maille/folder.h>
#include <maille/path.h>
#include <algorithm>
#include <cstring>
#include <filesystem>
#include "base/result.h"
#include "base/system.h"
#include "container/layout.h"
#include "io/format.h"
#include "io/gzip.h"
#include "io/letters.h"
#include "io/reading.h"

namespace maille {
namespace {

/// In the order in which first bytes are tried: clear signatures first, then those that guess from text (OFF,
/// STL, OBJ), whose `recognise` would also take files of others.
std::vector<const Format*> all_formats() {
  return {&ply_format(),  &glb_format(),        &gltf_format(),     &vrml_format(),    &vtp_format(),
          &vtu_format(),  &vtk_legacy_format(), &medit_format(),    &meditb_format(),  &gmsh_format(),
          &su2_format(),  &hedra_format(),      &polymesh_format(), &exodus_format(),  &vtkhdf_format(),
          &b3dm_format(), &mz3_format(),        &threemf_format(),  &ensight_format(), &cgns_format(),
          &xdmf_format(), &off_format(),        &stl_format(),      &obj_format()};
}

std::string known_formats() {
  std::string list;
  for (const FormatInfo& info : formats()) list += (list.empty() ? "" : ", ") + info.name;
  return list;
}

const Format* format_named(const std::string& name) {
  for (const Format* format : all_formats()) {
    const auto& extensions = format->info.extensions;
    if (format->info.name == name ||
        std::find(extensions.begin(), extensions.end(), "." + name) != extensions.end()) {
      return format;
    }
  }
  return nullptr;
}

/// The extension in lower case, with the dot, and without a ".gz" behind it.
std::string extension_of(const std::string& path) {
  std::string name = lower_case(split_path(path).name);
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  const size_t dot = name.find_last_of('.');
  return dot == std::string::npos ? "" : name.substr(dot);
}

const Format* format_by_extension(const std::string& path) {
  const std::string extension = extension_of(path);
  return extension.empty() ? nullptr : format_named(extension.substr(1));
}

// Enough for every `recognise`: XML declarations and comments come before the element that tells VTK's files
// apart. Chosen, not swept. first_bytes_of() reads 16 times as many: a packed file has to give 512 bytes
// behind a header that may hold a name.
constexpr size_t signature_size = 512;
constexpr uint8_t utf8_mark[] = {0xef, 0xbb, 0xbf};

bool begins_with(Bytes bytes, std::span<const uint8_t> magic) {
  return bytes.size() >= magic.size() && std::memcmp(bytes.data(), magic.data(), magic.size()) == 0;
}

/// `likely`: is taken where the bytes fit it, too, as formats of HDF5 begin alike.
const Format* format_by_content(Bytes first_bytes, const Format* likely = nullptr) {
  std::vector<std::byte> unpacked;
  if (is_gzip(first_bytes)) {
    unpacked = gunzip_front(first_bytes, signature_size);
    first_bytes = unpacked;
  }
  if (begins_with(first_bytes, utf8_mark)) first_bytes = first_bytes.subspan(std::size(utf8_mark));
  first_bytes = first_bytes.first(std::min(first_bytes.size(), signature_size));
  std::vector<const Format*> all = all_formats();
  if (likely != nullptr) all.insert(all.begin(), likely);
  for (const Format* format : all) {
    if (format->recognise != nullptr && format->recognise(first_bytes)) return format;
  }
  return nullptr;
}

Result<std::vector<std::byte>> first_bytes_of(const Source& source) {
  std::vector<std::byte> first(static_cast<size_t>(std::min<uint64_t>(source.size(), 16 * signature_size)));
  MAILLE_CHECK(source.read_at(0, first));
  return first;
}

/// What to say of a file whose format is not known; `what` where nothing better can be said.
tl::unexpected<Error> unknown_format(const std::string& name, Bytes first_bytes, const std::string& what) {
  const bool packed = is_gzip(first_bytes);
  const std::vector<std::byte> front =
      packed ? gunzip_front(first_bytes, file_magic.size()) : std::vector<std::byte>();
  if (begins_with(packed ? Bytes(front) : first_bytes, file_magic)) {
    return failure(ErrorCode::usage,
                   name + (packed ? ": a .maille file packed with gzip; unpack it first, e.g. "
                                    "with gunzip"
                                  : ": a .maille file, not one of a foreign format"));
  }
  return failure(ErrorCode::usage, name + ": " + what + known_formats());
}

Result<const Format*> choose(const std::string& asked, const Source& source) {
  if (!asked.empty()) {
    if (const Format* format = format_named(lower_case(asked))) return format;
    return failure(ErrorCode::usage, "unknown format \"" + asked + "\"; known are " + known_formats());
  }
  // polyMesh is the only format that is a folder, and a folder may have any name.
  if (source.size() == 0 && std::filesystem::is_directory(to_path(source.name()))) return &polymesh_format();
  // The name comes before the bytes: bytes of OBJ and of text STL are guesses, names are what users mean.
  // Where the reader then fails, with_other_format() says what the bytes look like.
  if (const Format* format = format_by_extension(source.name())) return format;
  const auto first = MAILLE_TRY(first_bytes_of(source));
  if (first.empty()) return failure(ErrorCode::malformed_input, source.name() + ": it is empty");
  if (const Format* format = format_by_content(first)) return format;
  return unknown_format(
      source.name(), first,
      "neither the name nor the first bytes tell the format; say which of these it is (the command: "
      "--input-format), or convert it to one of them first: ");
}

/// The unpacked bytes, which keep the name of the packed file for messages. Both are in memory here; the
/// packed ones go when this returns.
Result<std::unique_ptr<Source>> unpacked(const Source& source, const ReadOptions& options) {
  const InputBytes packed = MAILLE_TRY(InputBytes::load(source));
  auto bytes = MAILLE_TRY(gunzip(packed.bytes(), options.limits.mesh_bytes, source.name()));
  return memory_source(std::move(bytes), source.name());
}

/// The one place where readers' meshes are checked: after it all code relies on validate()'s promises.
Result<ReadResult> read_checked(const Format& format, const Source& source, const ReadOptions& options) {
  ReadResult result = MAILLE_TRY(format.read(source, options));
  if (auto ok = validate(result.mesh); !ok) {
    return failure(ErrorCode::malformed_input, source.name() + ": " + ok.error().message);
  }
  return result;
}

}  // namespace

const std::vector<FormatInfo>& formats() {
  static const std::vector<FormatInfo> infos = [] {
    std::vector<FormatInfo> list;
    for (const Format* format : all_formats()) list.push_back(format->info);
    std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return list;
  }();
  return infos;
}

Result<std::string> format_of(const std::string& path) {
  if (std::filesystem::is_directory(to_path(path))) return polymesh_format().info.name;
  if (const Format* format = format_by_extension(path)) return format->info.name;
  std::vector<std::byte> first;
  if (const auto source = file_source(path)) first = first_bytes_of(**source).value_or(first);
  if (const Format* format = format_by_content(first)) return format->info.name;
  return unknown_format(path, first, "no known mesh format (by extension or first bytes); known are ");
}

Result<std::string> format_of(const Source& source) {
  return MAILLE_TRY(choose("", source))->info.name;
}

Result<ReadResult> read_mesh(const std::string& path, const ReadOptions& options) {
  if (std::filesystem::is_directory(to_path(path))) return read_mesh(*memory_source(Bytes(), path), options);
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  return read_mesh(*source, options);
}

namespace {

/// Of a file that was renamed: the reader's message, followed by the format that the first bytes show. Only
/// for malformed input and where no format was asked for.
Error with_other_format(Error error, const Source& source, const Format& format, const ReadOptions& options) {
  const bool malformed = error.code == ErrorCode::malformed_input;
  const auto first = malformed && options.format.empty() ? first_bytes_of(source) : std::vector<std::byte>();
  const Format* const other = first ? format_by_content(*first, &format) : nullptr;
  if (other == nullptr || other == &format) return error;
  error.message += error.message.ends_with('?') ? " Its" : "; its";
  error.message += " first bytes are those of " + other->info.name + " (the command: --input-format " +
                   other->info.name + ")";
  return error;
}

Result<ReadResult> read_as(const Format& format, const Source& source, const ReadOptions& options) {
  auto result = read_checked(format, source, options);
  if (result) return result;
  return tl::unexpected(with_other_format(result.error(), source, format, options));
}

}  // namespace

Result<ReadResult> read_mesh(const Source& source, const ReadOptions& options) {
  const Format* const format = MAILLE_TRY(choose(options.format, source));
  if (source.size() >= 3) {
    std::byte magic[3];
    MAILLE_CHECK(source.read_at(0, magic));
    if (is_gzip(magic)) {
      const std::unique_ptr<Source> plain = MAILLE_TRY(unpacked(source, options));
      ReadOptions left = options;
      // No underflow: gunzip() has refused more than the limit.
      left.limits.mesh_bytes -= plain->size();
      return read_as(*format, *plain, left);
    }
  }
  return read_as(*format, source, options);
}

Result<std::vector<std::string>> write_mesh(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  const Format* const format =
      options.format.empty() ? format_by_extension(sink.name()) : format_named(lower_case(options.format));
  if (format == nullptr) {
    const std::string& what = options.format.empty() ? sink.name() : options.format;
    return unknown_format(what, {}, "no known mesh format; known are ");
  }
  // Meshes of callers are as hostile as files; writers index without checks after this.
  MAILLE_CHECK(validate(mesh));
  WriteOptions chosen = options;
  chosen.format = format->info.name;
  if (!lower_case(sink.name()).ends_with(".gz")) return format->write(mesh, sink, chosen);
  const std::unique_ptr<Sink> packing = gzip_sink(sink);
  auto notes = MAILLE_TRY(format->write(mesh, *packing, chosen));
  MAILLE_CHECK(packing->commit());
  return notes;
}

Result<std::vector<std::string>> write_mesh(const Mesh& mesh, const std::string& path,
                                            const WriteOptions& options) {
  WriteOptions chosen = options;
  if (chosen.format.empty()) chosen.format = MAILLE_TRY(format_of(path));
  std::unique_ptr<Sink> sink;
  if (lower_case(chosen.format) == "polymesh")
    sink = MAILLE_TRY(polymesh_sink(path));
  else
    sink = MAILLE_TRY(file_sink(path));
  auto notes = MAILLE_TRY(write_mesh(mesh, *sink, chosen));
  MAILLE_CHECK(sink->commit());
  return notes;
}

}  // namespace maille
