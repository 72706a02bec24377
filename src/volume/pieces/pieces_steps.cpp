#include "volume/pieces/pieces_steps.h"

#include <algorithm>

#include "base/result.h"
#include "volume/pieces/in_rounds.h"
#include "volume/pieces/piece_reader.h"
#include "volume/stream/append_step.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

/// The values of a piece, as arrays of a mesh; numbers are places in these.
class PieceValues final : public StepSource {
 public:
  explicit PieceValues(const std::vector<Array>& arrays) : arrays_(arrays) {}
  Result<> read(size_t array, uint64_t number, std::byte* out) override {
    const size_t size = arrays_[array].tuple_size();
    std::copy_n(arrays_[array].bytes.data() + number * size, size, out);
    return {};
  }

 private:
  const std::vector<Array>& arrays_;
};

// Appends one step to a file in pieces: pieces side by side, in order, then the index of the step and the
// step itself.
class PiecesStepWriter {
 public:
  PiecesStepWriter(const PieceReader& reader, StepHeader& step, uint64_t number, StepSource& values,
                   const StepOptions& options, FileWriter writer)
      : reader_(reader),
        step_(step),
        number_(number),
        values_(values),
        options_(options),
        writer_(std::move(writer)) {
    report_.number = number;
    report_.array_bytes.resize(step.arrays.size());
  }

  Result<StepReport> write() {
    // How many pieces are coded at once: all side by side have their streams and their values in memory.
    constexpr size_t at_once = 4;
    Executor& executor = options_.executor ? *options_.executor : serial_executor();
    MAILLE_CHECK((in_rounds<StepOfPiece, CodedStepOfPiece>(
        executor, reader_.pieces().size(), at_once,
        [&](size_t piece) { return load(static_cast<uint32_t>(piece)); },
        [&](size_t, const StepOfPiece& piece) { return code_step_of_piece(piece, step_, options_); },
        [&](size_t piece, const CodedStepOfPiece& coded) {
          return take(static_cast<uint32_t>(piece), coded);
        })));
    MAILLE_CHECK(write_step_end(writer_, number_, fields_, step_));
    report_.errors = step_.errors;
    report_.file_bytes = MAILLE_TRY(writer_.finish());
    return report_;
  }

 private:
  /// By one thread: `values` may be a file, and is read in the order of the piece's numbers, which rise.
  Result<StepOfPiece> load(uint32_t number) {
    StepOfPiece piece;
    const PieceNumbers numbers = MAILLE_TRY(reader_.read_numbers(number));
    piece.stream = MAILLE_TRY(reader_.read_stream(number, number_));
    piece.arrays = arrays_of_piece(step_.arrays, numbers);
    for (size_t i = 0; i < step_.arrays.size(); ++i) {
      Array& array = piece.arrays[i];
      std::byte* out = array.bytes.data();
      for (const uint32_t element : array.domain == Domain::point ? numbers.points : numbers.cells) {
        MAILLE_CHECK(values_.read(i, element, out));
        out += array.tuple_size();
      }
    }
    return piece;
  }

  // In the order of pieces, so that the file does not depend on threads.
  Result<> take(uint32_t number, const CodedStepOfPiece& coded) {
    MAILLE_CHECK(writer_.write_stream(key_of_step(number_, number), coded.bytes));
    for (size_t i = 0; i < step_.arrays.size(); ++i) {
      report_.array_bytes[i] += coded.report.array_bytes[i];
      step_.errors[i] = std::max(step_.errors[i], coded.report.errors[i]);
    }
    fields_.push_back(coded.fields);
    return {};
  }

  const PieceReader& reader_;
  StepHeader& step_;
  uint64_t number_;
  StepSource& values_;
  const StepOptions& options_;
  FileWriter writer_;
  StepReport report_;
  std::vector<std::vector<PieceField>> fields_;  ///< by piece
};

}  // namespace

std::vector<Array> arrays_of_piece(const std::vector<StreamArray>& described, const PieceNumbers& numbers) {
  std::vector<Array> arrays;
  for (const StreamArray& one : described) {
    Array& array = arrays.emplace_back(make_array(one.name, one.domain, one.type, one.components, one.role));
    array.resize(one.domain == Domain::point ? numbers.points.size() : numbers.cells.size());
  }
  return arrays;
}

Result<CodedStepOfPiece> code_step_of_piece(const StepOfPiece& piece, StepHeader step,
                                            const StepOptions& options) {
  CodedStepOfPiece coded;
  std::vector<Array> arrays = piece.arrays;
  for (size_t i = 0; i < arrays.size(); ++i) {
    // The index must hold for decoded values, hence the bound.
    const bool by_size = !step.maps[i].empty() && step.maps[i][0].kind == NumberMap::Kind::logarithm;
    coded.fields.push_back(describe_field(arrays[i], {step.bounds[i], by_size}));
    // Numbers of the mesh, which the piece has zeros for, too.
    if (step.codings[i].method == StepCoding::as_mesh)
      std::fill(arrays[i].bytes.begin(), arrays[i].bytes.end(), std::byte{0});
  }
  // The step in the piece codes values by itself; what refers to the mesh stands in the step of the whole
  // file.
  step.codings.assign(step.arrays.size(), {});
  step.metadata.reset();
  StepOptions own = options;
  // Threads are at the pieces already.
  own.executor = nullptr;
  PieceValues values(arrays);
  const auto source = memory_source(Bytes(piece.stream));
  coded.bytes = inverted(MAILLE_TRY(step_behind(*source, std::move(step), values, own, coded.report)));
  return coded;
}

Result<> write_step_end(FileWriter& writer, uint64_t number,
                        const std::vector<std::vector<PieceField>>& fields, const StepHeader& step) {
  for (size_t first = 0; first < fields.size(); first += pieces_per_page) {
    const auto count = static_cast<ptrdiff_t>(std::min<size_t>(pieces_per_page, fields.size() - first));
    const auto from = fields.begin() + static_cast<ptrdiff_t>(first);
    const StreamKey key = {"SIDX", static_cast<uint32_t>(number),
                           static_cast<uint32_t>(first / pieces_per_page)};
    MAILLE_CHECK(writer.write_stream(key, encode_step_index({from, from + count})));
  }
  const StreamKey key{"STEP", static_cast<uint32_t>(number), 0};
  return writer.write_stream(key, MAILLE_TRY(encode_step(step)));
}

Result<StepReport> append_to_pieces(const std::string& path, const Source& source, const FileReader& file,
                                    StepHeader step, StepSource& values, const StepOptions& options) {
  const uint64_t number = count_steps(file) + 1;
  if (number > UINT32_MAX) return failure(ErrorCode::unsupported, "more steps than a file can hold");
  DecodeOptions reading;
  reading.limits = options.limits;
  // The index of the mesh tells how many points and cells each piece has.
  const PieceReader reader = MAILLE_TRY(PieceReader::open(source, reading));
  const std::unique_ptr<Sink> sink = MAILLE_TRY(append_sink(path, file.end()));
  PiecesStepWriter writer(reader, step, number, values, options,
                          FileWriter::resume(*sink, file.end(), file.digest()));
  const StepReport report = MAILLE_TRY(writer.write());
  MAILLE_CHECK(sink->commit());
  return report;
}

}  // namespace maille
