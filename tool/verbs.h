#pragma once

#include <maille/error.h>
#include <maille/mesh.h>

#include <optional>
#include <string>

#include "options.h"

// One verb each. The value is the exit code of an answer (0, 1 differs, 6 damaged), an Error anything that
// kept the verb from giving one.
namespace maille::tool {

Result<int> run(const PrintText& options);
Result<int> run(const CompressOptions& options);
Result<int> run(const DecompressOptions& options);
Result<int> run(const AppendOptions& options);
Result<int> run(const InfoOptions& options);
Result<int> run(const ServeOptions& options);
Result<int> run(const ViewOptions& options);
Result<int> run(const VerifyOptions& options);
Result<int> run(const DiffOptions& options);
Result<int> run(const ConvertOptions& options);
Result<int> run(const StencilOptions& options);
Result<int> run(const SubdivideOptions& options);
Result<int> run(const BenchOptions& options);
Result<int> run(const GenerateOptions& options);
Result<int> run(const ExtractOptions& options);
Result<int> run(const SliceOptions& options);
Result<int> run(const ProbeOptions& options);

/// Is it a list of files in time (.pvd), a file with several steps (Exodus, VTKHDF, CGNS, XDMF, EnSight), or
/// a case of OpenFOAM with several times? compress makes one file of them, its steps appended.
bool is_series(const std::string& path);
Result<uint64_t> compress_series(CompressOptions options);
/// A .vtu for each time, and the list of them, a .pvd.
Result<int> decompress_series(const DecompressOptions& options);
/// What a VTK file says in its field data, or a case of OpenFOAM by the name of a folder; nothing for others.
std::optional<double> time_of(const Mesh& mesh);

}  // namespace maille::tool
