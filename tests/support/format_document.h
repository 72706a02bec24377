#pragma once

#include <cstddef>
#include <string>
#include <vector>

// docs/format.md, for tests that hold its examples and tables against the code.
namespace maille::testing {

std::string format_document();
/// A page of docs/ by its name.
std::string document(const std::string& name);
/// The lines between ```KIND and ```; none where there is no such block.
std::string block_of_document(const std::string& kind);
/// Pairs of hex digits up to the first two spaces of each line; the rest is explanation.
std::vector<std::byte> parse_hex(const std::string& text);
/// The bytes of a block ```hex NAME; of ```hex, where the name is empty.
std::vector<std::byte> example_of_document(const std::string& name = "");

}  // namespace maille::testing
