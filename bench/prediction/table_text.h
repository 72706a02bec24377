#pragma once

#include <string>

namespace maille {

/// The whole of stencil_tables.h, derived anew. For the program that writes it, and the test that compares.
std::string stencil_tables_text();

}  // namespace maille
