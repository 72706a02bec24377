#include <maille/ranks.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <tuple>

#include "base/bytes.h"
#include "volume/pieces/in_rounds.h"
#include "volume/pieces/piece_coder.h"
#include "volume/pieces/piece_reader.h"
#include "volume/pieces/pieces_steps.h"
#include "volume/ranks/collective.h"
#include "volume/ranks/directory.h"
#include "volume/ranks/part_layout.h"
#include "volume/ranks/piece_exchange.h"
#include "volume/ranks/rank_maps.h"
#include "volume/stream/append_step.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/stream_file.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

/// Tuples of all elements of a domain, each in the rank that looks after its number, from where any rank can
/// ask for it.
struct Kept {
  const Directory* directory = nullptr;
  size_t size = 0;
  std::vector<std::byte> tuples;  ///< from directory->first() on

  const std::byte* tuple(uint64_t number) const {
    return tuples.data() + (number - directory->first()) * size;
  }
};

// Values without positions, which steps do not have.
Kept keep_points(const PointDirectory& points, const PartLayout& layout) {
  const size_t positions = layout.empty.points.tuple_size();
  Kept kept{&points.directory(), Tuples(layout.empty, Domain::point).size() - positions, {}};
  kept.tuples.resize(kept.size * kept.directory->count());
  for (size_t i = 0; i < kept.directory->count(); ++i)
    std::copy_n(points.tuple(i) + positions, kept.size, kept.tuples.data() + i * kept.size);
  return kept;
}

/// Cells live in the ranks that have them; their tuples go to those who look after their numbers.
Kept keep_cells(const RankPart& part, const PartLayout& layout, const Directory& cells, Ranks& ranks) {
  Kept kept{&cells, Tuples(layout.empty, Domain::cell).size(), {}};
  kept.tuples.resize(kept.size * cells.count());
  const Tuples tuples(*part.mesh, Domain::cell);
  std::vector<std::byte> tuple(kept.size);
  std::vector<ByteWriter> to(ranks.size());
  for (size_t i = 0; i < cells.numbers().size(); ++i) {
    tuples.read(i, tuple.data());
    ByteWriter& out = to[cells.owner(cells.numbers()[i])];
    out.put(cells.numbers()[i]);
    out.put_bytes(tuple);
  }
  for (const auto& buffer : ranks.exchange(buffers_of(to))) {
    for (ByteReader in(buffer); in.remaining() > 0;) {
      const uint64_t at = in.get<uint32_t>() - cells.first();
      std::copy_n(in.get_bytes(kept.size).data(), kept.size, kept.tuples.data() + at * kept.size);
    }
  }
  return kept;
}

/// Brings the tuples of elements, in their order, from those who keep them: questions there, answers back in
/// the order of the questions.
std::vector<std::byte> fetch(const Kept& kept, std::span<const uint32_t> elements, Ranks& ranks) {
  std::vector<ByteWriter> asked(ranks.size());
  for (const uint32_t element : elements) asked[kept.directory->owner(element)].put(element);
  Buffers answers;
  for (const auto& buffer : ranks.exchange(buffers_of(asked))) {
    ByteWriter out;
    for (ByteReader in(buffer); in.remaining() > 0;)
      out.put_bytes(Bytes(kept.tuple(in.get<uint32_t>()), kept.size));
    answers.push_back(out.take());
  }
  const Buffers found = ranks.exchange(std::move(answers));
  std::vector<size_t> at(ranks.size());
  std::vector<std::byte> tuples;
  tuples.reserve(elements.size() * kept.size);
  for (const uint32_t element : elements) {
    const unsigned owner = kept.directory->owner(element);
    const auto from = found[owner].begin() + static_cast<ptrdiff_t>(at[owner]++ * kept.size);
    tuples.insert(tuples.end(), from, from + static_cast<ptrdiff_t>(kept.size));
  }
  return tuples;
}

/// Takes what stands behind the values, up to the footer, and the footer apart: a file has none before all
/// else is there, so that it is written last, in a second step.
class EndSink final : public Sink {
 public:
  Result<> write(Bytes bytes) override {
    auto& to = is_footer_ ? footer : before;
    to.insert(to.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<> commit() override {
    is_footer_ = true;
    return {};
  }
  std::string name() const override { return "the end of a step"; }

  std::vector<std::byte> before, footer;

 private:
  bool is_footer_ = false;
};

/// Appends a step to a file in pieces from many ranks. Each rank codes the pieces that rank_of_piece() gives
/// it, however the parts are cut: pieces are those of the file.
class RanksAppender {
 public:
  RanksAppender(const Source& before, double time, const RankPart& part, Ranks& ranks, RanksFile& file,
                const EncodeOptions& options, const RanksOptions& how)
      : before_(before), part_(part), ranks_(ranks), file_(file), options_(options), how_(how) {
    step_.time = time;
  }

  Result<StepReport> run() {
    layout_ = MAILLE_TRY(agree_on_layout(part_, ranks_));
    StreamOptions stream = MAILLE_TRY(agree(ranks_, stream_options_of(layout_.empty, options_)));
    step_.arrays = stream.arrays;
    MAILLE_CHECK(agree(ranks_, open()));
    const PointDirectory points = MAILLE_TRY(PointDirectory::make(part_, ranks_));
    const Directory cells = MAILLE_TRY(number_cells(part_, layout_, ranks_));
    MAILLE_CHECK(check_counts(before_, target_, points.directory().total(), cells.total()));
    // Arrays that rise are looked for below, against those of the mesh.
    stream.any_order = true;  // numbers that rise are those of the mesh, or as others
    ArrayMapsList maps =
        MAILLE_TRY(choose_maps_among_ranks(part_, layout_, points, cells, stream, how_.sample_bytes, ranks_));
    step_.maps.assign(maps.maps.begin() + 1, maps.maps.end());
    step_.bounds.assign(maps.bounds.begin() + 1, maps.bounds.end());
    const Kept of_points = keep_points(points, layout_), of_cells = keep_cells(part_, layout_, cells, ranks_);
    find_same_numbers(of_points, of_cells);
    step_.errors.assign(step_.arrays.size(), 0);
    report_.number = number_;
    report_.array_bytes.resize(step_.arrays.size());
    MAILLE_CHECK(agree(ranks_, load_numbers()));
    fetch_values(of_points, of_cells);
    MAILLE_CHECK(agree(ranks_, code()));
    return write();
  }

 private:
  // Every rank opens the file, and finds the same; each reads only the pieces that it codes.
  Result<> open() {
    target_ = MAILLE_TRY(open_for_step(before_, step_));
    if ((target_.file->header().required_features & in_pieces_feature) == 0)
      return failure(ErrorCode::usage, before_.name() + ": is not in pieces; `maille append` takes it");
    number_ = count_steps(*target_.file) + 1;
    if (number_ > UINT32_MAX) return failure(ErrorCode::unsupported, "more steps than a file can hold");
    StepOptions with;
    if (!layout_.empty.metadata.empty()) with.metadata = layout_.empty.metadata;
    MAILLE_CHECK(set_metadata(*target_.file, target_.mesh, with, step_));
    reader_.emplace(MAILLE_TRY(PieceReader::open(before_, {})));
    return {};
  }

  /// As the function of this name has it for one process; each rank looks at the numbers that it keeps.
  void find_same_numbers(const Kept& of_points, const Kept& of_cells) {
    step_.codings.resize(step_.arrays.size());
    for (const NumberedArray& numbered : target_.mesh.description.numbered) {
      const StreamArray& known = target_.mesh.description.arrays[numbered.array];
      const RisingNumbers numbers(numbered, known.type);
      const Kept& kept = known.domain == Domain::point ? of_points : of_cells;
      for (size_t i = 0, offset_of_points = 0, offset_of_cells = 0; i < step_.arrays.size(); ++i) {
        const StreamArray& array = step_.arrays[i];
        size_t& offset = array.domain == Domain::point ? offset_of_points : offset_of_cells;
        const size_t size = size_of(array.type) * array.components;
        const size_t at = offset;
        offset += size;
        if (array.name != known.name || !are_alike(array, known)) continue;
        uint64_t others = 0;
        for (uint64_t k = 0; k < kept.directory->count() && others == 0; ++k) {
          std::array<std::byte, 8> expected{};
          numbers.store(kept.directory->first() + k, expected.data());
          const std::byte* const found = kept.tuples.data() + k * kept.size + at;
          others += !std::equal(found, found + size, expected.data());
        }
        if (sum_of(ranks_, others) == 0)
          step_.codings[i] = {StepCoding::as_mesh, static_cast<uint32_t>(numbered.array)};
      }
    }
  }

  /// The numbers in the file may be damaged: they are checked before they are sent as questions.
  Result<> load_numbers() {
    const auto count = static_cast<uint32_t>(reader_->pieces().size());
    for (uint32_t piece = 0; piece < count; ++piece) {
      if (rank_of_piece(piece, count, ranks_.size()) != ranks_.rank()) continue;
      const PieceNumbers numbers = MAILLE_TRY(reader_->read_numbers(piece));
      const auto is_there = [](const std::vector<uint32_t>& all, uint64_t total) {
        return std::all_of(all.begin(), all.end(), [&](uint32_t number) { return number < total; });
      };
      if (!is_there(numbers.points, target_.tail.points) || !is_there(numbers.cells, target_.tail.cells))
        return failure(ErrorCode::corrupt, "a piece has points or cells that the mesh has not");
      mine_.push_back(piece);
      arrays_.push_back(arrays_of_piece(step_.arrays, numbers));
      points_.insert(points_.end(), numbers.points.begin(), numbers.points.end());
      cells_.insert(cells_.end(), numbers.cells.begin(), numbers.cells.end());
    }
    return {};
  }

  // All pieces of this rank at once: two exchanges for points and two for cells, however many pieces there
  // are.
  void fetch_values(const Kept& of_points, const Kept& of_cells) {
    for (const auto& [domain, kept, elements] :
         {std::tuple(Domain::point, &of_points, &points_), std::tuple(Domain::cell, &of_cells, &cells_)}) {
      const std::vector<std::byte> tuples = fetch(*kept, *elements, ranks_);
      const std::byte* from = tuples.data();
      for (std::vector<Array>& arrays : arrays_) {
        std::vector<Array*> wanted;
        for (Array& array : arrays) {
          if (array.domain == domain) wanted.push_back(&array);
        }
        const uint64_t count = wanted.empty() ? 0 : wanted[0]->count();
        for (uint64_t i = 0; i < count; ++i, from += kept->size) put_tuple(wanted, i, from);
      }
    }
  }

  Result<> code() {
    // As append_to_pieces(): all side by side have their streams in memory.
    constexpr size_t at_once = 4;
    Executor& executor = options_.executor ? *options_.executor : serial_executor();
    const auto sink = memory_sink(values_);
    FileWriter run = FileWriter::run(*sink);
    MAILLE_CHECK((in_rounds<StepOfPiece, CodedStepOfPiece>(
        executor, mine_.size(), at_once,
        [&](size_t i) -> Result<StepOfPiece> {
          return StepOfPiece{MAILLE_TRY(reader_->read_stream(mine_[i], number_)), std::move(arrays_[i])};
        },
        [&](size_t, const StepOfPiece& piece) { return code_step_of_piece(piece, step_, {}); },
        [&](size_t i, const CodedStepOfPiece& coded) -> Result<> {
          for (size_t k = 0; k < step_.arrays.size(); ++k) {
            report_.array_bytes[k] += coded.report.array_bytes[k];
            step_.errors[k] = std::max(step_.errors[k], coded.report.errors[k]);
          }
          fields_.push_back(coded.fields);
          return run.write_stream(key_of_step(number_, mine_[i]), coded.bytes);
        })));
    // Sizes and sums of chunks: what the first rank's writer needs of them.
    records_.assign(run.records().begin(), run.records().end());
    return {};
  }

  /// Values first, then what makes them count: a step that was cut off is not there for a reader.
  Result<StepReport> write() {
    ranks_.add(report_.array_bytes);
    std::vector<uint64_t> errors(
        step_.errors.size());  // as bits, which rise with numbers that are not negative
    // Bits of doubles that are not negative rise with them, so that the largest can be found as integers.
    std::copy_n(std::as_bytes(std::span(step_.errors)).begin(), errors.size() * sizeof(double),
                std::as_writable_bytes(std::span(errors)).begin());
    ranks_.largest(errors);
    std::copy_n(std::as_bytes(std::span(errors)).begin(), errors.size() * sizeof(double),
                std::as_writable_bytes(std::span(step_.errors)).begin());
    const Buffers records = to_first(ranks_, std::move(records_));
    const Buffers fields =
        to_first(ranks_, fields_.empty() ? std::vector<std::byte>() : encode_step_index(fields_));
    const std::vector<uint64_t> values_at = sums_before(ranks_, values_.size());
    EndSink end;
    MAILLE_CHECK(agree(ranks_, ranks_.rank() == 0 ? write_end(records, fields, end) : Result<>()));
    std::vector<uint64_t> sizes = {end.before.size(), end.footer.size()};
    ranks_.add(sizes);  // nothing from others than the first rank
    const uint64_t first = target_.file->end(), behind = first + values_at.back();
    const std::vector<RanksFile::Part> parts = {{first + values_at[ranks_.rank()], values_},
                                                {behind, end.before}};
    MAILLE_CHECK(file_.write(parts, behind + sizes[0]));
    const std::vector<RanksFile::Part> footer = {{behind + sizes[0], end.footer}};
    report_.file_bytes = behind + sizes[0] + sizes[1];
    MAILLE_CHECK(file_.write(footer, report_.file_bytes));
    MAILLE_CHECK(file_.commit());
    report_.errors = step_.errors;
    return report_;
  }

  // By the first rank alone; fields of pieces come by rank, and so in the order of pieces.
  Result<> write_end(const Buffers& records, const Buffers& fields, EndSink& end) {
    FileWriter writer = FileWriter::resume(end, target_.file->end(), target_.file->digest());
    for (const auto& run : records) MAILLE_CHECK(writer.count_chunks(run));
    std::vector<std::vector<PieceField>> all;
    for (const auto& some : fields) {
      if (some.empty()) continue;
      for (auto& piece : MAILLE_TRY(decode_step_index(some, plain_memory({}))).records)
        all.push_back(std::move(piece));
    }
    MAILLE_CHECK(write_step_end(writer, number_, all, step_));
    MAILLE_TRY(writer.finish());
    return {};
  }

  const Source& before_;
  const RankPart& part_;
  Ranks& ranks_;
  RanksFile& file_;
  const EncodeOptions& options_;
  RanksOptions how_;
  StepHeader step_;
  PartLayout layout_;
  StepTarget target_;
  uint64_t number_ = 0;
  std::optional<PieceReader> reader_;
  std::vector<uint32_t> mine_;              ///< pieces of this rank
  std::vector<std::vector<Array>> arrays_;  ///< by piece of this rank
  std::vector<uint32_t> points_, cells_;    ///< of these pieces, one after the other
  std::vector<std::byte> values_, records_;
  std::vector<std::vector<PieceField>> fields_;
  StepReport report_;
};

}  // namespace

Result<StepReport> append_step(const Source& before, double time, const RankPart& part, Ranks& ranks,
                               RanksFile& file, const EncodeOptions& options, const RanksOptions& how) {
  if (part.mesh == nullptr)
    return failure(ErrorCode::usage, "there is no part; give an empty mesh where a rank has none");
  return RanksAppender(before, time, part, ranks, file, options, how).run();
}

}  // namespace maille
