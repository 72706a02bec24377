// Converts PLY files of text to binary ones, row by row, for readers in parts.
#include "base/pace.h"
#include "io/converted_surface.h"
#include "io/ply/ply_table.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

/// Each row is written with the header's types, so the binary file holds what a reader of text would make of
/// it, and the header stays as it is but for the encoding. Point numbers are checked by the reader of the
/// binary file.
class PlyTextConverter {
 public:
  PlyTextConverter(const Source& source, const PartsOptions& options) : source_(source), options_(options) {}

  Result<ConvertedSurface> run() {
    // The header must be in the first block of 4 MiB.
    LineBlocks lines(source_, 0);
    const std::string_view front = MAILLE_TRY(lines.read());
    if (!lines.at_end() && front.find("end_header") == std::string_view::npos)
      return not_in_parts(source_, "a header of more than 4 MiB");
    TextScanner scanner(front);
    scanner.skip_byte_order_mark();
    PlyHeader header = MAILLE_TRY(parse_ply_header(scanner, source_.name()));
    if (header.encoding != PlyEncoding::ascii) return not_in_parts(source_, "what is no text");
    ConvertedSurface surface = MAILLE_TRY(ConvertedSurface::create(options_.folder));
    surface.header = header;
    surface.header.encoding = PlyEncoding::little_endian;
    uint64_t rows = 0;
    for (const PlyElement& element : header.elements) rows += element.count;
    Pace pace(options_.progress, "reading", rows);
    for (const PlyElement& element : header.elements) {
      const bool points = element.name == "vertex";
      if (!points && element.name != "face")
        return not_in_parts(source_, "other elements than points, then faces");
      for (uint64_t row = 0; row < element.count; ++row) {
        MAILLE_CHECK(next_line(scanner, lines));
        MAILLE_CHECK(convert_row(scanner, element, row, points ? surface.points : surface.faces));
        if (!pace.step()) return cancelled();
      }
    }
    if (too_small_ != 0) {
      surface.notes.push_back(
          counted(too_small_, "number") +
          " too small for the float that the header declares: zero, or with fewer digits");
    }
    return surface;
  }

 private:
  Result<> next_line(TextScanner& scanner, LineBlocks& lines) {
    scanner.skip_white();
    while (scanner.at_end() && !lines.at_end()) {
      // Rows do not reach over blocks, as blocks end with lines and rows do here, too.
      scanner = TextScanner(MAILLE_TRY(lines.read()), scanner.line());
      scanner.skip_white();
    }
    return {};
  }

  Result<> convert_row(TextScanner& scanner, const PlyElement& element, uint64_t number, ScratchFile& to) {
    const auto bad = [&]() -> tl::unexpected<Error> {
      // The reader of whole files goes on in the next line.
      if (scanner.at_line_end() && !scanner.at_end())
        return not_in_parts(source_, "a row over several lines");
      return malformed_line(source_.name(), scanner.line(),
                            element.name + " " + std::to_string(number) + ": " + found_at(scanner) +
                                " stands where a number of the header belongs");
    };
    row_.clear();
    for (const PlyProperty& property : element.properties) {
      uint64_t count = 1;
      if (property.list) {
        scanner.skip_blanks();
        if (!scanner.integer(count)) return bad();
        // Text may hold longer lists than the type of their length in the header can say.
        const size_t size = size_of(property.count_type);
        if (size < 4 && count >> (8 * size) != 0)
          return not_in_parts(source_, "a list too long for its type");
        // Far more corners than a line of 64 MB can have.
        if (count > uint64_t{1} << 28) return bad();
        row_.resize(row_.size() + size);
        std::memcpy(row_.data() + row_.size() - size, &count, size);
      }
      const size_t size = size_of(property.type);
      for (uint64_t i = 0; i < count; ++i) {
        scanner.skip_blanks();
        row_.resize(row_.size() + size);
        if (!read_ply_number(scanner, property.type, row_.data() + row_.size() - size, too_small_))
          return bad();
      }
    }
    scanner.skip_blanks();
    if (!scanner.at_line_end()) return bad();
    return to.append(row_);
  }

  const Source& source_;
  const PartsOptions& options_;
  std::vector<std::byte> row_;
  uint64_t too_small_ = 0;
};

}  // namespace

Result<ConvertedSurface> convert_ply_text(const Source& source, const PartsOptions& options) {
  return PlyTextConverter(source, options).run();
}

}  // namespace maille
