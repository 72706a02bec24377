// What a callback in C++ throws must end the call with an error, not the program.
#include "testing.h"

#include <stdexcept>

namespace {

int32_t throw_read(void*, uint64_t, void*, uint64_t) {
  throw std::runtime_error("read");
}
int32_t throw_write(void*, const void*, uint64_t) {
  throw 1;
}
int32_t throw_commit(void*) {
  throw std::bad_alloc();
}
int32_t throw_progress(void*, const char*, double) {
  throw std::runtime_error("progress");
}
int64_t throw_stream(void*, void*, uint64_t) {
  throw std::runtime_error("stream");
}
int32_t take(void*, const void*, uint64_t) {
  return 0;
}
void throw_note(void*, const char*) {
  throw std::runtime_error("no notes, please");
}

}  // namespace

int main() {
  maille_error* error = maille_error_create();
  const sheet s = make_sheet(20);
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  maille_source* source = maille_source_callbacks(1000, throw_read, nullptr, nullptr, error);
  NOTHING(MAILLE_CANNOT_READ, maille_decode(source, nullptr, error));
  NOTHING(MAILLE_CANNOT_READ, maille_reader_callbacks(throw_stream, nullptr, nullptr, nullptr, error));
  maille_source_free(source);

  maille_sink* sink = maille_sink_callbacks(throw_write, nullptr, nullptr, nullptr, error);
  FAILS(MAILLE_WRITE_FAILED, maille_encode(mesh, nullptr, sink, error));
  maille_sink_free(sink);
  sink = maille_sink_callbacks(take, throw_commit, nullptr, nullptr, error);
  FAILS(MAILLE_WRITE_FAILED, maille_encode(mesh, nullptr, sink, error));
  maille_sink_free(sink);

  maille_encode_options* options = maille_encode_options_create(error);
  for (const uint32_t threads : {1u, 2u}) {
    OK(maille_encode_options_set_threads(options, threads, error));
    OK(maille_encode_options_set_progress(options, throw_progress, nullptr, error));
    sink = maille_sink_memory(error);
    FAILS(MAILLE_CANCELLED, maille_encode(mesh, options, sink, error));
    maille_sink_free(sink);
  }
  // OBJ has no heights: a note, when the file is there already.
  FAILS(MAILLE_INTERNAL, maille_write_mesh(mesh, "exceptions.obj", nullptr, throw_note, nullptr, error));
  remove("exceptions.obj");
  maille_encode_options_free(options);
  maille_mesh_free(mesh);
  maille_error_free(error);
  return failures > 0;
}
