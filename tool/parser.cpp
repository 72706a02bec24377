#include "parser.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/io.h>
#include <peers/workload.h>

namespace maille::tool {

namespace {

// Groups of options, in the order of the help text.
constexpr const char* files_group = "Input and output";
constexpr const char* quality_group = "Quality";
constexpr const char* answer_group = "Answer";
constexpr const char* prediction_group = "Prediction";
constexpr const char* scheme_group = "Scheme";
constexpr const char* speed_group = "Speed and memory";
constexpr const char* message_group = "Messages";

CLI::Option* choice(CLI::Option* option, const std::vector<std::string>& values) {
  return option->check(CLI::IsMember(values))->type_name(fmt::format("{}", fmt::join(values, "|")));
}

std::vector<std::string> format_names(bool with_maille, bool for_output) {
  std::vector<std::string> names;
  for (const FormatInfo& format : formats()) {
    if (format.writable || !for_output) names.push_back(format.name);
  }
  if (with_maille) names.push_back("maille");
  return names;
}

CLI::Option* repeatable(CLI::Option* option, const std::string& value) {
  return option->allow_extra_args(false)->type_name(value)->group(quality_group);
}

/// "1,5,9" in one word.
CLI::Option* list(CLI::Option* option) {
  return option->delimiter(',')->allow_extra_args(false);
}

CLI::Option* file(CLI::App* verb, const std::string& names, std::string& variable, const std::string& help) {
  return verb->add_option(names, variable, help)->type_name("FILE")->group(files_group);
}

void add_input_format(CLI::App* verb, std::string& variable, const std::string& what, const char* group) {
  const std::string help = fmt::format("Format of {} (default: by extension, then by first bytes)", what);
  choice(verb->add_option("--input-format", variable, help), format_names(true, false))->group(group);
}

void add_force(CLI::App* verb, bool& force) {
  verb->add_flag("-f,--force", force, "Overwrite OUT if it exists; write binary data to a terminal")
      ->group(files_group);
}

}  // namespace

CLI::App* Parser::verb(const std::string& name, const std::string& description, const std::string& examples) {
  CLI::App* added = app.add_subcommand(name, description);
  added->footer(examples);
  added->set_help_flag("-h,--help", "Print this text")->group(message_group);
  return added;
}

void Parser::add_common(CLI::App* verb, CommonOptions& common, bool threads) {
  if (threads) {
    verb->add_option("-T,--threads", common.threads, "Threads to use; 0 (default): all of the machine")
        ->check(CLI::Range(0, 1024))
        ->type_name("N")
        ->group(speed_group);
    add_memory(verb);
  }
  verb->add_flag("-q,--quiet", common.quiet, "Print errors only")->group(message_group);
  if (threads) {
    verb->add_flag("-v,--verbose", common.verbose,
                   "Print more: how long each step took, a row for every array")
        ->group(message_group);
  }
  verb->add_flag("--json", common.json, "Answer in JSON on standard output")->group(message_group);
  if (threads) add_progress(verb);
}

void Parser::add_memory(CLI::App* verb) {
  verb->add_option("-M,--memory", raw.memory,
                   "Largest mesh to hold in memory, such as 500M or 4G (default 64G)")
      ->type_name("SIZE")
      ->group(speed_group);
}

void Parser::add_progress(CLI::App* verb) {
  CLI::Option* progress = verb->add_option(
      "--progress", raw.progress,
      "Show progress on standard error; auto (default): when it is a terminal; json: one object per line");
  choice(progress, {"auto", "always", "never", "json"})->group(message_group);
}

void Parser::add_compress() {
  CLI::App* c =
      verb("compress",
           "Compress a mesh into a .maille file.\n"
           "Every value of every array comes back bit for bit unless -e, --rel-error or --bits allows "
           "a loss. Vertices and faces come back in another order unless --keep-order is given.\n"
           "The same input and settings give the same file on every machine, with any number of threads; "
           "the file records the input's name unless --no-provenance is given.",
           "maille compress dragon.ply                        # dragon.maille, lossless\n"
           "maille compress run.pvd                           # run.maille, with all steps of time\n"
           "maille compress -e 0.01 dragon.ply small.maille   # positions within 0.01 file units\n"
           "maille compress --bits 14 --bits normal=10 in.obj out.maille\n"
           "maille compress --mode random -M 1G huge.ply      # may be larger than memory\n"
           "zcat big.ply.gz | maille c - - --input-format ply > big.maille");
  c->alias("c");
  file(c, "-i,--input,IN", compress.input, "Mesh to read; - is standard input")->required();
  file(c, "-o,--output,OUT", compress.output,
       "File to write; - is standard output (default: IN with the extension .maille)");
  add_input_format(c, compress.input_format, "IN", files_group);
  add_force(c, compress.force);
  c->add_flag("--no-provenance", raw.no_provenance,
              "Do not record version, input name and settings in the file: the same mesh then gives the same "
              "file whatever its name")
      ->group(files_group);

  repeatable(c->add_option("-e,--error", compress.error,
                           "Largest error allowed per coordinate of the positions, in file units, or per "
                           "component of the array NAME; repeatable"),
             "X|NAME=X");
  repeatable(
      c->add_option("--rel-error", compress.relative_error,
                    "The same as a fraction of the bounding box diagonal (positions) or of the range of "
                    "values (NAME); repeatable"),
      "X|NAME=X");
  repeatable(
      c->add_option("--bits", compress.bits,
                    "Lattice of 2^N values over the longest side of the bounding box (positions) or over "
                    "the range of values (NAME); repeatable"),
      "N|NAME=N");
  c->add_flag("--lossless", compress.lossless, "Bit for bit (default)")->group(quality_group);
  CLI::Option* keep =
      c->add_flag("--keep-order", raw.keep_order, "Keep the order of vertices and faces; costs some bytes")
          ->group(quality_group);
  CLI::Option* any =
      c->add_flag("--any-order", raw.any_order, "Let the order change (default, but not of mode stream)")
          ->group(quality_group)
          ->excludes(keep);
  c->add_option(
       "--delay", compress.delay,
       "Streams: hold back N cells, and write always the one that fits best; for a pipe, or a file too "
       "large to be put in order as a whole")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 28))
      ->group(quality_group)
      ->needs(any);

  choice(c->add_option("--mode", raw.mode,
                       "Kind of file (default: stream for meshes with volume cells, else single)"),
         {"single", "stream", "random"})
      ->group(speed_group);
  c->add_flag("-1{1},-2{2},-3{3},-4{4},-5{5},-6{6},-7{7},-8{8},-9{9}", raw.effort,
              "Effort: -1 is fast, -9 makes the smallest file (default -5)")
      ->group(speed_group);
  add_common(c, compress.common, true);
}

void Parser::add_decompress() {
  CLI::App* d = verb("decompress",
                     "Turn a .maille file back into a mesh file.\n"
                     "The extension of OUT chooses the format.",
                     "maille decompress dragon.maille             # dragon.ply\n"
                     "maille decompress dragon.maille dragon.obj\n"
                     "maille d --arrays normal in.maille out.ply  # positions, faces and normals only\n"
                     "maille d flow.maille flow_3.vtu --step 3\n"
                     "maille d in.maille - --output-format off | less");
  d->alias("d");
  file(d, "-i,--input,IN", decompress.input, "A .maille file; - is standard input")->required();
  file(d, "-o,--output,OUT", decompress.output,
       "File to write; - is standard output (default: IN with the extension of the format, .ply or for "
       "volumes .vtu)");
  choice(d->add_option("--output-format", decompress.output_format,
                       "Format of OUT (default: by extension; ply where there is none)"),
         format_names(false, true))
      ->group(files_group);
  add_force(d, decompress.force);
  d->add_option(
       "--arrays", raw.arrays,
       "Arrays to write besides positions and faces, separated by commas; '' for none (default: all)")
      ->type_name("A,B,...")
      ->group(files_group);
  CLI::Option* step = d->add_option("--step", decompress.step,
                                    "Step of time whose arrays are written; 0 (default): those of the mesh")
                          ->type_name("N")
                          ->group(files_group);
  d->add_option("--time", decompress.time, "The same by its time")
      ->type_name("T")
      ->group(files_group)
      ->excludes(step);
  d->add_flag("--salvage", decompress.salvage,
              "Write what comes before the first damage, and leave with exit code 6; mode stream only")
      ->group(files_group);
  d->add_flag("--ascii", decompress.ascii, "Text instead of binary, where the format has both")
      ->group(files_group);
  add_common(d, decompress.common, true);
}

void Parser::add_append() {
  CLI::App* a = verb(
      "append",
      "Append values of later times to a file of mode stream.\n"
      "Each STEP is the same mesh, points and cells in the same order, with other values in its arrays; a "
      ".pvd names several, with their times. Arrays that have not changed since the mesh was compressed take "
      "no room. Each step is read without the others. The file stays as it is until a step is whole.",
      "maille compress flow_0.vtu flow.maille\n"
      "maille append flow.maille flow_1.vtu --time 0.1\n"
      "maille append flow.maille run.pvd --error pressure=0.5\n"
      "maille decompress flow.maille last.vtu --time 0.1");
  file(a, "FILE", append.file, "A .maille file of mode stream")->required();
  a->add_option("STEP", append.steps, "Meshes with the values of the next steps, in any format, or .pvd")
      ->type_name("FILE")
      ->required()
      ->group(files_group);
  add_input_format(a, append.input_format, "STEP", files_group);
  a->add_option("--time", append.time,
                "Time of the first STEP, those behind it are 1 apart (default: what the file says, such as "
                "TimeValue, or the number of the step)")
      ->type_name("T")
      ->group(files_group);
  repeatable(a->add_option("-e,--error", append.quality.error,
                           "Largest error allowed per component of the array NAME; repeatable"),
             "NAME=X");
  repeatable(a->add_option("--rel-error", append.quality.relative_error,
                           "The same as a fraction of the range of values; repeatable"),
             "NAME=X");
  repeatable(a->add_option("--bits", append.quality.bits,
                           "2^N values over the range of values of the array NAME; repeatable"),
             "NAME=N");
  add_common(a, append.common, true);
}

void Parser::add_info() {
  CLI::App* i = verb("info",
                     "Say what a .maille file holds.\n"
                     "Reads the description only and decodes no values.",
                     "maille info dragon.maille\n"
                     "maille info https://example.org/dragon.maille\n"
                     "maille info --json dragon.maille | jq .points");
  file(i, "-i,--input,FILE", info.input, "A .maille file, or its address; - is standard input")->required();
  i->add_flag("--tree", info.tree, "List the levels of detail of a file of mode random, with their errors")
      ->group(answer_group);
  i->add_flag("--chunks", info.chunks, "List the chunks of the file, too")->group(answer_group);
  add_fetch_limit(i);
  add_common(i, info.common, false);
}

void Parser::add_verify() {
  CLI::App* v =
      verb("verify",
           "Check a .maille file: checksums, then everything decoded.\n"
           "With --against, also that it holds the original mesh: exactly what was stored lossless, "
           "within its bound what was not. Exit code 1 when it does not, 6 when the file is damaged. "
           "From a pipe a file of mode stream is decoded as it comes, without memory for all of it, but not "
           "the steps of time behind it.",
           "maille verify dragon.maille\n"
           "maille verify dragon.maille --against dragon.ply");
  file(v, "-i,--input,FILE", verify.input, "A .maille file; - is standard input")->required();
  v->add_option("--against", verify.original, "The mesh that was compressed, in any format")
      ->type_name("FILE")
      ->group(answer_group);
  add_input_format(v, verify.original_format, "the original", answer_group);
  add_common(v, verify.common, true);
}

void Parser::add_diff() {
  CLI::App* d =
      verb("diff",
           "Compare two meshes of any format, bit for bit.\n"
           "Meshes are equal when some order of vertices and faces makes them equal. Exit code 0 when "
           "equal, 1 when different.",
           "maille diff dragon.ply dragon.maille\n"
           "maille diff --same-order a.ply b.obj");
  d->add_option("A", diff.a, "First mesh; - is standard input")->type_name("FILE")->required();
  d->add_option("B", diff.b, "Second mesh; - is standard input")->type_name("FILE")->required();
  add_input_format(d, diff.input_format, "both", files_group);
  d->add_flag(
       "--same-order", diff.same_order,
       "Vertices and faces must be in the same order; also prints the largest difference of each array")
      ->group(answer_group);
  d->add_flag("--no-arrays", raw.no_arrays, "Compare positions and faces only")->group(answer_group);
  d->add_flag("--metadata", diff.metadata, "Compare comments and other metadata, too")->group(answer_group);
  add_common(d, diff.common, true);
}

void Parser::add_convert() {
  CLI::App* c =
      verb("convert",
           "Convert between mesh formats, .maille included.\n"
           "What the target format cannot hold is named on standard error. Nothing is lost on the way "
           "to .maille; use compress to choose a tolerance.",
           "maille convert scan.obj scan.ply\n"
           "maille convert --ascii scan.stl scan.ply\n"
           "maille convert - - --input-format ply --output-format obj < in.ply > out.obj");
  file(c, "-i,--input,IN", convert.input, "Mesh to read; - is standard input")->required();
  file(c, "-o,--output,OUT", convert.output, "File to write; - is standard output")->required();
  add_input_format(c, convert.input_format, "IN", files_group);
  choice(c->add_option("--output-format", convert.output_format, "Format of OUT (default: by extension)"),
         format_names(true, true))
      ->group(files_group);
  add_force(c, convert.force);
  c->add_flag("--ascii", convert.ascii, "Text instead of binary, where the format has both")
      ->group(files_group);
  add_common(c, convert.common, true);
}

void Parser::add_stencil() {
  CLI::App* s = verb(
      "stencil",
      "Derive the weights of a prediction from the smoothness of surfaces.\n"
      "Without NAME and --file, lists the stencils known by name. A file holds JSON: \"target\": [0, 0], "
      "\"known\": [[1, 0], ...] or [{\"label\": \"a\", \"position\": [1, 0]}, ...], and for the spectral "
      "rule "
      "\"hidden\" (samples neither known nor wanted) and \"edges\": [[0, 1], ...], which count known "
      "samples, the "
      "target, hidden ones. docs/prediction.md explains the rules.",
      "maille stencil\n"
      "maille stencil butterfly\n"
      "maille stencil k-star:6 --noise 0.2\n"
      "maille stencil dual-parallelogram:6 --covariance gaussian --json\n"
      "maille stencil 'grid:###/##x' --rule spectral");
  s->add_option("NAME", stencil.name, "Stencil, with its parameters behind colons")->type_name("NAME");
  s->add_option("--file", stencil.file, "Read a stencil of your own from a JSON file; - is standard input")
      ->type_name("FILE")
      ->group(prediction_group);
  choice(s->add_option("--rule", stencil.rule, "How weights are derived (default: as usual for the stencil)"),
         {"taylor", "spectral"})
      ->group(prediction_group);
  choice(s->add_option("--covariance", raw.covariance,
                       "Taylor: what derivatives of one order are taken to be (default: rotation)"),
         {"independent", "rotation", "gaussian"})
      ->group(prediction_group);
  s->add_option("--order", stencil.order,
                "Taylor: ignore derivatives above this order (default: none; with --noise: 2)")
      ->check(CLI::Range(0u, largest_taylor_order))
      ->type_name("N")
      ->group(prediction_group);
  s->add_option("--noise", stencil.noise,
                "Taylor: variance of the noise of known values, that of a mixed second derivative being 1")
      ->check(CLI::Range(0.0, 1e12))
      ->type_name("X")
      ->group(prediction_group);
  s->add_option("--exact", stencil.exact_order,
                "Taylor with noise: polynomials up to this degree are reproduced all the same (default: 1)")
      ->check(CLI::Range(0u, largest_taylor_order))
      ->type_name("N")
      ->group(prediction_group);
  add_common(s, stencil.common, false);
}

void Parser::add_subdivide() {
  CLI::App* s = verb(
      "subdivide",
      "Subdivide a triangle mesh, keeping its points.\n"
      "New points are predicted by the modified butterfly (each triangle becomes 4) or sqrt3 (3). Borders "
      "stay borders. Only positions come along. PLY is written as it is made: this takes memory for "
      "the input (three times as much for sqrt3 with an odd number of levels) and about a million triangles, "
      "however large "
      "the result.",
      "maille subdivide cow.off smooth.ply --levels 2\n"
      "maille subdivide bunny.ply large.ply --scheme sqrt3 --levels 6");
  file(s, "-i,--input,IN", subdivide.input, "Mesh to read; - is standard input")->required();
  file(s, "-o,--output,OUT", subdivide.output, "File to write; - is standard output")->required();
  add_input_format(s, subdivide.input_format, "IN", files_group);
  choice(s->add_option("--output-format", subdivide.output_format,
                       "Format of OUT (default: by extension; ply where there is none)"),
         format_names(false, true))
      ->group(files_group);
  add_force(s, subdivide.force);
  choice(s->add_option("--scheme", raw.scheme, "How points are predicted (default: butterfly)"),
         {"butterfly", "sqrt3"})
      ->group(scheme_group);
  s->add_option("--levels", subdivide.subdivision.levels, "How often (default: 1)")
      ->check(CLI::Range(1, 16))
      ->type_name("N")
      ->group(scheme_group);
  add_common(s, subdivide.common, true);
}

void Parser::add_generate() {
  CLI::App* g = verb(
      "generate",
      "Generate a mesh of hexahedral blocks from OpenFOAM's blockMeshDict.\n"
      "Blocks with gradings, edges that are arcs, splines, polylines, zones, patches: the mesh is that of "
      "blockMesh, cell by cell and point by point. docs/generate.md says what is supported. Points and "
      "cells come in blockMesh's order unless --any-order is given.",
      "maille generate system/blockMeshDict mesh.maille\n"
      "maille generate system/blockMeshDict fine.maille --refine 4\n"
      "maille generate system/blockMeshDict --count --refine 20");
  file(g, "-i,--input,DICT", generate.input, "blockMeshDict to read")->required();
  file(g, "-o,--output,OUT", generate.output, "File to write; - is standard output");
  choice(g->add_option("--output-format", generate.output_format, "Format of OUT (default: by extension)"),
         format_names(true, true))
      ->group(files_group);
  add_force(g, generate.force);
  g->add_option("--refine", generate.generation.refine, "Multiply all divisions of blocks (default: 1)")
      ->check(CLI::Range(1, 1 << 20))
      ->type_name("N")
      ->group(scheme_group);
  g->add_flag("--any-order", generate.generation.streaming_order,
              "Sweep blocks side by side together, so that few points are in use at any time")
      ->group(scheme_group);
  g->add_flag("--count", generate.count, "Generate all of it, count, and write nothing; needs no memory")
      ->group(scheme_group);
  add_common(g, generate.common, true);
}

void Parser::add_extract() {
  CLI::App* e = verb("extract",
                     "Extract a part of a file of mode random, at any level of detail.\n"
                     "Reads and decodes only what is needed. Without a limit on detail the faces are those "
                     "of the mesh, bit for bit, with "
                     "all arrays; coarser ones are triangles with values of the mesh. Faces that have a "
                     "point in the region are taken, "
                     "whole. Exit code 6 when charts were damaged: the others are written.",
                     "maille compress --mode random scan.ply scan.maille\n"
                     "maille extract scan.maille head.ply --box 0,0,1.5,1,1,2\n"
                     "maille extract scan.maille preview.ply --triangles 20000\n"
                     "maille extract scan.maille coarse.ply --error 0.01\n"
                     "maille extract scan.maille part.ply --component 0.1,0,2\n"
                     "maille extract scan.maille points.ply --nearest 0.1,0,2 --count 50\n"
                     "maille extract https://example.org/scan.maille head.ply --box 0,0,1.5,1,1,2");
  file(e, "-i,--input,IN", extract.input, "File of mode random to read, or its address")->required();
  file(e, "-o,--output,OUT", extract.output, "File to write; - is standard output")->required();
  choice(e->add_option("--output-format", extract.output_format,
                       "Format of OUT (default: by extension; ply where there is none)"),
         format_names(false, true))
      ->group(files_group);
  e->add_flag("--ascii", extract.ascii, "Write text where the format has both")->group(files_group);
  add_force(e, extract.force);
  constexpr const char* region = "Region";
  list(e->add_option("--box", extract.box, "Lowest and highest corner: six numbers, separated by commas"))
      ->expected(6)
      ->type_name("X,Y,Z,X,Y,Z")
      ->group(region);
  list(e->add_option("--sphere", extract.sphere, "Centre and radius: four numbers, separated by commas"))
      ->expected(4)
      ->type_name("X,Y,Z,R")
      ->group(region);
  e->add_flag("--whole-charts", extract.whole_charts, "Keep all faces of the charts that meet the region")
      ->group(region);
  e->add_flag("--chart-numbers", extract.chart_numbers,
              "Add an array 'chart' of the cells: which of the charts that were read each is of")
      ->group(files_group);
  CLI::Option* component =
      list(e->add_option("--component", extract.component,
                         "What hangs together with the face nearest to this point: three numbers, separated "
                         "by commas"))
          ->expected(3)
          ->type_name("X,Y,Z")
          ->group(region);
  CLI::Option* nearest =
      list(e->add_option("--nearest", extract.nearest,
                         "The points of the mesh nearest to this one, the nearest first, without faces: "
                         "three numbers, separated by commas"))
          ->expected(3)
          ->type_name("X,Y,Z")
          ->group(region)
          ->excludes(component);
  e->add_option("--count", extract.count, "How many points --nearest gives (default 1)")
      ->type_name("N")
      ->group(region)
      ->needs(nearest);
  constexpr const char* detail = "Detail";
  CLI::Option* full = e->add_flag("--full", extract.full, "The mesh itself (default)")->group(detail);
  CLI::Option* error = e->add_option("--error", extract.error,
                                     "The coarsest that is nowhere farther from the mesh, in file units")
                           ->check(CLI::NonNegativeNumber)
                           ->type_name("X")
                           ->group(detail)
                           ->excludes(full);
  CLI::Option* level =
      e->add_option("--level", extract.level, "Level of detail: 0 is the mesh, each next one a fourth")
          ->type_name("N")
          ->group(detail)
          ->excludes(full)
          ->excludes(error);
  e->add_option("--triangles", extract.triangles,
                "The finest of at most so many faces, before those outside are cut off")
      ->type_name("N")
      ->group(detail)
      ->excludes(full)
      ->excludes(error)
      ->excludes(level);
  list(e->add_option("--eye", extract.eye,
                     "As seen from there, on a screen of 1080 pixels over 60 degrees: three numbers, "
                     "separated by commas"))
      ->expected(3)
      ->type_name("X,Y,Z")
      ->group(detail)
      ->excludes(full);
  e->add_option("--pixel-error", extract.pixel_error,
                "The largest error that may be seen with --eye, in pixels (default 1)")
      ->check(CLI::PositiveNumber)
      ->type_name("N")
      ->group(detail);
  // Both are of the mesh itself, as a whole.
  for (const char* name : {"--box", "--sphere", "--whole-charts", "--chart-numbers", "--error", "--level",
                           "--triangles", "--eye"}) {
    component->excludes(e->get_option(name));
    nearest->excludes(e->get_option(name));
  }
  add_fetch_limit(e);
  add_common(e, extract.common, true);
}

void Parser::add_fetch_limit(CLI::App* verb) {
  verb->add_option(
          "--fetch-limit", raw.fetch_limit,
          "From an address, fetch at most so much more than what was asked for: where a server gives "
          "no parts of files, or the index is damaged (default 64M)")
      ->type_name("SIZE")
      ->group(files_group);
}

void Parser::add_serve() {
  CLI::App* s =
      verb("serve",
           "Serve a folder, or one file, over HTTP.\n"
           "With what programs and web pages need to read parts of .maille files: ranges, ETags, leave for "
           "pages of other servers (CORS), isolation (COOP, COEP). Only files below the folder are given, "
           "none whose name begins with a dot. Only this machine is answered unless --host says more; any "
           "page open in a browser here can read what is served. The address is printed; Ctrl-C ends.",
           "maille serve scans\n"
           "maille serve scan.maille --port 0 &\n"
           "maille extract http://127.0.0.1:8080/scan.maille head.ply --box 0,0,1.5,1,1,2");
  file(s, "PATH", serve.path, "Folder or file to serve")->required();
  s->add_option(
       "--host", serve.host,
       "Address to listen at; 0.0.0.0: for every machine that reaches this one (default: 127.0.0.1, for this "
       "machine only)")
      ->type_name("ADDRESS")
      ->group(files_group);
  s->add_option("-p,--port", serve.port, "Port to listen at; 0: any that is free (default: 8080)")
      ->check(CLI::Range(0, 65535))
      ->type_name("N")
      ->group(files_group);
  s->add_flag("-v,--verbose", serve.common.verbose, "Print every request")->group(message_group);
  add_common(s, serve.common, false);
}

void Parser::add_view() {
  CLI::App* v =
      verb("view",
           "Look at a .maille file in the browser.\n"
           "Of a file of mode random only what is in sight is read, as fine as it is seen, so that "
           "meshes of any size are there at once; others are shown whole, volumes by their boundary. "
           "Serves the file and the viewer to this machine, opens the browser where there is a screen, and "
           "prints the address; Ctrl-C ends. The server of an address must allow pages of others (CORS).",
           "maille view scan.maille\n"
           "maille view https://example.org/scan.maille\n"
           "maille view --no-browser --port 8081 scan.maille   # through ssh -L 8081:127.0.0.1:8081");
  file(v, "FILE", view.input, "A .maille file, or the address of one")->required();
  v->add_option("-p,--port", view.port, "Port to listen at; 0: any that is free (default)")
      ->check(CLI::Range(0, 65535))
      ->type_name("N")
      ->group(files_group);
  v->add_flag("--no-browser", raw.no_browser, "Only print the address");
  v->add_flag("-v,--verbose", view.common.verbose, "Print every request")->group(message_group);
  add_common(v, view.common, false);
}

void Parser::add_bench() {
  CLI::App* b = verb(
      "bench",
      "Measure maille on meshes of your own, at all levels and beside other codecs.\n"
      "Positions and faces only, the same integers for every codec, one thread, CPU seconds, medians; memory "
      "is what the work needed on top of the mesh. Each codec first runs in a process of its own, so one "
      "that "
      "crashes costs its row only. Codecs that were not there when maille was built are named. Below comes "
      "the whole file with all its arrays, bit for bit, beside packers of any bytes. Exit code 1 when a mesh "
      "did not come back from maille.",
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
  list(b->add_option("--levels", bench.levels, "Efforts of maille, separated by commas (default: 1 to 9)"))
      ->check(CLI::Range(1, 9))
      ->type_name("N,N,...")
      ->group(answer_group);
  list(b->add_option("--codec", bench.codecs,
                     "Only codecs with one of these in their name, separated by commas (default: all)"))
      ->type_name("NAME,...")
      ->group(answer_group);
  b->add_option("--against", bench.against,
                "The codec sizes are relative to (default: the first in the table that is not maille)")
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
  add_common(b, bench.common, false);
  add_progress(b);
}

void Parser::add_completion() {
  CLI::App* c = verb("completion",
                     "Print a completion script for a shell, or the manual.\n"
                     "man prints the manual page, markdown docs/command.md.",
                     "maille completion bash > ~/.local/share/bash-completion/completions/maille\n"
                     "maille completion zsh > ~/.zfunc/_maille   # a folder in $fpath\n"
                     "maille completion fish > ~/.config/fish/completions/maille.fish\n"
                     "maille completion man | man -l -");
  choice(c->add_option("SHELL", raw.shell, "What to print"), {"bash", "zsh", "fish", "man", "markdown"})
      ->required();
}

Parser::Parser() {
  app.set_help_flag("-h,--help", "Print help");
  app.set_version_flag("-V,--version", "Print the version");
  // Behind the verb, a word is a name: `maille compress d` reads a file d, decompress is not meant.
  app.require_subcommand(0, 1);
  add_compress();
  add_decompress();
  add_append();
  add_info();
  add_verify();
  add_diff();
  add_convert();
  add_stencil();
  add_subdivide();
  add_generate();
  add_extract();
  add_serve();
  add_view();
  add_bench();
  add_completion();
}

}  // namespace maille::tool
