// The mesh at hand as a PLY file, as `maille extract` writes it. In the full decoder only.
#include <maille/io.h>
#include <maille/source.h>

#include "reader.h"

namespace maille::wasm {
namespace {

class Collected : public Sink {
 public:
  explicit Collected(std::vector<std::byte>& to) : to_(to) {}

  Result<> write(Bytes bytes) override {
    to_.insert(to_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<> commit() override { return {}; }
  std::string name() const override { return "<ply>"; }

 private:
  std::vector<std::byte>& to_;
};

}  // namespace

/// numbers: address and size of the file, valid until maille_clear(); points and cells of the mesh.
/// message(): what PLY could not hold, a line each.
MAILLE_EXPORT int32_t maille_ply(Reader* reader) {
  reader->written.clear();
  Collected sink(reader->written);
  const auto notes = write_mesh(reader->mesh, sink, {.format = "ply"});
  if (!notes) return reader->outcome(notes.error());
  reader->message.clear();
  for (const std::string& note : *notes) reader->message += note + '\n';
  reader->numbers = {double(reinterpret_cast<uintptr_t>(reader->written.data())),
                     double(reader->written.size()), double(reader->mesh.point_count()),
                     double(reader->mesh.cell_count())};
  return done;
}

}  // namespace maille::wasm
