#pragma once

#include <maille/io.h>

namespace maille {

Result<ReadResult> read_vtk_legacy(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_vtk_legacy(const Mesh& mesh, Sink& sink, const WriteOptions& options);

/// Fields in which our writer keeps what the format has no place for: meanings of arrays ("point normal
/// NAME"), and what stands before the name of an array on corners, and of texts that were no text in a VTK
/// file. These are bytes, each text ended by a zero, since meshio reads no files with text.
inline constexpr char vtk_roles_name[] = "maille_roles";
inline constexpr char vtk_corner_prefix[] = "maille_corner:";
inline constexpr char vtk_text_prefix[] = "maille_text:";

/// The Scalar for the format's name of it ("vtktypeint64", in lower case); none for others.
std::optional<Scalar> scalar_of_vtk_legacy(std::string_view name);
const char* vtk_legacy_name_of(Scalar type);

}  // namespace maille
