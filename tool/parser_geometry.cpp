// Verbs about geometry, and measuring: stencil, subdivide, generate, bench.
#include <peers/workload.h>

#include "parser_names.h"

namespace maille::tool {

void Parser::add_stencil() {
  CLI::App* s = verb(
      "stencil",
      "Derive the weights of a prediction from the smoothness of surfaces.\n"
      "Without NAME and --file, lists the stencils known by name. A file holds JSON: \"target\": [0, 0], "
      "\"known\": [[1, 0], ...] or [{\"label\": \"a\", \"position\": [1, 0]}, ...], and for the spectral "
      "rule \"hidden\" (samples neither known nor wanted) and \"edges\": [[0, 1], ...], which count known "
      "samples, the target, hidden ones. docs/prediction.md explains the rules.",
      "maille stencil\n"
      "maille stencil butterfly\n"
      "maille stencil k-star:6 --noise 0.2\n"
      "maille stencil dual-parallelogram:6 --covariance gaussian --json\n"
      "maille stencil 'grid:###/##x' --rule spectral");
  s->add_option("NAME", stencil.name, "Stencil, with its parameters behind colons")->type_name("NAME");
  s->add_option("--file", stencil.file, "Read a stencil of your own from a JSON file; - is standard input")
      ->type_name("FILE")
      ->group(prediction_group);
  one_of(s->add_option("--rule", stencil.rule, "How weights are derived (default: as usual for the stencil)"),
         {"taylor", "spectral"})
      ->group(prediction_group);
  one_of(s->add_option("--covariance", raw.covariance,
                       "Taylor: how derivatives of one order are assumed to be related (default: rotation)"),
         {"independent", "rotation", "gaussian"})
      ->group(prediction_group);
  s->add_option("--order", stencil.order,
                "Taylor: ignore derivatives above this order (default: none; with --noise: 2)")
      ->check(CLI::Range(0u, largest_taylor_order))
      ->type_name("N")
      ->group(prediction_group);
  s->add_option("--noise", stencil.noise,
                "Taylor: variance of the noise in known values, relative to that of a mixed second "
                "derivative")
      // Chosen, not derived: far above any use, and far from overflow.
      ->check(CLI::Range(0.0, 1e12))
      ->type_name("X")
      ->group(prediction_group);
  s->add_option("--exact", stencil.exact_order,
                "Taylor with noise: polynomials up to this degree are still reproduced (default: 1)")
      ->check(CLI::Range(0u, largest_taylor_order))
      ->type_name("N")
      ->group(prediction_group);
  add_answer(s, stencil.common);
}

void Parser::add_subdivide() {
  CLI::App* s =
      verb("subdivide",
           "Subdivide a triangle mesh, keeping its points.\n"
           "New points are predicted by the modified butterfly (each triangle becomes 4) or sqrt3 "
           "(3). Borders stay borders. Only positions are kept. PLY is written as it is made: this "
           "takes memory for the input (three times as much for sqrt3 with an odd number of levels) "
           "and about a million triangles, however large the result.",
           "maille subdivide cow.off smooth.ply --levels 2\n"
           "maille subdivide bunny.ply large.ply --scheme sqrt3 --levels 6");
  add_file(s, "-i,--input,IN", subdivide.input, "Mesh to read; - is standard input")->required();
  add_file(s, "-o,--output,OUT", subdivide.output, "File to write; - is standard output")->required();
  add_input_format(s, subdivide.input_format, "IN", files_group);
  add_output_format(s, subdivide.output_format, "by extension; ply where there is none",
                    mesh_formats_to_write());
  add_force(s, subdivide.force);
  one_of(s->add_option("--scheme", raw.scheme, "How points are predicted (default: butterfly)"),
         {"butterfly", "sqrt3"})
      ->group(scheme_group);
  s->add_option("--levels", subdivide.subdivision.levels, "How often to subdivide (default: 1)")
      // 16 levels of the butterfly make 2^32 triangles of each one: more than points can be numbered.
      ->check(CLI::Range(1, 16))
      ->type_name("N")
      ->group(scheme_group);
  add_work(s, subdivide.common);
}

void Parser::add_generate() {
  CLI::App* g =
      verb("generate",
           "Generate a mesh of hexahedral blocks from OpenFOAM's blockMeshDict.\n"
           "Gradings, edges that are arcs, splines or polylines, projections, zones and patches are "
           "understood. The mesh is that of blockMesh, cell by cell and, unless something is "
           "projected, point by point; docs/generate.md says what is supported. Points and cells "
           "come in blockMesh's order unless --any-order is given.",
           "maille generate system/blockMeshDict mesh.maille\n"
           "maille generate system/blockMeshDict fine.maille --refine 4\n"
           "maille generate system/blockMeshDict --count --refine 20");
  add_file(g, "-i,--input,DICT", generate.input, "blockMeshDict to read; - is standard input")->required();
  add_file(g, "-o,--output,OUT", generate.output, "File to write; - is standard output");
  add_output_format(g, generate.output_format, "by extension", formats_to_write());
  add_force(g, generate.force);
  g->add_option("--refine", generate.generation.refine, "Multiply all divisions of blocks (default: 1)")
      ->check(CLI::Range(1, 1 << 20))
      ->type_name("N")
      ->group(scheme_group);
  g->add_flag("--any-order", generate.generation.streaming_order,
              "Sweep blocks that lie side by side together, so that few points are in use at any time")
      ->group(scheme_group);
  cells_of_pieces(
      g->add_option("--pieces", generate.pieces,
                    "For .maille: cut the mesh into pieces of about N cells (auto: 262,144) that can be read "
                    "alone; this takes temporary files (default: off)"))
      ->group(scheme_group);
  g->add_flag("--count", generate.count,
              "Generate everything, but only count, and write nothing; this takes hardly any memory")
      ->group(scheme_group);
  add_work(g, generate.common);
}

void Parser::add_bench() {
  CLI::App* b =
      verb("bench",
           "Measure maille on meshes of your own, at all levels and beside other codecs.\n"
           "Only positions and faces are compressed, and every codec gets the same integers. Times "
           "are CPU seconds of one thread, the best of several runs; memory is what the work needed "
           "on top of the mesh. Each codec first runs in a process of its own, so that a crash "
           "costs only its row. Codecs that were missing when maille was built are named. A second "
           "table compares the whole file with all its arrays, bit for bit, with packers of any "
           "bytes. The exit code is 1 if a mesh did not come back from maille.",
           "maille bench dragon.ply                        # minutes for a million faces\n"
           "maille bench --levels 2,5,9 --codec maille,draco *.ply\n"
           "maille bench --lossless --against 'xz -9' --json dragon.ply | jq '.[0].codecs[].ratio'");
  b->add_option("FILE", bench.inputs, "Meshes to measure; - is standard input")
      ->type_name("FILE")
      ->required()
      ->group(files_group);
  add_input_format(b, bench.input_format, "FILE", files_group);
  CLI::Option* bits = b->add_option("--bits", bench.bits,
                                    "Positions on a lattice of 2^N values over the longest side of the "
                                    "bounding box (default 14)")
                          ->check(CLI::Range(1, bench::max_bits))
                          ->type_name("N")
                          ->group(quality_group);
  b->add_flag("--lossless", raw.lossless, "Positions as float32, bit for bit")
      ->group(quality_group)
      ->excludes(bits);
  comma_separated(
      b->add_option("--levels", bench.levels, "Efforts of maille, separated by commas (default: 1 to 9)"))
      ->check(CLI::Range(1, 9))
      ->type_name("N,N,...")
      ->group(answer_group);
  comma_separated(
      b->add_option("--codec", bench.codecs,
                    "Only codecs with one of these in their name, separated by commas (default: all)"))
      ->type_name("NAME,...")
      ->group(answer_group);
  b->add_option("--against", bench.against,
                "The codec that sizes are relative to (default: the first in the table that is not "
                "maille)")
      ->type_name("NAME")
      ->group(answer_group);
  b->add_option("--repeat", bench.repeat,
                "Time each codec N times; fewer where that takes more than 3 seconds (default 5)")
      ->check(CLI::Range(1, 1000))
      ->type_name("N")
      ->group(answer_group);
  b->add_flag("--no-whole-file", raw.no_whole_file, "Leave out the table of the whole file")
      ->group(answer_group);
  add_memory(b);
  add_answer(b, bench.common);
  add_progress(b);
}

}  // namespace maille::tool
