#pragma once

#include <maille/error.h>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace maille {

using Bytes = std::span<const std::byte>;

/// Where bytes are read from, at any offset. Implement it for storage of your own; calls may come from
/// several threads at once.
class Source {
 public:
  virtual ~Source() = default;
  /// Size in bytes.
  virtual uint64_t size() const = 0;
  /// Fills `out` with the bytes from `offset` on, all of them or an error (cannot_read, network).
  [[nodiscard]] virtual Result<> read_at(uint64_t offset, std::span<std::byte> out) const = 0;
  /// A part that is wanted: `out` is to hold the bytes from `offset` on.
  struct Part {
    uint64_t offset = 0;
    std::span<std::byte> out;
  };
  /// Fills all parts, or gives an error. What is wanted at once is asked for at once: a distant source turns
  /// it into few requests. By default, one read_at() for each.
  [[nodiscard]] virtual Result<> read_many(std::span<const Part> parts) const;
  /// Says that the bytes from `offset` on were damaged as they came. A source that keeps copies drops them
  /// and gives true: reading again may help. By default false: it would give the same.
  virtual bool forget(uint64_t offset, uint64_t size) const;
  /// All bytes when they are addressable without copying; empty otherwise.
  virtual Bytes view() const { return {}; }
  /// How messages call it: a path, an address, "<memory>".
  virtual std::string name() const = 0;
};

/// Bytes in memory: borrowed (they must outlive the source) or owned.
std::unique_ptr<Source> memory_source(Bytes bytes, std::string name = "<memory>");
std::unique_ptr<Source> memory_source(std::vector<std::byte> bytes, std::string name = "<memory>");
/// A regular file, which is read as it is wanted; anything else is read into memory. Error: cannot_read, with
/// the system's reason.
[[nodiscard]] Result<std::unique_ptr<Source>> file_source(const std::string& path);
/// The same for inputs that may be larger than memory: what is no regular file goes to a temporary file.
/// Neither function maps files, because the process would end if somebody cut the file while it is read.
/// Error: cannot_read.
[[nodiscard]] Result<std::unique_ptr<Source>> unmapped_source(const std::string& path);
/// All that an open descriptor gives, in a temporary file in `folder` (empty: $TMPDIR, or /tmp) that has no
/// name and is gone with the process. Not for several threads. Errors: cannot_read, write_failed.
[[nodiscard]] Result<std::unique_ptr<Source>> spooled_source(int descriptor, const std::string& name,
                                                             const std::string& folder = {});
/// Part of another source, such as a .maille file inside another file: `size` bytes from `offset` on. It asks
/// the other one for no byte outside; that one must outlive it. Error: cannot_read, where it ends before.
[[nodiscard]] Result<std::unique_ptr<Source>> part_source(const Source& source, uint64_t offset,
                                                          uint64_t size);
/// Standard input, read to its end.
[[nodiscard]] Result<std::unique_ptr<Source>> stdin_source();

/// Where bytes are written to, front to back.
class Sink {
 public:
  virtual ~Sink() = default;
  [[nodiscard]] virtual Result<> write(Bytes bytes) = 0;
  /// Makes what was written durable and visible. Without it, nothing appears under the final name.
  [[nodiscard]] virtual Result<> commit() = 0;
  virtual std::string name() const = 0;
};

/// Appends to `out`, which must outlive the sink.
std::unique_ptr<Sink> memory_sink(std::vector<std::byte>& out);
/// A file that appears whole or not at all: written without a name, fsync, then named (a link; over an older
/// file a link under a temporary name and rename), fsync of the folder. A process that ends before commit()
/// leaves nothing, however it ends; on file systems that have no files without names (NFS, FAT) the temporary
/// name is there from the beginning, and a sink destroyed before commit() removes it. Error: write_failed,
/// with the system's reason (no such folder, no permission, disk full) before anything is written where that
/// can be known.
[[nodiscard]] Result<std::unique_ptr<Sink>> file_sink(const std::string& path);
/// Writes behind the first `size` bytes of a file that is there; what stood behind them is cut off. Each
/// commit() makes durable what was written so far. Error: write_failed, also if somebody else has such a sink
/// of the file.
[[nodiscard]] Result<std::unique_ptr<Sink>> append_sink(const std::string& path, uint64_t size);
/// Standard output; commit() flushes.
std::unique_ptr<Sink> stdout_sink();

/// Removes the temporary files of every open file_sink that has one. Safe to call from a signal handler.
void remove_unfinished_files() noexcept;

}  // namespace maille
