#include "command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/version.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "batch.h"
#include "files.h"
#include "gltf.h"
#include "in_parts.h"
#include "manual.h"
#include "parser.h"
#include "purpose.h"
#include "result.h"
#include "spelling.h"

namespace maille::tool {

namespace {

// Empty parts are left out, so "a,,b" or a comma at the end does no harm.
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
  // CLI11 keeps choices and placeholders in one text; placeholders are in capitals here ("FILE"), choices
  // never.
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

// Completions and manuals are generated from the parser itself, so they cannot name an option that does not
// exist.
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

// "500M", "4G", "1.5GiB", "100000": units are powers of 1024, whichever way they are written. Sizes stay
// below 2^63, so that sums of two of them do not wrap around.
Result<uint64_t> parse_size(const std::string& option, const std::string& text) {
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
                   fmt::format("{}: '{}' is no size; write such as 500M or 4G", option, text));
  }
  return static_cast<uint64_t>(bytes);
}

template <class Options>
/// What all verbs that work for a while have in common.
Result<Command> with_raw(Options options, const Raw& raw) {
  options.common.progress = progress_style(raw.progress);
  options.common.memory =
      raw.memory.empty() ? Limits{}.mesh_bytes : TOOL_TRY(parse_size("--memory", raw.memory));
  return options;
}

template <class Options>
Result<Command> with_fetch_limit(Options options, const Raw& raw) {
  if (!raw.fetch_limit.empty()) options.fetch_limit = TOOL_TRY(parse_size("--fetch-limit", raw.fetch_limit));
  return with_raw(options, raw);
}

/// With the names of --arrays; an empty list is one, too: no arrays.
template <class Options>
Options with_arrays(Options options, const Parser& parser, const std::string& verb) {
  if (parser.app.get_subcommand(verb)->count("--arrays") > 0) options.arrays = split(parser.raw.arrays, ',');
  return options;
}

/// Turns the parsed words into the options of a verb, so that verbs need not parse text. Error: usage.
Result<Command> command_of(const Parser& parser, const std::string& verb) {
  const Raw& raw = parser.raw;
  if (verb == "compress") {
    CompressOptions options = parser.compress;
    if (!raw.mode.empty()) options.mode = mode_of(raw.mode);
    if (!raw.effort.empty()) options.effort = raw.effort.back();
    options.keep_order = raw.keep_order;
    options.any_order = raw.any_order;
    options.provenance = !raw.no_provenance;
    if (parser.app.get_subcommand(verb)->count("--arrays") > 0)
      options.arrays.wanted = split(raw.arrays, ',');
    options.arrays.dropped = split(raw.drop, ',');
    set_for(raw.purpose, {.effort = !raw.effort.empty(), .order = raw.keep_order || raw.any_order}, options);
    take_inputs(options.batch, options.input, options.output,
                // What compress may have written itself is the output, also if it is there already.
                [](const std::string& path) {
                  return foreign_format(path) && is_regular(path) && !names_compressed_gltf(path);
                });
    return with_raw(options, raw);
  }
  if (verb == "decompress") {
    DecompressOptions options = with_arrays(parser.decompress, parser, verb);
    take_inputs(options.batch, options.input, options.output,
                [](const std::string& path) { return path.ends_with(".maille") && is_regular(path); });
    return with_raw(options, raw);
  }
  if (verb == "diff") {
    DiffOptions options = parser.diff;
    options.arrays = !raw.no_arrays;
    return with_raw(options, raw);
  }
  if (verb == "append") return with_raw(parser.append, raw);
  if (verb == "info") return with_fetch_limit(parser.info, raw);
  if (verb == "verify") return with_raw(parser.verify, raw);
  if (verb == "convert") return with_raw(parser.convert, raw);
  if (verb == "generate") return with_raw(parser.generate, raw);
  if (verb == "extract") return with_fetch_limit(with_arrays(parser.extract, parser, verb), raw);
  if (verb == "slice") return with_fetch_limit(with_arrays(parser.slice, parser, verb), raw);
  if (verb == "probe") return with_fetch_limit(with_arrays(parser.probe, parser, verb), raw);
  if (verb == "serve") return parser.serve;
  if (verb == "view") {
    ViewOptions options = parser.view;
    options.browser = !raw.no_browser;
    return options;
  }
  if (verb == "stencil") {
    StencilOptions options = parser.stencil;
    if (!raw.covariance.empty()) options.covariance = covariance_of(raw.covariance);
    return options;
  }
  if (verb == "subdivide") {
    SubdivideOptions options = parser.subdivide;
    if (raw.scheme == "sqrt3") options.subdivision.scheme = SubdivisionScheme::sqrt3;
    return with_raw(options, raw);
  }
  if (verb == "bench") {
    BenchOptions options = parser.bench;
    if (raw.lossless) options.bits = 0;
    options.whole_file = !raw.no_whole_file;
    return with_raw(options, raw);
  }
  return PrintText{generated(raw.shell, entry_of(parser))};
}

Result<> check_verb(const Parser& parser, const std::string& word) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : parser.app.get_subcommands({})) {
    if (verb->check_name(word)) return {};
    verbs.push_back(verb->get_name());
  }
  if (const std::string nearest = nearest_word(word, verbs); !nearest.empty()) {
    return failure(
        ErrorCode::usage,
        fmt::format("there is no verb '{}' (did you mean '{}'?); 'maille --help' lists them", word, nearest));
  }
  if (word.find('.') != std::string::npos) {
    const char* const verb = word.ends_with(".maille") ? "decompress" : "compress";
    return failure(
        ErrorCode::usage,
        fmt::format("there is no verb '{}'; if it is a file, write 'maille {} {}'", word, verb, word));
  }
  return failure(ErrorCode::usage,
                 fmt::format("there is no verb '{}'; the verbs are {}", word, fmt::join(verbs, ", ")));
}

/// Of an option in front of any verb; "--compress" is meant as one.
std::string about_first_option(const Parser& parser) {
  const std::string option = parser.app.remaining().front();
  const std::string word = option.substr(std::min(option.find_first_not_of('-'), option.size()));
  for (const CLI::App* verb : parser.app.get_subcommands({})) {
    if (!word.empty() && verb->check_name(word))
      return fmt::format("there is no option '{}'; write 'maille {}'", option, verb->get_name());
  }
  return fmt::format("there is no option '{}' before a verb", option);
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
      if (!option->get_required() || option->count() != 0) continue;
      const OptionEntry entry = entry_of(*option);
      return entry.positional.empty() ? entry.names.back() + " " + entry.value : entry.positional;
    }
  }
  return "a verb";
}

/// An option takes the next word as its value, also where that is a file: "-e scan.ply".
std::string swallowed_file(const Parser& parser) {
  for (const CLI::App* verb : parser.app.get_subcommands()) {
    for (const CLI::Option* option : verb->get_options()) {
      const std::vector<std::string>& words = option->results();
      if (option->get_positional() || words.empty() || !is_regular(words.back())) continue;
      return fmt::format(", since {} took '{}' as its value", option->get_name(), words.back());
    }
  }
  return "";
}

bool is_effort_like(const std::string& word) {
  return word.size() > 1 && word[0] == '-' && std::isdigit(static_cast<unsigned char>(word[1])) != 0;
}

/// A level of several digits as the user wrote it: CLI11 takes "-12" for "-1 -2". Behind an option it is a
/// value.
std::string long_level(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool digits = word.size() > 2 && word.find_first_not_of("0123456789", 1) == std::string::npos;
    if (word[0] == '-' && digits && argv[i - 1][0] != '-') return word;
  }
  return "";
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

/// What gzip, zstd and others call levels.
bool means_effort(const std::string& option) {
  static const std::vector<std::string> words = {"--best", "--fast", "--level", "--effort",
                                                 "--compression-level"};
  return std::find(words.begin(), words.end(), option.substr(0, option.find('='))) != words.end();
}

/// "; compress has it": the verbs that have an option which this one does not.
std::string owners_of(const Parser& parser, const std::string& option) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : parser.app.get_subcommands({})) {
    if (verb->get_option_no_throw(option) != nullptr) verbs.push_back(verb->get_name());
  }
  if (verbs.empty()) return "";
  const bool many = verbs.size() > 3;
  if (many) verbs.resize(1);
  return fmt::format("; {}{} {} it", fmt::join(verbs, " and "), many ? " and others" : "",
                     verbs.size() == 1 && !many ? "has" : "have");
}

// CLI11's own messages use its own terms. These name what the user wrote, and the nearest option there is.
std::string about_unknown_option(const Parser& parser, const std::string& option) {
  const CLI::App& verb = *parser.app.get_subcommands().front();
  if (verb.get_name() == "compress" && (is_effort_like(option) || means_effort(option)))
    return fmt::format("there is no level '{}'; levels are -1 (fast) to -9 (small)", option);
  std::vector<std::string> names;
  for (const CLI::Option* known : verb.get_options()) {
    for (const std::string& name : known->get_lnames()) names.push_back("--" + name);
  }
  const std::string word = option.substr(0, option.find('='));
  const std::string owners = owners_of(parser, word);
  return fmt::format("there is no option '{}'{}", word, owners.empty() ? suggestion(word, names) : owners);
}

/// `message`: "--error: 1 required X missing".
std::string about_missing_value(const CLI::App& app, const std::string& message) {
  const std::string name = message.substr(0, message.find(':'));
  const auto verbs = app.get_subcommands();
  const CLI::Option* const option = verbs.empty() ? nullptr : verbs.front()->get_option_no_throw(name);
  const int values = option == nullptr ? 1 : option->get_expected_min();
  return values <= 1 ? name + " needs a value"
                     : fmt::format("{} needs {} numbers, separated by commas", name, values);
}

/// `message`: "--threads: Value many not in range 0 to 1024" or "Could not convert: --triangles = few".
std::string about_bad_value(const std::string& message) {
  const std::string value = ": Value ", range = " not in range ", convert = "Could not convert: ";
  const size_t at = message.find(value), behind = message.rfind(range);
  if (at != std::string::npos && behind != std::string::npos) {
    const std::string bounds = message.substr(behind + range.size()), option = message.substr(0, at);
    return fmt::format("{}: '{}' is not a number from {}", option,
                       message.substr(at + value.size(), behind - at - value.size()), bounds);
  }
  const size_t equals = message.find(" = ");
  if (message.starts_with(convert) && equals != std::string::npos) {
    return fmt::format("{}: '{}' is not a number", message.substr(convert.size(), equals - convert.size()),
                       message.substr(equals + 3));
  }
  return message;
}

std::string about_extras(const Parser& parser) {
  const CLI::App& verb = *parser.app.get_subcommands().front();
  const std::vector<std::string> extras = verb.remaining();
  for (const std::string& extra : extras) {
    if (extra.size() > 1 && extra[0] == '-') return about_unknown_option(parser, extra);
  }
  std::vector<std::string> taken;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_positional()) taken.push_back(entry_of(*option).positional);
  }
  return fmt::format("too many names: '{}'; it takes only {}{}", fmt::join(extras, " "),
                     fmt::join(taken, " and "),
                     verb.get_name() == "verify" ? ", and the original behind --against" : "");
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
  // "maille help compress" is "maille compress --help".
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
    const std::string level = parser.raw.effort.empty() ? "" : long_level(argc, argv);
    const std::string misread = level.empty() ? misread_option(*parsed.front()) : level;
    if (!misread.empty()) return usage_failure(parser, about_unknown_option(parser, misread));
    if (parser.raw.effort.size() > 1)
      return usage_failure(parser, "several levels given; give one of -1 to -9");
    return command_of(parser, parsed.front()->get_name());
  } catch (const CLI::CallForHelp&) {
    return PrintText{help_of(parser)};
  } catch (const CLI::CallForVersion&) {
    return PrintText{
        fmt::format("maille {} (file format {}.{})\n", library_version(), format_major, format_minor)};
  } catch (const CLI::ExtrasError&) {
    const auto parsed = parser.app.get_subcommands();
    if (parsed.empty()) return usage_failure(parser, about_first_option(parser));
    const std::string misread = misread_option(*parsed.front());
    return usage_failure(parser,
                         misread.empty() ? about_extras(parser) : about_unknown_option(parser, misread));
  } catch (const CLI::RequiredError&) {
    return usage_failure(parser,
                         fmt::format("{} is missing{}", missing_argument(parser), swallowed_file(parser)));
  } catch (const CLI::ArgumentMismatch& error) {
    return usage_failure(parser, about_missing_value(parser.app, error.what()));
  } catch (const CLI::ParseError& error) {
    return usage_failure(parser, about_bad_value(error.what()));
  }
}

}  // namespace maille::tool
