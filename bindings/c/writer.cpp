// Meshes that come in portions.
#include "bytes.h"
#include "guard.h"
#include "options.h"

#include <maille/stream.h>
#include <cmath>
#include <limits>
#include <optional>

/// Declarations are collected until begin(), because the library wants all of them at once.
struct maille_writer {
  maille::c::CountedSink sink;
  maille::StreamOptions options;
  std::map<std::string, maille::Tolerance> bounds;
  std::optional<maille::StreamWriter> writer = {};  ///< from begin() to finish()
  bool finished = false;
};

namespace maille::c {
namespace {

/// For declarations: before begin().
Result<> before_begin(const maille_writer& writer) {
  if (writer.writer || writer.finished) return wrong("arrays are declared before maille_writer_begin()");
  return {};
}

Result<> begun(const maille_writer& writer) {
  if (writer.finished) return wrong("the writer is finished");
  if (!writer.writer) return wrong("maille_writer_begin() comes first");
  return {};
}

/// Runs `work`, which gives a Result<>, on a writer that takes points and cells.
template <class Work>
int32_t run_begun(maille_writer* writer, maille_error* error, std::initializer_list<Needed> needed,
                  const Work& work) {
  return run(error, needed, [&]() -> Result<> {
    if (!writer) return wrong("writer is NULL");
    if (auto ready = begun(*writer); !ready) return ready;
    return work(*writer->writer);
  });
}

template <class T>
Result<std::span<const T>> listed_numbers(const T* numbers, uint64_t count, const char* name) {
  if (!numbers && count > 0) return failure(ErrorCode::usage, std::string(name) + " is NULL");
  if (count > std::numeric_limits<ptrdiff_t>::max() / sizeof(T))
    return failure(ErrorCode::usage, std::string(name) + ": more than memory can hold");
  return std::span<const T>(numbers, static_cast<size_t>(count));
}

Result<Bytes> tuples(const StreamArray& array, const void* values, uint64_t count) {
  if (array.components != 0 && count > std::numeric_limits<ptrdiff_t>::max() / array.tuple_size())
    return failure(ErrorCode::usage, "\"" + array.name + "\": more than memory can hold");
  const auto numbers =
      listed_numbers(static_cast<const std::byte*>(values), count * array.tuple_size(), array.name.c_str());
  if (!numbers) return tl::unexpected(numbers.error());
  return Bytes(*numbers);
}

/// `count` tuples of each array of a domain.
Result<std::vector<Bytes>> tuples_of(const StreamOptions& options, Domain domain, const void* const* arrays,
                                     uint64_t count) {
  std::vector<Bytes> all;
  for (const StreamArray& array : options.arrays) {
    if (array.domain != domain) continue;
    if (!arrays) return failure(ErrorCode::usage, "arrays is NULL, but \"" + array.name + "\" was declared");
    const auto values = tuples(array, arrays[all.size()], count);
    if (!values) return tl::unexpected(values.error());
    all.push_back(*values);
  }
  return all;
}

/// NaN stands for a range that is not known; C has no optional values.
std::optional<std::pair<double, double>> range_of(double low, double high) {
  if (std::isnan(low) || std::isnan(high)) return std::nullopt;
  return std::pair(low, high);
}

Result<> declare(maille_writer& writer, StreamArray array) {
  if (auto early = before_begin(writer); !early) return early;
  if (array.domain != Domain::point && array.domain != Domain::cell)
    return wrong("\"" + array.name + "\": streams have arrays on points and on cells");
  if (const auto bound = writer.bounds.find(array.name); bound != writer.bounds.end())
    array.tolerance = bound->second;
  writer.options.arrays.push_back(std::move(array));
  return {};
}

Result<std::unique_ptr<maille_writer>> make_writer(maille_sink& sink, int32_t type,
                                                   const EncodeOptions& options) {
  const auto scalar = chosen<Scalar>(type, scalar_count, "the type of number");
  if (!scalar) return tl::unexpected(scalar.error());
  auto made = std::make_unique<maille_writer>(maille_writer{CountedSink(sink), {}, options.arrays});
  made->options.positions.type = *scalar;
  made->options.positions.tolerance = options.positions;
  made->options.effort = options.effort;
  // Streams keep the order only where it was asked for: the option's default is that of surfaces, canonical.
  made->options.any_order = options.order != Order::keep;
  made->options.executor = options.executor;
  made->options.provenance = options.provenance;
  made->options.time = options.time;
  return made;
}

/// Bounds of arrays that were never declared are mistakes, as in encode().
Result<> check_bounds(const maille_writer& writer) {
  for (const auto& bound : writer.bounds) {
    bool declared = false;
    for (const StreamArray& array : writer.options.arrays) declared = declared || array.name == bound.first;
    if (!declared) return wrong("there is a bound for \"" + bound.first + "\", but no such array");
  }
  return {};
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_writer* maille_writer_create(maille_sink* sink, int32_t type, const maille_encode_options* options,
                                    maille_error* error) {
  return make(error, {{sink, "sink"}}, [&] { return make_writer(*sink, type, options_of(options)); });
}
void maille_writer_free(maille_writer* writer) {
  delete writer;
}

int32_t maille_writer_declare(maille_writer* writer, const char* name, int32_t domain, int32_t type,
                              uint32_t components, double low, double high, maille_error* error) {
  return run(error, {{writer, "writer"}, {name, "name"}}, [&]() -> Result<> {
    const auto on = chosen<Domain>(domain, domain_count, "the domain");
    if (!on) return tl::unexpected(on.error());
    const auto scalar = chosen<Scalar>(type, scalar_count, "the type of number");
    if (!scalar) return tl::unexpected(scalar.error());
    StreamArray array;
    array.name = name;
    array.domain = *on;
    array.type = *scalar;
    array.components = components;
    array.range = range_of(low, high);
    return declare(*writer, std::move(array));
  });
}

int32_t maille_writer_set_position_range(maille_writer* writer, double low, double high,
                                         maille_error* error) {
  return run(error, {{writer, "writer"}}, [&]() -> Result<> {
    if (auto early = before_begin(*writer); !early) return early;
    writer->options.positions.range = range_of(low, high);
    return {};
  });
}

int32_t maille_writer_begin(maille_writer* writer, maille_error* error) {
  return run(error, {{writer, "writer"}}, [&]() -> Result<> {
    if (auto early = before_begin(*writer); !early) return early;
    if (auto known = check_bounds(*writer); !known) return known;
    auto begun = StreamWriter::begin(writer->sink, writer->options);
    if (!begun) return passed_on(std::move(begun));
    writer->writer.emplace(std::move(*begun));
    return {};
  });
}

int32_t maille_writer_add_points(maille_writer* writer, uint64_t first, uint64_t count, const void* positions,
                                 const void* const* arrays, maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) -> Result<> {
    const auto places = tuples(writer->options.positions, positions, count);
    if (!places) return tl::unexpected(places.error());
    const auto values = tuples_of(writer->options, Domain::point, arrays, count);
    if (!values) return tl::unexpected(values.error());
    return stream.add_points(first, *places, *values);
  });
}

int32_t maille_writer_add_numbered_points(maille_writer* writer, const uint64_t* numbers, uint64_t count,
                                          const void* positions, const void* const* arrays,
                                          maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) -> Result<> {
    const auto list = listed_numbers(numbers, count, "numbers");
    if (!list) return tl::unexpected(list.error());
    const auto places = tuples(writer->options.positions, positions, count);
    if (!places) return tl::unexpected(places.error());
    const auto values = tuples_of(writer->options, Domain::point, arrays, count);
    if (!values) return tl::unexpected(values.error());
    return stream.add_points(*list, *places, *values);
  });
}

int32_t maille_writer_begin_block(maille_writer* writer, const char* name, int32_t cell_type,
                                  maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) -> Result<> {
    const auto type = chosen<CellType>(cell_type, 256, "the cell type");
    if (!type) return tl::unexpected(type.error());
    return stream.begin_block(text(name), *type);
  });
}

int32_t maille_writer_add_cells(maille_writer* writer, int32_t cell_type, uint64_t cells, uint64_t nodes,
                                const uint64_t* connectivity, const uint8_t* last_use,
                                const void* const* arrays, maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) -> Result<> {
    const auto type = chosen<CellType>(cell_type, 256, "the cell type");
    if (!type) return tl::unexpected(type.error());
    const uint64_t each = nodes != 0 ? nodes : nodes_of(*type);
    if (each == 0)
      return wrong(std::string("cells of type ") + name_of(*type) + ": say how many nodes they have");
    // Divided, so that the product below cannot wrap.
    if (cells > std::numeric_limits<ptrdiff_t>::max() / sizeof(uint64_t) / each)
      return wrong("cells: more than memory can hold");
    const auto entries = listed_numbers(connectivity, cells * each, "connectivity");
    if (!entries) return tl::unexpected(entries.error());
    const auto values = tuples_of(writer->options, Domain::cell, arrays, cells);
    if (!values) return tl::unexpected(values.error());
    return stream.add_cells(*type, *entries, std::span(last_use, last_use ? entries->size() : 0), *values,
                            static_cast<size_t>(each));
  });
}

int32_t maille_writer_add_polyhedron(maille_writer* writer, const uint32_t* face_sizes, uint64_t faces,
                                     const uint64_t* connectivity, const uint8_t* last_use,
                                     const void* const* arrays, maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) -> Result<> {
    const auto sizes = listed_numbers(face_sizes, faces, "face_sizes");
    if (!sizes) return tl::unexpected(sizes.error());
    uint64_t corners = 0;  // below 2^64: each is below 2^32, and there are fewer than 2^61
    for (const uint32_t size : *sizes) corners += size;
    const auto entries = listed_numbers(connectivity, corners, "connectivity");
    if (!entries) return tl::unexpected(entries.error());
    const auto values = tuples_of(writer->options, Domain::cell, arrays, 1);
    if (!values) return tl::unexpected(values.error());
    return stream.add_polyhedron(*sizes, *entries, std::span(last_use, last_use ? entries->size() : 0),
                                 *values);
  });
}

int32_t maille_writer_end_points(maille_writer* writer, const uint64_t* numbers, uint64_t count,
                                 maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) -> Result<> {
    const auto list = listed_numbers(numbers, count, "numbers");
    if (!list) return tl::unexpected(list.error());
    return stream.end_points(*list);
  });
}

int32_t maille_writer_flush(maille_writer* writer, maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) { return stream.flush(); });
}

int32_t maille_writer_finish(maille_writer* writer, maille_error* error) {
  return run_begun(writer, error, {}, [&](StreamWriter& stream) -> Result<> {
    // Set even if finish() fails: what was written by then cannot be continued.
    writer->finished = true;
    const auto report = stream.finish();
    if (!report) return tl::unexpected(report.error());
    return {};
  });
}
