#include <maille/io.h>
#include <maille/surface_source.h>

#include <cstring>

#include "base/result.h"
#include "io/converted_surface.h"
#include "io/mesh_sources.h"

namespace maille {
namespace {

/// The PLY file that a conversion made: header, points and faces, one behind the other, as one source of
/// bytes.
class ConvertedBytes final : public Source {
 public:
  ConvertedBytes(ConvertedSurface surface, std::string name)
      : header_(format_ply_header(surface.header)),
        points_(std::make_unique<ScratchFile>(std::move(surface.points))),
        faces_(std::make_unique<ScratchFile>(std::move(surface.faces))),
        name_(std::move(name)) {}

  uint64_t size() const override { return header_.size() + points_->size() + faces_->size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    const auto of_header = [&](uint64_t at, std::span<std::byte> part) -> Result<> {
      std::memcpy(part.data(), header_.data() + at, part.size());
      return {};
    };
    MAILLE_CHECK(read_part(offset, out, header_.size(), of_header));
    for (ScratchFile* const file : {points_.get(), faces_.get()}) {
      MAILLE_CHECK(read_part(offset, out, file->size(), [&](uint64_t at, std::span<std::byte> part) {
        return file->read_at(at, part);
      }));
    }
    return out.empty() ? Result<>() : failure(ErrorCode::cannot_read, name_ + ": read beyond its end");
  }
  std::string name() const override { return name_; }

 private:
  /// Reads what of `out` is in a part of `size` bytes and shortens `out` by it. `offset` becomes the place
  /// behind this part, 0 as soon as reading has begun, so that the next part goes on at its front.
  template <class Read>
  static Result<> read_part(uint64_t& offset, std::span<std::byte>& out, uint64_t size, Read read) {
    if (offset >= size) {
      offset -= size;
      return {};
    }
    const uint64_t here = std::min<uint64_t>(size - offset, out.size());
    if (here > 0) MAILLE_CHECK(read(offset, out.first(here)));
    out = out.subspan(here);
    offset = 0;
    return {};
  }

  std::string header_;
  std::unique_ptr<ScratchFile> points_, faces_;
  std::string name_;
};

/// A source with the bytes that it reads.
class OwningSource final : public MeshSource {
 public:
  OwningSource(std::unique_ptr<Source> bytes, std::unique_ptr<MeshSource> mesh,
               std::vector<std::string> notes)
      : bytes_(std::move(bytes)), mesh_(std::move(mesh)), notes_(std::move(notes)) {}

  const MeshDescription& description() const override { return mesh_->description(); }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return mesh_->read_points(first, count, out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    return mesh_->read_cells(first, count, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return mesh_->read_array(array, first, count, out);
  }
  std::vector<std::string> notes() const override {
    std::vector<std::string> notes = notes_;
    const std::vector<std::string> more = mesh_->notes();
    notes.insert(notes.end(), more.begin(), more.end());
    return notes;
  }

 private:
  std::unique_ptr<Source> bytes_;
  std::unique_ptr<MeshSource> mesh_;
  std::vector<std::string> notes_;
};

}  // namespace

Result<std::unique_ptr<MeshSource>> open_converted(ConvertedSurface surface, const std::string& name) {
  std::vector<std::string> notes = std::move(surface.notes);
  auto bytes = std::make_unique<ConvertedBytes>(std::move(surface), name);
  // The order of the members of OwningSource matters: the mesh reads from the bytes, so it must be destroyed
  // first.
  auto mesh = MAILLE_TRY(open_ply_source(*bytes, {}));
  return std::unique_ptr<MeshSource>(
      std::make_unique<OwningSource>(std::move(bytes), std::move(mesh), std::move(notes)));
}

Result<std::unique_ptr<MeshSource>> open_surface_source(const Source& source, const PartsOptions& options) {
  const std::string format = MAILLE_TRY(format_of(source));
  if (format == "ply") {
    // Unsupported means text, or what no reader in parts knows. If the conversion does not know it either,
    // the first error is the better one.
    auto binary = open_ply_source(source, {});
    if (binary || binary.error().code != ErrorCode::unsupported) return binary;
    auto text = convert_ply_text(source, options);
    if (!text && text.error().code == ErrorCode::unsupported) return binary;
    return open_converted(MAILLE_TRY(std::move(text)), source.name());
  }
  if (format == "stl") return open_converted(MAILLE_TRY(convert_stl(source, options)), source.name());
  if (format == "obj") return open_converted(MAILLE_TRY(convert_obj(source, options)), source.name());
  return not_in_parts(source, "a surface of format " + format);
}

}  // namespace maille
