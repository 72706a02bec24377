#pragma once

namespace maille {

/// Version of the library, "major.minor.patch".
const char* library_version();

/// Version of the file format this library writes. It reads every released version up to this one.
inline constexpr unsigned format_major = 0;
inline constexpr unsigned format_minor = 1;

}  // namespace maille
