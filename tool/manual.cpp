#include "manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/version.h>

#include <algorithm>

namespace maille::tool {

namespace {

// Help is laid out for a terminal of 100 columns; manuals use the same width.
constexpr size_t help_column = 30;
constexpr size_t help_width = 100;

// What exit codes mean: include/maille/error.h, for users.
struct ExitCode {
  const char* code;
  const char* meaning;
};
constexpr ExitCode exit_codes[] = {
    {"0", "done; for diff and verify: equal"},
    {"1", "diff, verify: a difference was found"},
    {"2", "invalid command line, or the output exists already"},
    {"3", "the input is missing or unreadable"},
    {"4", "the input breaks the rules of its format; the message names line or byte and element"},
    {"5", "needs another version of maille, or a feature that does not exist yet"},
    {"6", "the .maille file is damaged"},
    {"7", "cannot be done within the memory allowed"},
    {"8",
     "the error bound cannot be met; not given by this version, which stores bit for bit what no "
     "lattice brings within the bound"},
    {"9", "the output could not be written"},
    {"10", "a file on a web server could not be read, or serve could not listen"},
    {"130, 143", "stopped by a signal; nothing is left under the output's name"},
};

constexpr const char* general_notes =
    "Wherever a .maille file is read, its address (http:// or https://) will do, too. "
    "Answers go to standard output, everything else to standard error. An output file "
    "appears whole or not at all: it is written under a temporary name and renamed at the "
    "end. Files are never overwritten without -f.";

/// Breaks lines at blanks. `column` is where the first line begins, `indent` where the others do.
std::string wrapped(const std::string& text, size_t indent, size_t column) {
  std::string lines;
  size_t start = 0;
  while (start < text.size()) {
    size_t end = std::min(text.find('\n', start), text.size());
    if (end - start > help_width - column) {
      const size_t space = text.rfind(' ', start + help_width - column);
      if (space != std::string::npos && space > start) end = space;
    }
    if (!lines.empty()) lines += std::string(indent, ' ');
    lines += text.substr(start, end - start) + "\n";
    start = end + 1;
  }
  return lines;
}

// "-e, --error X|NAME=X"; "-1 ... -9" for the row of efforts.
std::string names_of(const OptionEntry& option) {
  std::string text = option.names.size() > 4 ? option.names.front() + " ... " + option.names.back()
                                             : fmt::format("{}", fmt::join(option.names, ", "));
  if (!option.value.empty()) text += " " + option.value;
  return text;
}

std::string option_line(const std::string& left, const std::string& help) {
  if (left.size() + 2 > help_column - 2) {
    return fmt::format("  {}\n{:{}}{}", left, "", help_column, wrapped(help, help_column, help_column));
  }
  return fmt::format("  {:<{}}{}", left, help_column - 2, wrapped(help, help_column, help_column));
}

std::vector<std::string> groups_of(const VerbEntry& verb) {
  std::vector<std::string> groups;
  for (const OptionEntry& option : verb.options) {
    if (option.names.empty()) continue;
    if (std::find(groups.begin(), groups.end(), option.group) == groups.end()) groups.push_back(option.group);
  }
  return groups;
}

std::string details_of(const VerbEntry& verb) {
  const size_t line = verb.description.find('\n');
  return line == std::string::npos ? "" : verb.description.substr(line + 1);
}

std::string indented(const std::string& text, const std::string& indent) {
  std::string lines;
  for (size_t start = 0; start < text.size();) {
    const size_t end = std::min(text.find('\n', start), text.size());
    lines += indent + text.substr(start, end - start) + "\n";
    start = end + 1;
  }
  return lines;
}

}  // namespace

std::string usage_of(const VerbEntry& verb) {
  std::string usage = fmt::format("maille {}", verb.name);
  if (verb.options.size() > 2) usage += " [OPTIONS]";
  for (const OptionEntry& option : verb.options) {
    if (option.positional.empty()) continue;
    const std::string name =
        option.choices.empty() ? option.positional : fmt::format("{}", fmt::join(option.choices, "|"));
    usage += option.required ? " " + name : " [" + name + "]";
    if (option.repeatable) usage += "...";
  }
  return usage;
}

std::string help_text(const CommandEntry& command) {
  std::string text = fmt::format("{}\n\nUsage: maille VERB [OPTIONS] FILES\n\nVerbs:\n", command.description);
  for (const VerbEntry& verb : command.verbs) {
    std::vector<std::string> names = {verb.name};
    names.insert(names.end(), verb.aliases.begin(), verb.aliases.end());
    text += option_line(fmt::format("{}", fmt::join(names, ", ")), verb.summary());
  }
  text += "\nOptions:\n" +
          option_line("-h, --help", "Print this text; 'maille VERB --help' tells about a verb") +
          option_line("-V, --version", "Print the version");
  text += "\nExamples:\n";
  for (const VerbEntry& verb : command.verbs) {
    std::string example = verb.examples.substr(0, verb.examples.find('\n'));
    const size_t comment = example.find("  #");
    if (comment != std::string::npos) example.resize(example.find_last_not_of(' ', comment) + 1);
    text += indented(example, "  ");
  }
  text += "\nExit codes:\n";
  for (const ExitCode& exit : exit_codes) text += option_line(exit.code, exit.meaning);
  return text;
}

std::string help_text(const VerbEntry& verb) {
  std::string text = verb.summary() + "\n";
  const std::string details = details_of(verb);
  if (!details.empty()) text += wrapped(details, 0, 0);
  text += fmt::format("\nUsage: {}\n", usage_of(verb));
  std::string arguments;
  for (const OptionEntry& option : verb.options) {
    if (!option.positional.empty()) arguments += option_line(option.positional, option.help);
  }
  if (!arguments.empty()) text += "\nArguments:\n" + arguments;
  for (const std::string& group : groups_of(verb)) {
    text += fmt::format("\n{}:\n", group);
    for (const OptionEntry& option : verb.options) {
      if (option.names.empty() || option.group != group) continue;
      text += option_line(names_of(option),
                          option.positional.empty() ? option.help : "The same as " + option.positional);
    }
  }
  if (!verb.examples.empty()) text += "\nExamples:\n" + indented(verb.examples, "  ");
  return text;
}

namespace {

/// An item of a list. Further lines of the help, such as the values of an option, are items below it.
std::string markdown_item(const std::string& left, const std::string& help) {
  const size_t line = std::min(help.find('\n'), help.size());
  const std::string first = help.substr(0, line);
  const bool is_long = left.size() > help_width / 2;  // a name is not broken
  std::string text = is_long ? fmt::format("* {}:\n  {}", left, wrapped(first, 2, 2))
                             : "* " + wrapped(left + ": " + first, 2, 2);
  for (size_t start = line + 1; start < help.size();) {
    const size_t end = std::min(help.find('\n', start), help.size());
    text += "  * " + wrapped(help.substr(start, end - start), 4, 4);
    start = end + 1;
  }
  return text;
}

std::string markdown_option(const OptionEntry& option) {
  std::string left = option.positional.empty() ? "" : fmt::format("`{}`", option.positional);
  if (!option.names.empty()) left += fmt::format("{}`{}`", left.empty() ? "" : " or ", names_of(option));
  return markdown_item(left, option.help);
}

std::string markdown_verb(const VerbEntry& verb) {
  std::string text = fmt::format("## maille {}\n\n{}", verb.name, wrapped(verb.summary(), 0, 0));
  if (!details_of(verb).empty()) text += wrapped(details_of(verb), 0, 0);
  if (!verb.aliases.empty()) text += fmt::format("Short form: `{}`.\n", fmt::join(verb.aliases, "`, `"));
  text += fmt::format("\n```\n{}\n```\n\n", usage_of(verb));
  for (const OptionEntry& option : verb.options) text += markdown_option(option);
  if (!verb.examples.empty()) text += fmt::format("\n```sh\n{}\n```\n", verb.examples);
  return text + "\n";
}

}  // namespace

std::string markdown_manual(const CommandEntry& command) {
  std::string text = fmt::format(
      "# The command `maille`\n\n"
      "<!-- Written by `maille completion markdown`; a test keeps it current. Edit tool/parser.cpp. "
      "-->\n\n"
      "{}\n{}\n",
      wrapped(command.description, 0, 0), wrapped(general_notes, 0, 0));
  for (const VerbEntry& verb : command.verbs) text += markdown_verb(verb);
  text += "## Exit codes\n\n| code | meaning |\n|---|---|\n";
  for (const ExitCode& exit : exit_codes) text += fmt::format("| {} | {} |\n", exit.code, exit.meaning);
  return text;
}

namespace {

/// Escapes what roff would interpret: backslashes, hyphens (which it would turn into typographic ones that
/// cannot be copied into a shell), and dots or quotes at the beginning of a line, which begin requests.
std::string roff(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else if ((c == '.' || c == '\'') && (escaped.empty() || escaped.back() == '\n')) {
      escaped += fmt::format("\\&{}", c);
    } else {
      escaped += c;
    }
  }
  return escaped;
}

// Lines of their own.
std::string in_lines(std::string text) {
  for (size_t end = 0; (end = text.find('\n', end)) != std::string::npos; end += 5) text.insert(end, "\n.br");
  return text;
}

std::string man_verb(const VerbEntry& verb) {
  std::string text = fmt::format(".SS {}\n{}\n{}\n.PP\n.B {}\n", roff(verb.name), roff(verb.summary()),
                                 roff(details_of(verb)), roff(usage_of(verb)));
  for (const OptionEntry& option : verb.options) {
    std::string left = option.positional;
    if (!option.names.empty()) left += (left.empty() ? "" : ", ") + names_of(option);
    text += fmt::format(".TP\n.B {}\n{}\n", roff(left), in_lines(roff(option.help)));
  }
  if (!verb.examples.empty()) text += fmt::format(".PP\n.EX\n{}\n.EE\n", roff(verb.examples));
  return text;
}

}  // namespace

std::string man_page(const CommandEntry& command) {
  std::string text = fmt::format(
      ".TH MAILLE 1 \"\" \"maille {}\"\n.SH NAME\nmaille \\- compress meshes and open any part of them\n"
      ".SH SYNOPSIS\n.B maille\n.I VERB\n[OPTIONS] FILES\n.SH DESCRIPTION\n{}\n{}\n.SH VERBS\n",
      library_version(), roff(command.description), roff(general_notes));
  for (const VerbEntry& verb : command.verbs) text += man_verb(verb);
  text += ".SH EXIT STATUS\n";
  for (const ExitCode& exit : exit_codes)
    text += fmt::format(".TP\n.B {}\n{}\n", roff(exit.code), roff(exit.meaning));
  return text;
}

}  // namespace maille::tool
