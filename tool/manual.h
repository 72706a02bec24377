#pragma once

#include <string>
#include <vector>

// The command's own description, taken from the parser's tree (parser.cpp), and the texts made from it:
// one table, so that help, manual and completion cannot drift apart.
namespace maille::tool {

struct OptionEntry {
  std::vector<std::string> names;    ///< "-e", "--error"; empty for a positional argument only
  std::string positional;            ///< "IN"; empty for an option only
  std::string value;                 ///< "X", "FILE", "auto|always"; empty for a flag
  std::vector<std::string> choices;  ///< the values, where they are few
  std::string help;
  std::string group;
  bool required = false;
  bool repeatable = false;

  bool takes_file() const { return value == "FILE"; }
};

struct VerbEntry {
  std::string name;
  std::vector<std::string> aliases;
  std::string description;  ///< first line: what it does; the rest: details
  std::string examples;     ///< lines "command # what it does"
  std::vector<OptionEntry> options;

  std::string summary() const { return description.substr(0, description.find('\n')); }
};

struct CommandEntry {
  std::string description;
  std::vector<VerbEntry> verbs;
};

/// "maille compress [OPTIONS] IN [OUT]".
std::string usage_of(const VerbEntry& verb);
std::string help_text(const CommandEntry& command);
std::string help_text(const VerbEntry& verb);

/// docs/command.md.
std::string markdown_manual(const CommandEntry& command);
/// maille.1.
std::string man_page(const CommandEntry& command);

std::string bash_completion(const CommandEntry& command);
std::string zsh_completion(const CommandEntry& command);
std::string fish_completion(const CommandEntry& command);

}  // namespace maille::tool
