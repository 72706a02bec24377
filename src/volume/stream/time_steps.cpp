// Values of later times behind a mesh. docs/format.md, 16.9.
#include "volume/stream/time_steps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/bytes.h"
#include "base/result.h"
#include "container/chunk_finder.h"
#include "volume/pieces/pieces_steps.h"
#include "volume/stream/cell_replay.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/step_chain.h"
#include "volume/stream/stream_file.h"
#include "volume/values/array_stage.h"

namespace maille {
namespace {

// The description of the mesh, by the index.
Result<StreamHeader> header_of(const FileReader& file) {
  return decode_header(MAILLE_TRY(file.read_stream({"DESC"})));
}

}  // namespace

/// Each look-up goes to the index of the file, so that no step is read.
uint64_t count_steps(const FileReader& file) {
  uint64_t count = 0;
  while (count < UINT32_MAX && file.has_stream({"STEP", static_cast<uint32_t>(count + 1), 0})) ++count;
  return count;
}

void set_time(double time, std::vector<Array>& mesh_arrays) {
  for (Array& array : mesh_arrays) {
    if (array.name == "TimeValue" && array.type == Scalar::f64 && array.count() == 1)
      store(array.bytes.data(), time);
  }
}

Result<> check_step(uint64_t step, uint64_t steps, const std::string& name) {
  if (step <= steps) return {};
  return failure(ErrorCode::usage, name + ": has no step " + std::to_string(step) + "; the last one is " +
                                       std::to_string(steps));
}

Result<std::vector<StepHeader>> read_steps(const FileReader& file, const std::vector<StreamArray>& arrays) {
  // A source whose bytes arrive later is asked for all of them before the first that is missing is an error.
  std::vector<Result<std::vector<std::byte>>> streams;
  const uint64_t count = count_steps(file);
  for (uint32_t i = 1; i <= count; ++i) streams.push_back(file.read_stream({"STEP", i, 0}));
  std::vector<StepHeader> steps;
  for (auto& stream : streams)
    steps.push_back(MAILLE_TRY(decode_step(MAILLE_TRY(std::move(stream)), arrays)));
  return steps;
}

namespace {

/// How an array of the new step goes with one of an earlier step while that is read. All that can make it
/// cheaper is tried in one pass over the earlier step: its values as they are, differences on its lattice, or
/// expectations from it.
struct Partner {
  size_t array = 0;         ///< of the step, in the new one
  uint32_t of = 0;          ///< in the earlier one
  bool keeps = true;        ///< its values are within the bound so far
  double error = 0;         ///< the largest
  bool on_lattice = false;  ///< all values of the new array are within the bound on `maps`
  double lattice_error = 0;
  std::vector<NumberMap> maps;  ///< of differences
  bool follows = false;         ///< numbers of the new array may be expected from those of the earlier one
  std::vector<std::byte> before = {};  ///< all tuples of the earlier array, as they are read
};

/// The lattice for differences. The step before an array's partner had a finer lattice: on the same one
/// errors do not add up, as a difference of 0 gives the same number again. A lattice up to twice as fine is
/// taken; each halving of the step costs a bit a number.
std::vector<NumberMap> lattice_for(const std::vector<NumberMap>& now, const std::vector<NumberMap>& before) {
  for (size_t k = 0; k < now.size(); ++k) {
    if (now[k].kind != NumberMap::Kind::lattice) return {};
    const bool same = k < before.size() && before[k].kind == NumberMap::Kind::lattice &&
                      before[k].step <= now[k].step && before[k].step >= now[k].step / 2;
    if (!same) return now;
  }
  return before;
}

/// Holds the arrays of a new step against those of an earlier one, portion by portion, in the order of the
/// stream. What is kept is decided by the numbers that a decoder would give out, not by those that were
/// given.
class Comparison {
 public:
  Comparison(const StepHeader& step, const StreamHeader& mesh, StepSource& values)
      : step_(step), mesh_(mesh), values_(values) {}

  /// Arrays go together by name, domain, type and components; the first one of a name counts. `differences`:
  /// values may be coded as such. `known` and `maps` are those of the earlier step.
  void add_partners(const std::vector<StreamArray>& known, const std::vector<std::vector<NumberMap>>& maps,
                    bool differences) {
    for (size_t i = 0; i < step_.arrays.size(); ++i) {
      for (size_t k = 0; k < known.size(); ++k) {
        if (known[k].name != step_.arrays[i].name || !are_alike(known[k], step_.arrays[i])) continue;
        Partner& partner = partners_.emplace_back();
        partner.array = i;
        partner.of = static_cast<uint32_t>(k);
        if (differences && step_.bounds[i] > 0) partner.maps = lattice_for(step_.maps[i], maps[k]);
        partner.on_lattice = !partner.maps.empty();
        partner.follows = differences && step_.array(i, mesh_).mixed && !is_numbered(known[k]);
        break;
      }
    }
  }
  std::vector<Partner>& partners() { return partners_; }
  /// Reads all values of the earlier step, until no array needs them: then most of the file is left unread.
  Result<> read(StreamReader& reader, const std::vector<StreamArray>& known) {
    StreamPortion portion;
    while (is_any_left() && MAILLE_TRY(reader.next(portion))) {
      for (Partner& partner : partners_) {
        if (!is_of_use(partner)) continue;
        size_t place = 0;  // among the arrays of the domain
        for (size_t k = 0; k < partner.of; ++k) place += known[k].domain == known[partner.of].domain;
        const bool points = known[partner.of].domain == Domain::point;
        MAILLE_CHECK(
            compare(partner, portion, points ? portion.point_arrays[place] : portion.cell_arrays[place]));
      }
    }
    return {};
  }

 private:
  bool is_any_left() const { return std::any_of(partners_.begin(), partners_.end(), is_of_use); }
  static bool is_of_use(const Partner& partner) {
    return partner.keeps || partner.on_lattice || partner.follows;
  }
  // Values of the new step are held against a portion of the earlier one, number by number, until the bound
  // is exceeded once: from then on that way is out.
  Result<> compare(Partner& partner, const StreamPortion& portion, Bytes tuples) {
    const size_t i = partner.array;
    const StreamedArray array{step_.arrays[i].type, step_.arrays[i].components, step_.maps[i],
                              step_.bounds[i]};
    const size_t size = array.tuple_size(), number_size = size_of(array.type);
    tuple_.resize(size);
    if (partner.on_lattice || partner.follows)
      partner.before.insert(partner.before.end(), tuples.begin(), tuples.end());
    // Tuples of the new step are asked for by number; the caller's source may be a file.
    for (size_t at = 0; at * size < tuples.size() && (partner.keeps || partner.on_lattice); ++at) {
      const bool points = step_.arrays[i].domain == Domain::point;
      MAILLE_CHECK(values_.read(i, points ? portion.points[at] : portion.first_cell + at, tuple_.data()));
      for (size_t c = 0; c < array.components; ++c) {
        const std::byte* const number = tuple_.data() + c * number_size;
        const bool logarithm = array.maps[c].kind == NumberMap::Kind::logarithm;
        const std::byte* const known = tuples.data() + at * size + c * number_size;
        partner.keeps = partner.keeps && is_kept(array, logarithm, number, known, partner.error);
        if (!partner.on_lattice) continue;
        std::array<std::byte, 8> back{};
        partner.maps[c].store_number(array.type, partner.maps[c].code_of(array.type, number), back.data());
        partner.on_lattice = is_kept(array, logarithm, number, back.data(), partner.lattice_error);
      }
    }
    // Not needed any more: the values of a whole step would stay in memory.
    if (!partner.on_lattice && !partner.follows) partner.before = {};
    return {};
  }

  /// Numbers that are not coded with the mesh, so that no chain of steps can begin with them.
  bool is_numbered(const StreamArray& array) const {
    const StreamDescription& mesh = mesh_.description;
    return std::any_of(mesh.numbered.begin(), mesh.numbered.end(), [&](const NumberedArray& numbered) {
      return mesh.arrays[numbered.array].name == array.name && are_alike(mesh.arrays[numbered.array], array);
    });
  }

  const StepHeader& step_;
  const StreamHeader& mesh_;
  StepSource& values_;
  std::vector<Partner> partners_;
  std::vector<std::byte> tuple_;
};

/// Marks arrays that values of the mesh, or of the step before, serve within the bound. What is returned may
/// be coded as differences, or as what follows. Every 16th step stands alone, so that no reader needs more
/// than 15 others.
Result<std::vector<Partner>> compare_with_earlier(const Source& source, const StreamHeader& mesh,
                                                  uint64_t number, StepHeader& step, StepSource& values,
                                                  const StepOptions& options) {
  const StreamReadOptions reading{.limits = options.limits, .any_order = true, .executor = options.executor};
  const bool by_itself = number % key_steps == 0;
  std::vector<Partner> differences;
  // The mesh first: values that come back to those of the mesh then refer to nothing else, so that no chain
  // is read for them.
  const auto hold = [&](uint64_t earlier, const std::vector<StreamArray>& known, const auto& maps,
                        StepCoding::Method method) -> Result<> {
    Comparison comparison(step, mesh, values);
    comparison.add_partners(known, maps, earlier + 1 == number && !by_itself);
    StreamReader reader = MAILLE_TRY(StreamReader::open(source, earlier, reading));
    MAILLE_CHECK(comparison.read(reader, known));
    for (Partner& partner : comparison.partners()) {
      if (step.codings[partner.array].method != StepCoding::alone) continue;
      if (partner.keeps) {
        step.codings[partner.array] = {method, partner.of};
        step.errors[partner.array] = partner.error;
      } else if (partner.on_lattice || partner.follows) {
        differences.push_back(std::move(partner));
      }
    }
    return {};
  };
  const std::vector<std::vector<NumberMap>> of_arrays(mesh.maps.begin() + 1, mesh.maps.end());
  MAILLE_CHECK(hold(0, mesh.description.arrays, of_arrays, StepCoding::as_mesh));
  if (number == 1 || by_itself) return differences;
  const auto before = StepValues::open(source, number - 1);
  const Result<> held =
      before ? hold(number - 1, before->header().arrays, before->header().maps, StepCoding::as_before)
             : Result<>(tl::unexpected(before.error()));
  // What is damaged is of no use to later steps, and no reason against them.
  if (!held && held.error().code != ErrorCode::corrupt) return tl::unexpected(held.error());
  return differences;
}

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

/// Codes the values of one step behind the cells, which are decoded once more for that (CellReplay). The
/// header of the step comes last, as it has the errors: a step that was cut off is not there for a reader.
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

// The same limits as check_options() of a stream has.
Result<> check_arrays(const std::vector<StreamArray>& arrays) {
  for (const StreamArray& array : arrays) {
    if (array.components == 0 || array.components > 0xffff)
      return failure(ErrorCode::usage, "array \"" + array.name + "\" must have 1 to 65535 components");
    if (array.domain != Domain::point && array.domain != Domain::cell)
      return failure(ErrorCode::unsupported, "array \"" + array.name + "\" is on " + name_of(array.domain) +
                                                 "s; a step has arrays on points and on cells");
  }
  return {};
}

struct Counts {
  uint64_t points, cells;
};

/// Values of a mesh whose cells and points stand in another order in the stream: numbers are turned from
/// those of the stream into those of the input.
class InOrderOfStream final : public StepSource {
 public:
  InOrderOfStream(StepSource& values, const InputOrder& order, std::vector<StreamArray> arrays)
      : values_(values),
        points_(inverse(order.points)),
        cells_(inverse(order.cells)),
        arrays_(std::move(arrays)) {}
  Result<> read(size_t array, uint64_t number, std::byte* out) override {
    const auto& input = arrays_[array].domain == Domain::point ? points_ : cells_;
    if (number >= input.size())
      return failure(ErrorCode::corrupt, "a point or cell that the order does not name");
    return values_.read(array, input[number], out);
  }

 private:
  /// The list is a permutation, as decode_order() has checked.
  static std::vector<uint32_t> inverse(const std::vector<uint32_t>& places) {
    std::vector<uint32_t> numbers(places.size());
    for (uint32_t i = 0; i < places.size(); ++i) numbers[places[i]] = i;
    return numbers;
  }

  StepSource& values_;
  std::vector<uint32_t> points_, cells_;
  std::vector<StreamArray> arrays_;
};

/// In the order of the mesh: marks arrays whose numbers are those of the mesh's numbered arrays. They take no
/// bytes then, and need no partner.
Result<> find_same_numbers(const StreamHeader& mesh, const StreamTail& tail, StepSource& values,
                           StepHeader& step) {
  step.codings.resize(step.arrays.size());
  for (const NumberedArray& numbered : mesh.description.numbered) {
    const StreamArray& known = mesh.description.arrays[numbered.array];
    const RisingNumbers numbers(numbered, known.type);
    const uint64_t count = known.domain == Domain::point ? tail.points : tail.cells;
    for (size_t i = 0; i < step.arrays.size(); ++i) {
      if (step.arrays[i].name != known.name || !are_alike(step.arrays[i], known)) continue;
      bool same = true;
      for (uint64_t k = 0; k < count && same; ++k) {
        std::array<std::byte, 8> expected{}, found{};
        numbers.store(k, expected.data());
        MAILLE_CHECK(values.read(i, k, found.data()));
        same = expected == found;
      }
      if (same) step.codings[i] = {StepCoding::as_mesh, static_cast<uint32_t>(numbered.array)};
    }
  }
  return {};
}

/// Writes the next step. `open_sink` opens a sink for what stands behind the file, only when the step before
/// was read: the file may be the same.
template <class OpenSink>
Result<StepReport> write_step(const Source& source, const FileReader& file, const StreamHeader& mesh,
                              StepHeader step, StepSource& values, const StepOptions& options,
                              OpenSink open_sink) {
  const uint64_t number = count_steps(file) + 1;
  step.errors.resize(step.arrays.size());
  const auto partners = MAILLE_TRY(compare_with_earlier(source, mesh, number, step, values, options));
  const std::unique_ptr<Sink> sink = MAILLE_TRY(open_sink());
  StepWriter writer(file, mesh, step, number, partners, values, options,
                    // The digest goes on over the chunks that are there, so that the new footer vouches for
                    // the whole file.
                    FileWriter::resume(*sink, file.end(), file.digest()));
  const StepReport report = MAILLE_TRY(writer.write());
  MAILLE_CHECK(sink->commit());
  return report;
}

/// The same where values are in the order of the input.
template <class OpenSink>
Result<StepReport> write_in_order(const Source& source, const FileReader& file, const StreamHeader& mesh,
                                  StepHeader step, StepSource& values, const StepOptions& options,
                                  OpenSink open_sink) {
  const auto order = MAILLE_TRY(input_order_of(source, options.limits));
  if (!order) return write_step(source, file, mesh, std::move(step), values, options, open_sink);
  InOrderOfStream reordered(values, *order, step.arrays);
  return write_step(source, file, mesh, std::move(step), reordered, options, open_sink);
}

/// `counts`: of what the values are of, if known.
Result<StepReport> append(const std::string& path, StepHeader step, StepSource& values,
                          const StepOptions& options, const std::optional<Counts>& counts) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  const StepTarget target = MAILLE_TRY(open_for_step(*source, step));
  const StreamHeader& mesh = target.mesh;
  const StreamTail& tail = target.tail;
  const FileReader& file = *target.file;
  if (counts) MAILLE_CHECK(check_counts(*source, target, counts->points, counts->cells));
  MAILLE_CHECK(find_same_numbers(mesh, tail, values, step));
  MAILLE_CHECK(set_metadata(file, mesh, options, step));
  if ((file.header().required_features & in_pieces_feature) != 0) {
    step.errors.resize(step.arrays.size());
    return append_to_pieces(path, *source, file, std::move(step), values, options);
  }
  return write_in_order(*source, file, mesh, std::move(step), values, options,
                        [&] { return append_sink(path, file.end()); });
}

/// Arrays of a mesh in memory.
class MeshValues final : public StepSource {
 public:
  explicit MeshValues(std::vector<const Array*> arrays) : arrays_(std::move(arrays)) {}
  Result<> read(size_t array, uint64_t number, std::byte* out) override {
    const size_t size = arrays_[array]->tuple_size();
    if ((number + 1) * size > arrays_[array]->bytes.size())
      return failure(ErrorCode::usage, "the step has no point or cell " + std::to_string(number));
    std::copy_n(arrays_[array]->bytes.data() + number * size, size, out);
    return {};
  }

 private:
  std::vector<const Array*> arrays_;
};

}  // namespace

// All that can be refused is refused before a byte is written. A mesh in any order has no steps: nobody could
// say which point is which.
Result<StepTarget> open_for_step(const Source& source, const StepHeader& step) {
  const auto refused = [&](const std::string& what) {
    return failure(ErrorCode::usage, source.name() + ": " + what);
  };
  if (!std::isfinite(step.time)) return refused("the time of a step has to be a finite number");
  MAILLE_CHECK(check_arrays(step.arrays));
  StepTarget target;
  target.file = std::make_unique<FileReader>(MAILLE_TRY(FileReader::open(source, stream_chunk_types)));
  const FileReader& file = *target.file;
  MAILLE_CHECK(file.check_complete());
  if (file.header().mode != Mode::stream)
    return refused("steps can be appended to files of mode \"stream\" only");
  target.mesh = MAILLE_TRY(header_of(file));
  if (target.mesh.description.any_order && !target.mesh.description.order_apart) {
    return refused(
        "was compressed in any order, so values of later steps do not know their points; compress it "
        "without --any-order");
  }
  target.tail = MAILLE_TRY(decode_tail(MAILLE_TRY(file.read_stream({"TAIL"}))));
  return target;
}

Result<> check_counts(const Source& source, const StepTarget& target, uint64_t points, uint64_t cells) {
  const StreamTail& tail = target.tail;
  if (points == tail.points && cells == tail.cells) return {};
  return failure(ErrorCode::usage, source.name() + ": has " + std::to_string(tail.points) + " points and " +
                                       std::to_string(tail.cells) + " cells, the step has " +
                                       std::to_string(points) + " and " + std::to_string(cells));
}

// Metadata like those of the mesh are left out; others are told by the list before. A damaged list before is
// no reason against the step: all of it is told then.
Result<> set_metadata(const FileReader& file, const StreamHeader& mesh, const StepOptions& options,
                      StepHeader& step) {
  if (!options.metadata || *options.metadata == mesh.description.metadata) return {};
  const uint64_t number = count_steps(file) + 1;
  const bool by_itself = number % key_steps == 0;
  const auto before = by_itself ? mesh.description.metadata : metadata_of_step(file, mesh, number - 1);
  if (!before && before.error().code != ErrorCode::corrupt) return tl::unexpected(before.error());
  step.metadata = entries_of(*options.metadata, before.value_or(Metadata()));
  return {};
}

/// For pieces, whose files are within a file: what would be appended is returned.
Result<std::vector<std::byte>> step_behind(const Source& stream, StepHeader step, StepSource& values,
                                           const StepOptions& options, StepReport& report) {
  const FileReader file = MAILLE_TRY(FileReader::open(stream, stream_chunk_types));
  const StreamHeader mesh = MAILLE_TRY(header_of(file));
  std::vector<std::byte> bytes;
  report = MAILLE_TRY(write_in_order(stream, file, mesh, std::move(step), values, options,
                                     [&]() -> Result<std::unique_ptr<Sink>> { return memory_sink(bytes); }));
  return bytes;
}

// Maps follow from the declarations alone, as values are read once.
Result<StepReport> append_step(const std::string& path, const StepOptions& options, StepSource& values) {
  StepHeader step;
  step.time = options.time;
  step.arrays = options.arrays;
  for (const StreamArray& array : options.arrays) {
    double bound = 0;
    step.maps.push_back(MAILLE_TRY(declared_maps(array, declared_width(array), bound)));
    step.bounds.push_back(bound);
  }
  return append(path, std::move(step), values, options, {});
}

Result<StepReport> append_step(const std::string& path, double time, const Mesh& mesh,
                               const EncodeOptions& options) {
  MAILLE_CHECK(validate(mesh));
  StepHeader step;
  step.time = time;
  std::vector<const Array*> columns;
  StreamOptions stream;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) continue;
    stream.arrays.push_back({array.name,
                             array.domain,
                             array.type,
                             array.components,
                             array.role,
                             array.labels,
                             tolerance_of(options, array.name),
                             {}});
    columns.push_back(&array);
  }
  step.arrays = stream.arrays;
  MAILLE_CHECK(check_arrays(step.arrays));
  ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(mesh, stream));
  step.maps.assign(maps.maps.begin() + 1, maps.maps.end());
  step.bounds.assign(maps.bounds.begin() + 1, maps.bounds.end());
  MeshValues values(std::move(columns));
  StepOptions step_options;
  step_options.executor = options.executor;
  if (!mesh.metadata.empty()) step_options.metadata = mesh.metadata;
  return append(path, std::move(step), values, step_options, Counts{mesh.point_count(), mesh.cell_count()});
}

namespace {

/// Whether each array of the mesh is there, with the mesh's own values.
bool repeats(const StepHeader& step, const std::vector<StreamArray>& arrays) {
  for (size_t i = 0; i < arrays.size(); ++i) {
    const auto is_it = [&](size_t k) {
      return step.codings[k].method == StepCoding::as_mesh && step.codings[k].of == i &&
             step.arrays[k].name == arrays[i].name;
    };
    size_t k = 0;
    while (k < step.arrays.size() && !is_it(k)) ++k;
    if (k == step.arrays.size()) return false;
  }
  return true;
}

/// A large file whose end tells nothing would be looked through from the front by FileReader, which takes as
/// long as reading it; who lists steps is told instead.
Result<> check_end(const Source& source) {
  if (source.size() < 2 * indexed_file_bytes) return {};
  std::vector<std::byte> end(footer_bytes);
  MAILLE_CHECK(source.read_at(source.size() - footer_bytes, end));
  const auto footer = read_footer(end);
  if (footer && footer->index_offset != 0) {
    const auto records = read_index(source, *footer);
    if (records) return {};
    if (records.error().code != ErrorCode::corrupt) return tl::unexpected(records.error());
  }
  return failure(ErrorCode::corrupt,
                 source.name() + ": its end is damaged, so it does not tell which steps of time it has");
}

}  // namespace

// Bytes of a step are those of all its chunks, by the records of the file.
Result<std::vector<StreamStep>> steps_of(const FileReader& file, const StreamHeader& mesh) {
  const std::vector<StreamArray>& arrays = mesh.description.arrays;
  std::vector<StreamStep> steps;
  for (StepHeader& header : MAILLE_TRY(read_steps(file, arrays))) {
    const bool repeated = repeats(header, arrays);
    steps.push_back({header.time, std::move(header.arrays), std::move(header.errors), 0, repeated});
  }
  for (const ChunkRecord& record : file.records()) {
    const std::string_view type(record.header.type.data(), record.header.type.size());
    if ((type == "STEP" || type == "SVAL" || type == "SIDX") && record.header.patch >= 1 &&
        record.header.patch <= steps.size())
      steps[record.header.patch - 1].coded_bytes += record.header.size;
  }
  return steps;
}

Result<std::vector<StreamStep>> list_steps(const Source& source, bool search) {
  if (!search) MAILLE_CHECK(check_end(source));
  const FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  if (file.header().mode != Mode::stream) return std::vector<StreamStep>{};
  // What is missing may be the head of a step: those before it would pass for all.
  MAILLE_CHECK(file.check_complete());
  return steps_of(file, MAILLE_TRY(header_of(file)));
}

}  // namespace maille
