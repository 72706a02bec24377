#include "command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/io.h>
#include <maille/version.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "manual.h"
#include "result.h"

// The only file that includes CLI11, which takes half a minute to compile.
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

/// What CLI11 writes to that is not an option of a verb as it stands.
struct Raw {
  std::string mode = "single";
  std::vector<int> effort;
  bool keep_order = false;
  bool any_order = false;
  bool no_provenance = false;
  bool no_arrays = false;
  std::string arrays;
  std::string memory;
  std::string progress = "auto";
  std::string shell;
  std::string covariance;
  std::string scheme = "butterfly";
};

struct Parser {
  CLI::App app{
      "maille compresses meshes: any polygons, every array, bit for bit unless a tolerance is given."};
  Raw raw;
  CompressOptions compress;
  DecompressOptions decompress;
  InfoOptions info;
  VerifyOptions verify;
  DiffOptions diff;
  ConvertOptions convert;
  StencilOptions stencil;
  SubdivideOptions subdivide;

  Parser();
  CLI::App* verb(const std::string& name, const std::string& description, const std::string& examples);
  void add_common(CLI::App* verb, CommonOptions& common, bool threads);
  void add_compress();
  void add_decompress();
  void add_info();
  void add_verify();
  void add_diff();
  void add_convert();
  void add_stencil();
  void add_subdivide();
  void add_completion();
  Result<Command> command(const std::string& verb) const;
};

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

CLI::Option* file(CLI::App* verb, const std::string& names, std::string& variable, const std::string& help) {
  return verb->add_option(names, variable, help)->type_name("FILE")->group(files_group);
}

void add_force(CLI::App* verb, bool& force) {
  verb->add_flag("-f,--force", force, "Overwrite OUT if it exists; write binary data to a terminal")
      ->group(files_group);
}

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
    verb->add_option("-M,--memory", raw.memory,
                     "Largest mesh to hold in memory, such as 500M or 4G (default 64G)")
        ->type_name("SIZE")
        ->group(speed_group);
  }
  verb->add_flag("-q,--quiet", common.quiet, "Print errors only")->group(message_group);
  if (threads) {
    verb->add_flag("-v,--verbose", common.verbose,
                   "Print more: how long each step took, a row for every array")
        ->group(message_group);
  }
  verb->add_flag("--json", common.json, "Answer in JSON on standard output")->group(message_group);
  if (threads) {
    CLI::Option* progress = verb->add_option(
        "--progress", raw.progress,
        "Show progress on standard error; auto (default): when it is a terminal; json: one object per line");
    choice(progress, {"auto", "always", "never", "json"})->group(message_group);
  }
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
           "maille compress -e 0.01 dragon.ply small.maille   # positions within 0.01 file units\n"
           "maille compress --bits 14 --bits normal=10 in.obj out.maille\n"
           "zcat big.ply.gz | maille c - - --input-format ply > big.maille");
  c->alias("c");
  file(c, "-i,--input,IN", compress.input, "Mesh to read; - is standard input")->required();
  file(c, "-o,--output,OUT", compress.output,
       "File to write; - is standard output (default: IN with the extension .maille)");
  choice(c->add_option("--input-format", compress.input_format,
                       "Format of IN (default: by extension, then by first bytes)"),
         format_names(true, false))
      ->group(files_group);
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
  c->add_flag("--any-order", raw.any_order, "Let the order change (default)")
      ->group(quality_group)
      ->excludes(keep);

  choice(c->add_option("--mode", raw.mode,
                       "Kind of file (default: single; the others come with a later version)"),
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
                     "maille d in.maille - --output-format off | less");
  d->alias("d");
  file(d, "-i,--input,IN", decompress.input, "A .maille file; - is standard input")->required();
  file(d, "-o,--output,OUT", decompress.output,
       "File to write; - is standard output (default: IN with the extension .ply)");
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
  d->add_flag("--ascii", decompress.ascii, "Text instead of binary, where the format has both")
      ->group(files_group);
  add_common(d, decompress.common, true);
}

void Parser::add_info() {
  CLI::App* i = verb("info",
                     "Say what a .maille file holds.\n"
                     "Reads the description only and decodes no values.",
                     "maille info dragon.maille\n"
                     "maille info --json dragon.maille | jq .points");
  file(i, "-i,--input,FILE", info.input, "A .maille file; - is standard input")->required();
  i->add_flag("--chunks", info.chunks, "List the chunks of the file, too")->group(answer_group);
  add_common(i, info.common, false);
}

void Parser::add_verify() {
  CLI::App* v =
      verb("verify",
           "Check a .maille file: checksums, then everything decoded.\n"
           "With --against, also that it holds the original mesh: exactly what was stored lossless, "
           "within its bound what was not. Exit code 1 when it does not, 6 when the file is damaged.",
           "maille verify dragon.maille\n"
           "maille verify dragon.maille --against dragon.ply");
  file(v, "-i,--input,FILE", verify.input, "A .maille file; - is standard input")->required();
  v->add_option("--against", verify.original, "The mesh that was compressed, in any format")
      ->type_name("FILE")
      ->group(answer_group);
  choice(v->add_option("--input-format", verify.original_format,
                       "Format of the original (default: by extension, then by first bytes)"),
         format_names(true, false))
      ->group(answer_group);
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
  choice(d->add_option("--input-format", diff.input_format,
                       "Format of both (default: by extension, then by first bytes)"),
         format_names(true, false))
      ->group(files_group);
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
  choice(c->add_option("--input-format", convert.input_format,
                       "Format of IN (default: by extension, then by first bytes)"),
         format_names(true, false))
      ->group(files_group);
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
      "stay borders. Only positions come along. PLY is written as it is made: the butterfly needs memory "
      "for the input and a few MB more, however large the result, sqrt3 for all levels but the last.",
      "maille subdivide cow.off smooth.ply --levels 2\n"
      "maille subdivide bunny.ply large.ply --scheme sqrt3 --levels 6");
  file(s, "-i,--input,IN", subdivide.input, "Mesh to read; - is standard input")->required();
  file(s, "-o,--output,OUT", subdivide.output, "File to write; - is standard output")->required();
  choice(s->add_option("--input-format", subdivide.input_format,
                       "Format of IN (default: by extension, then by first bytes)"),
         format_names(true, false))
      ->group(files_group);
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
  add_info();
  add_verify();
  add_diff();
  add_convert();
  add_stencil();
  add_subdivide();
  add_completion();
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (size_t start = 0; start < text.size();) {
    const size_t end = std::min(text.find(separator, start), text.size());
    if (end > start) parts.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

// What the table needs to know of an option, from the parser's tree.
OptionEntry entry_of(const CLI::Option& option) {
  OptionEntry entry;
  for (const std::string& name : option.get_snames()) entry.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) entry.names.push_back("--" + name);
  entry.positional = option.get_name(true).find('-') == 0 ? "" : option.get_name(true);
  // What follows the colon describes the checks.
  const std::string type = option.get_type_name();
  if (option.get_items_expected_max() > 0) entry.value = type.substr(0, type.find(':'));
  const bool small_letters = std::none_of(entry.value.begin(), entry.value.end(),
                                          [](unsigned char c) { return std::isupper(c) != 0; });
  if (small_letters) entry.choices = split(entry.value, '|');
  entry.help = option.get_description();
  entry.group = option.get_group();
  entry.required = option.get_required();
  entry.repeatable = option.get_expected_max() > 1 && !entry.value.empty();
  return entry;
}

VerbEntry entry_of(const CLI::App& verb) {
  VerbEntry entry{verb.get_name(), verb.get_aliases(), verb.get_description(), verb.get_footer(), {}};
  for (const CLI::Option* option : verb.get_options()) entry.options.push_back(entry_of(*option));
  // --help is made first, but belongs to the messages at the end.
  if (!entry.options.empty())
    std::rotate(entry.options.begin(), entry.options.begin() + 1, entry.options.end());
  return entry;
}

CommandEntry entry_of(const Parser& parser) {
  CommandEntry entry{parser.app.get_description(), {}};
  for (const CLI::App* verb : parser.app.get_subcommands({})) entry.verbs.push_back(entry_of(*verb));
  return entry;
}

std::string generated(const std::string& what, const CommandEntry& entry) {
  if (what == "bash") return bash_completion(entry);
  if (what == "zsh") return zsh_completion(entry);
  if (what == "fish") return fish_completion(entry);
  return what == "man" ? man_page(entry) : markdown_manual(entry);
}

ProgressStyle progress_style(const std::string& text) {
  if (text == "always") return ProgressStyle::always;
  if (text == "never") return ProgressStyle::never;
  return text == "json" ? ProgressStyle::json : ProgressStyle::automatic;
}

Mode mode_of(const std::string& text) {
  return text == "stream" ? Mode::stream : text == "random" ? Mode::random : Mode::single;
}

Covariance covariance_of(const std::string& text) {
  if (text == "independent") return Covariance::independent;
  return text == "gaussian" ? Covariance::gaussian : Covariance::rotation;
}

// "500M", "4G", "1.5GiB", "100000": powers of 1024, whichever way they are written.
Result<uint64_t> parse_size(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  std::string unit(end, text.data() + text.size());
  std::transform(unit.begin(), unit.end(), unit.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const size_t power = unit.empty() ? 0 : std::string("BKMGT").find(unit.front());
  const std::string rest = unit.empty() ? "" : unit.substr(1);
  const bool known =
      power != std::string::npos && (rest.empty() || (power > 0 && (rest == "B" || rest == "IB")));
  const double bytes = known ? std::ldexp(value, static_cast<int>(10 * power)) : 0;
  if (error != std::errc() || !(bytes >= 1) || bytes >= 0x1p63) {
    return failure(ErrorCode::usage,
                   fmt::format("--memory: '{}' is no size; write such as 500M or 4G", text));
  }
  return static_cast<uint64_t>(bytes);
}

template <class Options>
Result<Command> with_raw(Options options, const Raw& raw) {
  options.common.progress = progress_style(raw.progress);
  if (!raw.memory.empty()) options.common.memory = TOOL_TRY(parse_size(raw.memory));
  return options;
}

Result<Command> Parser::command(const std::string& verb) const {
  if (verb == "compress") {
    CompressOptions options = compress;
    options.mode = mode_of(raw.mode);
    if (!raw.effort.empty()) options.effort = raw.effort.back();
    options.order = raw.keep_order ? Order::keep : Order::canonical;
    options.provenance = !raw.no_provenance;
    return with_raw(options, raw);
  }
  if (verb == "decompress") {
    DecompressOptions options = decompress;
    if (app.get_subcommand(verb)->count("--arrays") > 0) options.arrays = split(raw.arrays, ',');
    return with_raw(options, raw);
  }
  if (verb == "diff") {
    DiffOptions options = diff;
    options.arrays = !raw.no_arrays;
    return with_raw(options, raw);
  }
  if (verb == "info") return info;
  if (verb == "verify") return with_raw(verify, raw);
  if (verb == "convert") return with_raw(convert, raw);
  if (verb == "stencil") {
    StencilOptions options = stencil;
    if (!raw.covariance.empty()) options.covariance = covariance_of(raw.covariance);
    return options;
  }
  if (verb == "subdivide") {
    SubdivideOptions options = subdivide;
    if (raw.scheme == "sqrt3") options.subdivision.scheme = SubdivisionScheme::sqrt3;
    return with_raw(options, raw);
  }
  return PrintText{generated(raw.shell, entry_of(*this))};
}

Result<> check_verb(const Parser& parser, const std::string& word) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : parser.app.get_subcommands({})) {
    if (verb->check_name(word)) return {};
    verbs.push_back(verb->get_name());
  }
  return failure(ErrorCode::usage,
                 fmt::format("no verb '{}'; the verbs are {}", word, fmt::join(verbs, ", ")));
}

std::string help_of(const Parser& parser) {
  const CommandEntry entry = entry_of(parser);
  const auto parsed = parser.app.get_subcommands();
  if (parsed.empty()) return help_text(entry);
  for (const VerbEntry& verb : entry.verbs) {
    if (verb.name == parsed.front()->get_name()) return help_text(verb);
  }
  return help_text(entry);
}

std::string missing_argument(const Parser& parser) {
  for (const CLI::App* verb : parser.app.get_subcommands()) {
    for (const CLI::Option* option : verb->get_options()) {
      if (option->get_required() && option->count() == 0) return entry_of(*option).positional;
    }
  }
  return "a verb";
}

bool is_effort_like(const std::string& word) {
  return word.size() > 1 && word[0] == '-' && std::isdigit(static_cast<unsigned char>(word[1])) != 0;
}

// "-0" is no option, so CLI11 takes it for a negative number and thus for a name.
std::string misread_option(const CLI::App& verb) {
  std::vector<std::string> names = verb.remaining();
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_positional())
      names.insert(names.end(), option->results().begin(), option->results().end());
  }
  const auto found = std::find_if(names.begin(), names.end(), is_effort_like);
  return found == names.end() ? "" : *found;
}

std::string about_misread_option(const CLI::App& verb, const std::string& option) {
  if (verb.get_name() != "compress") return fmt::format("does not know '{}'", option);
  return fmt::format("'{}' is no effort; give one of -1 to -9", option);
}

std::string about_extras(const CLI::App& verb) {
  const std::vector<std::string> extras = verb.remaining();
  for (const std::string& extra : extras) {
    if (extra.size() > 1 && extra[0] == '-') return fmt::format("does not know '{}'", extra);
  }
  std::vector<std::string> taken;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_positional()) taken.push_back(entry_of(*option).positional);
  }
  return fmt::format("too many names: '{}'; it takes only {}", fmt::join(extras, " "),
                     fmt::join(taken, " and "));
}

Result<Command> usage_failure(const Parser& parser, std::string message) {
  const auto parsed = parser.app.get_subcommands();
  const std::string verb = parsed.empty() ? "" : " " + parsed.front()->get_name();
  std::replace(message.begin(), message.end(), '\n', ' ');
  return failure(ErrorCode::usage, fmt::format("{}{}; see 'maille{} --help'",
                                               verb.empty() ? "" : verb.substr(1) + ": ", message, verb));
}

}  // namespace

Result<Command> parse_command_line(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  Parser parser;
  if (words.empty()) {
    return failure(ErrorCode::usage, "no verb given; 'maille --help' lists them");
  }
  if (words.front() == "help") {
    words.erase(words.begin());
    words.push_back("--help");
  }
  if (words.front().find('-') != 0) TOOL_CHECK(check_verb(parser, words.front()));
  try {
    // CLI11 takes the words from the back.
    std::reverse(words.begin(), words.end());
    parser.app.parse(words);
    const auto parsed = parser.app.get_subcommands();
    if (parsed.empty()) return failure(ErrorCode::usage, "no verb given; 'maille --help' lists them");
    const std::string misread = misread_option(*parsed.front());
    if (!misread.empty()) return usage_failure(parser, about_misread_option(*parsed.front(), misread));
    if (parser.raw.effort.size() > 1)
      return usage_failure(parser, "several efforts given; give one of -1 to -9");
    return parser.command(parsed.front()->get_name());
  } catch (const CLI::CallForHelp&) {
    return PrintText{help_of(parser)};
  } catch (const CLI::CallForVersion&) {
    return PrintText{
        fmt::format("maille {} (file format {}.{})\n", library_version(), format_major, format_minor)};
  } catch (const CLI::ExtrasError&) {
    const auto parsed = parser.app.get_subcommands();
    if (parsed.empty())
      return usage_failure(parser, fmt::format("does not know '{}'", fmt::join(parser.app.remaining(), " ")));
    const CLI::App& verb = *parsed.front();
    const std::string misread = misread_option(verb);
    return usage_failure(parser, misread.empty() ? about_extras(verb) : about_misread_option(verb, misread));
  } catch (const CLI::RequiredError&) {
    return usage_failure(parser, fmt::format("{} is missing", missing_argument(parser)));
  } catch (const CLI::ArgumentMismatch& error) {
    // "--error: 1 required X missing"
    const std::string message = error.what();
    return usage_failure(parser, message.substr(0, message.find(':')) + " needs a value");
  } catch (const CLI::ParseError& error) {
    return usage_failure(parser, error.what());
  }
}

}  // namespace maille::tool
