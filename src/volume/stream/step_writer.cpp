// The values of one step of time as chunks. docs/format.md, 16.9.
#include "volume/stream/step_writer.h"

#include <algorithm>

#include "base/result.h"
#include "volume/stream/cell_replay.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/step_chain.h"
#include "volume/values/array_stage.h"

namespace maille {
namespace {

/// One way to code an array of a step: by itself, as differences, or expected from the step before, too. All
/// batches are coded, so that the smallest one can be chosen: where little changes, or all by noise,
/// differences are smaller by up to a fifth; elsewhere what follows is, by 5 to 20 %, and is hardly ever
/// larger than alone. The coded bytes of all ways are held until then.
struct CodedArray {
  size_t array;
  ArrayStage<RansEncoder> stage;
  const Partner* partner = nullptr;  ///< of differences, or to follow
  bool follows = false;
  size_t at = 0;  ///< bytes of the partner that have been used
  std::vector<std::byte> tuples = {};
  std::vector<std::pair<uint32_t, std::vector<std::byte>>> batches = {};
  uint64_t bytes = 0;
};

class StepWriter {
 public:
  StepWriter(const FileReader& file, const StreamHeader& mesh, StepHeader& step, uint64_t number,
             const std::vector<Partner>& partners, StepSource& values, const StepOptions& options,
             FileWriter writer)
      : step_(step),
        file_(file),
        number_(number),
        values_(values),
        executor_(options.executor ? *options.executor : serial_executor()),
        replay_(file, mesh, options.limits),
        positions_(ValueChain::of_mesh(mesh, {})),
        position_type_(mesh.description.positions.type),
        writer_(std::move(writer)) {
    for (size_t i = 0; i < step.arrays.size(); ++i) {
      if (step.codings[i].method == StepCoding::alone)
        ways_.push_back({i, {step.array(i, mesh), step.arrays[i].domain}});
    }
    for (const Partner& partner : partners) {
      const StreamArray& array = step.arrays[partner.array];
      if (partner.on_lattice)
        ways_.push_back({partner.array, {differences_of(array, mesh), array.domain}, &partner});
      if (!partner.follows) continue;
      StreamedArray following = step.array(partner.array, mesh);
      following.follows = true;
      ways_.push_back({partner.array, {following, array.domain}, &partner, true});
    }
    for (const CodedArray& way : ways_) is_placed_ = is_placed_ || way.stage.is_placed();
    tuples_.resize(step.arrays.size());
    report_.array_bytes.resize(step.arrays.size());
  }

  Result<StepReport> write() {
    while (MAILLE_TRY(replay_.next_batch())) MAILLE_CHECK(code_batch());
    for (const CodedArray& way : ways_) {
      if (is_chosen(way)) MAILLE_CHECK(write_array(way));
    }
    // The header comes last: errors are known now, and a step is there only if all that it speaks of is.
    const StreamKey key{"STEP", static_cast<uint32_t>(number_), 0};
    MAILLE_CHECK(writer_.write_stream(key, MAILLE_TRY(encode_step(step_))));
    report_.number = number_;
    report_.errors = step_.errors;
    report_.file_bytes = MAILLE_TRY(writer_.finish());
    return report_;
  }

 private:
  Result<> code_batch() {
    for (CodedArray& way : ways_) way.stage.begin_batch(RansEncoder(way.stage.lanes()));
    // Positions are decoded again only where some way of coding needs them.
    if (is_placed_) MAILLE_CHECK(begin_positions());
    while (MAILLE_TRY(replay_.next_block(cells_))) {
      MAILLE_CHECK(take_values());
      if (is_placed_) MAILLE_CHECK(find_places_of_block());
      executor_.parallel_for(ways_.size(), [&](size_t i) { code_block(ways_[i]); });
      first_cell_ += cells_.size();
    }
    for (CodedArray& way : ways_) {
      const BatchHeader& batch = replay_.batch();
      if ((way.stage.domain() == Domain::point ? batch.points : batch.cells) == 0) continue;
      way.batches.emplace_back(replay_.batch_number(), way.stage.coder().finish());
      way.bytes += way.batches.back().second.size();
    }
    return {};
  }
  void code_block(CodedArray& way) {
    std::vector<std::byte>& tuples = tuples_[way.array];
    if (way.partner == nullptr) {
      way.stage.code(cells_, places_, tuples.data());
      return;
    }
    const Scalar type = step_.arrays[way.array].type;
    const Bytes before = Bytes(way.partner->before).subspan(way.at, tuples.size());
    way.at += tuples.size();
    if (way.follows) {
      way.stage.code(cells_, places_, tuples.data(), before.data());
      return;
    }
    way.tuples.resize(tuples.size() / size_of(type) *
                      size_of(size_of(type) == 8 ? Scalar::i64 : Scalar::i32));
    find_differences(type, way.partner->maps, before, tuples, way.tuples.data());
    way.stage.code(cells_, places_, way.tuples.data());
  }
  Result<> begin_positions() {
    if (replay_.batch().points == 0) {
      positions_.begin_empty_batch();
      return {};
    }
    const std::vector<std::byte> bytes = MAILLE_TRY(file_.read_stream({"POSI", replay_.batch_number(), 0}));
    // A mesh without points in this batch has no such chunk.
    return positions_.begin_batch(bytes, nullptr, replay_.batch_number());
  }
  Result<> find_places_of_block() {
    std::vector<std::byte> positions(cells_.points.size() * positions_.tuple_size());
    if (!positions_.code(cells_, {}, positions.data()))
      return failure(ErrorCode::corrupt, "the positions of the mesh are damaged");
    find_places(position_type_, positions, places_);
    return {};
  }
  // Values in the order in which the stream has points and cells. Sources are asked by number, in an order
  // that is local where the mesh's is.
  Result<> take_values() {
    // Arrays that an earlier step serves need no values.
    for (size_t i = 0; i < tuples_.size(); ++i) {
      if (step_.codings[i].method != StepCoding::alone) continue;
      const bool points = step_.arrays[i].domain == Domain::point;
      const size_t size = step_.arrays[i].tuple_size();
      const size_t count = points ? cells_.points.size() : cells_.size();
      tuples_[i].resize(count * size);
      for (size_t k = 0; k < count; ++k) {
        const uint64_t number = points ? cells_.points[k].number : first_cell_ + k;
        MAILLE_CHECK(values_.read(i, number, tuples_[i].data() + k * size));
      }
    }
    return {};
  }
  /// Whether the way is the smallest for its array; the first of those that are the same, so that "alone"
  /// wins ties.
  bool is_chosen(const CodedArray& way) const {
    return std::none_of(ways_.begin(), ways_.end(), [&](const CodedArray& other) {
      if (other.array != way.array) return false;
      return &other < &way ? other.bytes <= way.bytes : other.bytes < way.bytes;
    });
  }
  Result<> write_array(const CodedArray& way) {
    step_.errors[way.array] = way.stage.largest_error();
    if (way.follows) {
      step_.codings[way.array] = {StepCoding::following, way.partner->of};
    } else if (way.partner != nullptr) {
      step_.codings[way.array] = {StepCoding::difference, way.partner->of};
      step_.maps[way.array] = way.partner->maps;
      step_.errors[way.array] = way.partner->lattice_error;
    }
    report_.array_bytes[way.array] = way.bytes;
    for (const auto& [batch, bytes] : way.batches) {
      const StreamKey key = MAILLE_TRY(key_of(number_, batch, way.array, step_.arrays.size()));
      MAILLE_CHECK(writer_.write_stream(key, bytes));
    }
    return {};
  }

  StepHeader& step_;
  const FileReader& file_;
  uint64_t number_;
  StepSource& values_;
  Executor& executor_;
  CellReplay replay_;
  ValueChain positions_;
  Scalar position_type_;
  std::vector<Vector3> places_;  ///< of the points of a block, if an array needs them
  bool is_placed_ = false;
  FileWriter writer_;
  std::vector<CodedArray> ways_;
  std::vector<std::vector<std::byte>> tuples_;  ///< of a block, by array
  CodedCells cells_;
  uint64_t first_cell_ = 0;
  StepReport report_;
};

}  // namespace

Result<StepReport> write_step(const FileReader& file, const StreamHeader& mesh, StepHeader& step,
                              uint64_t number, const std::vector<Partner>& partners, StepSource& values,
                              const StepOptions& options, FileWriter writer) {
  return StepWriter(file, mesh, step, number, partners, values, options, std::move(writer)).write();
}

}  // namespace maille
