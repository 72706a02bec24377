#include <cstdio>

#include "table_text.h"

// maille_tables > bench/prediction/stencil_tables.h
int main() {
  const std::string text = maille::stencil_tables_text();
  return std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0 ? 0 : 1;
}
