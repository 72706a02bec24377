#include <maille/ranks.h>

#include <algorithm>

#include "base/bytes.h"
#include "base/pace.h"
#include "surface/arrays/array_report.h"
#include "volume/pieces/cut_rules.h"
#include "volume/pieces/piece_coder.h"
#include "volume/ranks/collective.h"
#include "volume/ranks/cut_among_ranks.h"
#include "volume/ranks/directory.h"
#include "volume/ranks/part_layout.h"
#include "volume/ranks/piece_exchange.h"
#include "volume/ranks/rank_joins.h"
#include "volume/ranks/rank_maps.h"
#include "volume/ranks/rank_totals.h"
#include "volume/stream/stream_file.h"

namespace maille {
namespace {

/// Writes one file in pieces from many ranks, each with a part of the mesh: the same bytes as from one
/// process, as far as samples hold all numbers and parts do not stay as they are. The steps follow run(); all
/// ranks go through all of them together, and each step that can fail ends with an agreement. docs/mpi.md.
class RanksEncoder {
 public:
  RanksEncoder(const RankPart& part, Ranks& ranks, RanksFile& file, const EncodeOptions& options,
               const RanksOptions& how)
      : part_(part), ranks_(ranks), file_(file), how_(how) {
    coding_.options = options;
  }

  Result<EncodeReport> run() {
    layout_ = MAILLE_TRY(agree_on_layout(part_, ranks_));
    coding_.stream = MAILLE_TRY(agree(ranks_, stream_options_of(layout_.empty, coding_.options)));
    const PointDirectory points = MAILLE_TRY(PointDirectory::make(part_, ranks_));
    const Directory cells = MAILLE_TRY(number_cells(part_, layout_, ranks_));
    coding_.maps = MAILLE_TRY(
        choose_maps_among_ranks(part_, layout_, points, cells, coding_.stream, how_.sample_bytes, ranks_));
    totals_ = count_among_ranks(part_, layout_, points, ranks_);
    coding_.cells = totals_.tail.cells;
    const Division division = divide(points, cells);
    pieces_ = division.count;
    std::vector<PieceOfRank> mine = exchange_pieces(part_, layout_, points, division, ranks_);
    MAILLE_CHECK(agree(ranks_, code(mine)));
    return write();
  }

 private:
  /// Which piece each cell belongs to: the parts as they are, or cuts through the whole mesh.
  Division divide(const PointDirectory& points, const Directory& cells) {
    Division division;
    division.numbers = cells.numbers();
    uint64_t unused = 0;
    for (size_t i = 0; i < points.directory().count(); ++i) unused += !points.is_used(i);
    division.has_unused = sum_of(ranks_, unused) > 0;
    if (how_.as_is) {
      // Ranks without cells have no piece.
      const std::vector<uint64_t> before = sums_before(ranks_, !cells.numbers().empty());
      division.pieces.assign(cells.numbers().size(), static_cast<uint32_t>(before[ranks_.rank()]));
      division.count = static_cast<uint32_t>(before.back());
    } else {
      RankPieces cut = cut_into_pieces(points.directory(), cells);
      division.pieces = std::move(cut.of_cell);
      division.count = cut.count;
    }
    division.count += division.has_unused;
    return division;
  }

  /// As the function of this name has it for a mesh in memory: both ways of cutting are compared by the same
  /// numbers.
  RankPieces cut_into_pieces(const Directory& points, const Directory& cells) {
    ReachCounts reaches;
    const std::vector<Middle> each = middles(cells, reaches);
    ranks_.add(reaches.counts());
    RankPieces by_planes = cut_among_ranks(each, reaches.median(), how_.cells_per_piece, ranks_);
    if (by_planes.count < 2) return by_planes;
    const NumberCut cut = {coding_.cells, by_planes.count};
    RankPieces by_number = {{}, by_planes.count};
    for (const uint32_t cell : cells.numbers()) by_number.of_cell.push_back(cut.piece_of(cell));
    const LookedAt numbered = look_among_ranks(*part_.mesh, by_number, points.numbers(), ranks_),
                   planes = look_among_ranks(*part_.mesh, by_planes, points.numbers(), ranks_);
    const bool better = is_better(numbered, planes, {coding_.cells, points.total()}, coding_.kept());
    return better ? std::move(by_number) : std::move(by_planes);
  }

  Executor& executor_of() const {
    return coding_.options.executor ? *coding_.options.executor : serial_executor();
  }

  // As middles_of() of cut_cells.cpp: the same sums in the same order.
  std::vector<Middle> middles(const Directory& cells, ReachCounts& reaches) const {
    const std::vector<CutPosition> positions = cut_positions(part_.mesh->points, executor_of());
    std::vector<Middle> middles;
    middles.reserve(cells.numbers().size());
    for (const CellBlock& block : part_.mesh->blocks) {
      for (uint64_t i = 0, count = block.size(); i < count; ++i) {
        const uint32_t number = cells.numbers()[middles.size()];
        CellCorners corners;
        for (const uint32_t point : block.cell(i)) corners.add(positions[point]);
        middles.push_back({corners.middle(), number});
        reaches.add(corners.reach());
      }
    }
    return middles;
  }

  /// The pieces of this rank, coded side by side. An error of one is told when all are done.
  Result<> code(std::vector<PieceOfRank>& mine) {
    Executor& executor = executor_of();
    coded_.resize(mine.size());
    joins_ = joins_of(mine);
    std::vector<Result<>> done(mine.size());
    executor.parallel_for(mine.size(), [&](size_t i) {
      Result<PieceInWork> piece = code_piece(coding_, std::move(mine[i].sub), std::move(mine[i].cells));
      if (piece) {
        coded_[i] = *std::move(piece);
      } else {
        done[i] = tl::unexpected(piece.error());
      }
    });
    for (const Result<>& each : done) MAILLE_CHECK(each);
    return {};
  }

  /// Chunks of all pieces of this rank, as they will stand in the file, and what the first rank needs to know
  /// of them for index and digest: type, size and checksum of each.
  struct Run {
    std::vector<std::byte> bytes, records;
  };
  template <class BytesOf>
  Result<Run> run_of(StreamKey key, BytesOf bytes_of) {
    Run run;
    const auto sink = memory_sink(run.bytes);
    FileWriter file = FileWriter::run(*sink);
    for (size_t i = 0; i < coded_.size(); ++i) {
      key.patch = joins_[i].piece;
      MAILLE_CHECK(file.write_stream(key, bytes_of(coded_[i])));
    }
    run.records.assign(file.records().begin(), file.records().end());
    return run;
  }

  /// Places in the file follow from sizes alone, so that all ranks write at once: front, pieces, numbers,
  /// back.
  Result<EncodeReport> write() {
    join_among_ranks(joins_, pieces_, coded_, ranks_);
    Run pieces = MAILLE_TRY(
        agree(ranks_, run_of({"PIEC"}, [](const PieceInWork& piece) { return encode_piece(piece.coded); })));
    Run numbers;
    uint64_t order_bytes = 0;
    if (coding_.kept()) {
      numbers = MAILLE_TRY(agree(ranks_, run_of({"GIDS"}, [&](const PieceInWork& piece) {
                                   std::vector<std::byte> bytes = encode_numbers(piece.numbers);
                                   order_bytes += bytes.size();
                                   return bytes;
                                 })));
    }
    EncodeReport report = sum_reports(order_bytes);
    const std::vector<PieceRecord> records = MAILLE_TRY(all_records());
    const Buffers of_pieces = to_first(ranks_, std::move(pieces.records));
    const Buffers of_numbers = to_first(ranks_, std::move(numbers.records));
    const std::vector<uint64_t> pieces_at = sums_before(ranks_, pieces.bytes.size());
    const std::vector<uint64_t> numbers_at = sums_before(ranks_, numbers.bytes.size());
    Ends ends = MAILLE_TRY(agree(ranks_, write_ends(of_pieces, of_numbers, records, report)));
    std::vector<uint64_t> sizes = {ends.front.size(), ends.back.size()};
    ranks_.add(sizes);  // nothing from others than the first rank
    const uint64_t end = sizes[0] + pieces_at.back() + numbers_at.back();
    const unsigned rank = ranks_.rank();
    const std::vector<RanksFile::Part> parts = {
        {0, ends.front},
        {sizes[0] + pieces_at[rank], pieces.bytes},
        {sizes[0] + pieces_at.back() + numbers_at[rank], numbers.bytes},
        {end, ends.back}};
    // Every rank names the front and the back; those of others than the first are empty.
    MAILLE_CHECK(file_.write(parts, end + sizes[1]));
    MAILLE_CHECK(file_.commit());
    report.file_bytes = end + sizes[1];
    set_other_bytes(report);
    return report;
  }

  /// What stands before and behind the pieces, made by the first rank: its writer counts the chunks of others
  /// without having their bytes.
  struct Ends {
    std::vector<std::byte> front, back;
  };
  Result<Ends> write_ends(const Buffers& of_pieces, const Buffers& of_numbers,
                          const std::vector<PieceRecord>& records, const EncodeReport& report) {
    Ends ends;
    if (ranks_.rank() != 0) return ends;
    std::vector<std::byte> bytes;
    const auto sink = memory_sink(bytes);
    FileWriter file = MAILLE_TRY(begin_file(*sink, coding_));
    const size_t front = bytes.size();
    for (const auto* runs : {&of_pieces, &of_numbers}) {
      for (const auto& run : *runs) MAILLE_CHECK(file.count_chunks(run));
    }
    MAILLE_CHECK(write_index(file, records));
    StreamTail tail = totals_.tail;
    tail.batches = pieces_;
    tail.errors = errors_of(report);
    MAILLE_CHECK(file.write_stream({"TAIL"}, encode_tail(tail)));
    MAILLE_TRY(file.finish());
    ends.front.assign(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(front));
    ends.back.assign(bytes.begin() + static_cast<ptrdiff_t>(front), bytes.end());
    return ends;
  }

  /// The index of all pieces, in all ranks: some hundred bytes each. Ranks have pieces in rising order, so
  /// that joining them by rank keeps it.
  Result<std::vector<PieceRecord>> all_records() const {
    ByteWriter mine;
    for (const PieceInWork& piece : coded_) {
      const std::vector<std::byte> packed = encode_index({piece.record});
      mine.put_count(packed.size());
      mine.put_bytes(packed);
    }
    std::vector<PieceRecord> records;
    for (const auto& buffer : to_all(ranks_, mine.bytes())) {
      for (ByteReader in(buffer); in.remaining() > 0;) {
        for (PieceRecord& record :
             MAILLE_TRY(decode_index(in.get_bytes(in.get_count()), plain_memory({}))).records)
          records.push_back(std::move(record));
      }
    }
    return records;
  }

  // What this rank's pieces took is added to sizes that all know, then all are added up.
  EncodeReport sum_reports(uint64_t order_bytes) const {
    EncodeReport report = totals_.report;
    for (const PieceInWork& piece : coded_) add_report(piece.report, report);
    report.order_bytes += order_bytes;
    add_reports_of_ranks(coding_, ranks_, report);
    return report;
  }

  const RankPart& part_;
  Ranks& ranks_;
  RanksFile& file_;
  RanksOptions how_;
  PieceCoding coding_;
  PartLayout layout_;
  RankTotals totals_;
  uint32_t pieces_ = 0;
  std::vector<PieceInWork> coded_;
  std::vector<PieceJoin> joins_;
};

}  // namespace

Result<EncodeReport> encode(const RankPart& part, Ranks& ranks, RanksFile& file, const EncodeOptions& options,
                            const RanksOptions& how) {
  const auto bad = [](const std::string& what) { return failure(ErrorCode::usage, what); };
  if (options.mode != Mode::stream) return bad("ranks write files of mode stream");
  if (how.cells_per_piece == 0) return bad("a piece must have room for a cell");
  if (part.mesh == nullptr) return bad("there is no part; give an empty mesh where a rank has none");
  return RanksEncoder(part, ranks, file, options, how).run();
}

}  // namespace maille
