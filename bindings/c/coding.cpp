// Whole meshes: encode, decode, files of other formats, steps of time.
#include "bytes.h"
#include "guard.h"
#include "mesh.h"
#include "options.h"

#include <maille/file.h>
#include <maille/folder.h>
#include <maille/http.h>
#include <maille/io.h>
#include <maille/stream.h>

namespace maille::c {
namespace {

using Notes = void (*)(void* user, const char* sentence);

bool ends_with(const std::string& path, std::string_view end) {
  return path.size() >= end.size() && path.compare(path.size() - end.size(), end.size(), end) == 0;
}

Result<> write_foreign(const Mesh& mesh, const std::string& path, Notes notes, void* user) {
  const auto written = write_mesh(mesh, path);
  if (!written) return tl::unexpected(written.error());
  for (const std::string& note : *written) {
    if (notes) notes(user, note.c_str());
  }
  return {};
}

Result<std::unique_ptr<maille_mesh>> with_notes(Result<ReadResult> read) {
  if (!read) return passed_on(std::move(read));
  auto made = handle(std::move(read->mesh));
  if (made) (*made)->notes = std::move(read->notes);
  return made;
}

/// Reads .maille files and foreign formats alike; the first bytes decide, not the name.
Result<std::unique_ptr<maille_mesh>> read_any(const std::string& path, const DecodeOptions& options) {
  ReadOptions reading;
  reading.limits = options.limits;
  reading.progress = options.progress;
  if (!is_url(path)) {
    // Folders (OpenFOAM) and files that name others (.pvtu) are opened by their readers.
    const auto file = file_source(path);
    if (!file || !is_maille(**file)) return with_notes(read_mesh(path, reading));
    return handle(decode(**file, options));
  }
  const auto remote = http_source(path);
  if (!remote) return tl::unexpected(remote.error());
  if (is_maille(**remote)) return handle(decode(**remote, options));
  return with_notes(read_mesh(**remote, reading));
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

int32_t maille_encode(const maille_mesh* mesh, const maille_encode_options* options, maille_sink* sink,
                      maille_error* error) {
  return run(error, {{mesh, "mesh"}, {sink, "sink"}}, [&]() -> Result<> {
    // Two files behind each other are no .maille file, and a reader would take the second one for damage.
    if (sink->size != 0) return wrong("the sink has a file already; make another one");
    CountedSink counted(*sink);
    const auto report = encode(mesh->mesh, counted, options_of(options));
    if (!report) return tl::unexpected(report.error());
    return {};
  });
}

int32_t maille_write_mesh(const maille_mesh* mesh, const char* path, const maille_encode_options* options,
                          void (*notes)(void* user, const char* sentence), void* user, maille_error* error) {
  return run(error, {{mesh, "mesh"}, {path, "path"}}, [&]() -> Result<> {
    if (!ends_with(path, ".maille")) return write_foreign(mesh->mesh, path, notes, user);
    const auto sink = file_sink(path);
    if (!sink) return tl::unexpected(sink.error());
    const auto report = encode(mesh->mesh, **sink, options_of(options));
    if (!report) return tl::unexpected(report.error());
    return {};
  });
}

maille_mesh* maille_decode(const maille_source* source, const maille_decode_options* options,
                           maille_error* error) {
  return make(error, {{source, "source"}},
              [&] { return handle(decode(*source->source, options_of(options))); });
}

maille_mesh* maille_salvage(const maille_source* source, const maille_decode_options* options,
                            maille_error* error) {
  return make(error, {{source, "source"}}, [&]() -> Result<std::unique_ptr<maille_mesh>> {
    auto salvaged = salvage(*source->source, options_of(options));
    if (!salvaged) return passed_on(std::move(salvaged));
    auto made = handle(std::move(salvaged->mesh));
    if (made && salvaged->damage) (*made)->notes.push_back(salvaged->damage->message);
    return made;
  });
}

maille_mesh* maille_read_mesh(const char* path_or_url, const maille_decode_options* options,
                              maille_error* error) {
  return make(error, {{path_or_url, "path_or_url"}},
              [&] { return read_any(path_or_url, options_of(options)); });
}

const char* maille_format_name(uint64_t number) {
  const FormatInfo* const format = at(formats(), number);
  return format ? format->name.c_str() : nullptr;
}

int32_t maille_format_writable(uint64_t number) {
  const FormatInfo* const format = at(formats(), number);
  return format && format->writable ? 1 : 0;
}

int32_t maille_verify(const maille_source* source, maille_error* error) {
  return run(error, {{source, "source"}}, [&]() -> Result<> {
    const auto damage = verify_checksums(*source->source);
    if (!damage) return tl::unexpected(damage.error());
    if (damage->empty()) return {};
    return failure(ErrorCode::corrupt, damage->front());
  });
}

int32_t maille_append_step(const char* path, double time, const maille_mesh* mesh,
                           const maille_encode_options* options, uint64_t* step, maille_error* error) {
  return run(error, {{path, "path"}, {mesh, "mesh"}}, [&]() -> Result<> {
    const auto report = append_step(path, time, mesh->mesh, options_of(options));
    if (!report) return tl::unexpected(report.error());
    if (step) *step = report->number;
    return {};
  });
}
