/* A solver that keeps its results in a .maille file: heat flows through a block of hexahedra, each saved time is a step of the
 * file, and in the end a corner of the block is read back without the rest.
 *
 * The arrays of the solver are handed over where they lie (MAILLE_BORROW): nothing is copied. */
#include <maille.h>
#include <stdio.h>
#include <stdlib.h>

enum { N = 40, M = N + 1, POINTS = M * M * M, CELLS = N * N * N };

static double positions[POINTS][3];
static double heat[POINTS];
static uint32_t cells[CELLS][8];

static void die(maille_error* error) {
  fprintf(stderr, "%s\n", maille_error_message(error));
  exit(maille_error_code(error));
}
#define TRY(call) \
  if ((call) != MAILLE_OK) die(error)

static uint32_t point(uint32_t i, uint32_t j, uint32_t k) {
  return i + M * (j + M * k);
}

static void make_block(void) {
  for (uint32_t p = 0; p < POINTS; ++p) {
    positions[p][0] = (double)(p % M) / N;
    positions[p][1] = (double)(p / M % M) / N;
    positions[p][2] = (double)(p / M / M) / N;
    heat[p] = p / M / M == 0 ? 100 : 20; /* the floor is hot */
  }
  for (uint32_t c = 0; c < CELLS; ++c) {
    const uint32_t i = c % N, j = c / N % N, k = c / N / N;
    for (uint32_t top = 0; top < 2; ++top) { /* VTK's order: round the lower face, then the upper one */
      uint32_t* corner = cells[c] + 4 * top;
      corner[0] = point(i, j, k + top);
      corner[1] = point(i + 1, j, k + top);
      corner[2] = point(i + 1, j + 1, k + top);
      corner[3] = point(i, j + 1, k + top);
    }
  }
}

static void flow(void) { /* upwards, from layer to layer */
  for (uint32_t p = POINTS - 1; p >= M * M; --p) heat[p] += 0.4 * (heat[p - M * M] - heat[p]);
}

static maille_mesh* results(maille_error* error) {
  maille_mesh* mesh = maille_mesh_create(error);
  TRY(maille_mesh_set_points(mesh, MAILLE_F64, POINTS, positions, MAILLE_BORROW, error));
  TRY(maille_mesh_add_block(mesh, "block", MAILLE_HEXAHEDRON, CELLS, NULL, cells[0], 8 * CELLS, NULL, MAILLE_BORROW, error));
  TRY(maille_mesh_add_array(mesh, "heat", MAILLE_POINT, MAILLE_F64, 1, POINTS, heat, MAILLE_NO_ROLE, MAILLE_BORROW, error));
  return mesh;
}

int main(int argc, char** argv) {
  const char* path = argc > 1 ? argv[1] : "heat.maille";
  maille_error* error = maille_error_create();
  make_block();

  /* Pieces of 8192 cells can be read alone; steps need the order kept; heat may be off by a hundredth of a degree. */
  maille_encode_options* options = maille_encode_options_create(error);
  TRY(maille_encode_options_set_part_cells(options, 8192, error));
  TRY(maille_encode_options_set_keep_order(options, 1, error));
  TRY(maille_encode_options_set_bound(options, "heat", MAILLE_ABSOLUTE, 0.01, error));
  maille_mesh* mesh = results(error);
  TRY(maille_write_mesh(mesh, path, options, NULL, NULL, error));
  for (int step = 1; step <= 5; ++step) {
    for (int i = 0; i < 10; ++i) flow();
    TRY(maille_append_step(path, step, mesh, options, NULL, error)); /* the mesh sees what the solver did */
  }

  maille_source* source = maille_source_open(path, error);
  maille_decode_options* decoding = maille_decode_options_create(error);
  TRY(maille_decode_options_set_step(decoding, 5, error));
  maille_volume* volume = source ? maille_volume_open(source, decoding, error) : NULL;
  if (!volume) die(error);
  const double low[3] = {0, 0, 0}, high[3] = {0.1, 0.1, 0.1};
  maille_query* corner = maille_query_create(error);
  TRY(maille_query_set_box(corner, low, high, error));
  uint64_t pieces = 0;
  TRY(maille_volume_select(volume, corner, NULL, 0, &pieces, error));
  maille_mesh* part = maille_volume_extract(volume, corner, error);
  if (!part) die(error);
  const double* values = maille_array_values(part, maille_mesh_find(part, "heat", MAILLE_POINT));
  printf("%llu bytes for 6 times; the corner has %llu cells, in %llu of %u pieces; it is %.0f degrees warm\n",
         (unsigned long long)maille_source_size(source), (unsigned long long)maille_mesh_cells(part),
         (unsigned long long)pieces, (unsigned)maille_volume_pieces(volume), values[maille_mesh_points(part) - 1]);

  maille_mesh_free(part);
  maille_query_free(corner);
  maille_volume_free(volume);
  maille_decode_options_free(decoding);
  maille_source_free(source);
  maille_mesh_free(mesh);
  maille_encode_options_free(options);
  maille_error_free(error);
  return 0;
}
