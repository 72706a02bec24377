#include "io/zip.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "base/bytes.h"
#include "base/result.h"
#include "io/letters.h"

namespace maille {
namespace {

constexpr uint32_t local_mark = 0x04034b50, central_mark = 0x02014b50, end_mark = 0x06054b50;
constexpr size_t local_size = 30, central_size = 46, end_size = 22;
constexpr uint64_t most_bytes = 0xfffffffe;  // the largest size that is no mark of ZIP64
constexpr uint16_t first_of_1980 = 0x21;     // the first date that the format has
constexpr uint16_t stored = 0, deflated = 8;
constexpr int raw_window = -15;  // zlib: largest window, no wrapper

uint16_t short_at(Bytes bytes, size_t at) {
  return load<uint16_t>(bytes.data() + at);
}
uint32_t word_at(Bytes bytes, size_t at) {
  return load<uint32_t>(bytes.data() + at);
}

tl::unexpected<Error> damaged_zip(const std::string& name, const std::string& what) {
  return failure(ErrorCode::malformed_input, name + ": the ZIP archive " + what);
}

/// Where the record at the end begins: in front of a comment of at most 64 KiB.
Result<size_t> end_record(Bytes bytes, const std::string& name) {
  if (bytes.size() >= end_size) {
    const size_t last = bytes.size() - end_size, first = last - std::min<size_t>(last, 0xffff);
    for (size_t at = last + 1; at-- > first;) {
      if (word_at(bytes, at) == end_mark) return at;
    }
  }
  return damaged_zip(name, "has no list of files at its end; it may be cut off");
}

/// Sizes that need 64 bits stand in an extra field, in this order, those only that are marked.
bool take_long_sizes(Bytes extra, ZipEntry& entry) {
  constexpr uint64_t marked = 0xffffffff;
  if (entry.size != marked && entry.packed != marked && entry.header != marked) return true;
  while (extra.size() >= 4) {
    const uint16_t kind = short_at(extra, 0);
    const size_t size = std::min<size_t>(short_at(extra, 2), extra.size() - 4);
    Bytes field = extra.subspan(4, size);
    extra = extra.subspan(4 + size);
    if (kind != 1) continue;
    for (uint64_t* const value : {&entry.size, &entry.packed, &entry.header}) {
      if (*value != marked) continue;
      if (field.size() < 8) return false;
      *value = load<uint64_t>(field.data());
      field = field.subspan(8);
    }
    return true;
  }
  return false;
}

/// One run of zlib over deflated bytes; the length is what was claimed, or the archive is damaged.
class RawInflater {
 public:
  explicit RawInflater(Bytes bytes) : left_(bytes) { ok_ = inflateInit2(&stream_, raw_window) == Z_OK; }
  ~RawInflater() { inflateEnd(&stream_); }
  RawInflater(const RawInflater&) = delete;
  RawInflater& operator=(const RawInflater&) = delete;

  /// Fills as much of the room as there are bytes for.
  size_t fill(std::span<std::byte> room) {
    size_t filled = 0;
    while (ok_ && filled < room.size()) {
      const uInt given = piece(left_.size()), space = piece(room.size() - filled);
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(left_.data()));
      stream_.avail_in = given;
      stream_.next_out = reinterpret_cast<Bytef*>(room.data() + filled);
      stream_.avail_out = space;
      ok_ = inflate(&stream_, Z_NO_FLUSH) == Z_OK;  // not at the end, either
      left_ = left_.subspan(given - stream_.avail_in);
      filled += space - stream_.avail_out;
    }
    return filled;
  }

 private:
  /// zlib counts in 32 bits.
  static uInt piece(size_t size) { return static_cast<uInt>(std::min<size_t>(size, size_t{1} << 30)); }

  z_stream stream_{};
  Bytes left_;
  bool ok_ = false;
};

/// Memory doubles with what really comes: the claimed size is only where it ends.
std::vector<std::byte> inflated(Bytes packed, uint64_t size) {
  std::vector<std::byte> out;
  RawInflater inflater(packed);
  while (out.size() < size) {
    const size_t before = out.size();
    out.resize(static_cast<size_t>(std::min<uint64_t>(size, std::max<uint64_t>(2 * before, 1 << 16))));
    const size_t filled = inflater.fill(std::span(out).subspan(before));
    if (before + filled < out.size()) {
      out.resize(before + filled);
      break;
    }
  }
  return out;
}

uint32_t crc_of(uint32_t crc, Bytes bytes) {
  return static_cast<uint32_t>(crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// Deflates into memory.
class DeflateSink final : public Sink {
 public:
  DeflateSink(std::vector<std::byte>& out, std::string name) : out_(out), name_(std::move(name)) {
    ok_ =
        deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, raw_window, 8, Z_DEFAULT_STRATEGY) == Z_OK;
  }
  ~DeflateSink() override { deflateEnd(&stream_); }
  DeflateSink(const DeflateSink&) = delete;
  DeflateSink& operator=(const DeflateSink&) = delete;

  Result<> write(Bytes bytes) override {
    constexpr size_t piece = size_t{1} << 30;
    size += bytes.size();
    crc = crc_of(crc, bytes);
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(piece, bytes.size())))
      MAILLE_CHECK(run(bytes.first(std::min(piece, bytes.size())), Z_NO_FLUSH));
    return {};
  }
  Result<> commit() override { return run({}, Z_FINISH); }
  std::string name() const override { return name_; }

  uint64_t size = 0;
  uint32_t crc = 0;

 private:
  Result<> run(Bytes bytes, int flush) {
    if (!ok_) return failure(ErrorCode::write_failed, name_ + ": zlib has no memory");
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(bytes.size());
    std::vector<std::byte> room(size_t{1} << 16);
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(room.data());
      stream_.avail_out = static_cast<uInt>(room.size());
      deflate(&stream_, flush);
      out_.insert(out_.end(), room.begin(), room.end() - stream_.avail_out);
    } while (stream_.avail_out == 0);
    return {};
  }

  std::vector<std::byte>& out_;
  std::string name_;
  z_stream stream_{};
  bool ok_ = false;
};

void put_short(ByteWriter& out, uint64_t value) {
  out.put(static_cast<uint16_t>(value));
}
void put_word(ByteWriter& out, uint64_t value) {
  out.put(static_cast<uint32_t>(value));
}

/// What the header in front of a file and the list at the end have in common.
void put_entry(ByteWriter& out, const ZipEntry& entry) {
  put_short(out, 20);  // version of the format that a reader needs: deflate
  put_short(out, 0);
  put_short(out, entry.method);
  put_short(out, 0);
  put_short(out, first_of_1980);
  put_word(out, entry.crc);
  put_word(out, entry.packed);
  put_word(out, entry.size);
  put_short(out, entry.path.size());
  put_short(out, 0);
}

}  // namespace

bool is_zip(Bytes bytes) {
  return bytes.size() >= 4 && word_at(bytes, 0) == local_mark;
}

Result<ZipReader> ZipReader::open(Bytes bytes, std::string name) {
  ZipReader zip;
  zip.bytes_ = bytes;
  zip.name_ = std::move(name);
  const size_t end = MAILLE_TRY(end_record(bytes, zip.name_));
  const uint64_t size = word_at(bytes, end + 12), begin = word_at(bytes, end + 16);
  if (size == 0xffffffff || begin == 0xffffffff)
    return failure(ErrorCode::unsupported, zip.name_ + ": ZIP archives of more than 4 GiB are not read");
  if (begin > end || size > end - begin) return damaged_zip(zip.name_, "has its list of files outside of it");
  Bytes list = bytes.subspan(static_cast<size_t>(begin), static_cast<size_t>(size));
  while (!list.empty()) {
    const bool header = list.size() >= central_size && word_at(list, 0) == central_mark;
    const size_t path = header ? short_at(list, 28) : 0, extra = header ? short_at(list, 30) : 0;
    const size_t whole = header ? central_size + path + extra + short_at(list, 32) : 0;
    if (!header || whole > list.size()) return damaged_zip(zip.name_, "has a damaged list of files");
    ZipEntry entry;
    entry.path.assign(reinterpret_cast<const char*>(list.data()) + central_size, path);
    entry.flags = short_at(list, 8);
    entry.method = short_at(list, 10);
    entry.crc = word_at(list, 16);
    entry.packed = word_at(list, 20);
    entry.size = word_at(list, 24);
    entry.header = word_at(list, 42);
    if (!take_long_sizes(list.subspan(central_size + path, extra), entry))
      return damaged_zip(zip.name_, "does not say how long \"" + entry.path + "\" is");
    zip.entries_.push_back(std::move(entry));
    list = list.subspan(whole);
  }
  return zip;
}

const ZipEntry* ZipReader::find(std::string_view path) const {
  if (path.starts_with('/')) path.remove_prefix(1);
  const std::string wanted = lower_case(path);
  for (const ZipEntry& entry : entries_) {
    if (lower_case(entry.path) == wanted) return &entry;
  }
  return nullptr;
}

Result<std::vector<std::byte>> ZipReader::read(const ZipEntry& entry, uint64_t limit) const {
  const std::string what = "\"" + entry.path + "\"";
  if ((entry.flags & 1) != 0 || (entry.method != stored && entry.method != deflated)) {
    return failure(ErrorCode::unsupported,
                   name_ + ": " + what + " is encrypted, or packed in another way than by deflate");
  }
  const uint64_t all = bytes_.size();
  if (entry.header > all || all - entry.header < local_size ||
      word_at(bytes_, static_cast<size_t>(entry.header)) != local_mark)
    return damaged_zip(name_, "has no header where " + what + " should begin");
  const auto header = static_cast<size_t>(entry.header);
  const uint64_t begin =
      entry.header + local_size + short_at(bytes_, header + 26) + short_at(bytes_, header + 28);
  if (begin > all || entry.packed > all - begin) return damaged_zip(name_, "ends inside " + what);
  if (entry.size > limit) {
    return failure(ErrorCode::memory_bound,
                   name_ + ": " + what + " unpacks to more than the " + std::to_string(limit) +
                       " bytes allowed; raise the memory limit if you trust the file");
  }
  const Bytes packed = bytes_.subspan(static_cast<size_t>(begin), static_cast<size_t>(entry.packed));
  auto out = entry.method == stored ? std::vector<std::byte>(packed.begin(), packed.end())
                                    : inflated(packed, entry.size);
  if (out.size() != entry.size || crc_of(0, out) != entry.crc)
    return damaged_zip(name_, "is damaged inside " + what);
  return out;
}

Result<> ZipWriter::add(const std::string& path, const std::function<Result<>(Sink&)>& write) {
  ZipEntry entry;
  std::vector<std::byte> packed;
  DeflateSink sink(packed, sink_.name());
  MAILLE_CHECK(write(sink));
  MAILLE_CHECK(sink.commit());
  entry.path = path;
  entry.method = deflated;
  entry.packed = packed.size();
  entry.size = sink.size;
  entry.crc = sink.crc;
  entry.header = written_;
  if (std::max({entry.size, entry.packed, entry.header}) > most_bytes) {
    return failure(ErrorCode::usage,
                   sink_.name() + ": the mesh is too large for a ZIP archive (4 GiB); write another format");
  }
  ByteWriter header;
  put_word(header, local_mark);
  put_entry(header, entry);
  header.put_bytes(std::as_bytes(std::span(path)));
  MAILLE_CHECK(sink_.write(header.bytes()));
  MAILLE_CHECK(sink_.write(packed));
  written_ += header.size() + packed.size();
  entries_.push_back(std::move(entry));
  return {};
}

Result<> ZipWriter::finish() {
  ByteWriter list;
  for (const ZipEntry& entry : entries_) {
    put_word(list, central_mark);
    put_short(list, 20);
    put_entry(list, entry);
    put_short(list, 0);  // comment, disk, kinds of text, two of attributes
    put_short(list, 0);
    put_short(list, 0);
    put_word(list, 0);
    put_word(list, entry.header);
    list.put_bytes(std::as_bytes(std::span(entry.path)));
  }
  const uint64_t size = list.size();
  if (written_ > most_bytes) {
    return failure(ErrorCode::usage,
                   sink_.name() + ": the mesh is too large for a ZIP archive (4 GiB); write another format");
  }
  put_word(list, end_mark);
  put_word(list, 0);
  put_short(list, entries_.size());
  put_short(list, entries_.size());
  put_word(list, size);
  put_word(list, written_);
  put_short(list, 0);
  return sink_.write(list.bytes());
}

}  // namespace maille
