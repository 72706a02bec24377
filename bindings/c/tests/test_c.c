/* The library for C, function by function. Each test is a claim. */
#include "testing.h"

#include <threads.h>

static maille_error* error;
static const char* folder = ".";

static const char* in_folder(const char* name) {
  static char path[4096];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  return path;
}

/* ---- Errors, sources, sinks ---- */

static void versions_are_told(void) {
  uint32_t major = 99, minor = 99;
  CHECK(maille_abi_version() == 1);
  CHECK(strlen(maille_library_version()) >= 5);
  maille_format_version(&major, &minor);
  CHECK(major == 0 && minor < 99);
  maille_format_version(NULL, NULL);
}

static void errors_are_a_code_and_a_sentence(void) {
  maille_error* e = maille_error_create();
  CHECK(maille_error_code(e) == MAILLE_OK && strcmp(maille_error_message(e), "") == 0);
  CHECK(maille_source_open("/no/such/file", e) == NULL);
  CHECK(maille_error_code(e) == MAILLE_CANNOT_READ);
  CHECK(strstr(maille_error_message(e), "/no/such/file") != NULL);
  maille_error_clear(e);
  CHECK(maille_error_code(e) == MAILLE_OK && strcmp(maille_error_message(e), "") == 0);
  maille_error_free(e);
  CHECK(maille_source_open("/no/such/file", NULL) == NULL); /* nobody wants to know */
  CHECK(maille_error_code(NULL) == MAILLE_OK);
  CHECK(strcmp(maille_error_message(NULL), "") == 0);
  maille_error_clear(NULL);
  maille_error_free(NULL);
}

static int32_t read_text(void* user, uint64_t offset, void* out, uint64_t size) {
  memcpy(out, (const char*)user + offset, size);
  return 0;
}
static int32_t read_nothing(void* user, uint64_t offset, void* out, uint64_t size) {
  (void)user, (void)offset, (void)out, (void)size;
  return 7;
}

static void sources_are_memory_files_functions_and_parts_of_others(void) {
  char text[] = "0123456789";
  char out[4] = {0};
  maille_source* all = maille_source_callbacks(10, read_text, text, "ten", error);
  maille_source* part = maille_source_part(all, 3, 4, error);
  maille_source* memory = maille_source_memory(text, 10, error);
  CHECK(maille_source_size(part) == 4 && maille_source_size(memory) == 10);
  OK(maille_source_read(part, 1, out, 3, error));
  CHECK(memcmp(out, "456", 3) == 0);
  OK(maille_source_read(memory, 7, out, 3, error));
  CHECK(memcmp(out, "789", 3) == 0);
  FAILS(MAILLE_CANNOT_READ, maille_source_read(part, 2, out, 3, error));
  FAILS(MAILLE_CANNOT_READ, maille_source_read(all, UINT64_MAX, out, 3, error));
  NOTHING(MAILLE_CANNOT_READ, maille_source_part(all, 8, 3, error));
  NOTHING(MAILLE_USAGE, maille_source_memory(NULL, 3, error));
  NOTHING(MAILLE_USAGE, maille_source_callbacks(3, NULL, NULL, NULL, error));
  NOTHING(MAILLE_USAGE, maille_source_open(NULL, error));
  NOTHING(MAILLE_USAGE, maille_source_part(NULL, 0, 0, error));
  FAILS(MAILLE_USAGE, maille_source_read(NULL, 0, out, 1, error));
  maille_source_free(part);
  maille_source_free(all);
  maille_source_free(memory);
  maille_source_free(NULL);
  all = maille_source_callbacks(10, read_nothing, NULL, NULL, error);
  FAILS(MAILLE_CANNOT_READ, maille_source_read(all, 0, out, 3, error));
  NOTHING(MAILLE_CANNOT_READ, maille_decode(all, NULL, error));
  maille_source_free(all);
}

typedef struct {
  uint64_t size, most;
  int commits;
} counter;
static int32_t count_bytes(void* user, const void* bytes, uint64_t size) {
  counter* c = user;
  (void)bytes;
  c->size += size;
  return c->size > c->most;
}
static int32_t count_commits(void* user) {
  ++((counter*)user)->commits;
  return 0;
}

static void sinks_are_memory_files_and_functions(void) {
  const sheet s = make_sheet(20);
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  counter c = {0, UINT64_MAX, 0};
  maille_sink* sink = maille_sink_callbacks(count_bytes, count_commits, &c, "counter", error);
  OK(maille_encode(mesh, NULL, sink, error));
  CHECK(c.size > 100 && c.size == maille_sink_size(sink) && c.commits == 1);
  CHECK(maille_sink_bytes(sink) == NULL);
  FAILS(MAILLE_USAGE, maille_encode(mesh, NULL, sink, error)); /* it has its file */
  maille_sink_free(sink);

  counter full = {0, 50, 0};
  sink = maille_sink_callbacks(count_bytes, NULL, &full, "full", error);
  FAILS(MAILLE_WRITE_FAILED, maille_encode(mesh, NULL, sink, error));
  CHECK(strstr(maille_error_message(error), "full") != NULL);
  maille_sink_free(sink);

  sink = maille_sink_file(in_folder("sink.maille"), error);
  OK(maille_encode(mesh, NULL, sink, error));
  CHECK(maille_sink_size(sink) == c.size);
  maille_sink_free(sink);
  maille_source* source = maille_source_open(in_folder("sink.maille"), error);
  CHECK(maille_source_size(source) == c.size);
  OK(maille_verify(source, error));
  maille_source_free(source);

  NOTHING(MAILLE_WRITE_FAILED, maille_sink_file("/no/such/folder/x.maille", error));
  NOTHING(MAILLE_USAGE, maille_sink_file(NULL, error));
  NOTHING(MAILLE_USAGE, maille_sink_callbacks(NULL, NULL, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_encode(NULL, NULL, NULL, error));
  CHECK(maille_sink_size(NULL) == 0 && maille_sink_bytes(NULL) == NULL);
  maille_sink_free(NULL);
  maille_mesh_free(mesh);
}

/* ---- Meshes ---- */

static void a_mesh_gives_back_what_it_was_given(void) {
  static const float positions[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1};
  static const uint64_t offsets[] = {0, 4, 7};
  static const uint32_t connectivity[] = {0, 1, 2, 3, 0, 1, 4};
  static const uint8_t types[] = {MAILLE_QUAD, MAILLE_TRIANGLE};
  static const uint8_t kinds[] = {0, 1};
  uint64_t count = 0;
  maille_mesh* mesh = maille_mesh_create(error);
  OK(maille_mesh_set_points(mesh, MAILLE_F32, 5, positions, MAILLE_COPY, error));
  OK(maille_mesh_add_block(mesh, "faces", MAILLE_MIXED, 2, offsets, connectivity, 7, types, MAILLE_BORROW, error));
  OK(maille_mesh_add_array(mesh, "kind", MAILLE_CELL, MAILLE_U8, 1, 2, kinds, MAILLE_LABEL, MAILLE_COPY, error));
  OK(maille_mesh_add_label(mesh, 0, "wall", error));
  OK(maille_mesh_add_label(mesh, 0, "inlet", error));
  OK(maille_mesh_add_metadata(mesh, "unit", "mm", error));
  OK(maille_mesh_validate(mesh, error));

  CHECK(maille_mesh_points(mesh) == 5 && maille_mesh_cells(mesh) == 2 && maille_mesh_corners(mesh) == 7);
  CHECK(maille_mesh_position_type(mesh) == MAILLE_F32);
  CHECK(memcmp(maille_mesh_positions(mesh), positions, sizeof positions) == 0);
  CHECK(maille_mesh_positions(mesh) != positions); /* copied */
  CHECK(maille_mesh_blocks(mesh) == 1 && strcmp(maille_block_name(mesh, 0), "faces") == 0);
  CHECK(maille_block_type(mesh, 0) == MAILLE_MIXED && maille_block_cells(mesh, 0) == 2);
  CHECK(maille_block_connectivity(mesh, 0, &count) == connectivity && count == 7); /* in place */
  CHECK(maille_block_offsets(mesh, 0, &count) == offsets && count == 3);
  CHECK(maille_block_types(mesh, 0, &count) == types && count == 2);
  CHECK(maille_block_face_sizes(mesh, 0, &count) == NULL && count == 0);
  CHECK(maille_block_cell_faces(mesh, 0, NULL) == NULL);
  CHECK(maille_mesh_arrays(mesh) == 1 && maille_mesh_find(mesh, "kind", MAILLE_CELL) == 0);
  CHECK(maille_mesh_find(mesh, "kind", MAILLE_POINT) == 1 && maille_mesh_find(mesh, NULL, 0) == 1);
  CHECK(strcmp(maille_array_name(mesh, 0), "kind") == 0);
  CHECK(maille_array_domain(mesh, 0) == MAILLE_CELL && maille_array_type(mesh, 0) == MAILLE_U8);
  CHECK(maille_array_role(mesh, 0) == MAILLE_LABEL && maille_array_components(mesh, 0) == 1);
  CHECK(maille_array_tuples(mesh, 0) == 2 && memcmp(maille_array_values(mesh, 0), kinds, 2) == 0);
  CHECK(maille_array_labels(mesh, 0) == 2 && strcmp(maille_array_label(mesh, 0, 1), "inlet") == 0);
  CHECK(maille_mesh_metadata(mesh) == 1 && strcmp(maille_mesh_metadata_key(mesh, 0), "unit") == 0);
  CHECK(strcmp(maille_mesh_metadata_value(mesh, 0), "mm") == 0);
  CHECK(maille_mesh_notes(mesh) == 0 && maille_mesh_note(mesh, 0) == NULL);
  CHECK(maille_mesh_cell_numbers(mesh, &count) == NULL && count == 0);
  CHECK(maille_mesh_point_numbers(mesh, &count) == NULL && count == 0);

  /* Numbers out of range, and no mesh at all. */
  const maille_mesh* nobody = NULL;
  CHECK(maille_block_name(mesh, 1) == NULL && maille_block_type(mesh, 1) == -1 && maille_block_cells(mesh, 9) == 0);
  count = 5;
  CHECK(maille_block_connectivity(mesh, 1, &count) == NULL && count == 0);
  CHECK(maille_array_name(mesh, 1) == NULL && maille_array_type(mesh, 1) == -1 && maille_array_role(mesh, 1) == -1);
  CHECK(maille_array_domain(mesh, 1) == -1 && maille_array_values(mesh, 1) == NULL && maille_array_tuples(mesh, 1) == 0);
  CHECK(maille_array_components(mesh, 1) == 0 && maille_array_labels(mesh, 1) == 0);
  CHECK(maille_array_label(mesh, 0, 2) == NULL && maille_array_label(mesh, 7, 0) == NULL);
  CHECK(maille_mesh_metadata_key(mesh, 1) == NULL && maille_mesh_metadata_value(mesh, 1) == NULL);
  CHECK(maille_mesh_points(nobody) == 0 && maille_mesh_cells(nobody) == 0 && maille_mesh_corners(nobody) == 0);
  CHECK(maille_mesh_positions(nobody) == NULL && maille_mesh_position_type(nobody) == -1);
  CHECK(maille_mesh_blocks(nobody) == 0 && maille_mesh_arrays(nobody) == 0 && maille_mesh_metadata(nobody) == 0);
  CHECK(maille_mesh_notes(nobody) == 0 && maille_mesh_cell_numbers(nobody, NULL) == NULL);
  maille_mesh_free(mesh);
  maille_mesh_free(NULL);
}

static void wrong_meshes_are_refused_with_a_sentence(void) {
  static const double positions[7] = {0};
  static const uint32_t corners[] = {0, 1, 2, 3};
  static const uint64_t offsets[] = {0, 3};
  maille_mesh* mesh = maille_mesh_create(error);
  FAILS(MAILLE_USAGE, maille_mesh_set_points(mesh, 10, 1, positions, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_set_points(mesh, -1, 1, positions, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_set_points(mesh, MAILLE_F64, UINT64_MAX, positions, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_set_points(mesh, MAILLE_F64, 2, NULL, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_set_points(mesh, MAILLE_F64, 2, positions, 2, error));
  FAILS(MAILLE_USAGE, maille_mesh_set_points(NULL, MAILLE_F64, 2, positions, MAILLE_COPY, error));
  OK(maille_mesh_set_points(mesh, MAILLE_F64, 2, positions, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_block(mesh, "", MAILLE_TRIANGLE, 1, NULL, corners, 4, NULL, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_block(mesh, "", MAILLE_TRIANGLE, 1, offsets, corners, 3, NULL, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_block(mesh, "", MAILLE_POLYGON, 1, NULL, corners, 3, NULL, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_block(mesh, "", MAILLE_MIXED, 1, offsets, corners, 3, NULL, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_block(mesh, "", 256, 1, offsets, corners, 3, NULL, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE,
        maille_mesh_add_block(mesh, "", MAILLE_POLYGON, UINT64_MAX, offsets, corners, 3, NULL, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_set_faces(mesh, 0, corners, 1, offsets, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_array(mesh, "a", 4, MAILLE_F64, 1, 2, positions, 0, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_array(mesh, "a", 0, MAILLE_F64, 0, 2, positions, 0, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_array(mesh, "a", 0, MAILLE_F64, 1, 2, positions, 99, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_array(mesh, NULL, 0, MAILLE_F64, 1, 2, positions, 0, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE,
        maille_mesh_add_array(mesh, "a", 0, MAILLE_F64, UINT32_MAX, UINT64_MAX / 8, positions, 0, MAILLE_COPY, error));
  OK(maille_mesh_add_array(mesh, "a", 0, MAILLE_F64, 1, 2, positions, 0, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_array(mesh, "a", 0, MAILLE_F64, 1, 2, positions, 0, MAILLE_COPY, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_label(mesh, 1, "x", error));
  FAILS(MAILLE_USAGE, maille_mesh_add_label(mesh, 0, NULL, error));
  FAILS(MAILLE_USAGE, maille_mesh_add_metadata(mesh, "x", NULL, error));
  /* A point that is not there. */
  OK(maille_mesh_add_block(mesh, NULL, MAILLE_POLYGON, 1, offsets, corners, 3, NULL, MAILLE_BORROW, error));
  FAILS(MAILLE_MALFORMED_INPUT, maille_mesh_validate(mesh, error));
  maille_sink* sink = maille_sink_memory(error);
  FAILS(MAILLE_MALFORMED_INPUT, maille_encode(mesh, NULL, sink, error));
  FAILS(MAILLE_MALFORMED_INPUT, maille_compare(mesh, mesh, 0, error));
  const double up[3] = {0, 0, 1};
  NOTHING(MAILLE_MALFORMED_INPUT, maille_slice(mesh, up, 0, error));
  maille_query* query = maille_query_create(error);
  NOTHING(MAILLE_MALFORMED_INPUT, maille_clip(mesh, query, error));
  maille_query_free(query);
  maille_sink_free(sink);
  /* Numbers that do not lie as their type needs it. */
  maille_mesh* crooked = maille_mesh_create(error);
  OK(maille_mesh_set_points(crooked, MAILLE_F64, 2, (const char*)positions + 1, MAILLE_BORROW, error));
  FAILS(MAILLE_MALFORMED_INPUT, maille_mesh_validate(crooked, error));
  maille_mesh_free(crooked);
  maille_mesh_free(mesh);
}

static void polyhedra_come_back(void) {
  static const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const uint64_t offsets[] = {0, 12};
  static const uint32_t corners[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  static const uint32_t sizes[] = {3, 3, 3, 3};
  static const uint64_t faces[] = {0, 4};
  uint64_t count = 0;
  maille_mesh* mesh = maille_mesh_create(error);
  OK(maille_mesh_set_points(mesh, MAILLE_F64, 4, positions, MAILLE_BORROW, error));
  OK(maille_mesh_add_block(mesh, "cell", MAILLE_POLYHEDRON, 1, offsets, corners, 12, NULL, MAILLE_BORROW, error));
  OK(maille_mesh_set_faces(mesh, 0, sizes, 4, faces, MAILLE_BORROW, error));
  CHECK(maille_block_face_sizes(mesh, 0, &count) == sizes && count == 4);
  CHECK(maille_block_cell_faces(mesh, 0, &count) == faces && count == 2);
  coded file = code(mesh, NULL, error);
  maille_mesh* back = maille_decode(file.source, NULL, error);
  OK(maille_compare(mesh, back, 0, error));
  maille_mesh_free(back);
  maille_mesh_free(mesh);
  free_coded(file);
}

/* ---- Encoding and decoding ---- */

static void all_modes_and_efforts_give_the_mesh_back(void) {
  const sheet s = make_sheet(30);
  const int32_t modes[] = {MAILLE_USUAL, MAILLE_SINGLE, MAILLE_STREAM, MAILLE_RANDOM};
  const int32_t efforts[] = {1, 5, 7};
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_provenance(options, "test_c", error));
  for (int m = 0; m < 4; ++m) {
    for (int e = 0; e < 3; ++e) {
      for (int32_t keep = 0; keep < 2; ++keep) {
        OK(maille_encode_options_set_mode(options, modes[m], error));
        OK(maille_encode_options_set_effort(options, efforts[e], error));
        OK(maille_encode_options_set_keep_order(options, keep, error));
        coded file = code(mesh, options, error);
        maille_mesh* back = maille_decode(file.source, NULL, error);
        OK(maille_compare(mesh, back, keep, error));
        maille_info* info = maille_inspect(file.source, error);
        CHECK(maille_info_mode(info) == (modes[m] == MAILLE_USUAL ? MAILLE_SINGLE : modes[m]));
        CHECK(maille_info_effort(info) == efforts[e] && maille_info_keeps_order(info) == keep);
        maille_info_free(info);
        maille_mesh_free(back);
        free_coded(file);
      }
    }
  }
  maille_encode_options_free(options);
  maille_mesh_free(mesh);
}

static void bounds_are_kept_and_told(void) {
  const sheet s = make_sheet(30);
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_keep_order(options, 1, error));
  OK(maille_encode_options_set_bound(options, NULL, MAILLE_ABSOLUTE, 1e-3, error));
  OK(maille_encode_options_set_bound(options, "height", MAILLE_ABSOLUTE, 1e-2, error));
  coded file = code(mesh, options, error);
  maille_mesh* back = maille_decode(file.source, NULL, error);
  const float* positions = maille_mesh_positions(back);
  const float* heights = maille_array_values(back, maille_mesh_find(back, "height", MAILLE_POINT));
  double worst = 0, worst_height = 0;
  for (uint64_t i = 0; i < 3 * s.points; ++i) worst = fmax(worst, fabs((double)positions[i] - (double)s.positions[i]));
  for (uint64_t i = 0; i < s.points; ++i) worst_height = fmax(worst_height, fabs((double)heights[i] - (double)s.heights[i]));
  CHECK(worst > 0 && worst <= 1e-3 && worst_height > 0 && worst_height <= 1e-2);
  FAILS(MAILLE_DIFFERS, maille_compare(mesh, back, 0, error));
  maille_info* info = maille_inspect(file.source, error);
  CHECK(maille_info_array_bound(info, MAILLE_POSITIONS) > 0 && maille_info_array_bound(info, MAILLE_POSITIONS) <= 1e-3);
  CHECK(maille_info_array_bound(info, 0) > 0 && maille_info_array_bound(info, 0) <= 1e-2);
  maille_info_free(info);
  maille_mesh_free(back);
  free_coded(file);

  maille_sink* sink = maille_sink_memory(error);
  OK(maille_encode_options_set_bound(options, "depth", MAILLE_ABSOLUTE, 1, error));
  FAILS(MAILLE_USAGE, maille_encode(mesh, options, sink, error)); /* no array of that name */
  FAILS(MAILLE_USAGE, maille_encode_options_set_bound(options, NULL, 7, 1, error));
  FAILS(MAILLE_USAGE, maille_encode_options_set_bound(options, NULL, MAILLE_ABSOLUTE, NAN, error));
  FAILS(MAILLE_USAGE, maille_encode_options_set_bound(options, NULL, MAILLE_ABSOLUTE, -1, error));
  FAILS(MAILLE_USAGE, maille_encode_options_set_mode(options, 3, error));
  FAILS(MAILLE_USAGE, maille_encode_options_set_effort(options, 0, error));
  FAILS(MAILLE_USAGE, maille_encode_options_set_effort(options, 10, error));
  FAILS(MAILLE_USAGE, maille_encode_options_set_effort(NULL, 1, error));
  maille_sink_free(sink);
  maille_encode_options_free(options);
  maille_encode_options_free(NULL);
  maille_mesh_free(mesh);
}

static void what_is_asked_for_is_all_that_comes(void) {
  const brick b = make_brick(6);
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  coded file = code(mesh, NULL, error);
  const char* names[] = {"layer"};
  maille_decode_options* options = maille_decode_options_create(error);
  OK(maille_decode_options_set_arrays(options, names, 1, error));
  maille_mesh* back = maille_decode(file.source, options, error);
  CHECK(maille_mesh_arrays(back) == 1 && strcmp(maille_array_name(back, 0), "layer") == 0);
  maille_mesh_free(back);
  OK(maille_decode_options_set_arrays(options, NULL, 0, error));
  back = maille_decode(file.source, options, error);
  CHECK(maille_mesh_arrays(back) == 2);
  maille_mesh_free(back);
  OK(maille_decode_options_set_memory(options, 1000, error));
  NOTHING(MAILLE_MEMORY_BOUND, maille_decode(file.source, options, error));
  names[0] = NULL;
  FAILS(MAILLE_USAGE, maille_decode_options_set_arrays(options, names, 1, error));
  FAILS(MAILLE_USAGE, maille_decode_options_set_step(NULL, 1, error));
  maille_decode_options_free(options);
  maille_decode_options_free(NULL);
  maille_mesh_free(mesh);
  free_coded(file);
}

typedef struct {
  int calls, stop_at;
} watcher;
static int32_t watch(void* user, const char* stage, double fraction) {
  watcher* w = user;
  if (!stage || !(fraction >= 0 && fraction <= 1)) ++failures;
  return ++w->calls == w->stop_at;
}

static void progress_is_told_and_can_stop_a_job(void) {
  const sheet s = make_sheet(60);
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  maille_encode_options* encoding = maille_encode_options_create(error);
  maille_decode_options* decoding = maille_decode_options_create(error);
  watcher w = {0, 0};
  OK(maille_encode_options_set_progress(encoding, watch, &w, error));
  coded file = code(mesh, encoding, error);
  CHECK(w.calls > 0);
  w.calls = 0;
  w.stop_at = 1;
  maille_sink* sink = maille_sink_memory(error);
  FAILS(MAILLE_CANCELLED, maille_encode(mesh, encoding, sink, error));
  w.calls = 0;
  OK(maille_decode_options_set_progress(decoding, watch, &w, error));
  NOTHING(MAILLE_CANCELLED, maille_decode(file.source, decoding, error));
  OK(maille_decode_options_set_progress(decoding, NULL, NULL, error));
  maille_mesh* back = maille_decode(file.source, decoding, error);
  CHECK(back != NULL);
  maille_mesh_free(back);
  maille_sink_free(sink);
  free_coded(file);
  maille_encode_options_free(encoding);
  maille_decode_options_free(decoding);
  maille_mesh_free(mesh);
}

static void threads_change_nothing(void) {
  const brick b = make_brick(12);
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_part_cells(options, 300, error));
  coded one = code(mesh, options, error);
  OK(maille_encode_options_set_threads(options, 0, error));
  coded many = code(mesh, options, error);
  CHECK(maille_sink_size(one.sink) == maille_sink_size(many.sink));
  CHECK(memcmp(maille_sink_bytes(one.sink), maille_sink_bytes(many.sink), maille_sink_size(one.sink)) == 0);
  maille_decode_options* decoding = maille_decode_options_create(error);
  OK(maille_decode_options_set_threads(decoding, 2, error));
  maille_mesh* back = maille_decode(many.source, decoding, error);
  OK(maille_compare(mesh, back, 0, error));
  maille_mesh_free(back);
  maille_decode_options_free(decoding);
  maille_encode_options_free(options);
  free_coded(one);
  free_coded(many);
  maille_mesh_free(mesh);
}

static int decode_often(void* user) {
  const coded* file = user;
  for (int i = 0; i < 8; ++i) {
    maille_mesh* mesh = maille_decode(file->source, NULL, NULL);
    const int good = mesh && maille_mesh_validate(mesh, NULL) == MAILLE_OK;
    maille_mesh_free(mesh);
    if (!good) return 1;
  }
  return 0;
}

static void two_threads_may_read_one_source(void) {
  const sheet s = make_sheet(30);
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  coded file = code(mesh, NULL, error);
  thrd_t threads[2];
  int bad[2] = {1, 1};
  for (int i = 0; i < 2; ++i) CHECK(thrd_create(&threads[i], decode_often, &file) == thrd_success);
  for (int i = 0; i < 2; ++i) thrd_join(threads[i], &bad[i]);
  CHECK(bad[0] == 0 && bad[1] == 0);
  free_coded(file);
  maille_mesh_free(mesh);
}

static void damaged_files_are_errors_never_crashes(void) {
  const brick b = make_brick(5);
  const int32_t modes[] = {MAILLE_SINGLE, MAILLE_STREAM};
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  maille_encode_options* options = maille_encode_options_create(error);
  for (int m = 0; m < 2; ++m) {
    OK(maille_encode_options_set_mode(options, modes[m], error));
    coded file = code(mesh, options, error);
    const uint64_t size = maille_sink_size(file.sink);
    unsigned char* bytes = malloc(size);
    for (uint64_t at = 0; at < size; at += 1 + size / 97) {
      memcpy(bytes, maille_sink_bytes(file.sink), size);
      bytes[at] ^= 0x10;
      maille_source* damaged = maille_source_memory(bytes, size, error);
      maille_mesh* back = maille_decode(damaged, NULL, error);
      if (back) {
        CHECK(maille_mesh_validate(back, error) == MAILLE_OK); /* a byte that decoding does not need */
      } else {
        CHECK(strlen(maille_error_message(error)) > 8);
      }
      CHECK(maille_verify(damaged, error) != MAILLE_OK);
      maille_mesh_free(back);
      maille_mesh_free(maille_salvage(damaged, NULL, error));
      maille_info_free(maille_inspect(damaged, error));
      maille_volume_free(maille_volume_open(damaged, NULL, error));
      maille_source_free(damaged);
      maille_source* cut = maille_source_memory(maille_sink_bytes(file.sink), at, error);
      NOTHING(maille_error_code(error), maille_decode(cut, NULL, error));
      maille_source_free(cut);
    }
    free(bytes);
    free_coded(file);
  }
  maille_encode_options_free(options);
  maille_mesh_free(mesh);
  maille_source* none = maille_source_memory(NULL, 0, error);
  NOTHING(MAILLE_CORRUPT, maille_decode(none, NULL, error));
  NOTHING(MAILLE_CORRUPT, maille_inspect(none, error));
  maille_source_free(none);
  NOTHING(MAILLE_USAGE, maille_decode(NULL, NULL, error));
  NOTHING(MAILLE_USAGE, maille_inspect(NULL, error));
  NOTHING(MAILLE_USAGE, maille_salvage(NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_verify(NULL, error));
}

static void what_is_left_of_a_stream_can_be_had(void) {
  const brick b = make_brick(8);
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  coded file = code(mesh, NULL, error);
  maille_source* cut = maille_source_memory(maille_sink_bytes(file.sink), maille_sink_size(file.sink) - 9, error);
  maille_mesh* left = maille_salvage(cut, NULL, error);
  CHECK(left != NULL && maille_mesh_notes(left) == 1 && strlen(maille_mesh_note(left, 0)) > 8);
  maille_mesh_free(left);
  maille_source_free(cut);
  maille_mesh* whole = maille_salvage(file.source, NULL, error);
  CHECK(maille_mesh_notes(whole) == 0 && maille_mesh_cells(whole) == b.cells);
  maille_mesh_free(whole);
  free_coded(file);
  maille_mesh_free(mesh);
}

static void count_notes(void* user, const char* sentence) {
  if (strlen(sentence) > 8) ++*(int*)user;
}

static void other_formats_are_read_and_written(void) {
  const sheet s = make_sheet(10);
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  const char* names[] = {"sheet.ply", "sheet.vtu", "sheet.maille", "sheet.obj"};
  for (int i = 0; i < 4; ++i) {
    int notes = 0;
    OK(maille_write_mesh(mesh, in_folder(names[i]), NULL, count_notes, &notes, error));
    maille_mesh* back = maille_read_mesh(in_folder(names[i]), NULL, error);
    CHECK(maille_mesh_points(back) == s.points && maille_mesh_cells(back) == s.faces);
    if (i == 2) OK(maille_compare(mesh, back, 0, error));
    if (i == 3) CHECK(notes > 0); /* OBJ has no heights */
    maille_mesh_free(back);
  }
  OK(maille_write_mesh(mesh, in_folder("quiet.obj"), NULL, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_write_mesh(mesh, in_folder("sheet.doc"), NULL, NULL, NULL, error));
  FAILS(MAILLE_WRITE_FAILED, maille_write_mesh(mesh, "/no/such/folder/x.ply", NULL, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_write_mesh(mesh, NULL, NULL, NULL, NULL, error));
  NOTHING(MAILLE_CANNOT_READ, maille_read_mesh("/no/such/file.ply", NULL, error));
  NOTHING(MAILLE_USAGE, maille_read_mesh(NULL, NULL, error));
  uint64_t known = 0, writable = 0;
  for (; maille_format_name(known); ++known) writable += maille_format_writable(known) != 0;
  CHECK(known > 10 && writable > 5 && writable <= known && maille_format_writable(known) == 0);
  maille_mesh_free(mesh);
}

/* ---- Info ---- */

static void a_file_tells_what_it_holds(void) {
  const brick b = make_brick(6);
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  coded file = code(mesh, NULL, error);
  maille_info* info = maille_inspect(file.source, error);
  CHECK(maille_info_mode(info) == MAILLE_STREAM && maille_info_file_bytes(info) == maille_sink_size(file.sink));
  CHECK(maille_info_points(info) == b.points && maille_info_cells(info) == b.cells);
  CHECK(maille_info_blocks(info) == 1 && maille_info_block_cells(info, 0) == b.cells);
  CHECK(strstr(maille_info_block_name(info, 0), "brick") != NULL && maille_info_block_name(info, 1) == NULL);
  CHECK(maille_info_arrays(info) == 2 && strcmp(maille_info_array_name(info, 0), "heat") == 0);
  CHECK(maille_info_array_domain(info, 0) == MAILLE_POINT && maille_info_array_type(info, 0) == MAILLE_F64);
  CHECK(maille_info_array_components(info, MAILLE_POSITIONS) == 3 && maille_info_array_bytes(info, 1) > 0);
  CHECK(maille_info_array_bound(info, 0) == 0);
  double low = 9, high = -9;
  CHECK(maille_info_array_range(info, 1, 0, &low, &high) == 1 && low == 0 && high == 5);
  CHECK(maille_info_array_range(info, 1, 1, &low, &high) == 0 && maille_info_array_range(info, 2, 0, NULL, NULL) == 0);
  CHECK(maille_info_array_name(info, 2) == NULL && maille_info_array_type(info, 2) == -1);
  CHECK(maille_info_array_domain(info, 2) == -1 && maille_info_array_bytes(info, 2) == 0);
  uint64_t of_type = 0;
  CHECK(maille_info_cell_types(info) == 1 && maille_info_cell_type(info, 0, &of_type) == MAILLE_HEXAHEDRON);
  CHECK(of_type == b.cells && maille_info_cell_type(info, 1, &of_type) == -1 && of_type == 0);
  CHECK(maille_info_times(info) == 0 && isnan(maille_info_time(NULL, 0, NULL)));
  CHECK(maille_info_steps(info) == 0 && maille_info_step_time(info, 0) == 0 && maille_info_levels(info) == 0);
  CHECK(maille_info_level_faces(info, 0) == 0 && maille_info_level_bound(info, 0) == 0);
  CHECK(maille_info_problems(info) == 0 && maille_info_problem(info, 0) == NULL);
  CHECK(maille_info_mode(NULL) == -1 && maille_info_points(NULL) == 0 && maille_info_array_name(NULL, 0) == NULL);
  maille_info_free(info);
  maille_info_free(NULL);
  free_coded(file);
  maille_mesh_free(mesh);
}

static void steps_of_time_are_appended_and_read(void) {
  const brick b = make_brick(6);
  double* later = malloc(b.points * sizeof(double));
  for (uint64_t i = 0; i < b.points; ++i) later[i] = 2 * b.heat[i];
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_keep_order(options, 1, error));
  FAILS(MAILLE_USAGE, maille_encode_options_set_time(options, INFINITY, error));
  OK(maille_encode_options_set_time(options, 0.25, error));
  OK(maille_write_mesh(mesh, in_folder("steps.maille"), options, NULL, NULL, error));

  maille_mesh* second = maille_mesh_create(error);
  OK(maille_mesh_set_points(second, MAILLE_F64, b.points, b.positions, MAILLE_BORROW, error));
  OK(maille_mesh_add_block(second, "brick", MAILLE_HEXAHEDRON, b.cells, NULL, b.hexahedra, 8 * b.cells, NULL,
                           MAILLE_BORROW, error));
  OK(maille_mesh_add_array(second, "heat", MAILLE_POINT, MAILLE_F64, 1, b.points, later, 0, MAILLE_BORROW, error));
  uint64_t step = 0;
  OK(maille_append_step(in_folder("steps.maille"), 0.5, second, NULL, &step, error));
  CHECK(step == 1);

  maille_source* source = maille_source_open(in_folder("steps.maille"), error);
  maille_info* info = maille_inspect(source, error);
  CHECK(maille_info_steps(info) == 1 && maille_info_step_time(info, 1) == 0.5 && maille_info_step_time(info, 2) == 0);
  uint64_t of_time = 9;
  CHECK(maille_info_times(info) == 2 && maille_info_time(info, 0, &of_time) == 0.25 && of_time == 0);
  CHECK(maille_info_time(info, 1, &of_time) == 0.5 && of_time == 1 && isnan(maille_info_time(info, 2, NULL)));
  maille_decode_options* decoding = maille_decode_options_create(error);
  OK(maille_decode_options_set_step(decoding, 1, error));
  maille_mesh* back = maille_decode(source, decoding, error);
  CHECK(memcmp(maille_array_values(back, maille_mesh_find(back, "heat", MAILLE_POINT)), later,
               b.points * sizeof(double)) == 0);
  maille_mesh_free(back);
  OK(maille_decode_options_set_step(decoding, 2, error));
  NOTHING(MAILLE_USAGE, maille_decode(source, decoding, error));
  FAILS(MAILLE_CANNOT_READ, maille_append_step("/no/such/file.maille", 1, second, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_append_step(in_folder("steps.maille"), NAN, second, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_append_step(NULL, 1, second, NULL, NULL, error));
  maille_decode_options_free(decoding);
  maille_encode_options_free(options);
  maille_info_free(info);
  maille_source_free(source);
  maille_mesh_free(second);
  maille_mesh_free(mesh);
  free(later);
}

/* ---- Parts of files ---- */

static void surfaces_are_read_in_parts_and_asked(void) {
  const sheet s = make_sheet(120);
  maille_mesh* mesh = sheet_mesh(&s, MAILLE_BORROW, error);
  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_mode(options, MAILLE_RANDOM, error));
  coded coded_sheet = code(mesh, options, error);
  maille_file* file = maille_file_open(coded_sheet.source, NULL, error);
  CHECK(maille_file_levels(file) > 1 && maille_file_faces(file, 0) == s.faces);
  CHECK(maille_file_faces(file, 1) < s.faces && maille_file_charts(file, 0) > 1);
  CHECK(maille_file_faces(file, 999) == 0 && maille_file_charts(file, 999) == 0);
  double sphere[4] = {0};
  OK(maille_file_sphere(file, sphere, error));
  CHECK(sphere[3] > 0.5 && sphere[3] < 2);

  maille_selection* all = maille_file_select(file, NULL, error);
  CHECK(maille_selection_faces(all) == s.faces);
  maille_mesh* whole = maille_file_extract(file, all, 0, error);
  OK(maille_compare(mesh, whole, 0, error));
  maille_mesh_free(whole);
  whole = maille_file_extract(file, all, 1, error);
  CHECK(maille_mesh_notes(whole) == 0 && maille_mesh_cells(whole) == s.faces);
  maille_mesh_free(whole);
  uint32_t group = 9, chart = 9, level = 9;
  uint64_t faces = 0, bytes = 0;
  double box[6] = {0};
  OK(maille_selection_chart(all, 0, &group, &chart, error));
  OK(maille_file_chart(file, group, chart, &level, &faces, &bytes, box, error));
  CHECK(level == 0 && faces > 0 && bytes > 0 && box[0] < box[3]);
  maille_mesh* one = maille_file_read(file, group, chart, error);
  CHECK(maille_mesh_cells(one) == faces);
  maille_mesh_free(one);
  FAILS(MAILLE_USAGE, maille_selection_chart(all, maille_selection_charts(all), &group, &chart, error));
  FAILS(MAILLE_USAGE, maille_file_chart(file, 99999, 0, NULL, NULL, NULL, NULL, error));
  NOTHING(MAILLE_USAGE, maille_file_read(file, 99999, 0, error));
  maille_selection_free(all);

  maille_query* query = maille_query_create(error);
  const double low[3] = {0, 0, -1}, high[3] = {0.25, 0.25, 1};
  OK(maille_query_set_box(query, low, high, error));
  maille_selection* corner = maille_file_select(file, query, error);
  CHECK(maille_selection_faces(corner) < s.faces && maille_selection_charts(corner) > 0);
  maille_mesh* part = maille_file_extract(file, corner, 0, error);
  maille_mesh* clipped = maille_clip(part, query, error);
  CHECK(maille_mesh_cells(clipped) < maille_mesh_cells(part) && maille_mesh_cells(clipped) >= 2 * 30 * 30);
  maille_mesh_free(clipped);
  maille_mesh_free(part);
  maille_selection_free(corner);

  OK(maille_query_set_level(query, 1, error));
  const double centre[3] = {0.1, 0.1, 0}, x[3] = {2, 0, 0}, eye[3] = {0.5, 0.5, 2};
  OK(maille_query_set_sphere(query, centre, 0.2, error));
  OK(maille_query_add_plane(query, x, 0, error));
  OK(maille_query_set_error(query, 0.01, error));
  OK(maille_query_set_view(query, eye, 500, 2, error));
  corner = maille_file_select(file, query, error);
  CHECK(maille_selection_charts(corner) > 0);
  maille_selection_free(corner);
  maille_query_free(query);
  query = maille_query_create(error);
  OK(maille_query_set_most_faces(query, s.faces / 3, error));
  corner = maille_file_select(file, query, error);
  CHECK(maille_selection_faces(corner) <= s.faces / 3 && maille_selection_faces(corner) > 0);
  maille_selection_free(corner);
  maille_query_free(query);

  maille_place place;
  memset(&place, 0, sizeof place);
  const double origin[3] = {0.5, 0.5, 3}, down[3] = {0, 0, -1}, away[3] = {0, 0, 1};
  FAILS(MAILLE_USAGE, maille_file_hit(file, origin, down, &place, error)); /* struct_size */
  place.struct_size = sizeof place;
  OK(maille_file_hit(file, origin, down, &place, error));
  CHECK(place.found == 1 && fabs(place.position[0] - 0.5) < 1e-9 && fabs(place.position[2] - (3 - place.distance)) < 1e-9);
  CHECK(fabs(place.weights[0] + place.weights[1] + place.weights[2] - 1) < 1e-9);
  OK(maille_file_hit(file, origin, away, &place, error));
  CHECK(place.found == 0 && place.distance == 0);
  OK(maille_file_nearest(file, origin, &place, error));
  CHECK(place.found == 1 && place.distance < 3.2);
  double near[9] = {0}, distances[3] = {9, 9, 9};
  uint64_t found = 0;
  OK(maille_file_nearest_points(file, origin, 3, near, distances, &found, error));
  CHECK(found == 3 && distances[0] <= distances[1] && distances[1] <= distances[2]);
  OK(maille_file_nearest_points(file, origin, 1, near, NULL, &found, error));
  FAILS(MAILLE_USAGE, maille_file_nearest(NULL, origin, &place, error));
  NOTHING(MAILLE_USAGE, maille_file_open(NULL, NULL, error));
  NOTHING(MAILLE_USAGE, maille_file_select(NULL, NULL, error));
  maille_file_free(file);
  maille_file_free(NULL);
  maille_selection_free(NULL);
  free_coded(coded_sheet);
  OK(maille_encode_options_set_mode(options, MAILLE_SINGLE, error));
  coded_sheet = code(mesh, options, error);
  NOTHING(MAILLE_USAGE, maille_file_open(coded_sheet.source, NULL, error));
  free_coded(coded_sheet);
  maille_info* info = NULL;
  OK(maille_encode_options_set_mode(options, MAILLE_RANDOM, error));
  coded_sheet = code(mesh, options, error);
  info = maille_inspect(coded_sheet.source, error);
  CHECK(maille_info_levels(info) > 1 && maille_info_level_faces(info, 0) == s.faces && maille_info_level_bound(info, 1) > 0);
  maille_info_free(info);
  free_coded(coded_sheet);
  maille_encode_options_free(options);
  maille_mesh_free(mesh);
}

static void volumes_are_read_in_pieces(void) {
  const brick b = make_brick(16);
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_part_cells(options, 512, error));
  OK(maille_encode_options_set_keep_order(options, 1, error));
  coded file = code(mesh, options, error);
  maille_volume* volume = maille_volume_open(file.source, NULL, error);
  CHECK(maille_volume_cells(volume) == b.cells && maille_volume_points(volume) == b.points);
  const uint32_t pieces = maille_volume_pieces(volume);
  CHECK(pieces >= 8);
  uint64_t cells = 0, points = 0, bytes = 0, all = 0;
  double box[6];
  for (uint32_t i = 0; i < pieces; ++i) {
    OK(maille_volume_piece(volume, i, &cells, &points, &bytes, box, error));
    CHECK(cells > 0 && points > 0 && bytes > 0 && box[0] < box[3]);
    all += cells;
  }
  CHECK(all == b.cells);
  FAILS(MAILLE_USAGE, maille_volume_piece(volume, pieces, NULL, NULL, NULL, NULL, error));

  const double low[3] = {0.01, 0.01, 0.01}, high[3] = {0.2, 0.2, 0.2}, up[3] = {0, 0, 3};
  maille_query* query = maille_query_create(error);
  OK(maille_query_set_box(query, low, high, error));
  uint64_t count = 0;
  uint32_t first[2] = {0};
  OK(maille_volume_select(volume, query, first, 2, &count, error));
  CHECK(count >= 1 && count < pieces);
  OK(maille_volume_select(volume, query, NULL, 0, &count, error));
  maille_mesh* part = maille_volume_extract(volume, query, error);
  CHECK(maille_mesh_cells(part) == 64); /* 0.2 * 16 = 3.2: four layers each way */
  uint64_t numbered = 0;
  const uint32_t* numbers = maille_mesh_cell_numbers(part, &numbered);
  CHECK(numbered == 64 && numbers[0] == 0 && numbers[63] == 3 * (256 + 16 + 1));
  CHECK(maille_mesh_point_numbers(part, &numbered) != NULL && numbered == maille_mesh_points(part));
  maille_mesh_free(part);
  maille_query_free(query);

  query = maille_query_create(error);
  OK(maille_query_set_cut(query, up, -0.3, error)); /* z = 0.1 */
  part = maille_volume_extract(volume, query, error);
  CHECK(maille_mesh_cells(part) == 256);
  maille_mesh* slice = maille_slice(part, up, -0.3, error);
  CHECK(maille_mesh_cells(slice) == 256);
  maille_mesh_free(slice);
  maille_mesh_free(part);
  maille_query_free(query);

  query = maille_query_create(error);
  OK(maille_query_add_condition(query, "layer", 0, 2, 3, error));
  part = maille_volume_extract(volume, query, error);
  CHECK(maille_mesh_cells(part) == 512);
  maille_mesh_free(part);
  OK(maille_query_set_cells(query, 512, 600, error));
  part = maille_volume_extract(volume, query, error);
  CHECK(maille_mesh_cells(part) == 88);
  maille_mesh_free(part);
  OK(maille_query_set_pieces(query, first, 1, error));
  OK(maille_query_add_condition(query, "smoke", -1, 2, 3, error));
  NOTHING(MAILLE_USAGE, maille_volume_extract(volume, query, error)); /* no such array */
  maille_query_free(query);
  part = maille_volume_extract(volume, NULL, error);
  OK(maille_compare(mesh, part, 1, error));
  maille_mesh_free(part);
  part = maille_volume_coarse(volume, error);
  CHECK(maille_mesh_points(part) > 0 && maille_mesh_points(part) < b.points);
  maille_mesh_free(part);

  NOTHING(MAILLE_USAGE, maille_volume_open(NULL, NULL, error));
  NOTHING(MAILLE_USAGE, maille_volume_extract(NULL, NULL, error));
  maille_volume_free(volume);
  maille_volume_free(NULL);
  free_coded(file);
  maille_encode_options_free(options);
  maille_mesh_free(mesh);
}

static void queries_that_make_no_sense_are_refused(void) {
  const double zero[3] = {0, 0, 0}, one[3] = {1, 1, 1}, nan3[3] = {NAN, 0, 0};
  maille_query* query = maille_query_create(error);
  FAILS(MAILLE_USAGE, maille_query_set_box(query, one, zero, error));
  FAILS(MAILLE_USAGE, maille_query_set_box(query, nan3, one, error));
  FAILS(MAILLE_USAGE, maille_query_set_box(query, NULL, one, error));
  FAILS(MAILLE_USAGE, maille_query_set_sphere(query, one, -1, error));
  FAILS(MAILLE_USAGE, maille_query_add_plane(query, zero, 1, error));
  FAILS(MAILLE_USAGE, maille_query_set_cut(query, nan3, 1, error));
  FAILS(MAILLE_USAGE, maille_query_set_error(query, -1, error));
  FAILS(MAILLE_USAGE, maille_query_set_view(query, one, 0, 1, error));
  FAILS(MAILLE_USAGE, maille_query_add_condition(query, NULL, 0, 0, 1, error));
  FAILS(MAILLE_USAGE, maille_query_add_condition(query, "a", 0, 1, 0, error));
  FAILS(MAILLE_USAGE, maille_query_set_pieces(query, NULL, 1, error));
  FAILS(MAILLE_USAGE, maille_query_set_cells(query, 2, 1, error));
  FAILS(MAILLE_USAGE, maille_query_set_level(NULL, 1, error));
  FAILS(MAILLE_USAGE, maille_query_set_most_faces(NULL, 1, error));
  maille_query_free(query);
  maille_query_free(NULL);
}

/* ---- Streams ---- */

typedef struct {
  const unsigned char* bytes;
  uint64_t size, at;
} pipe_end;
static int64_t read_some(void* user, void* out, uint64_t size) {
  pipe_end* p = user;
  uint64_t some = p->size - p->at < 1000 ? p->size - p->at : 1000; /* as pipes do */
  if (some > size) some = size;
  memcpy(out, p->bytes + p->at, some);
  p->at += some;
  return (int64_t)some;
}
static int64_t read_failure(void* user, void* out, uint64_t size) {
  (void)user, (void)out, (void)size;
  return -1;
}

/* Of all portions, the sum of heats, and how many cells and points there are. */
static void drain(maille_reader* reader, uint64_t* cells, uint64_t* points, double* sum) {
  int32_t more = 1;
  *cells = *points = 0;
  *sum = 0;
  while (maille_reader_next(reader, &more, error) == MAILLE_OK && more) {
    uint64_t count = 0, corners = 0, slots = 0, bytes = 0;
    CHECK(maille_reader_first_cell(reader) == *cells);
    CHECK(maille_reader_types(reader, &count) != NULL || maille_reader_cells(reader) == 0);
    CHECK(count == maille_reader_cells(reader));
    const uint64_t* offsets = maille_reader_offsets(reader, &count);
    CHECK(count == maille_reader_cells(reader) + 1 && offsets[0] == 0);
    CHECK(maille_reader_connectivity(reader, &corners) != NULL || corners == 0);
    CHECK(corners == offsets[count - 1]);
    const uint32_t* places = maille_reader_connectivity_slots(reader, &slots);
    CHECK(slots == corners);
    for (uint64_t i = 0; i < slots; ++i) CHECK(places[i] < maille_reader_slots(reader));
    (void)maille_reader_points(reader, &count);
    CHECK(maille_reader_point_slots(reader, &slots) != NULL || slots == 0);
    CHECK(slots == count);
    (void)maille_reader_positions(reader, &bytes);
    CHECK(bytes == count * 24);
    const double* heat = maille_reader_values(reader, 0, &bytes);
    CHECK(bytes == count * 8);
    for (uint64_t i = 0; i < count; ++i) *sum += heat[i];
    (void)maille_reader_values(reader, 1, &bytes);
    CHECK(bytes == maille_reader_cells(reader) * 4);
    (void)maille_reader_ended_slots(reader, NULL);
    CHECK(maille_reader_face_sizes(reader, NULL) == NULL && maille_reader_cell_faces(reader, NULL) == NULL);
    *cells += maille_reader_cells(reader);
    *points += count;
  }
  OK(maille_error_code(error) == MAILLE_OK ? MAILLE_OK : maille_error_code(error));
}

static void streams_go_in_and_out_in_portions(void) {
  const brick b = make_brick(10);
  uint64_t* wide = malloc(b.cells * 8 * sizeof(uint64_t));
  for (uint64_t i = 0; i < 8 * b.cells; ++i) wide[i] = b.hexahedra[i];
  double heats = 0;
  for (uint64_t i = 0; i < b.points; ++i) heats += b.heat[i];

  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_keep_order(options, 1, error));
  maille_sink* sink = maille_sink_memory(error);
  maille_writer* writer = maille_writer_create(sink, MAILLE_F64, options, error);
  OK(maille_writer_declare(writer, "heat", MAILLE_POINT, MAILLE_F64, 1, NAN, NAN, error));
  OK(maille_writer_declare(writer, "layer", MAILLE_CELL, MAILLE_I32, 1, 0, 9, error));
  OK(maille_writer_set_position_range(writer, 0, 1, error));
  FAILS(MAILLE_USAGE, maille_writer_flush(writer, error)); /* not begun */
  OK(maille_writer_begin(writer, error));
  FAILS(MAILLE_USAGE, maille_writer_begin(writer, error));
  FAILS(MAILLE_USAGE, maille_writer_declare(writer, "late", MAILLE_CELL, MAILLE_I32, 1, 0, 9, error));
  OK(maille_writer_begin_block(writer, "brick", MAILLE_HEXAHEDRON, error));
  const uint64_t half = b.points / 2;
  const void* heat[1] = {b.heat};
  FAILS(MAILLE_USAGE, maille_writer_add_points(writer, 0, half, b.positions, NULL, error));
  FAILS(MAILLE_USAGE, maille_writer_add_points(writer, 0, half, NULL, heat, error));
  OK(maille_writer_add_points(writer, 0, half, b.positions, heat, error));
  uint64_t* rest = malloc((b.points - half) * sizeof(uint64_t));
  for (uint64_t i = half; i < b.points; ++i) rest[i - half] = i;
  heat[0] = b.heat + half;
  OK(maille_writer_add_numbered_points(writer, rest, b.points - half, b.positions + 3 * half, heat, error));
  const void* layers[1] = {b.layers};
  OK(maille_writer_add_cells(writer, MAILLE_HEXAHEDRON, 500, 0, wide, NULL, layers, error));
  OK(maille_writer_flush(writer, error));
  layers[0] = b.layers + 500;
  uint8_t* last = calloc((b.cells - 500) * 8, 1);
  OK(maille_writer_add_cells(writer, MAILLE_HEXAHEDRON, b.cells - 500, 8, wide + 4000, last, layers, error));
  const uint64_t wrong[8] = {0, 1, 2, 3, 4, 5, 6, 9999999};
  maille_writer* other = maille_writer_create(sink, 99, NULL, error);
  CHECK(other == NULL);
  OK(maille_writer_end_points(writer, rest, 3, error));
  OK(maille_writer_finish(writer, error));
  FAILS(MAILLE_USAGE, maille_writer_finish(writer, error));
  FAILS(MAILLE_USAGE, maille_writer_add_cells(writer, MAILLE_HEXAHEDRON, 1, 0, wrong, NULL, layers, error));
  maille_writer_free(writer);
  maille_writer_free(NULL);

  maille_source* source = maille_source_memory(maille_sink_bytes(sink), maille_sink_size(sink), error);
  maille_mesh* mesh = brick_mesh(&b, MAILLE_BORROW, error);
  maille_mesh* back = maille_decode(source, NULL, error);
  OK(maille_compare(mesh, back, 1, error));
  maille_mesh_free(back);
  maille_mesh_free(mesh);

  uint64_t cells = 0, points = 0;
  double sum = 0;
  maille_error_clear(error);
  maille_reader* reader = maille_reader_open(source, NULL, error);
  CHECK(maille_reader_position_type(reader) == MAILLE_F64 && maille_reader_arrays(reader) == 2);
  CHECK(strcmp(maille_reader_array_name(reader, 1), "layer") == 0 && maille_reader_array_name(reader, 2) == NULL);
  CHECK(maille_reader_array_domain(reader, 1) == MAILLE_CELL && maille_reader_array_type(reader, 1) == MAILLE_I32);
  CHECK(maille_reader_array_components(reader, 0) == 1 && maille_reader_array_type(reader, 2) == -1);
  drain(reader, &cells, &points, &sum);
  CHECK(cells == b.cells && points == b.points && fabs(sum - heats) < 1e-6);
  maille_reader_free(reader);
  maille_reader_free(NULL);
  CHECK(maille_reader_cells(NULL) == 0 && maille_reader_slots(NULL) == 0 && maille_reader_values(NULL, 0, NULL) == NULL);
  CHECK(maille_reader_types(NULL, &cells) == NULL && cells == 0 && maille_reader_position_type(NULL) == -1);

  pipe_end pipe = {maille_sink_bytes(sink), maille_sink_size(sink), 0};
  reader = maille_reader_callbacks(read_some, &pipe, "pipe", NULL, error);
  drain(reader, &cells, &points, &sum);
  CHECK(cells == b.cells && points == b.points && fabs(sum - heats) < 1e-6);
  maille_reader_free(reader);

  /* A pipe that breaks off, and one that fails. */
  pipe_end broken = {maille_sink_bytes(sink), maille_sink_size(sink) / 2, 0};
  reader = maille_reader_callbacks(read_some, &broken, NULL, NULL, error);
  int32_t more = 1, status = MAILLE_OK;
  while (reader && status == MAILLE_OK && more) status = maille_reader_next(reader, &more, error);
  CHECK(reader == NULL || (status == MAILLE_CORRUPT && more == 0));
  maille_reader_free(reader);
  NOTHING(MAILLE_CANNOT_READ, maille_reader_callbacks(read_failure, NULL, NULL, NULL, error));
  NOTHING(MAILLE_USAGE, maille_reader_callbacks(NULL, NULL, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_reader_next(NULL, &more, error));
  maille_source_free(source);
  maille_sink_free(sink);
  maille_encode_options_free(options);
  free(wide);
  free(rest);
  free(last);
}

static void streams_take_polyhedra(void) {
  static const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const uint64_t corners[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  static const uint32_t sizes[] = {3, 3, 3, 3};
  maille_sink* sink = maille_sink_memory(error);
  maille_encode_options* options = maille_encode_options_create(error);
  OK(maille_encode_options_set_bound(options, "lost", MAILLE_ABSOLUTE, 1, error));
  maille_writer* writer = maille_writer_create(sink, MAILLE_F64, options, error);
  FAILS(MAILLE_USAGE, maille_writer_begin(writer, error)); /* a bound of no array */
  maille_writer_free(writer);
  writer = maille_writer_create(sink, MAILLE_F64, NULL, error);
  FAILS(MAILLE_USAGE, maille_writer_declare(writer, "x", MAILLE_CORNER, MAILLE_F32, 1, 0, 1, error));
  OK(maille_writer_begin(writer, error));
  OK(maille_writer_add_points(writer, 0, 4, positions, NULL, error));
  FAILS(MAILLE_USAGE, maille_writer_add_cells(writer, MAILLE_POLYGON, 1, 0, corners, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_writer_add_cells(writer, 999, 1, 0, corners, NULL, NULL, error));
  FAILS(MAILLE_USAGE, maille_writer_add_cells(writer, MAILLE_TETRAHEDRON, UINT64_MAX, 0, corners, NULL, NULL, error));
  OK(maille_writer_add_polyhedron(writer, sizes, 4, corners, NULL, NULL, error));
  OK(maille_writer_finish(writer, error));
  maille_writer_free(writer);
  maille_source* source = maille_source_memory(maille_sink_bytes(sink), maille_sink_size(sink), error);
  maille_mesh* mesh = maille_decode(source, NULL, error);
  CHECK(maille_mesh_cells(mesh) == 1 && maille_block_face_sizes(mesh, 0, NULL) != NULL);
  maille_mesh_free(mesh);
  maille_source_free(source);
  maille_sink_free(sink);
  maille_encode_options_free(options);
}

int main(int argc, char** argv) {
  if (argc > 1) folder = argv[1];
  error = maille_error_create();
  versions_are_told();
  errors_are_a_code_and_a_sentence();
  sources_are_memory_files_functions_and_parts_of_others();
  sinks_are_memory_files_and_functions();
  a_mesh_gives_back_what_it_was_given();
  wrong_meshes_are_refused_with_a_sentence();
  polyhedra_come_back();
  all_modes_and_efforts_give_the_mesh_back();
  bounds_are_kept_and_told();
  what_is_asked_for_is_all_that_comes();
  progress_is_told_and_can_stop_a_job();
  threads_change_nothing();
  two_threads_may_read_one_source();
  damaged_files_are_errors_never_crashes();
  what_is_left_of_a_stream_can_be_had();
  other_formats_are_read_and_written();
  a_file_tells_what_it_holds();
  steps_of_time_are_appended_and_read();
  surfaces_are_read_in_parts_and_asked();
  volumes_are_read_in_pieces();
  queries_that_make_no_sense_are_refused();
  streams_go_in_and_out_in_portions();
  streams_take_polyhedra();
  maille_error_free(error);
  if (failures > 0) fprintf(stderr, "%d claims do not hold\n", failures);
  return failures > 0;
}
