/* What the tests in C share: claims that are checked, and meshes made by formulas. */
#ifndef MAILLE_C_TESTING_H
#define MAILLE_C_TESTING_H

#include <maille.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(claim)                                                      \
  do {                                                                    \
    if (!(claim)) {                                                       \
      fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #claim); \
      ++failures;                                                         \
    }                                                                     \
  } while (0)
/* A call that must go well. */
#define OK(call)                                                                    \
  do {                                                                              \
    const int32_t code_ = (call);                                                   \
    if (code_ != MAILLE_OK) {                                                       \
      fprintf(stderr, "%s:%d: %s: %d, %s\n", __FILE__, __LINE__, #call, (int)code_, \
              maille_error_message(error));                                         \
      ++failures;                                                                   \
    }                                                                               \
  } while (0)
/* A call that must fail with a code, and say why. */
#define FAILS(expected, call)                                                           \
  do {                                                                                  \
    maille_error_clear(error);                                                          \
    const int32_t code_ = (call);                                                       \
    if (code_ != (expected) || maille_error_code(error) != code_ ||                     \
        strlen(maille_error_message(error)) < 8) {                                      \
      fprintf(stderr, "%s:%d: %s: %d, \"%s\"\n", __FILE__, __LINE__, #call, (int)code_, \
              maille_error_message(error));                                             \
      ++failures;                                                                       \
    }                                                                                   \
  } while (0)
/* A function that must make nothing, for a reason. */
#define NOTHING(expected, call)                                                                            \
  do {                                                                                                     \
    maille_error_clear(error);                                                                             \
    const void* const made_ = (call);                                                                      \
    if (made_ || maille_error_code(error) != (expected) || strlen(maille_error_message(error)) < 8) {      \
      fprintf(stderr, "%s:%d: %s: %d, \"%s\"\n", __FILE__, __LINE__, #call, (int)maille_error_code(error), \
              maille_error_message(error));                                                                \
      ++failures;                                                                                          \
    }                                                                                                      \
  } while (0)

/* Only what a program uses of this file. */
#define MAYBE_UNUSED __attribute__((unused))

/* Memory that lives as long as the program; the list lets leak checkers find it. */
MAYBE_UNUSED static void* keep(size_t bytes) {
  static void* kept[256];
  static unsigned count = 0;
  if (count == 256) abort();
  return kept[count++] = malloc(bytes);
}

/* A waving sheet of n x n quads, cut into triangles, with a float on each point. */
typedef struct {
  float* positions;
  float* heights;
  uint32_t* triangles;
  uint64_t points, faces;
} sheet;

MAYBE_UNUSED static sheet make_sheet(uint32_t n) {
  sheet s;
  s.points = (uint64_t)(n + 1) * (n + 1);
  s.faces = (uint64_t)2 * n * n;
  s.positions = (float*)keep(s.points * 3 * sizeof(float));
  s.heights = (float*)keep(s.points * sizeof(float));
  s.triangles = (uint32_t*)keep(s.faces * 3 * sizeof(uint32_t));
  for (uint32_t j = 0; j <= n; ++j) {
    for (uint32_t i = 0; i <= n; ++i) {
      const uint32_t p = j * (n + 1) + i;
      const double x = (double)i / n, y = (double)j / n;
      s.heights[p] = (float)(0.1 * sin(9 * x) * cos(7 * y));
      s.positions[3 * p] = (float)x;
      s.positions[3 * p + 1] = (float)y;
      s.positions[3 * p + 2] = s.heights[p];
    }
  }
  uint32_t* t = s.triangles;
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      const uint32_t both[6] = {a, b, d, a, d, c};
      memcpy(t, both, sizeof both);
      t += 6;
    }
  }
  return s;
}

/* The sheet as a mesh. */
MAYBE_UNUSED static maille_mesh* sheet_mesh(const sheet* s, int32_t how, maille_error* error) {
  maille_mesh* mesh = maille_mesh_create(error);
  OK(maille_mesh_set_points(mesh, MAILLE_F32, s->points, s->positions, how, error));
  OK(maille_mesh_add_block(mesh, "sheet", MAILLE_TRIANGLE, s->faces, NULL, s->triangles, 3 * s->faces, NULL,
                           how, error));
  OK(maille_mesh_add_array(mesh, "height", MAILLE_POINT, MAILLE_F32, 1, s->points, s->heights, MAILLE_NO_ROLE,
                           how, error));
  return mesh;
}

/* n x n x n hexahedra in the unit cube, with a double on each point and a number on each cell. */
typedef struct {
  double* positions;
  double* heat;
  uint32_t* hexahedra;
  int32_t* layers;
  uint64_t points, cells;
} brick;

MAYBE_UNUSED static brick make_brick(uint32_t n) {
  brick b;
  const uint32_t m = n + 1;
  b.points = (uint64_t)m * m * m;
  b.cells = (uint64_t)n * n * n;
  b.positions = (double*)keep(b.points * 3 * sizeof(double));
  b.heat = (double*)keep(b.points * sizeof(double));
  b.hexahedra = (uint32_t*)keep(b.cells * 8 * sizeof(uint32_t));
  b.layers = (int32_t*)keep(b.cells * sizeof(int32_t));
  for (uint32_t p = 0; p < b.points; ++p) {
    const uint32_t i = p % m, j = p / m % m, k = p / m / m;
    b.positions[3 * p] = (double)i / n;
    b.positions[3 * p + 1] = (double)j / n;
    b.positions[3 * p + 2] = (double)k / n;
    b.heat[p] = exp(-b.positions[3 * p]) + b.positions[3 * p + 2];
  }
  for (uint32_t c = 0; c < b.cells; ++c) {
    const uint32_t i = c % n, j = c / n % n, k = c / n / n;
    const uint32_t a = i + m * (j + m * k), up = m * m;
    const uint32_t corners[8] = {a, a + 1, a + 1 + m, a + m, a + up, a + up + 1, a + up + 1 + m, a + up + m};
    memcpy(b.hexahedra + 8 * c, corners, sizeof corners);
    b.layers[c] = (int32_t)k;
  }
  return b;
}

MAYBE_UNUSED static maille_mesh* brick_mesh(const brick* b, int32_t how, maille_error* error) {
  maille_mesh* mesh = maille_mesh_create(error);
  OK(maille_mesh_set_points(mesh, MAILLE_F64, b->points, b->positions, how, error));
  OK(maille_mesh_add_block(mesh, "brick", MAILLE_HEXAHEDRON, b->cells, NULL, b->hexahedra, 8 * b->cells, NULL,
                           how, error));
  OK(maille_mesh_add_array(mesh, "heat", MAILLE_POINT, MAILLE_F64, 1, b->points, b->heat, MAILLE_NO_ROLE, how,
                           error));
  OK(maille_mesh_add_array(mesh, "layer", MAILLE_CELL, MAILLE_I32, 1, b->cells, b->layers, MAILLE_NO_ROLE,
                           how, error));
  return mesh;
}

/* A file in memory, and a source of its bytes. */
typedef struct {
  maille_sink* sink;
  maille_source* source;
} coded;

MAYBE_UNUSED static coded code(const maille_mesh* mesh, const maille_encode_options* options,
                               maille_error* error) {
  coded file;
  file.sink = maille_sink_memory(error);
  OK(maille_encode(mesh, options, file.sink, error));
  file.source = maille_source_memory(maille_sink_bytes(file.sink), maille_sink_size(file.sink), error);
  return file;
}
MAYBE_UNUSED static void free_coded(coded file) {
  maille_source_free(file.source);
  maille_sink_free(file.sink);
}

#endif
