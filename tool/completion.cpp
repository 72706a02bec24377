#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "manual.h"

namespace maille::tool {

namespace {

std::vector<std::string> words_for(const VerbEntry& verb) {
  std::vector<std::string> words = {verb.name};
  words.insert(words.end(), verb.aliases.begin(), verb.aliases.end());
  return words;
}

std::vector<std::string> all_verbs(const CommandEntry& command) {
  std::vector<std::string> verbs;
  for (const VerbEntry& verb : command.verbs) verbs.push_back(verb.name);
  return verbs;
}

// Up to the first aside: completion menus have one line.
std::string short_help(const OptionEntry& option) {
  return option.help.substr(0, std::min(option.help.find_first_of(";\n"), option.help.find(" (")));
}

std::string replaced(std::string text, char from, const std::string& to) {
  for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, 1, to);
  return text;
}

// Text between single quotes of a shell.
std::string in_quotes(const std::string& text) {
  return "'" + replaced(text, '\'', "'\\''") + "'";
}

const OptionEntry* positional_choice(const VerbEntry& verb) {
  for (const OptionEntry& option : verb.options) {
    if (!option.positional.empty() && !option.choices.empty()) return &option;
  }
  return nullptr;
}

// The values of the option before the cursor, and the names of all options.
std::string bash_verb(const VerbEntry& verb) {
  std::string values;
  std::vector<std::string> names;
  for (const OptionEntry& option : verb.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
    if (option.names.empty() || option.value.empty()) continue;
    const std::string pattern = fmt::format("{}", fmt::join(option.names, "|"));
    if (!option.choices.empty()) {
      values += fmt::format("        {}) words='{}' ;;\n", pattern, fmt::join(option.choices, " "));
    } else if (!option.takes_file()) {
      values += fmt::format("        {}) return ;;\n", pattern);
    } else {
      values += fmt::format("        {}) files=1 ;;\n", pattern);
    }
  }
  std::string text =
      fmt::format("    {})\n      words='{}'\n", fmt::join(words_for(verb), "|"), fmt::join(names, " "));
  if (!values.empty()) text += fmt::format("      case $previous in\n{}      esac\n", values);
  if (const OptionEntry* choice = positional_choice(verb)) {
    text += fmt::format("      [[ $current == -* ]] || words='{}'\n", fmt::join(choice->choices, " "));
  } else {
    text += "      [[ $current == -* || $words != -* ]] || files=1\n";
  }
  return text + "      ;;\n";
}

}  // namespace

std::string bash_completion(const CommandEntry& command) {
  std::string cases;
  for (const VerbEntry& verb : command.verbs) cases += bash_verb(verb);
  return fmt::format(
      "# bash completion for maille, written by `maille completion bash`\n"
      "_maille() {{\n"
      "  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} words='' files=''\n"
      "  COMPREPLY=()\n"
      "  if (( COMP_CWORD == 1 )); then\n"
      "    mapfile -t COMPREPLY < <(compgen -W '{} help --help --version' -- \"$current\")\n"
      "    return\n"
      "  fi\n"
      "  case ${{COMP_WORDS[1]}} in\n"
      "{}"
      "  esac\n"
      "  if [[ $files ]]; then\n"
      "    compopt -o filenames\n"
      "    mapfile -t COMPREPLY < <(compgen -f -- \"$current\")\n"
      "  else\n"
      "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
      "  fi\n"
      "}}\n"
      "complete -F _maille maille\n",
      fmt::join(all_verbs(command), " "), cases);
}

namespace {

std::string zsh_action(const OptionEntry& option) {
  if (!option.choices.empty()) return fmt::format("({})", fmt::join(option.choices, " "));
  return option.takes_file() ? "_files" : "";
}

// '*--error[help]:X:' of _arguments; one line per name keeps it simple.
std::string zsh_option(const OptionEntry& option) {
  std::string help = short_help(option);
  help = replaced(replaced(replaced(help, '[', "\\["), ']', "\\]"), ':', "\\:");
  std::string lines;
  for (const std::string& name : option.names) {
    std::string spec = fmt::format("{}{}[{}]", option.repeatable ? "*" : "", name, help);
    if (!option.value.empty()) spec += fmt::format(":{}:{}", option.value, zsh_action(option));
    lines += fmt::format("        {} \\\n", in_quotes(spec));
  }
  return lines;
}

std::string zsh_verb(const VerbEntry& verb) {
  std::string text = fmt::format("    {})\n      _arguments \\\n", fmt::join(words_for(verb), "|"));
  for (const OptionEntry& option : verb.options) text += zsh_option(option);
  const OptionEntry* choice = positional_choice(verb);
  text += fmt::format("        {}\n",
                      in_quotes(choice != nullptr ? "1:what:" + zsh_action(*choice) : "*:file:_files"));
  return text + "      ;;\n";
}

}  // namespace

std::string zsh_completion(const CommandEntry& command) {
  std::string verbs;
  std::string cases;
  for (const VerbEntry& verb : command.verbs) {
    verbs += fmt::format("      {}\n", in_quotes(verb.name + ":" + replaced(verb.summary(), ':', "\\:")));
    cases += zsh_verb(verb);
  }
  return fmt::format(
      "#compdef maille\n"
      "# zsh completion for maille, written by `maille completion zsh`\n"
      "_maille() {{\n"
      "  if (( CURRENT == 2 )); then\n"
      "    local -a verbs=(\n{}    )\n"
      "    _describe verb verbs\n"
      "    return\n"
      "  fi\n"
      "  local verb=${{words[2]}}\n"
      "  shift words\n"
      "  (( CURRENT-- ))\n"
      "  case $verb in\n{}  esac\n"
      "}}\n"
      "_maille \"$@\"\n",
      verbs, cases);
}

namespace {

/// fish has one line for each option, with a condition that names its verb.
std::string fish_option(const VerbEntry& verb, const OptionEntry& option) {
  std::string names;
  for (const std::string& name : option.names) {
    names += name.find("--") == 0 ? " -l " + name.substr(2) : " -s " + name.substr(1);
  }
  std::string value;
  if (!option.choices.empty()) {
    value = fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
  } else if (!option.value.empty()) {
    value = option.takes_file() ? " -r -F" : " -x";
  }
  return fmt::format("complete -c maille -n '__fish_seen_subcommand_from {}'{}{} -d {}\n",
                     fmt::join(words_for(verb), " "), names, value, in_quotes(short_help(option)));
}

}  // namespace

std::string fish_completion(const CommandEntry& command) {
  std::string text = "# fish completion for maille, written by `maille completion fish`\n";
  for (const VerbEntry& verb : command.verbs) {
    text += fmt::format("complete -c maille -n __fish_use_subcommand -f -a {} -d {}\n", verb.name,
                        in_quotes(verb.summary()));
  }
  for (const VerbEntry& verb : command.verbs) {
    for (const OptionEntry& option : verb.options) {
      if (option.names.empty() && option.choices.empty()) continue;
      text += fish_option(verb, option);
    }
  }
  return text;
}

}  // namespace maille::tool
