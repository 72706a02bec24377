#include "parser.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/io.h>

#include <algorithm>

#include "parser_names.h"
#include "spelling.h"
#include "text.h"

namespace maille::tool {

// A check of its own instead of CLI11's IsMember, so that the message names the word that was meant.
CLI::Option* one_of(CLI::Option* option, const std::vector<std::string>& values) {
  const auto is_known = [values](const std::string& word) {
    if (std::find(values.begin(), values.end(), word) != values.end()) return std::string();
    return fmt::format("there is no '{}'{}; choose one of {}", word, suggestion(word, values),
                       fmt::join(values, ", "));
  };
  return option->check(is_known)->type_name(fmt::format("{}", fmt::join(values, "|")));
}

// One value for each time the option is given: without this CLI11 would take the name of the next file for
// another value.
CLI::Option* repeatable(CLI::Option* option, const std::string& value) {
  return option->allow_extra_args(false)->type_name(value)->group(quality_group);
}

CLI::Option* comma_separated(CLI::Option* option) {
  return option->delimiter(',')->allow_extra_args(false);
}

// CLI11's own check of a number or a word answers in its own terms.
CLI::Option* cells_of_pieces(CLI::Option* option) {
  const auto is_known = [](const std::string& word) {
    const std::optional<uint64_t> number = parse_number<uint64_t>(word);
    if (word == "auto" || word == "off" || (number && *number >= 1 && *number <= uint64_t{1} << 32))
      return std::string();
    return fmt::format("'{}' is neither auto nor off, nor a number from 1 to 4294967296", word);
  };
  return option->check(is_known)->type_name("N|auto|off");
}

CLI::Option* add_file(CLI::App* verb, const std::string& names, std::string& variable,
                      const std::string& help) {
  return verb->add_option(names, variable, help)->type_name("FILE")->group(files_group);
}

std::vector<std::string> mesh_formats_to_write() {
  std::vector<std::string> names;
  for (const FormatInfo& format : formats()) {
    if (format.writable) names.push_back(format.name);
  }
  return names;
}

// "maille" is not in formats(): the library's readers and writers are those of foreign formats.
std::vector<std::string> formats_to_write() {
  std::vector<std::string> names = mesh_formats_to_write();
  names.push_back("maille");
  return names;
}

void add_input_format(CLI::App* verb, std::string& variable, const std::string& what, const char* group) {
  std::vector<std::string> names;
  for (const FormatInfo& format : formats()) names.push_back(format.name);
  names.push_back("maille");
  const std::string help = fmt::format("Format of {} (default: by extension, then by first bytes)", what);
  one_of(verb->add_option("--input-format", variable, help), names)->group(group);
}

void add_output_format(CLI::App* verb, std::string& variable, const std::string& fallback,
                       const std::vector<std::string>& names) {
  const std::string help = fmt::format("Format of OUT (default: {})", fallback);
  one_of(verb->add_option("--output-format", variable, help), names)->group(files_group);
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

void Parser::add_answer(CLI::App* verb, CommonOptions& common) {
  add_quiet(verb, common);
  add_json(verb, common);
}

void Parser::add_work(CLI::App* verb, CommonOptions& common) {
  verb->add_option("-T,--threads", common.threads, "Threads to use; 0 (default): all of the machine")
      ->check(CLI::Range(0, 1024))
      ->type_name("N")
      ->group(speed_group);
  add_memory(verb);
  add_quiet(verb, common);
  verb->add_flag("-v,--verbose", common.verbose, "Print more: how long each step took, a row for every array")
      ->group(message_group);
  add_json(verb, common);
  add_progress(verb);
}

void Parser::add_quiet(CLI::App* verb, CommonOptions& common) {
  verb->add_flag("-q,--quiet", common.quiet, "Print errors only")->group(message_group);
}

void Parser::add_json(CLI::App* verb, CommonOptions& common) {
  verb->add_flag("--json", common.json, "Answer in JSON on standard output")->group(message_group);
}

void Parser::add_memory(CLI::App* verb) {
  verb->add_option("-M,--memory", raw.memory,
                   "Largest mesh to hold in memory, such as 500M or 4G (default: half of the machine)")
      ->type_name("SIZE")
      ->group(speed_group);
}

void Parser::add_progress(CLI::App* verb) {
  CLI::Option* progress = verb->add_option(
      "--progress", raw.progress,
      "Show progress on standard error; auto (default): when it is a terminal; json: one object per line");
  one_of(progress, {"auto", "always", "never", "json"})->group(message_group);
}

void Parser::add_fetch_limit(CLI::App* verb) {
  verb->add_option("--fetch-limit", raw.fetch_limit,
                   "Fetch at most so much more from a web server than was asked for, as happens if it sends "
                   "no parts of files, or if the index is damaged (default 64M)")
      ->type_name("SIZE")
      ->group(files_group);
}

void Parser::add_completion() {
  CLI::App* c = verb("completion",
                     "Print a completion script for a shell, or the manual.\n"
                     "man prints the manual page, markdown docs/command.md.",
                     "maille completion bash > ~/.local/share/bash-completion/completions/maille\n"
                     "maille completion zsh > ~/.zfunc/_maille   # a folder in $fpath\n"
                     "maille completion fish > ~/.config/fish/completions/maille.fish\n"
                     "maille completion man | man -l -");
  one_of(c->add_option("SHELL", raw.shell, "What to print"), {"bash", "zsh", "fish", "man", "markdown"})
      ->required();
}

Parser::Parser() {
  app.set_help_flag("-h,--help", "Print help");
  app.set_version_flag("-V,--version", "Print the version");
  // Behind the verb, a word is a name: `maille compress d` reads a file d, decompress is not meant.
  app.require_subcommand(0, 1);
  app.allow_windows_style_options(false);  // "/scan.ply" is a path on Windows, too
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
  add_slice();
  add_probe();
  add_serve();
  add_view();
  add_bench();
  add_completion();
}

}  // namespace maille::tool
