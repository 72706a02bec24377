#include "bytes.h"

#include "guard.h"

#include <maille/http.h>

namespace maille::c {
namespace {

/// A source and a sink that call functions of the C program. A program in C++ may pass functions that throw;
/// these exceptions end here and become errors.
class CallbackSource final : public Source {
 public:
  CallbackSource(uint64_t size, maille_read_at read_at, void* user, std::string name)
      : size_(size), read_at_(read_at), user_(user), name_(std::move(name)) {}

  uint64_t size() const override { return size_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    const bool inside = offset <= size_ && out.size() <= size_ - offset;
    // The caller's function is never asked for no bytes.
    if (out.empty() && inside) return {};
    if (inside && ask(offset, out)) return {};
    return failure(ErrorCode::cannot_read, name_ + ": " + std::to_string(out.size()) + " bytes from byte " +
                                               std::to_string(offset) + " on could not be read" +
                                               (inside ? "" : ": it ends before"));
  }
  std::string name() const override { return name_; }

 private:
  bool ask(uint64_t offset, std::span<std::byte> out) const {
    try {
      return read_at_(user_, offset, out.data(), out.size()) == 0;
    } catch (...) {
      return false;
    }
  }

  uint64_t size_;
  maille_read_at read_at_;
  void* user_;
  std::string name_;
};

class CallbackSink final : public Sink {
 public:
  CallbackSink(maille_write write, maille_commit commit, void* user, std::string name)
      : write_(write), commit_(commit), user_(user), name_(std::move(name)) {}

  Result<> write(Bytes bytes) override {
    return done([&] { return bytes.empty() ? 0 : write_(user_, bytes.data(), bytes.size()); });
  }
  Result<> commit() override {
    return done([&] { return commit_ ? commit_(user_) : 0; });
  }
  std::string name() const override { return name_; }

 private:
  template <class Call>
  Result<> done(const Call& call) {
    try {
      if (call() == 0) return {};
    } catch (...) {
    }
    return failure(ErrorCode::write_failed, name_ + ": could not be written to");
  }

  maille_write write_;
  maille_commit commit_;
  void* user_;
  std::string name_;
};

Result<std::unique_ptr<maille_source>> source_handle(Result<std::unique_ptr<Source>> source) {
  if (!source) return passed_on(std::move(source));
  auto made = std::make_unique<maille_source>();
  made->source = std::move(*source);
  return made;
}

Result<std::unique_ptr<maille_sink>> sink_handle(Result<std::unique_ptr<Sink>> sink) {
  if (!sink) return passed_on(std::move(sink));
  auto made = std::make_unique<maille_sink>();
  made->target = std::move(*sink);
  return made;
}

std::string named(const char* name) {
  return name ? name : "<callbacks>";
}

}  // namespace

// Counts what has arrived, also where the write after it fails: maille_encode() refuses a sink that has
// bytes.
Result<> CountedSink::write(Bytes bytes) {
  auto written = sink_.target->write(bytes);
  if (written) sink_.size += bytes.size();
  return written;
}

Result<std::unique_ptr<Source>> open_bytes(const std::string& path_or_url) {
  if (is_url(path_or_url)) return http_source(path_or_url);
  return file_source(path_or_url);
}

}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_source* maille_source_memory(const void* bytes, uint64_t size, maille_error* error) {
  // NULL is fine for no bytes, as malloc(0) may return it, but check() refuses it.
  static const std::byte none{};
  return make(error, {{size == 0 ? &none : bytes, "bytes"}}, [&] {
    return source_handle(
        memory_source(Bytes(static_cast<const std::byte*>(bytes), static_cast<size_t>(size))));
  });
}

maille_source* maille_source_open(const char* path_or_url, maille_error* error) {
  return make(error, {{path_or_url, "path_or_url"}}, [&] { return source_handle(open_bytes(path_or_url)); });
}

maille_source* maille_source_callbacks(uint64_t size, maille_read_at read_at, void* user, const char* name,
                                       maille_error* error) {
  return make(error, {{reinterpret_cast<const void*>(read_at), "read_at"}}, [&] {
    return source_handle(std::make_unique<CallbackSource>(size, read_at, user, named(name)));
  });
}

maille_source* maille_source_part(const maille_source* source, uint64_t offset, uint64_t size,
                                  maille_error* error) {
  return make(error, {{source, "source"}},
              [&] { return source_handle(part_source(*source->source, offset, size)); });
}

uint64_t maille_source_size(const maille_source* source) {
  return source ? source->source->size() : 0;
}

int32_t maille_source_read(const maille_source* source, uint64_t offset, void* out, uint64_t size,
                           maille_error* error) {
  return run(error, {{source, "source"}, {out, "out"}}, [&] {
    return source->source->read_at(offset, {static_cast<std::byte*>(out), static_cast<size_t>(size)});
  });
}

void maille_source_free(maille_source* source) {
  delete source;
}

maille_sink* maille_sink_memory(maille_error* error) {
  return make(error, {}, [&]() -> Result<std::unique_ptr<maille_sink>> {
    auto sink = std::make_unique<maille_sink>();
    sink->in_memory = true;
    sink->target = memory_sink(sink->bytes);
    return sink;
  });
}

maille_sink* maille_sink_file(const char* path, maille_error* error) {
  return make(error, {{path, "path"}}, [&] { return sink_handle(file_sink(path)); });
}

maille_sink* maille_sink_callbacks(maille_write write, maille_commit commit, void* user, const char* name,
                                   maille_error* error) {
  return make(error, {{reinterpret_cast<const void*>(write), "write"}},
              [&] { return sink_handle(std::make_unique<CallbackSink>(write, commit, user, named(name))); });
}

uint64_t maille_sink_size(const maille_sink* sink) {
  return sink ? sink->size : 0;
}

const void* maille_sink_bytes(const maille_sink* sink) {
  return sink && sink->in_memory ? sink->bytes.data() : nullptr;
}

void maille_sink_free(maille_sink* sink) {
  delete sink;
}
