#include <maille/source.h>

#include <new>
#include <string>

#include "command_line.h"
#include "system.h"
#include "text.h"
#include "verbs.h"

namespace {

// Each verb has its own type of options and its own overload of run() (verbs.h).
maille::Result<int> run(int argc, char** argv) {
  const auto command = maille::tool::parse_command_line(argc, argv);
  if (!command) return tl::unexpected(command.error());
  return std::visit([](const auto& options) { return maille::tool::run(options); }, *command);
}

}  // namespace

// The exit code is the verb's answer or the code of its error. The library throws no exceptions of its own,
// so only a refused allocation is caught here.
int main(int argc, char** argv) {
  maille::tool::install_signal_handlers();
  try {
    char** const arguments = maille::tool::utf8_arguments(argc, argv);
    const auto result = run(argc, arguments);
    if (result) return *result;
    // A reader that has seen enough, as in `| head`, needs no message; the exit code is for scripts.
    const maille::Error& error = result.error();
    if (!maille::tool::is_of_closed_pipe(error.message))
      maille::tool::complain(maille::tool::sentence_of(error));
    return static_cast<int>(result.error().code);
  } catch (const std::bad_alloc&) {
    maille::remove_unfinished_files();
    maille::tool::complain("out of memory; the mesh needs more than this machine gives");
    return static_cast<int>(maille::ErrorCode::memory_bound);
  }
}
