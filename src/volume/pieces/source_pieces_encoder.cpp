// encode() of a mesh that is read in parts, into pieces.
#include <maille/out_of_core.h>

#include <algorithm>
#include <array>

#include "base/pace.h"
#include "base/result.h"
#include "container/file_writer.h"
#include "numbers/number_space.h"
#include "surface/arrays/array_report.h"
#include "volume/order/working_memory.h"
#include "volume/pieces/in_rounds.h"
#include "volume/pieces/piece_coder.h"
#include "volume/pieces/pieces_file.h"
#include "volume/pieces/source_pieces.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/source_report.h"
#include "volume/stream/source_sample.h"

namespace maille {
namespace {

/// Positions as decoders will have them, one by one: what shared points are known by. Without loss these are
/// the positions themselves.
class DecodedPlaces {
 public:
  DecodedPlaces(MeshSource& mesh, const ArrayMapsList& maps, uint64_t memory)
      : points_(mesh, memory, false),
        array_{mesh.description().point_type, 3, maps.maps[0], maps.bounds[0]},
        position_(make_array("", Domain::point, mesh.description().point_type, 3)) {
    position_.resize(1);
    for (const NumberMap& map : array_.maps) spaces_.emplace_back(array_.type, map);
  }
  Result<Place> of(uint64_t point) {
    MAILLE_CHECK(points_.read(point, position_.bytes.data()));
    for (unsigned k = 0; k < 3 && array_.bound > 0; ++k)
      decode(position_.bytes.data() + k * size_of(array_.type), k);
    return place_of(position_, 0);
  }

 private:
  /// What does not keep the bound on the lattice is coded as it is.
  void decode(std::byte* number, unsigned k) const {
    double error = 0;
    const int64_t code = spaces_[k].code_of(number);
    if (keeps(array_, spaces_[k], number, code, error)) spaces_[k].store_number(code, number);
  }
  SourcePoints points_;
  StreamedArray array_;
  std::vector<NumberSpace> spaces_;
  Array position_;
};

/// Shared points of a piece, by their places in its coded order, rising. Both lists rise by number, so that
/// each is a search.
std::vector<SharedPoint> in_coded_order(const std::vector<SharedPoint>& shared,
                                        const std::vector<uint32_t>& points,
                                        const std::vector<uint32_t>& coded_points) {
  std::vector<SharedPoint> coded;
  for (uint32_t i = 0; i < coded_points.size(); ++i) {
    const auto place = static_cast<uint32_t>(std::lower_bound(points.begin(), points.end(), coded_points[i]) -
                                             points.begin());
    const auto at = std::lower_bound(shared.begin(), shared.end(), place,
                                     [](const SharedPoint& a, uint32_t b) { return a.point < b; });
    if (at != shared.end() && at->point == place) coded.push_back({i, at->copy});
  }
  return coded;
}

class SourcePiecesEncoder {
 public:
  SourcePiecesEncoder(MeshSource& mesh, const EncodeOptions& options, const WorkingSpace& space)
      : mesh_(mesh), options_(options), space_(space), pieces_(mesh, space, options) {}

  // The order of steps bounds memory: the sample is gone before cells are distributed.
  Result<EncodeReport> run(Sink& sink, uint64_t target) {
    coding_.options = options_;
    coding_.cells = mesh_.description().cells;
    coding_.stream = MAILLE_TRY(stream_options_of(mesh_.description(), options_));
    coding_.maps = MAILLE_TRY(choose_source_maps(mesh_, coding_.stream, std::nullopt));
    if (coding_.kept()) set_numbered(MAILLE_TRY(find_numbered(mesh_)), coding_.maps);
    MAILLE_CHECK(check_space(target));
    MAILLE_CHECK(pieces_.cut(target));
    MAILLE_CHECK(share());
    file_.emplace(MAILLE_TRY(begin_file(sink, coding_)));
    report_ = report_of(mesh_.description());
    MAILLE_CHECK(code_all());
    MAILLE_CHECK(write_rest());
    report_.file_bytes = MAILLE_TRY(file_->finish());
    MAILLE_CHECK(sink.commit());
    set_other_bytes(report_);
    return std::move(report_);
  }

 private:
  /// What a piece leaves behind.
  struct Coded {
    std::vector<std::byte> piece, numbers;
    PieceRecord record;
    EncodeReport report;
    CellTotals totals;
  };

  /// What a cell takes in bytes in a piece that is coded, about: the peak for hexahedra with doubles, one
  /// thread, was 244.
  uint64_t bytes_of_cell() const {
    const MeshDescription& mesh = mesh_.description();
    const uint64_t corners = mesh.corners / std::max<uint64_t>(mesh.cells, 1) + 1;
    uint64_t bytes = 150 + 12 * corners;
    for (const Array& array : mesh.arrays) bytes += 4 * array.tuple_size();
    return bytes;
  }
  /// Finds how many pieces can be coded at once: as many as there is room for, four at most. Error:
  /// memory_bound, where there is none for one. Also sets aside 1,024 bytes for each piece: buffers of its
  /// lists, and its line of the index.
  Result<> check_space(uint64_t target) {
    constexpr uint64_t usual = 4;
    const uint64_t piece = std::min(target, mesh_.description().cells) * bytes_of_cell();
    const uint64_t pieces = mesh_.description().cells / target + 1,
                   besides = working_memory(space_) + pieces * 1024;
    MAILLE_CHECK(
        check_limit(space_, piece + pieces * 1024, "coding pieces of " + std::to_string(target) + " cells"));
    if (space_.limit == ~uint64_t{0}) {
      at_once_ = usual;
      return {};
    }
    space_.memory =
        std::min(space_.memory, (space_.limit - std::min(space_.limit, WorkingSpace::of_process)) / 4);
    const uint64_t left = space_.limit - std::min(space_.limit, WorkingSpace::of_process + besides);
    at_once_ = static_cast<size_t>(std::clamp<uint64_t>(left / std::max<uint64_t>(piece, 1), 1, usual));
    return {};
  }

  Result<> share() {
    DecodedPlaces places(mesh_, coding_.maps, working_memory(space_) / 4);
    return pieces_.share([&](uint64_t point) { return places.of(point); });
  }

  Result<> code_all() {
    const size_t count = pieces_.count();
    numbers_ = MAILLE_TRY(ScratchLists::create(space_.folder, count, 0));
    return in_rounds<SourcePieces::Raw, Coded>(
        options_.executor ? *options_.executor : serial_executor(), count, at_once_,
        [&](size_t piece) { return pieces_.read(piece); },
        [&](size_t, SourcePieces::Raw raw) { return code(std::move(raw)); },
        [&](size_t piece, const Coded& coded) -> Result<> {
          MAILLE_CHECK(write(static_cast<uint32_t>(piece), coded));
          const double share = static_cast<double>(piece + 1) / static_cast<double>(count);
          return options_.progress && !options_.progress({"cells", share}) ? cancelled() : Result<>();
        });
  }

  // By any thread; nothing here is shared but what does not change.
  Result<Coded> code(SourcePieces::Raw raw) const {
    SourcePieces::Loaded loaded = MAILLE_TRY(pieces_.load(std::move(raw)));
    const std::vector<uint32_t> points = loaded.sub.points;
    Coded coded;
    coded.totals = count_cells(loaded.sub.mesh);
    PieceInWork work = MAILLE_TRY(code_piece(coding_, std::move(loaded.sub), std::move(loaded.cells)));
    const std::vector<SharedPoint> shared = in_coded_order(loaded.shared, points, work.coded_points);
    work.coded.shared =
        encode_shared(shared, static_cast<uint32_t>(points.size()), work.border, work.on_side);
    coded.piece = encode_piece(work.coded);
    if (coding_.kept()) coded.numbers = encode_numbers(work.numbers);
    coded.record = std::move(work.record);
    coded.report = std::move(work.report);
    return coded;
  }

  /// Pieces are written in order; numbers stand behind all of them, so they wait in a temporary file.
  Result<> write(uint32_t number, const Coded& coded) {
    MAILLE_CHECK(file_->write_stream({"PIEC", number, 0}, coded.piece));
    MAILLE_CHECK(numbers_->append(number, coded.numbers));
    report_.order_bytes += coded.numbers.size();
    add_report(coded.report, report_);
    add_totals(coded.totals, totals_);
    records_.push_back(coded.record);
    return {};
  }

  Result<> write_rest() {
    const auto count = static_cast<uint32_t>(records_.size());
    for (uint32_t p = 0; p < count && coding_.kept(); ++p)
      MAILLE_CHECK(file_->write_stream({"GIDS", p, 0}, MAILLE_TRY(numbers_->read(p))));
    MAILLE_CHECK(write_index(*file_, records_));
    return file_->write_stream({"TAIL"}, encode_tail(MAILLE_TRY(tail())));
  }

  /// What the file's end says. Ranges come from one more reading of points and arrays, as pieces share
  /// points.
  Result<StreamTail> tail() {
    const MeshDescription& mesh = mesh_.description();
    StreamTail tail;
    tail.points = mesh.points;
    tail.cells = mesh.cells;
    tail.batches = records_.size();
    for (size_t b = 0; b < mesh.blocks.size(); ++b)
      tail.blocks.push_back({mesh.blocks[b].name, pieces_.block_types()[b], mesh.blocks[b].cells});
    set_totals(totals_, tail);
    const Array positions = make_array("", Domain::point, mesh.point_type, 3);
    const auto read_points = [&](uint64_t first, uint64_t some, std::span<std::byte> out) {
      return mesh_.read_points(first, some, out);
    };
    tail.ranges.push_back(MAILLE_TRY(range_of(positions, mesh.points, read_points)));
    for (size_t i = 0; i < mesh.arrays.size(); ++i) {
      const auto read_array = [&](uint64_t first, uint64_t some, std::span<std::byte> out) {
        return mesh_.read_array(i, first, some, out);
      };
      tail.ranges.push_back(MAILLE_TRY(range_of(mesh.arrays[i], mesh.count_of(mesh.arrays[i]), read_array)));
    }
    unsign_zeros(tail);
    tail.errors = errors_of(report_);
    return tail;
  }
  /// The range of all tuples, each once: pieces have some twice, and NaN are counted.
  template <class Read>
  static Result<ValueRange> range_of(const Array& array, uint64_t count, Read read) {
    constexpr uint64_t at_once = 4096;
    ValueRange range;
    widen(range, array.type, array.components, {});
    std::vector<std::byte> bytes;
    for (uint64_t first = 0; first < count; first += at_once) {
      bytes.resize(std::min(at_once, count - first) * array.tuple_size());
      MAILLE_CHECK(read(first, bytes.size() / array.tuple_size(), bytes));
      widen(range, array.type, array.components, bytes);
    }
    return range;
  }

  MeshSource& mesh_;
  const EncodeOptions& options_;
  WorkingSpace space_;
  SourcePieces pieces_;
  PieceCoding coding_;
  std::optional<FileWriter> file_;
  std::optional<ScratchLists> numbers_;
  size_t at_once_ = 1;
  std::vector<PieceRecord> records_;
  CellTotals totals_;
  EncodeReport report_;
};

}  // namespace

Result<EncodeReport> encode_in_pieces(MeshSource& mesh, Sink& sink, const EncodeOptions& options,
                                      uint64_t target, const WorkingSpace& space) {
  if (target == 0) return failure(ErrorCode::usage, "a piece must have room for a cell");
  if (space.delay > 0)
    return failure(ErrorCode::usage, "pieces are put in order as a whole, so cells need no delay");
  return SourcePiecesEncoder(mesh, options, space).run(sink, target);
}

}  // namespace maille
