// Values of later times, behind those of the step before. docs/format.md, 16.9.
#include "volume/stream/step_chain.h"

#include <algorithm>

#include "base/result.h"
#include "volume/stream/time_steps.h"

namespace maille {

/// In 64 bits the product cannot overflow: batches and arrays are below 2^32.
Result<StreamKey> key_of(uint64_t step, uint64_t batch, uint64_t array, uint64_t arrays) {
  const uint64_t number = batch * arrays + array;
  if (step > UINT32_MAX || number > UINT32_MAX)
    return failure(ErrorCode::unsupported, "more steps, or arrays in a step, than a file can hold");
  return StreamKey{"SVAL", static_cast<uint32_t>(step), static_cast<uint32_t>(number)};
}

// The file must be whole: a step that is missing in the middle would make those behind it mean something
// else.
Result<StepValues> StepValues::open(const Source& source, uint64_t number, const Limits& limits) {
  FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  MAILLE_CHECK(file.check_complete());
  const uint64_t count = count_steps(file);
  if (number == 0 || number > count) {
    return failure(ErrorCode::usage, source.name() + ": has no step " + std::to_string(number) +
                                         "; the last one is " + std::to_string(count));
  }
  const StreamHeader mesh = MAILLE_TRY(maille::header_of(file, limits));
  StepValues values(std::move(file), number, limits);
  uint64_t left = plain_memory(limits) - mesh.memory;
  // Backwards, until a step needs none before it. A hostile file cannot make this long: multiples of 16 must
  // stand alone.
  for (uint64_t step = number;; --step) {
    const StreamKey key{"STEP", static_cast<uint32_t>(step), 0};
    StepHeader header =
        MAILLE_TRY(decode_step(MAILLE_TRY(values.file_.read_stream(key)), mesh.description.arrays, left));
    left -= header.memory;
    const bool needs_before = header.needs_before();
    if (needs_before && step % key_steps == 0)
      return failure(ErrorCode::corrupt, source.name() + ": step " + std::to_string(step) +
                                             " is to be read without others, but needs the one before");
    values.headers_.push_front(std::move(header));
    if (!needs_before || step == 1) return values;
  }
}

namespace {

/// Such a list begins anew, whatever was before.
bool needs_none_before(const std::vector<StepEntry>& entries) {
  return std::all_of(entries.begin(), entries.end(),
                     [](const StepEntry& entry) { return entry.method == StepEntry::whole; });
}

}  // namespace

/// Lists of metadata are told by the one before; the walk back ends at a step that does without, that has
/// none of its own, or whose number is a multiple of 16.
Result<Metadata> metadata_of_step(const FileReader& file, const StreamHeader& mesh, uint64_t step,
                                  const Limits& limits) {
  std::vector<std::vector<StepEntry>> lists;  // the last one first
  uint64_t left = plain_memory(limits) - std::min(mesh.memory, plain_memory(limits));
  for (; step > 0; --step) {
    StepHeader header =
        MAILLE_TRY(decode_step(MAILLE_TRY(file.read_stream({"STEP", static_cast<uint32_t>(step), 0})),
                               mesh.description.arrays, left));
    left -= header.memory;
    if (!header.metadata) break;
    lists.push_back(*std::move(header.metadata));
    if (step % key_steps == 0 || needs_none_before(lists.back())) break;
  }
  Metadata metadata = mesh.description.metadata;
  for (size_t i = lists.size(); i-- > 0;) metadata = MAILLE_TRY(metadata_of(lists[i], metadata));
  return metadata;
}

Result<Metadata> StepValues::metadata(const StreamHeader& mesh) const {
  return metadata_of_step(file_, mesh, number_, limits_);
}

Result<std::vector<std::byte>> StepValues::read(uint64_t step, uint32_t batch, size_t array) const {
  return file_.read_stream(MAILLE_TRY(key_of(step, batch, array, header_of(step).arrays.size())));
}

// Bytes are added up as links are made, so that a reader can refuse a chain before it decodes.
void ValueChain::add(uint64_t step, size_t array, const StreamedArray& coded, Domain domain,
                     std::vector<NumberMap> maps) {
  coder_bytes_ += tuple_coder_bytes(coded);
  links_.push_back({step, array, ArrayStage<RansDecoder>(coded, domain), std::move(maps)});
}

// A chain of one link.
ValueChain ValueChain::of_mesh(const StreamHeader& mesh, std::optional<size_t> array) {
  const StreamArray& described = array ? mesh.description.arrays[*array] : mesh.description.positions;
  ValueChain chain(described.type, described.components);
  chain.add(0, array.value_or(0), array ? mesh.array(*array) : mesh.positions(),
            array ? described.domain : Domain::point);
  return chain;
}

Result<ValueChain> ValueChain::of_step(const StreamHeader& mesh, const StepValues& values, size_t array) {
  const StreamArray wanted = values.header().arrays[array];
  ValueChain chain(wanted.type, wanted.components);
  // Follows `of` from step to step; every array on the way must be like the one that is wanted, as its values
  // pass through. `step` falls with each turn, so that the loop ends.
  // From the last link to the first.
  std::vector<std::pair<uint64_t, size_t>> links;
  uint64_t step = values.number();
  for (;; --step) {
    const auto& arrays = step == 0 ? mesh.description.arrays : values.header_of(step).arrays;
    if (array >= arrays.size() || !are_alike(arrays[array], wanted))
      return failure(ErrorCode::corrupt, "a step has differences to an array that is not there");
    if (step == 0) break;
    const StepCoding coding = values.header_of(step).codings[array];
    if (coding.method != StepCoding::as_mesh && coding.method != StepCoding::as_before)
      links.emplace_back(step, array);
    if (coding.method == StepCoding::alone) break;
    array = coding.of;
    if (coding.method == StepCoding::as_mesh) step = 1;  // the mesh comes next
  }
  if (step == 0) chain.add(0, array, mesh.array(array), wanted.domain);
  for (size_t i = links.size(); i-- > 0;) {
    const StepHeader& header = values.header_of(links[i].first);
    const size_t at = links[i].second;
    const bool differs = header.codings[at].method == StepCoding::difference;
    const StreamedArray coded = header.array(at, mesh);
    if (coded.follows && !coded.mixed)
      return failure(ErrorCode::corrupt, "a step follows another in an array whose numbers are not mixed");
    chain.add(links[i].first, at, coded, wanted.domain, differs ? header.maps[at] : std::vector<NumberMap>{});
  }
  return chain;
}

/// Each link reads its own chunk of the batch. Bytes are kept, as decoders refer to them.
Result<> ValueChain::begin_batch(Bytes of_mesh, const StepValues* values, uint32_t batch) {
  for (Link& link : links_) {
    if (link.step == 0) {
      link.bytes.assign(of_mesh.begin(), of_mesh.end());
    } else {
      link.bytes = MAILLE_TRY(values->read(link.step, batch, link.array));
    }
    link.stage.begin_batch(RansDecoder(link.bytes, link.stage.lanes()));
  }
  return {};
}

// Coders of zero bytes: code() is called with no tuples and must find one.
void ValueChain::begin_empty_batch() {
  for (Link& link : links_) {
    link.bytes.clear();
    link.stage.begin_batch(RansDecoder(link.bytes, link.stage.lanes()));
  }
}

uint64_t ValueChain::grown_bytes(uint64_t points, uint64_t cells) const {
  uint64_t bytes = bytes_held(differences_);
  for (const Link& link : links_) bytes += link.stage.grown_bytes(points, cells) + bytes_held(link.bytes);
  return bytes;
}

bool ValueChain::is_placed() const {
  return std::any_of(links_.begin(), links_.end(), [](const Link& link) { return link.stage.is_placed(); });
}

// The first link gives values, each one behind it changes them in place. All links are decoded for every
// block, also where the last one alone is wanted, as models must see all that was coded.
bool ValueChain::code(const CodedCells& cells, std::span<const Vector3> places, std::byte* tuples) {
  const size_t count = domain() == Domain::point ? cells.points.size() : cells.size();
  for (Link& link : links_) {
    if (link.maps.empty()) {
      // `tuples` are read as the step before and written as this one, tuple by tuple (ArrayStage::code()).
      if (!link.stage.code(cells, places, tuples, tuples)) return false;
      continue;
    }
    differences_.resize(count * link.stage.tuple_size());
    if (!link.stage.code(cells, places, differences_.data())) return false;
    add_differences(type_, link.maps, differences_, tuples);
  }
  return true;
}

namespace {

template <class Code>
void add_as(Scalar type, const std::vector<NumberMap>& maps, Bytes differences, std::byte* tuples) {
  using Unsigned = std::make_unsigned_t<Code>;
  for (size_t i = 0; i < differences.size() / sizeof(Code); ++i) {
    std::byte* const number = tuples + i * size_of(type);
    const NumberMap& map = maps[i % maps.size()];
    // Unsigned, as differences of a damaged stream may be anything.
    const auto before = static_cast<Unsigned>(map.code_of(type, number));
    const auto code = static_cast<Code>(before + load<Unsigned>(differences.data() + i * sizeof(Code)));
    map.store_number(type, code, number);
  }
}

template <class Code>
// Encoder's side of add_as().
void find_as(Scalar type, const std::vector<NumberMap>& maps, Bytes before, Bytes tuples,
             std::byte* differences) {
  using Unsigned = std::make_unsigned_t<Code>;
  for (size_t i = 0; i < tuples.size() / size_of(type); ++i) {
    const NumberMap& map = maps[i % maps.size()];
    const auto code = static_cast<Unsigned>(map.code_of(type, tuples.data() + i * size_of(type)));
    const auto known = static_cast<Unsigned>(map.code_of(type, before.data() + i * size_of(type)));
    store(differences + i * sizeof(Code), static_cast<Code>(code - known));
  }
}

}  // namespace

void add_differences(Scalar type, const std::vector<NumberMap>& maps, Bytes differences, std::byte* tuples) {
  if (size_of(type) == 8) return add_as<int64_t>(type, maps, differences, tuples);
  add_as<int32_t>(type, maps, differences, tuples);
}

void find_differences(Scalar type, const std::vector<NumberMap>& maps, Bytes before, Bytes tuples,
                      std::byte* differences) {
  if (size_of(type) == 8) return find_as<int64_t>(type, maps, before, tuples, differences);
  find_as<int32_t>(type, maps, before, tuples, differences);
}

}  // namespace maille
