// Meshes that go out in portions.
#include "bytes.h"
#include "guard.h"
#include "mesh.h"
#include "options.h"

#include <maille/stream.h>

struct maille_reader {
  maille::StreamReader reader;
  maille::StreamPortion portion = {};
};

namespace maille::c {
namespace {

/// A function of the C program as a stream. Its answer is checked, since a count beyond the buffer would make
/// the library read memory that nobody filled.
class CallbackStream final : public ByteStream {
 public:
  CallbackStream(maille_read read, void* user, std::string name)
      : read_(read), user_(user), name_(std::move(name)) {}

  Result<size_t> read(std::span<std::byte> out) override {
    int64_t got = -1;
    try {
      got = read_(user_, out.data(), out.size());
    } catch (...) {
      got = -1;
    }
    if (got >= 0 && static_cast<uint64_t>(got) <= out.size()) return static_cast<size_t>(got);
    return failure(ErrorCode::cannot_read, name_ + ": could not be read");
  }
  std::string name() const override { return name_; }

 private:
  maille_read read_;
  void* user_;
  std::string name_;
};

StreamReadOptions reading_options(const DecodeOptions& options) {
  StreamReadOptions reading;
  reading.limits = options.limits;
  reading.executor = options.executor;
  // Without this, files whose order stands apart from their cells would be refused. Their portions come in
  // the order of the file.
  reading.any_order = true;
  return reading;
}

Result<std::unique_ptr<maille_reader>> reader_handle(Result<StreamReader> reader) {
  if (!reader) return passed_on(std::move(reader));
  return std::make_unique<maille_reader>(maille_reader{std::move(*reader)});
}

const StreamArray* array_of(const maille_reader* reader, uint64_t array) {
  return reader ? at(reader->reader.description().arrays, array) : nullptr;
}

/// A portion lists point arrays and cell arrays apart, while C numbers all arrays together as they were
/// declared.
const std::vector<std::byte>* values_of(const maille_reader* reader, uint64_t array) {
  const StreamArray* const found = array_of(reader, array);
  if (!found) return nullptr;
  const auto& arrays = reader->reader.description().arrays;
  uint64_t place = 0;
  for (uint64_t i = 0; i < array; ++i)
    place += arrays[static_cast<size_t>(i)].domain == found->domain ? 1 : 0;
  const bool of_points = found->domain == Domain::point;
  return at(of_points ? reader->portion.point_arrays : reader->portion.cell_arrays, place);
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_reader* maille_reader_open(const maille_source* source, const maille_decode_options* options,
                                  maille_error* error) {
  return make(error, {{source, "source"}}, [&] {
    const DecodeOptions decoding = options_of(options);
    return reader_handle(StreamReader::open(*source->source, decoding.step, reading_options(decoding)));
  });
}

maille_reader* maille_reader_callbacks(maille_read read, void* user, const char* name,
                                       const maille_decode_options* options, maille_error* error) {
  return make(error, {{reinterpret_cast<const void*>(read), "read"}}, [&] {
    auto bytes = std::make_unique<CallbackStream>(read, user, name ? name : "<callbacks>");
    return reader_handle(StreamReader::open(std::move(bytes), reading_options(options_of(options))));
  });
}

void maille_reader_free(maille_reader* reader) {
  delete reader;
}

int32_t maille_reader_position_type(const maille_reader* reader) {
  return reader ? static_cast<int32_t>(reader->reader.description().positions.type) : -1;
}
uint64_t maille_reader_arrays(const maille_reader* reader) {
  return reader ? reader->reader.description().arrays.size() : 0;
}
const char* maille_reader_array_name(const maille_reader* reader, uint64_t array) {
  const StreamArray* const found = array_of(reader, array);
  return found ? found->name.c_str() : nullptr;
}
int32_t maille_reader_array_domain(const maille_reader* reader, uint64_t array) {
  const StreamArray* const found = array_of(reader, array);
  return found ? static_cast<int32_t>(found->domain) : -1;
}
int32_t maille_reader_array_type(const maille_reader* reader, uint64_t array) {
  const StreamArray* const found = array_of(reader, array);
  return found ? static_cast<int32_t>(found->type) : -1;
}
uint32_t maille_reader_array_components(const maille_reader* reader, uint64_t array) {
  const StreamArray* const found = array_of(reader, array);
  return found ? found->components : 0;
}

int32_t maille_reader_next(maille_reader* reader, int32_t* more, maille_error* error) {
  if (more) *more = 0;  // also where it fails: loops end
  return run(error, {{reader, "reader"}, {more, "more"}}, [&]() -> Result<> {
    const auto next = reader->reader.next(reader->portion);
    if (!next) return tl::unexpected(next.error());
    *more = *next ? 1 : 0;
    return {};
  });
}

uint64_t maille_reader_cells(const maille_reader* reader) {
  return reader ? reader->portion.cell_count() : 0;
}
uint64_t maille_reader_first_cell(const maille_reader* reader) {
  return reader ? reader->portion.first_cell : 0;
}
const uint8_t* maille_reader_types(const maille_reader* reader, uint64_t* count) {
  static_assert(sizeof(CellType) == 1);
  return reinterpret_cast<const uint8_t*>(reader ? listed(reader->portion.types, count)
                                                 : none<CellType>(count));
}
const uint64_t* maille_reader_offsets(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.offsets, count) : none<uint64_t>(count);
}
const uint64_t* maille_reader_connectivity(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.connectivity, count) : none<uint64_t>(count);
}
const uint32_t* maille_reader_connectivity_slots(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.slots, count) : none<uint32_t>(count);
}
const uint32_t* maille_reader_face_sizes(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.face_sizes, count) : none<uint32_t>(count);
}
const uint64_t* maille_reader_cell_faces(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.cell_faces, count) : none<uint64_t>(count);
}
const uint64_t* maille_reader_points(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.points, count) : none<uint64_t>(count);
}
const uint32_t* maille_reader_point_slots(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.point_slots, count) : none<uint32_t>(count);
}
const void* maille_reader_positions(const maille_reader* reader, uint64_t* bytes) {
  return reader ? listed(reader->portion.positions, bytes) : none<std::byte>(bytes);
}
const void* maille_reader_values(const maille_reader* reader, uint64_t array, uint64_t* bytes) {
  const std::vector<std::byte>* const values = values_of(reader, array);
  return values ? listed(*values, bytes) : none<std::byte>(bytes);
}
const uint32_t* maille_reader_ended_slots(const maille_reader* reader, uint64_t* count) {
  return reader ? listed(reader->portion.ended_slots, count) : none<uint32_t>(count);
}
uint32_t maille_reader_slots(const maille_reader* reader) {
  return reader ? reader->portion.slot_count : 0;
}
