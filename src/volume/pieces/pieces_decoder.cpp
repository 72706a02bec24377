#include <numeric>

#include "base/pace.h"
#include "base/result.h"
#include "volume/pieces/piece_reader.h"
#include "volume/pieces/pieces_file.h"

namespace maille {
namespace {

/// All pieces, or those that are whole, with the first error of the others. Errors other than damage end
/// reading.
struct AllPieces {
  std::vector<DecodedPiece> pieces;
  std::optional<Error> damage;
};

Result<AllPieces> read_all(const PieceReader& reader, const DecodeOptions& options, bool numbered) {
  std::vector<uint32_t> numbers(reader.pieces().size());
  std::iota(numbers.begin(), numbers.end(), 0u);
  AllPieces all;
  const auto take = [&](size_t i, Result<DecodedPiece> piece) -> Result<> {
    if (piece) {
      all.pieces.push_back(*std::move(piece));
    } else if (!all.damage) {
      all.damage = std::move(piece).error();
    }
    const double share = static_cast<double>(i + 1) / static_cast<double>(numbers.size());
    return options.progress && !options.progress({"cells", share}) ? cancelled() : Result<>();
  };
  MAILLE_CHECK(read_pieces(reader, numbers, numbered, options, {}, take));
  return all;
}

/// The pieces as one mesh. Each piece is valid, but what the file says of all of them is not checked before.
Result<Mesh> joined(const AllPieces& all, const PieceReader& reader, bool kept, const Source& source,
                    Executor* executor) {
  Mesh mesh = MAILLE_TRY(join_pieces(all.pieces, reader, kept, executor));
  if (auto valid = validate(mesh); !valid)
    return failure(ErrorCode::corrupt, source.name() + ": " + valid.error().message);
  return mesh;
}

}  // namespace

Result<Mesh> decode_pieces(const Source& source, const DecodeOptions& options) {
  const PieceReader reader = MAILLE_TRY(PieceReader::open(source, options));
  MAILLE_CHECK(reader.file().check_complete());
  const AllPieces all = MAILLE_TRY(read_all(reader, options, reader.kept()));
  if (all.damage) return tl::unexpected(*all.damage);
  Mesh mesh = MAILLE_TRY(joined(all, reader, reader.kept(), source, options.executor));
  const StreamTail& tail = reader.tail();
  if (mesh.point_count() != tail.points || mesh.cell_count() != tail.cells)
    return failure(ErrorCode::corrupt, source.name() + ": the pieces do not hold what the file's end says");
  return mesh;
}

/// Whatever pieces are whole, without their order where the index is lost: numbers stand behind all pieces.
Result<Salvaged> salvage_pieces(const Source& source, const DecodeOptions& options) {
  Result<PieceReader> opened = PieceReader::open(source, options);
  const bool indexed = opened.has_value();
  std::optional<Error> damage;
  if (!indexed) {
    if (opened.error().code != ErrorCode::corrupt) return tl::unexpected(opened.error());
    damage = opened.error();
    opened = PieceReader::open_damaged(source, options);
  }
  PieceReader reader = MAILLE_TRY(std::move(opened));
  AllPieces all = MAILLE_TRY(read_all(reader, options, indexed && reader.kept()));
  // Without the end of the file nobody knows how many cells each block has, and so where those of the next
  // begin.
  if (!indexed) MAILLE_CHECK(reader.take_blocks(all.pieces));
  Salvaged salvaged;
  salvaged.damage = damage ? std::move(damage) : std::move(all.damage);
  const Result<> complete = reader.file().check_complete();
  if (!complete && !salvaged.damage) salvaged.damage = complete.error();
  salvaged.mesh = MAILLE_TRY(joined(all, reader, indexed && reader.kept(), source, options.executor));
  return salvaged;
}

}  // namespace maille
