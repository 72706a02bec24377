// Verbs from file to file, and what they hold: compress, decompress, append, info, verify, diff, convert.
#include <fmt/format.h>
#include <maille/encode.h>

#include "parser_names.h"
#include "purpose.h"
#include "tolerance.h"

namespace maille::tool {
namespace {

// Which efforts differ is said by the library's own table.
std::string effort_help() {
  std::string text = fmt::format("Effort, from fast to small (default -{}):", EncodeOptions{}.effort);
  for (const EffortRange& range : effort_ranges()) {
    const auto others = range.last == range.first ? "" : fmt::format(" to -{}", range.last);
    text += fmt::format("\n-{}{}: {}", range.first, others, range.summary);
  }
  return text;
}

void add_as_stored(CLI::App* verb, bool& as_stored) {
  verb->add_flag("--as-stored,!--scene", as_stored,
                 "For glTF: write each mesh once, as it is stored; by default (--scene) meshes are "
                 "written where the nodes of the scene place them, unless OUT is glTF or .maille")
      ->group(files_group);
}

/// The arguments behind IN and OUT, and where outputs of several inputs go.
void add_batch(CLI::App* verb, Batch& batch, const std::string& what) {
  verb->add_option("MORE", batch.inputs, "If there are more than two names, all are inputs")
      ->type_name("FILE")
      ->group(files_group);
  verb->add_option("--output-folder", batch.output_folder,
                   "Folder for the outputs, created if it does not exist; all names are then inputs "
                   "(default: beside each input)")
      ->type_name("DIR")
      ->group(files_group);
  verb->add_flag("-r,--recursive", batch.recursive, "Take " + what + " in the given folders and below them")
      ->group(files_group);
}

std::string purpose_help() {
  std::string text = "Settings for a purpose, which other options override:";
  for (const Purpose& purpose : purposes()) text += "\n" + purpose.name + ": " + purpose.summary;
  return text;
}

std::vector<std::string> purpose_names() {
  std::vector<std::string> names;
  for (const Purpose& purpose : purposes()) names.push_back(purpose.name);
  return names;
}

}  // namespace

void Parser::add_compress() {
  CLI::App* c =
      verb("compress",
           "Compress a mesh into a .maille file.\n"
           "Every value of every array comes back bit for bit unless -e, --rel-error or --bits allows "
           "a loss. Vertices and faces come back in another order unless --keep-order is given.\n"
           "The same input and settings give the same file on every machine, with any number of threads; "
           "the file records the input's name unless --no-provenance is given.",
           "maille compress dragon.ply                        # dragon.maille, lossless\n"
           "maille compress -r --output-folder packed scans   # all meshes in scans and below\n"
           "maille compress run.pvd                           # run.maille, with all steps of time\n"
           "maille compress cavity flow.maille                # a case of OpenFOAM, with all its times\n"
           "maille compress -e 0.01 dragon.ply small.maille   # positions within 0.01 file units\n"
           "maille compress --for web in.glb out.maille       # as Draco's users set their bits\n"
           "maille compress --bits 14 --bits normal=10 in.obj out.maille\n"
           "maille compress model.glb model.maille.glb        # textures, animations and all else stay\n"
           "maille compress --mode random -M 1G huge.ply      # may be larger than memory\n"
           "zcat big.ply.gz | maille c - - --input-format ply > big.maille");
  c->alias("c");
  add_file(c, "-i,--input,IN", compress.input, "Mesh to read; - is standard input")->required();
  add_file(
      c, "-o,--output,OUT", compress.output,
      "File to write; - is standard output (default: IN with the extension .maille). NAME.maille.glb and "
      "NAME.maille.gltf are glTF files that keep all but the geometry of IN as it is");
  add_batch(c, compress.batch, "all meshes");
  add_input_format(c, compress.input_format, "IN", files_group);
  add_force(c, compress.force);
  c->add_flag("--no-provenance", raw.no_provenance,
              "Do not record version, input name and settings in the file: the same mesh then gives the same "
              "file whatever its name")
      ->group(files_group);

  one_of(c->add_option("--for", raw.purpose, purpose_help()), purpose_names())->group(quality_group);
  for (const BoundOption& option : bound_options) {
    repeatable(c->add_option(option.flags, compress.bounds[option.kind], option.meaning), option.arguments);
  }
  c->add_flag("--lossless", compress.lossless, "Bit for bit (default)")->group(quality_group);
  c->add_option("--arrays", raw.arrays,
                "Arrays to keep besides positions and cells, separated by commas; '' for none (default: all)")
      ->type_name("A,B,...")
      ->group(quality_group);
  c->add_option("--drop", raw.drop, "Arrays to leave out, separated by commas, such as normal,texcoord")
      ->type_name("A,B,...")
      ->group(quality_group);
  CLI::Option* keep =
      c->add_flag("--keep-order", raw.keep_order, "Keep the order of vertices and faces; costs some bytes")
          ->group(quality_group);
  CLI::Option* any =
      c->add_flag("--any-order", raw.any_order, "Let the order change (the default, except in mode stream)")
          ->group(quality_group)
          ->excludes(keep);
  c->add_option("--delay", compress.delay,
                "Mode stream: hold back N cells and always write the one that fits best; for a pipe, or "
                "a file too large to be put in order as a whole")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 28))
      ->group(quality_group)
      ->needs(any);

  cells_of_pieces(
      c->add_option("--pieces", compress.pieces,
                    "Cut a volume into pieces of about N cells (auto: 262,144) that can be read alone and "
                    "coded in parallel (default: off). Mode random: cut the surface into charts of about N "
                    "triangles (auto: 4096)"))
      ->group(speed_group);

  one_of(c->add_option("--mode", raw.mode,
                       "Kind of file (default: stream for meshes with volume cells, else single)"),
         {"single", "stream", "random"})
      ->group(speed_group);
  c->add_flag("-1{1},-2{2},-3{3},-4{4},-5{5},-6{6},-7{7},-8{8},-9{9}", raw.effort, effort_help())
      ->group(speed_group);
  add_work(c, compress.common);
}

void Parser::add_decompress() {
  CLI::App* d = verb("decompress",
                     "Turn a .maille file back into a mesh file.\n"
                     "The extension of OUT chooses the format.",
                     "maille decompress dragon.maille             # dragon.ply\n"
                     "maille decompress dragon.maille dragon.obj\n"
                     "maille decompress model.maille.glb          # model.glb\n"
                     "maille d --arrays normal in.maille out.ply  # positions, faces and normals only\n"
                     "maille d *.maille --output-folder meshes --output-format obj\n"
                     "maille d flow.maille flow_3.vtu --step 3\n"
                     "maille d in.maille - --output-format off | less");
  d->alias("d");
  add_file(d, "-i,--input,IN", decompress.input, "A .maille file, or a .maille.glb; - is standard input")
      ->required();
  add_file(d, "-o,--output,OUT", decompress.output,
           "File to write; - is standard output (default: IN with the extension of the format, .ply or for "
           "volumes .vtu)");
  add_batch(d, decompress.batch, "all .maille files");
  add_output_format(d, decompress.output_format, "by extension; ply where there is none",
                    mesh_formats_to_write());
  add_force(d, decompress.force);
  d->add_option(
       "--arrays", raw.arrays,
       "Arrays to write besides positions and faces, separated by commas; '' for none (default: all)")
      ->type_name("A,B,...")
      ->group(files_group);
  CLI::Option* step =
      d->add_option("--step", decompress.step,
                    "Time step whose arrays are written; 0 (default): those of the mesh; a .pvd or a case of "
                    "OpenFOAM (polymesh) gets all steps")
          ->type_name("N")
          ->check(CLI::Range(uint64_t{0}, uint64_t{UINT32_MAX}))
          ->group(files_group);
  d->add_option("--time", decompress.time, "The same, chosen by its time")
      ->type_name("T")
      ->group(files_group)
      ->excludes(step);
  d->add_flag("--salvage", decompress.salvage,
              "Write what is left of a damaged file, say what is lost, and exit with code 6")
      ->group(files_group);
  add_as_stored(d, decompress.as_stored);
  d->add_flag("--ascii", decompress.ascii, "Write text instead of binary, where the format has both")
      ->group(files_group);
  add_work(d, decompress.common);
}

void Parser::add_append() {
  CLI::App* a = verb("append",
                     "Append values of later times to a file of mode stream.\n"
                     "Each STEP is the same mesh, with its points and cells in the same order and other "
                     "values in its arrays; a .pvd or a case of OpenFOAM names several, with their times. "
                     "Arrays that have not changed since the mesh was compressed take no room. Each step can "
                     "be read on its own. The file does not change until a step is complete.",
                     "maille compress flow_0.vtu flow.maille\n"
                     "maille append flow.maille flow_1.vtu --time 0.1\n"
                     "maille append flow.maille run.pvd --error pressure=0.5\n"
                     "maille append --remove-last flow.maille\n"
                     "maille decompress flow.maille last.vtu --time 0.1");
  add_file(a, "FILE", append.file, "A .maille file of mode stream")->required();
  CLI::Option* steps =
      a->add_option("STEP", append.steps,
                    "Meshes with the values of the next steps, in any format, or .pvd files or cases")
          ->type_name("FILE")
          ->group(files_group);
  add_input_format(a, append.input_format, "STEP", files_group);
  CLI::Option* time =
      a->add_option("--time", append.time,
                    "Time of the first STEP; the others follow at intervals of 1 (default: what the file "
                    "says, such as TimeValue, or the number of the step)")
          ->type_name("T")
          ->group(files_group);
  a->add_flag("--remove-last", append.remove_last,
              "Append nothing, but take the last step away again: the file is then as it was before")
      ->excludes(steps)
      ->excludes(time)
      ->group(files_group);
  for (const BoundOption& option : bound_options) {
    const std::string arguments = option.arguments;
    repeatable(a->add_option(option.flags, append.quality.bounds[option.kind],
                             "As in compress, but only for arrays; repeatable"),
               arguments.substr(arguments.find('|') + 1));
  }
  add_work(a, append.common);
}

void Parser::add_info() {
  CLI::App* i = verb("info",
                     "Describe a .maille file, or a mesh of any other format.\n"
                     "Only the description of a .maille file is read, and no value is decoded. Other meshes "
                     "are read whole; for them the answer includes the ranges of arrays, and whether a "
                     "surface is closed.",
                     "maille info dragon.maille\n"
                     "maille info dragon.ply\n"
                     "maille info https://example.org/dragon.maille\n"
                     "maille info --json dragon.maille | jq .points");
  add_file(i, "-i,--input,FILE", info.input, "A .maille file or a mesh, or its address; - is standard input")
      ->required();
  add_input_format(i, info.input_format, "FILE", files_group);
  i->add_flag("--tree", info.tree, "List the levels of detail of a file of mode random, with their errors")
      ->group(answer_group);
  i->add_flag("--pieces", info.pieces, "List the pieces of a volume, with their boxes and ranges of values")
      ->group(answer_group);
  i->add_flag("--chunks", info.chunks, "List the chunks of the file, too")->group(answer_group);
  add_fetch_limit(i);
  add_answer(i, info.common);
}

void Parser::add_verify() {
  CLI::App* v =
      verb("verify",
           "Check a .maille file: checksums, then everything decoded.\n"
           "With --against, it must also hold the original mesh: exactly where it was stored "
           "without loss, and within the bounds elsewhere. The exit code is 1 if it does not, and 6 "
           "if the file is damaged. A file of mode stream from a pipe is decoded as it comes, "
           "without memory for all of it, but its time steps are not checked then.",
           "maille verify dragon.maille\n"
           "maille verify dragon.maille --against dragon.ply");
  add_file(v, "-i,--input,FILE", verify.input, "A .maille file, or a .maille.glb; - is standard input")
      ->required();
  v->add_option("--against", verify.original,
                "The mesh that was compressed, in any format, or the series, whose steps are then "
                "compared, too")
      ->type_name("FILE")
      ->group(answer_group);
  add_input_format(v, verify.original_format, "the original", answer_group);
  add_work(v, verify.common);
}

void Parser::add_diff() {
  CLI::App* d = verb("diff",
                     "Compare two meshes of any format, bit for bit.\n"
                     "Meshes are equal if some order of their vertices and faces makes them equal. The exit "
                     "code is 0 if they are equal, and 1 if they differ.",
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
  add_work(d, diff.common);
}

void Parser::add_convert() {
  CLI::App* c = verb("convert",
                     "Convert between mesh formats, .maille included.\n"
                     "Standard error names what the target format cannot hold. Nothing is lost on the way to "
                     ".maille; use compress to choose a tolerance.",
                     "maille convert scan.obj scan.ply\n"
                     "maille convert --ascii scan.stl scan.ply\n"
                     "maille convert - - --input-format ply --output-format obj < in.ply > out.obj");
  add_file(c, "-i,--input,IN", convert.input, "Mesh to read; - is standard input")->required();
  add_file(c, "-o,--output,OUT", convert.output, "File to write; - is standard output")->required();
  add_input_format(c, convert.input_format, "IN", files_group);
  add_output_format(c, convert.output_format, "by extension", formats_to_write());
  add_force(c, convert.force);
  add_as_stored(c, convert.as_stored);
  c->add_flag("--ascii", convert.ascii, "Write text instead of binary, where the format has both")
      ->group(files_group);
  add_work(c, convert.common);
}

}  // namespace maille::tool
