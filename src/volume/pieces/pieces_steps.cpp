#include "volume/pieces/pieces_steps.h"

#include <algorithm>

#include "base/result.h"
#include "volume/pieces/in_rounds.h"
#include "volume/pieces/piece_reader.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

/// The values of a piece, as arrays of a mesh.
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
    // All side by side have their streams and their values in memory.
    constexpr size_t at_once = 4;
    Executor& executor = options_.executor ? *options_.executor : serial_executor();
    MAILLE_CHECK((in_rounds<Piece, Coded>(
        executor, reader_.pieces().size(), at_once,
        [&](size_t piece) { return load(static_cast<uint32_t>(piece)); },
        [&](size_t, const Piece& piece) { return code(piece); },
        [&](size_t piece, const Coded& coded) { return take(static_cast<uint32_t>(piece), coded); })));
    for (size_t first = 0; first < fields_.size(); first += pieces_per_page) {
      const auto count = static_cast<ptrdiff_t>(std::min<size_t>(pieces_per_page, fields_.size() - first));
      const auto from = fields_.begin() + static_cast<ptrdiff_t>(first);
      const StreamKey key = {"SIDX", static_cast<uint32_t>(number_),
                             static_cast<uint32_t>(first / pieces_per_page)};
      MAILLE_CHECK(writer_.write_stream(key, encode_step_index({from, from + count})));
    }
    const StreamKey key{"STEP", static_cast<uint32_t>(number_), 0};
    MAILLE_CHECK(writer_.write_stream(key, MAILLE_TRY(encode_step(step_))));
    report_.errors = step_.errors;
    report_.file_bytes = MAILLE_TRY(writer_.finish());
    return report_;
  }

 private:
  struct Piece {
    std::vector<std::byte> stream;  ///< with the steps before, of the group
    std::vector<Array> arrays;
  };
  struct Coded {
    std::vector<std::byte> bytes;
    StepReport report;
    std::vector<PieceField> fields;
  };

  Result<Piece> load(uint32_t number) {
    Piece piece;
    const PieceNumbers numbers = MAILLE_TRY(reader_.read_numbers(number));
    piece.stream = MAILLE_TRY(reader_.read_stream(number, number_));
    for (size_t i = 0; i < step_.arrays.size(); ++i) {
      const StreamArray& described = step_.arrays[i];
      Array& array = piece.arrays.emplace_back(
          make_array(described.name, described.domain, described.type, described.components, described.role));
      const auto& elements = described.domain == Domain::point ? numbers.points : numbers.cells;
      array.resize(elements.size());
      std::byte* out = array.bytes.data();
      for (const uint32_t element : elements) {
        MAILLE_CHECK(values_.read(i, element, out));
        out += array.tuple_size();
      }
    }
    return piece;
  }

  Result<Coded> code(const Piece& piece) const {
    Coded coded;
    std::vector<Array> arrays = piece.arrays;
    StepHeader step = step_;
    step.codings.assign(step.arrays.size(), {});
    step.metadata.reset();
    for (size_t i = 0; i < arrays.size(); ++i) {
      const bool by_size = !step.maps[i].empty() && step.maps[i][0].kind == NumberMap::Kind::logarithm;
      coded.fields.push_back(describe_field(arrays[i], {step.bounds[i], by_size}));
      // Numbers of the mesh, which the piece has zeros for, too.
      if (step_.codings[i].method == StepCoding::as_mesh)
        std::fill(arrays[i].bytes.begin(), arrays[i].bytes.end(), std::byte{0});
    }
    StepOptions options = options_;
    options.executor = nullptr;
    PieceValues values(arrays);
    const auto source = memory_source(Bytes(piece.stream));
    coded.bytes = MAILLE_TRY(step_behind(*source, std::move(step), values, options, coded.report));
    return coded;
  }

  Result<> take(uint32_t number, const Coded& coded) {
    const StreamKey key = {"SVAL", static_cast<uint32_t>(number_), number};
    MAILLE_CHECK(writer_.write_stream(key, inverted(coded.bytes)));
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

Result<StepReport> append_to_pieces(const std::string& path, const Source& source, const FileReader& file,
                                    StepHeader step, StepSource& values, const StepOptions& options) {
  const uint64_t number = count_steps(file) + 1;
  if (number > UINT32_MAX) return failure(ErrorCode::unsupported, "more steps than a file can hold");
  DecodeOptions reading;
  reading.limits = options.limits;
  const PieceReader reader = MAILLE_TRY(PieceReader::open(source, reading));
  const std::unique_ptr<Sink> sink = MAILLE_TRY(append_sink(path, file.end()));
  PiecesStepWriter writer(reader, step, number, values, options,
                          FileWriter::resume(*sink, file.end(), file.digest()));
  const StepReport report = MAILLE_TRY(writer.write());
  MAILLE_CHECK(sink->commit());
  return report;
}

}  // namespace maille
