#pragma once

#include "parser.h"

// Words and kinds of options that several verbs share. Only for the files of the parser.
namespace maille::tool {

// Groups of options, in the order of the help text.
inline constexpr const char* files_group = "Input and output";
inline constexpr const char* quality_group = "Quality";
inline constexpr const char* answer_group = "Answer";
inline constexpr const char* prediction_group = "Prediction";
inline constexpr const char* scheme_group = "Scheme";
inline constexpr const char* speed_group = "Speed and memory";
inline constexpr const char* message_group = "Messages";

/// One of `values`.
CLI::Option* one_of(CLI::Option* option, const std::vector<std::string>& values);
/// May be given several times, each with one `value`; an option of quality.
CLI::Option* repeatable(CLI::Option* option, const std::string& value);
/// "1,5,9" in one word.
CLI::Option* comma_separated(CLI::Option* option);
/// --pieces: how many cells each has.
CLI::Option* cells_of_pieces(CLI::Option* option);
CLI::Option* add_file(CLI::App* verb, const std::string& names, std::string& variable,
                      const std::string& help);

/// Mesh formats that can be written; with "maille" behind them.
std::vector<std::string> mesh_formats_to_write();
std::vector<std::string> formats_to_write();
/// --input-format, which says how `what` is read.
void add_input_format(CLI::App* verb, std::string& variable, const std::string& what, const char* group);
/// --output-format; `fallback`: what decides where it is not given.
void add_output_format(CLI::App* verb, std::string& variable, const std::string& fallback,
                       const std::vector<std::string>& names);
void add_force(CLI::App* verb, bool& force);

}  // namespace maille::tool
