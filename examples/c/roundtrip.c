/* Reads a mesh in any format maille knows, compresses it in memory, brings it back and compares. */
#include <maille.h>
#include <stdio.h>

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: %s MESH\n", argv[0]);
    return MAILLE_USAGE;
  }
  /* What makes an object gives NULL where it cannot, what does something a code; `error` has the sentence. NULL is an error for
   * all functions, and ignored by those that free, so one look at the end will do. */
  maille_error* error = maille_error_create();
  maille_mesh* mesh = maille_read_mesh(argv[1], NULL, error);
  maille_encode_options* options = maille_encode_options_create(error);
  maille_encode_options_set_threads(options, 0, error);
  maille_sink* sink = maille_sink_memory(error);
  maille_source* source = NULL;
  maille_mesh* decoded = NULL;
  if (mesh && maille_encode(mesh, options, sink, error) == MAILLE_OK) {
    source = maille_source_memory(maille_sink_bytes(sink), maille_sink_size(sink), error);
    decoded = maille_decode(source, NULL, error);
  }
  if (decoded && maille_compare(mesh, decoded, 0, error) == MAILLE_OK) {
    printf("%s: %llu points, %llu cells in %llu bytes, equal after decoding\n", argv[1],
           (unsigned long long)maille_mesh_points(mesh), (unsigned long long)maille_mesh_cells(mesh),
           (unsigned long long)maille_sink_size(sink));
  } else {
    fprintf(stderr, "%s\n", maille_error_message(error));
  }
  const int status = maille_error_code(error);
  maille_mesh_free(decoded);
  maille_source_free(source);
  maille_sink_free(sink);
  maille_encode_options_free(options);
  maille_mesh_free(mesh);
  maille_error_free(error);
  return status;
}
