#pragma once

#include <maille.h>

#include <maille/source.h>
#include <memory>
#include <vector>

/// These structs are what C sees as opaque handles. Each is freed by its own maille_..._free().
struct maille_source {
  std::unique_ptr<maille::Source> source;
};

struct maille_sink {
  std::vector<std::byte> bytes;  ///< of a sink in memory
  bool in_memory = false;
  uint64_t size = 0;
  std::unique_ptr<maille::Sink> target;
};

namespace maille::c {

/// Counts the bytes that go into a sink of C, so that a second mesh in the same sink can be refused.
class CountedSink final : public Sink {
 public:
  explicit CountedSink(maille_sink& sink) : sink_(sink) {}
  Result<> write(Bytes bytes) override;
  Result<> commit() override { return sink_.target->commit(); }
  std::string name() const override { return sink_.target->name(); }

 private:
  maille_sink& sink_;
};

/// A file, or what an address has.
Result<std::unique_ptr<Source>> open_bytes(const std::string& path_or_url);

}  // namespace maille::c
