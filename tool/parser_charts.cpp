// Verbs that read parts of files: extract, slice, probe, serve, view.
#include <fmt/format.h>

#include "parser_names.h"
#include "text.h"

namespace maille::tool {

namespace {

/// Each is looked up in the file by itself.
constexpr int most_places = 10000;

void add_region(CLI::App* verb, ExtractOptions& extract) {
  constexpr const char* region = "Region";
  comma_separated(
      verb->add_option("--box", extract.box,
                       "The lowest and the highest corner of a box: six numbers, separated by commas"))
      ->expected(6)
      ->type_name("X,Y,Z,X,Y,Z")
      ->group(region);
  comma_separated(
      verb->add_option("--sphere", extract.sphere,
                       "The centre and the radius of a sphere: four numbers, separated by commas"))
      ->expected(4)
      ->type_name("X,Y,Z,R")
      ->group(region);
  comma_separated(
      verb->add_option(
          "--plane", extract.plane,
          "Volumes: cells that a plane passes through, given by a point on it and its normal: six "
          "numbers, separated by commas"))
      ->expected(6)
      ->type_name("X,Y,Z,X,Y,Z")
      ->group(region);
  verb->add_option(
          "--where", extract.where,
          "Volumes: cells that meet a condition, or have a point that does, such as 'T > 500', 'T "
          "= 1:2' or 'velocity[0] < 0'; of a vector, the length counts; a name with < > = or [0] in it goes "
          "into double quotes, as in '\"a<b\" > 1'; repeatable: all conditions must hold")
      ->type_name("CONDITION")
      ->allow_extra_args(false)
      ->group(region);
  verb->add_option("--cells", extract.cells,
                   "Volumes: cells by their numbers in the input, from 0: 100:200 takes cells 100 to 199")
      ->type_name("RANGE")
      ->group(region);
  verb->add_flag("--whole-charts", extract.whole_charts, "Keep all faces of the charts that meet the region")
      ->group(region);
  verb->add_flag("--chart-numbers", extract.chart_numbers,
                 "Add a cell array 'chart': the number of each cell's chart among those that were read")
      ->group(files_group);
  CLI::Option* component =
      comma_separated(
          verb->add_option(
              "--component", extract.component,
              "The connected component that contains the face nearest to this point: three numbers, "
              "separated by commas"))
          ->expected(3)
          ->type_name("X,Y,Z")
          ->group(region);
  CLI::Option* nearest =
      comma_separated(
          verb->add_option("--nearest", extract.nearest,
                           "The points of the mesh nearest to this one, the nearest first, without faces: "
                           "three numbers, separated by commas"))
          ->expected(3)
          ->type_name("X,Y,Z")
          ->group(region)
          ->excludes(component);
  verb->add_option("--count", extract.count, "How many points --nearest gives (default 1)")
      ->type_name("N")
      ->group(region)
      ->needs(nearest);
}

void add_values(CLI::App* verb, std::string& arrays, uint64_t& step) {
  verb->add_option("--arrays", arrays, "Arrays to read, separated by commas; '' for none (default: all)")
      ->type_name("A,B,...")
      ->group(files_group);
  verb->add_option("--step", step, "Time step whose arrays are read; 0 (default): those of the mesh")
      ->type_name("N")
      ->check(CLI::Range(uint64_t{0}, uint64_t{UINT32_MAX}))
      ->group(files_group);
}

void add_detail(CLI::App* verb, ExtractOptions& extract) {
  constexpr const char* detail = "Detail";
  CLI::Option* full = verb->add_flag("--full", extract.full, "The mesh itself (default)")->group(detail);
  CLI::Option* error =
      verb->add_option("--error", extract.error,
                       "The coarsest level that stays within this distance of the mesh, in file units")
          ->check([](const std::string& word) {
            const std::optional<double> number = parse_number<double>(word);
            return number && *number >= 0 ? "" : fmt::format("'{}' is not a number of 0 or more", word);
          })
          ->type_name("X")
          ->group(detail)
          ->excludes(full);
  CLI::Option* level =
      verb->add_option(
              "--level", extract.level,
              "Level of detail: 0 is the mesh, and each further level has a fourth of the faces of the "
              "one before")
          ->type_name("N")
          ->group(detail)
          ->excludes(full)
          ->excludes(error);
  verb->add_option("--triangles", extract.triangles,
                   "The finest level with at most so many faces, before clipping to the region")
      ->type_name("N")
      ->group(detail)
      ->excludes(full)
      ->excludes(error)
      ->excludes(level);
  comma_separated(
      verb->add_option(
          "--eye", extract.eye,
          "The detail visible from a viewpoint, on a screen of 1080 pixels over 60 degrees: three "
          "numbers, separated by commas"))
      ->expected(3)
      ->type_name("X,Y,Z")
      ->group(detail)
      ->excludes(full);
  verb->add_option("--pixel-error", extract.pixel_error,
                   "The largest error that may be seen with --eye, in pixels (default 1)")
      ->check(CLI::PositiveNumber)
      ->type_name("N")
      ->group(detail);
}

}  // namespace

void Parser::add_extract() {
  CLI::App* e =
      verb("extract",
           "Extract a part of a file of mode random, at any level of detail, or of a volume.\n"
           "Only what is needed is read and decoded. Without a limit on detail, the faces are those "
           "of the mesh, bit for bit, with all arrays; those of coarser levels are triangles with "
           "values of the mesh. Faces that have a point in the region are taken whole. Of a volume "
           "(mode stream), the cells are taken whose boxes meet the region; if it was compressed "
           "with --pieces, only pieces that may have such cells are read. The exit code is 6 if "
           "charts or pieces were damaged; the others are written then.",
           "maille compress --mode random scan.ply scan.maille\n"
           "maille extract scan.maille head.ply --box 0,0,1.5,1,1,2\n"
           "maille extract scan.maille preview.ply --triangles 20000\n"
           "maille extract scan.maille coarse.ply --error 0.01\n"
           "maille extract scan.maille part.ply --component 0.1,0,2\n"
           "maille extract scan.maille points.ply --nearest 0.1,0,2 --count 50\n"
           "maille extract https://example.org/scan.maille head.ply --box 0,0,1.5,1,1,2\n"
           "maille compress --pieces auto flow.vtu flow.maille\n"
           "maille extract flow.maille hot.vtu --where 'T > 500' --arrays T,p");
  add_file(e, "-i,--input,IN", extract.input, "File of mode random or stream to read, or its address")
      ->required();
  add_file(e, "-o,--output,OUT", extract.output, "File to write; - is standard output")->required();
  add_output_format(e, extract.output_format, "by extension; ply where there is none",
                    mesh_formats_to_write());
  e->add_flag("--ascii", extract.ascii, "Write text instead of binary, where the format has both")
      ->group(files_group);
  add_force(e, extract.force);
  e->add_option("--arrays", raw.arrays,
                "Volumes: arrays to write, separated by commas; '' for none (default: all)")
      ->type_name("A,B,...")
      ->group(files_group);
  e->add_option("--step", extract.step, "Volumes: time step whose arrays are written")
      ->type_name("N")
      ->check(CLI::Range(uint64_t{0}, uint64_t{UINT32_MAX}))
      ->group(files_group);
  e->add_flag(
       "--numbers", extract.numbers,
       "Volumes: add arrays 'input_cell' and 'input_point' with the numbers in the input, if the file keeps "
       "its order")
      ->group(files_group);
  add_region(e, extract);
  add_detail(e, extract);
  CLI::Option* coarse =
      e->add_flag("--coarse", extract.coarse,
                  "Volumes in pieces: some thousand vertices with the means of the values around them")
          ->group("Detail");
  for (const char* part : {"--box", "--sphere", "--plane", "--where", "--cells", "--numbers", "--step"})
    coarse->excludes(e->get_option(part));
  // Both are of the mesh itself, as a whole.
  for (const char* whole : {"--component", "--nearest"}) {
    for (const char* name : {"--box", "--sphere", "--whole-charts", "--chart-numbers", "--error", "--level",
                             "--triangles", "--eye"})
      e->get_option(whole)->excludes(e->get_option(name));
  }
  add_fetch_limit(e);
  add_work(e, extract.common);
}

void Parser::add_slice() {
  CLI::App* s = verb("slice",
                     "Cut a volume by a plane: polygons with the values on them.\n"
                     "Each cell that the plane passes through gives a polygon. Values of points are "
                     "interpolated along edges; integers, and values next to one that is not finite, are "
                     "those of the nearer end. Values of cells are kept. If the volume was compressed with "
                     "--pieces, only pieces that meet the plane are read.",
                     "maille slice flow.maille cut.vtu --plane 0,0,0.5,0,0,1\n"
                     "maille slice flow.vtu cut.vtp --plane 0,0,0.5,0,0,1 --arrays T");
  add_file(s, "-i,--input,IN", slice.input, "Volume to read, in any format, or its address")->required();
  add_file(s, "-o,--output,OUT", slice.output, "File to write; - is standard output")->required();
  add_input_format(s, slice.input_format, "IN", files_group);
  add_output_format(s, slice.output_format, "by extension; ply where there is none", mesh_formats_to_write());
  s->add_flag("--ascii", slice.ascii, "Write text instead of binary, where the format has both")
      ->group(files_group);
  add_force(s, slice.force);
  comma_separated(s->add_option("--plane", slice.plane,
                                "A point on the plane, and its normal: six numbers, separated by commas"))
      ->expected(6)
      ->type_name("X,Y,Z,X,Y,Z")
      ->group(files_group)
      ->required();
  add_values(s, raw.arrays, slice.step);
  add_fetch_limit(s);
  add_work(s, slice.common);
}

void Parser::add_probe() {
  CLI::App* p =
      verb("probe",
           "Print the values of a volume at given places.\n"
           "Values of points are interpolated linearly in tetrahedra between the middle of a cell, "
           "the middles of its faces and their edges; values of cells are those of the cell. If the "
           "volume was compressed with --pieces, only the pieces around the places are read. The "
           "exit code is 1 if a place is in no cell.",
           "maille probe flow.maille --at 0.1,0,0.5\n"
           "maille probe flow.maille --at 0.1,0,0.5 --at 0.2,0,0.5 --arrays T,p --json");
  add_file(p, "-i,--input,IN", probe.input, "Volume to read, in any format, or its address")->required();
  add_input_format(p, probe.input_format, "IN", files_group);
  comma_separated(
      p->add_option("--at", probe.places, "A place: three numbers, separated by commas; repeatable"))
      ->expected(3, 3 * most_places)
      ->type_name("X,Y,Z")
      ->group(files_group)
      ->required();
  add_values(p, raw.arrays, probe.step);
  add_fetch_limit(p);
  add_work(p, probe.common);
}

void Parser::add_serve() {
  CLI::App* s =
      verb("serve",
           "Serve a folder, or one file, over HTTP.\n"
           "The server sends what programs and web pages need to read parts of .maille files: "
           "ranges, ETags, CORS headers, and those for isolated pages (COOP, COEP). It serves only "
           "files below the folder, except those whose names begin with a dot. It answers only this "
           "machine unless --host allows others; any page open in a browser on this machine can "
           "read what is served. It prints its address; Ctrl-C ends it.",
           "maille serve scans\n"
           "maille serve scan.maille --port 0 &\n"
           "maille extract http://127.0.0.1:8080/scan.maille head.ply --box 0,0,1.5,1,1,2");
  add_file(s, "PATH", serve.path, "Folder or file to serve")->required();
  s->add_option("--host", serve.host,
                "Address to listen on; 0.0.0.0 serves every machine that reaches this one (default: "
                "127.0.0.1, for this machine only)")
      ->type_name("ADDRESS")
      ->group(files_group);
  s->add_option("-p,--port", serve.port, "Port to listen on; 0: any free port (default: 8080)")
      ->check(CLI::Range(0, 65535))
      ->type_name("N")
      ->group(files_group);
  s->add_flag("-v,--verbose", serve.common.verbose, "Print every request")->group(message_group);
  add_answer(s, serve.common);
}

void Parser::add_view() {
  CLI::App* v =
      verb("view",
           "Look at a .maille or .maille.glb file in the browser.\n"
           "Of a file of mode random, only what is in sight is read, in the detail that can be "
           "seen, so that meshes of any size appear at once. Other files are shown whole, and "
           "volumes by their boundary. The command serves the file and the viewer to this machine, "
           "opens the browser if there is a screen, and prints the address; Ctrl-C ends it. The "
           "server of an address must send CORS headers.",
           "maille view scan.maille\n"
           "maille view https://example.org/scan.maille\n"
           "maille view --no-browser --port 8081 scan.maille   # through ssh -L 8081:127.0.0.1:8081");
  add_file(v, "FILE", view.input, "A .maille, .maille.glb or .glb file, or the address of one")->required();
  v->add_option("-p,--port", view.port, "Port to listen on; 0: any free port (default)")
      ->check(CLI::Range(0, 65535))
      ->type_name("N")
      ->group(files_group);
  v->add_flag("--no-browser", raw.no_browser, "Only print the address");
  v->add_flag("-v,--verbose", view.common.verbose, "Print every request")->group(message_group);
  add_answer(v, view.common);
}

}  // namespace maille::tool
