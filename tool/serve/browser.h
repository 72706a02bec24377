#pragma once

#include <string>

namespace maille::tool {

/// Opens an address in the browser of whoever sits at this machine. False: there is no screen, or no
/// xdg-open.
bool open_in_browser(const std::string& address);

}  // namespace maille::tool
