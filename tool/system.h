#pragma once

#include <string>

#include "result.h"

// What the command asks of the operating system. posix/ and windows/ each have all of it.

namespace maille::tool {

/// The arguments of main() in UTF-8. Standard streams are made to take bytes as they are, and terminals
/// UTF-8.
char** utf8_arguments(int& count, char** arguments);
/// Signals that end the process remove unfinished files first; a closed pipe is an error of writing.
void install_signal_handlers();
/// Whether this message is that of writing to a pipe whose reader went away.
bool is_of_closed_pipe(const std::string& message);
/// Two paths lead to one file, through links and mounts. Not said of character devices: /dev/null may be both
/// input and output.
bool is_same_file(const std::string& a, const std::string& b);
/// An empty file, PREFIX and characters that no other file has and SUFFIX. Error: write_failed.
Result<std::string> make_empty_file(const std::string& prefix, const std::string& suffix);
/// Before work in parts. What memory is for is a few tables that grow with the front, and are twice as large
/// each time: those that are left go back to the system at once, instead of waiting for something as large.
void keep_memory_small();
/// Becomes the program maille-full, with the arguments of this one; returns only where that fails.
Result<int> become_full_program();

}  // namespace maille::tool
