#include "io/gzip.h"

#include <zlib.h>
#include <algorithm>
#include "base/result.h"

namespace maille {
namespace {

constexpr int gzip_window = 15 + 16;  // zlib: largest window, gzip wrapper

/// zlib counts input in 32 bits (uInt); larger input is handed over in pieces of at most 1 GiB.
uInt piece_of(size_t size) {
  return static_cast<uInt>(std::min<size_t>(size, size_t{1} << 30));
}

/// One pass over the members of a gzip file (RFC 1952: members may follow each other, and their contents are
/// joined).
class Inflater {
 public:
  explicit Inflater(Bytes bytes) : left_(bytes) { ok_ = inflateInit2(&stream_, gzip_window) == Z_OK; }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  enum class Status { more, done, damaged, truncated };

  /// Fills up to `room.size()` bytes and says how many.
  Status fill(std::span<std::byte> room, size_t& filled) {
    filled = 0;
    while (ok_ && filled < room.size()) {
      if (member_ended_) {
        // Bytes behind the last member that are no gzip (padding of tapes) are ignored, as gzip does.
        if (!is_gzip(left_)) return Status::done;
        inflateReset(&stream_);
        member_ended_ = false;
      }
      const uInt given = piece_of(left_.size());
      const uInt space = piece_of(room.size() - filled);
      // zlib's interface takes no const, but does not write to its input.
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(left_.data()));
      stream_.avail_in = given;
      stream_.next_out = reinterpret_cast<Bytef*>(room.data() + filled);
      stream_.avail_out = space;
      const int status = inflate(&stream_, Z_NO_FLUSH);
      left_ = left_.subspan(given - stream_.avail_in);
      filled += space - stream_.avail_out;
      if (status == Z_STREAM_END) {
        member_ended_ = true;
        // No progress is possible: the input ended inside a member. This ends the loop on cut files.
      } else if (status == Z_BUF_ERROR) {
        return Status::truncated;
      } else if (status != Z_OK) {
        ok_ = false;
      } else if (left_.empty() && filled < room.size()) {
        return Status::truncated;
      }
    }
    return ok_ ? Status::more : Status::damaged;
  }

 private:
  z_stream stream_{};
  Bytes left_;
  bool ok_ = false;
  bool member_ended_ = false;
};

/// deflateInit2 leaves name and time stamp of the header empty, so equal bytes make equal files.
class GzipSink final : public Sink {
 public:
  explicit GzipSink(Sink& sink) : sink_(sink), buffer_(size_t{1} << 18) {
    ok_ =
        deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, gzip_window, 8, Z_DEFAULT_STRATEGY) == Z_OK;
  }
  ~GzipSink() override { deflateEnd(&stream_); }

  Result<> write(Bytes bytes) override {
    while (!bytes.empty()) {
      const uInt given = piece_of(bytes.size());
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
      stream_.avail_in = given;
      MAILLE_CHECK(run(Z_NO_FLUSH));
      bytes = bytes.subspan(given);
    }
    return {};
  }
  Result<> commit() override {
    stream_.avail_in = 0;
    return run(Z_FINISH);
  }
  std::string name() const override { return sink_.name(); }

 private:
  Result<> run(int flush) {
    if (!ok_) return failure(ErrorCode::write_failed, name() + ": zlib has no memory");
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      deflate(&stream_, flush);
      MAILLE_CHECK(sink_.write(Bytes(buffer_.data(), buffer_.size() - stream_.avail_out)));
      // A buffer that is not full means that zlib has no more output for this input.
    } while (stream_.avail_out == 0);
    return {};
  }

  Sink& sink_;
  std::vector<std::byte> buffer_;
  z_stream stream_{};
  bool ok_ = false;
};

}  // namespace

bool is_gzip(Bytes bytes) {
  return bytes.size() >= 3 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b} &&
         bytes[2] == std::byte{8};
}

namespace {

/// How many bytes there are, which a gzip file does not say; `status`: whether all is well with it.
Result<uint64_t> unpacked_size(Bytes bytes, uint64_t limit, const std::string& name,
                               Inflater::Status& status) {
  Inflater inflater(bytes);
  std::vector<std::byte> room(size_t{1} << 16);
  uint64_t used = 0;
  for (status = Inflater::Status::more; status == Inflater::Status::more;) {
    size_t filled = 0;
    status = inflater.fill(room, filled);
    used += filled;
    if (used > limit) {
      return failure(ErrorCode::memory_bound,
                     name + ": unpacks to more than the " + std::to_string(limit) +
                         " bytes allowed; raise the memory limit if you trust the file");
    }
  }
  return used;
}

}  // namespace

// The data are unpacked twice: once to count, once into a buffer of the right size. Growing a buffer takes up
// to three times the memory, and unpacking is fast beside reading a mesh. The size that gzip files end with
// is not used: it is modulo 2^32, of the last member only, and anybody's claim.
Result<std::vector<std::byte>> gunzip(Bytes bytes, uint64_t limit, const std::string& name) {
  auto status = Inflater::Status::more;
  const uint64_t used = MAILLE_TRY(unpacked_size(bytes, limit, name, status));
  if (status == Inflater::Status::truncated) {
    return failure(ErrorCode::malformed_input, name + ": the gzip data ends too early (after " +
                                                   std::to_string(used) + " unpacked bytes)");
  }
  if (status == Inflater::Status::damaged) {
    return failure(ErrorCode::malformed_input,
                   name + ": the gzip data is damaged (after " + std::to_string(used) + " unpacked bytes)");
  }
  std::vector<std::byte> out(static_cast<size_t>(used));
  size_t filled = 0;
  Inflater(bytes).fill(out, filled);
  return out;
}

std::vector<std::byte> gunzip_front(Bytes bytes, size_t count) {
  std::vector<std::byte> out(count);
  size_t filled = 0;
  Inflater(bytes).fill(out, filled);
  out.resize(filled);
  return out;
}

std::unique_ptr<Sink> gzip_sink(Sink& sink) {
  return std::make_unique<GzipSink>(sink);
}

}  // namespace maille
