#include "io/hdf5/hdf5_file.h"

#include <algorithm>
#include <cstring>

#include "io/hdf5/hdf5_reader.h"
#include "io/reading.h"

namespace maille {
namespace {

ByteWriter question_of(Hdf5Question question, const std::string& path) {
  ByteWriter out;
  out.put(static_cast<uint8_t>(question));
  out.put_string(path);
  return out;
}

/// Chunks that were never written are not in the file, and packed ones may say that they hold anything: what
/// is there must come near to what is claimed, or a file of some bytes could ask for any array of zeros.
bool is_plausible(const Hdf5Dataset& dataset, uint64_t size) {
  const uint64_t factor = dataset.packed ? 1100 : 1;  // deflate packs a thousand bytes in one at best
  return dataset.stored >= size / factor;
}

/// Memory and time of the child: what a file of this size may need, and some more for the library itself.
/// Chosen, not swept: 1 GiB and a minute, with 64 bytes and a microsecond for each byte of the file, are far
/// above what whole files need; they only have to end what runs away.
constexpr uint64_t least_bytes = uint64_t{1} << 30, bytes_each = 64;
constexpr uint64_t least_seconds = 60, bytes_in_a_second = uint64_t{1} << 20;

}  // namespace

void put_dataset(const Hdf5Dataset& dataset, ByteWriter& out) {
  out.put_count(dataset.shape.size());
  for (const uint64_t size : dataset.shape) out.put_count(size);
  out.put<uint8_t>(dataset.type ? static_cast<uint8_t>(*dataset.type) : 255);
  for (const bool flag : {dataset.grows, dataset.packed, dataset.elsewhere}) out.put<uint8_t>(flag);
  for (const uint64_t count : {dataset.text_size, dataset.stored, dataset.chunk_size}) out.put_count(count);
}

Hdf5Dataset get_dataset(ByteReader& in) {
  Hdf5Dataset dataset;
  dataset.shape.resize(std::min<uint64_t>(in.get_count(), 32));  // the library's bound
  for (uint64_t& size : dataset.shape) size = in.get_count();
  const auto type = in.get<uint8_t>();
  if (type <= static_cast<uint8_t>(Scalar::f64)) dataset.type = static_cast<Scalar>(type);
  for (bool* flag : {&dataset.grows, &dataset.packed, &dataset.elsewhere}) *flag = in.get<uint8_t>() != 0;
  for (uint64_t* count : {&dataset.text_size, &dataset.stored, &dataset.chunk_size}) *count = in.get_count();
  return dataset;
}

bool is_hdf5(Bytes first_bytes) {
  static constexpr char signature[] = "\x89HDF\r\n\x1a\n";
  return first_bytes.size() >= 8 && std::memcmp(first_bytes.data(), signature, 8) == 0;
}

// Saturates at what the number of components of an array can hold, which rows() refuses.
uint64_t Hdf5Dataset::row_size() const {
  uint64_t size = 1;
  for (size_t k = 1; k < shape.size(); ++k) {
    if (shape[k] != 0 && size > UINT32_MAX / shape[k]) return UINT32_MAX;
    size *= shape[k];
  }
  return size;
}

Hdf5File::Hdf5File(std::string name) : name_(std::move(name)) {}
Hdf5File::~Hdf5File() = default;

Result<std::unique_ptr<Hdf5File>> Hdf5File::open(const Source& source) {
  // The child has a copy of memory, but not of the threads that answer a source over the web: so all bytes
  // are in memory, or mapped, before it starts. It needs no file descriptors for them either.
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  const auto bytes = memory_source(input.bytes(), source.name());
  // The bound keeps the product below from overflowing.
  const uint64_t size = std::min<uint64_t>(source.size(), uint64_t{1} << 48);
  const std::function<ChildProcess::Answer()> reader = MAILLE_TRY(hdf5_reader(*bytes));
  std::unique_ptr<Hdf5File> file(new Hdf5File(source.name()));
  file->reader_ = MAILLE_TRY(
      ChildProcess::start(reader, least_bytes + bytes_each * size, least_seconds + size / bytes_in_a_second));
  const auto opened = file->reader_->ask({});
  if (opened && opened->size() == 1 && (*opened)[0] == std::byte{1}) return file;
  return failure(ErrorCode::malformed_input,
                 source.name() + ": it is no file of HDF5, or one that was cut off or damaged");
}

tl::unexpected<Error> Hdf5File::malformed(const std::string& path, const std::string& what) const {
  return failure(ErrorCode::malformed_input, name_ + ": \"" + path + "\" " + what);
}

// An empty answer reads as "no" everywhere: ByteReader gives zeros beyond its end.
std::vector<std::byte> Hdf5File::ask(Bytes question) const {
  auto answer = reader_->ask(question);
  if (!answer) broken_ = true;
  return answer ? *std::move(answer) : std::vector<std::byte>();
}

bool Hdf5File::is_group(const std::string& path) const {
  const auto answer = ask(question_of(Hdf5Question::is_group, path).bytes());
  return !answer.empty() && answer[0] == std::byte{1};
}

std::vector<std::string> Hdf5File::members(const std::string& group) const {
  const auto answer = ask(question_of(Hdf5Question::members, group).bytes());
  ByteReader in(answer);
  std::vector<std::string> names;
  while (in.ok() && in.remaining() > 0) names.push_back(in.get_string());
  return names;
}

std::optional<Hdf5Dataset> Hdf5File::find(const std::string& path) const {
  const auto answer = ask(question_of(Hdf5Question::find, path).bytes());
  ByteReader in(answer);
  if (in.get<uint8_t>() == 0) return std::nullopt;
  Hdf5Dataset dataset = get_dataset(in);
  return in.ok() ? std::optional(std::move(dataset)) : std::nullopt;
}

Result<Array> Hdf5File::rows(const std::string& path, uint64_t first, uint64_t count, Array array,
                             Budget& budget) const {
  const std::optional<Hdf5Dataset> dataset = find(path);
  if (!dataset) return malformed(path, broken_ ? "cannot be read: it is damaged" : "is missing");
  if (!dataset->type && dataset->text_size == 0) return malformed(path, "holds no numbers that we know");
  if (dataset->elsewhere) return malformed(path, "has its values in other files, which are not followed");
  if (first > dataset->rows() || count > dataset->rows() - first) {
    return malformed(path, "has " + std::to_string(dataset->rows()) + " rows, but those from " +
                               std::to_string(first) + " to " + std::to_string(first + count) +
                               " are asked for");
  }
  const uint64_t text_size = std::max<uint64_t>(dataset->text_size, 1);
  const uint64_t components = text_size < UINT32_MAX ? dataset->row_size() * text_size : UINT32_MAX;
  if (components >= UINT32_MAX) return malformed(path, "has rows of 2^32 numbers or more");
  array.type = dataset->type.value_or(Scalar::u8);
  array.components = static_cast<uint32_t>(components);
  array.bytes.clear();
  if (count == 0 || components == 0) return array;
  // The library makes room for a whole chunk, even where an edge of it is all that is wanted.
  MAILLE_CHECK(budget.take(dataset->chunk_size, size_of(array.type)));
  MAILLE_CHECK(budget.take(count, array.tuple_size()));
  const uint64_t bytes = count * array.tuple_size();
  if (!is_plausible(*dataset, bytes))
    return malformed(path, "has fewer bytes in the file than its size asks for");
  ByteWriter question = question_of(Hdf5Question::rows, path);
  // The child is told how many bytes are expected and allocates that many, which the budget has paid for
  // here.
  for (const uint64_t number : {first, count, bytes}) question.put_count(number);
  array.bytes = ask(question.bytes());
  if (array.bytes.size() != bytes)
    return malformed(path, "cannot be read: it is damaged, or packed by a filter that is not here");
  return array;
}

std::optional<std::string> Hdf5File::text(const std::string& object, const std::string& name) const {
  ByteWriter question = question_of(Hdf5Question::text, object);
  question.put_string(name);
  const auto answer = ask(question.bytes());
  ByteReader in(answer);
  if (in.get<uint8_t>() == 0) return std::nullopt;
  return in.get_string();
}

std::optional<int64_t> Hdf5File::number(const std::string& object, const std::string& name) const {
  ByteWriter question = question_of(Hdf5Question::number, object);
  question.put_string(name);
  const auto answer = ask(question.bytes());
  ByteReader in(answer);
  if (in.get<uint8_t>() == 0) return std::nullopt;
  return in.get_zigzag();
}

}  // namespace maille
