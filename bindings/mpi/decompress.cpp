// maille-mpi decompress: a .pvtu and a part for each rank. `maille-mpi compress` and ParaView read it.
#include <maille/io.h>
#include <maille/volume_file.h>
#include <maille/xml.h>

#include <algorithm>
#include <optional>

#include "program.h"

namespace maille {
namespace {

constexpr char point_numbers[] = "GlobalPointIds", cell_numbers[] = "GlobalCellIds";

/// VTK joins parts by these. Arrays of the mesh that are called so stay.
void add_numbers(Mesh& mesh, const char* name, Domain domain, const std::vector<uint32_t>& numbers) {
  if (mesh.find(name, domain) != nullptr) return;
  Array array = make_array(name, domain, Scalar::i64, 1);
  array.resize(numbers.size());
  std::copy(numbers.begin(), numbers.end(), array.values<int64_t>().begin());
  mesh.arrays.push_back(std::move(array));
}

Result<Mesh> read_share(const std::string& path, uint64_t step, const Ranks& ranks) {
  Result<std::unique_ptr<Source>> source = file_source(path);
  if (!source) return tl::unexpected(source.error());
  DecodeOptions options;
  options.step = step;
  Result<VolumeFile> file = VolumeFile::open(**source, options);
  if (!file) return tl::unexpected(file.error());
  VolumeQuery query;
  query.pieces.emplace();
  // Each rank takes a run of pieces. The runs are as even as possible and together have all pieces.
  const uint64_t pieces = file->pieces();
  for (uint64_t p = pieces * ranks.rank() / ranks.size(); p < pieces * (ranks.rank() + 1) / ranks.size(); ++p)
    query.pieces->push_back(static_cast<uint32_t>(p));
  Result<ExtractedVolume> found = file->extract(query);
  if (!found) return tl::unexpected(found.error());
  if (!found->problems.empty()) return failure(ErrorCode::corrupt, path + ": " + found->problems[0]);
  Mesh& mesh = found->mesh;
  if (found->cell_numbers.size() != mesh.cell_count() || found->point_numbers.size() != mesh.point_count()) {
    return failure(ErrorCode::usage,
                   path +
                       ": its cells are in no order, so nothing tells which points of "
                       "several parts are one; `maille decompress` writes them as one mesh");
  }
  add_numbers(mesh, point_numbers, Domain::point, found->point_numbers);
  add_numbers(mesh, cell_numbers, Domain::cell, found->cell_numbers);
  return std::move(mesh);
}

std::string vtk_type(Scalar type) {
  static constexpr const char* names[] = {"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                          "UInt32", "Int64", "UInt64", "Float32", "Float64"};
  return names[static_cast<size_t>(type)];
}

std::string described(const Array& array) {
  return "<PDataArray type=\"" + vtk_type(array.type) + "\" Name=\"" + xml_escaped(array.name) +
         "\" NumberOfComponents=\"" + std::to_string(array.components) + "\"/>\n";
}

/// What ParaView wants to know before it reads parts.
std::string list_of_parts(const Mesh& mesh, const std::vector<std::string>& parts) {
  std::string text =
      "<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
      "<PUnstructuredGrid GhostLevel=\"0\">\n";
  const auto arrays = [&](Domain domain, const char* tag, const char* ids) {
    text += std::string("<") + tag + " GlobalIds=\"" + ids + "\">\n";
    for (const Array& array : mesh.arrays) {
      if (array.domain == domain) text += described(array);
    }
    text += std::string("</") + tag + ">\n";
  };
  arrays(Domain::point, "PPointData", point_numbers);
  arrays(Domain::cell, "PCellData", cell_numbers);
  Array points = make_array("Points", Domain::point, mesh.points.type, 3);
  text += "<PPoints>\n" + described(points) + "</PPoints>\n";
  for (const std::string& part : parts) text += "<Piece Source=\"" + xml_escaped(part) + "\"/>\n";
  return text + "</PUnstructuredGrid>\n</VTKFile>\n";
}

Result<> write_text(const std::string& path, const std::string& text) {
  Result<std::unique_ptr<Sink>> sink = file_sink(path);
  if (!sink) return tl::unexpected(sink.error());
  const Result<> written = (*sink)->write(std::as_bytes(std::span(text.data(), text.size())));
  return written ? (*sink)->commit() : written;
}

Result<std::unique_ptr<Sink>> write_part(const Mesh& mesh, const std::string& path) {
  Result<std::unique_ptr<Sink>> sink = file_sink(path);
  if (!sink) return sink;
  const auto written = write_mesh(mesh, **sink, {});
  if (!written) return tl::unexpected(written.error());
  return sink;
}

Result<> without_value(const Result<std::unique_ptr<Sink>>& result) {
  return result ? Result<>() : Result<>(tl::unexpected(result.error()));
}

}  // namespace

Result<> decompress_shares(const std::string& input, const std::string& output, uint64_t step, Ranks& ranks) {
  constexpr std::string_view ending = ".pvtu";
  if (!output.ends_with(ending))
    return failure(ErrorCode::usage, output + ": name a .pvtu; each rank writes a .vtu beside it");
  const Result<Mesh> mesh = read_share(input, step, ranks);
  if (auto all = agree(ranks, mesh ? Result<>() : Result<>(tl::unexpected(mesh.error()))); !all) return all;

  // Ranks without cells have no part.
  std::vector<uint64_t> cells(ranks.size());
  cells[ranks.rank()] = mesh->cell_count() + mesh->point_count();
  ranks.add(cells);
  const std::string base = output.substr(0, output.size() - ending.size());
  const auto path_of = [&](size_t rank) { return base + "_" + std::to_string(rank) + ".vtu"; };
  Result<std::unique_ptr<Sink>> part = std::unique_ptr<Sink>();
  if (cells[ranks.rank()] > 0) part = write_part(*mesh, path_of(ranks.rank()));
  // No part gets its name before all are written, and the list comes last.
  if (auto all = agree(ranks, without_value(part)); !all) return all;
  const Result<> committed = *part ? (*part)->commit() : Result<>();
  if (auto all = agree(ranks, committed); !all) return all;
  std::vector<std::string> parts;
  std::optional<size_t> first;
  for (size_t rank = 0; rank < cells.size(); ++rank) {
    if (cells[rank] == 0) continue;
    const std::string path = path_of(rank);
    parts.push_back(path.substr(path.find_last_of('/') + 1));
    if (!first) first = rank;
  }
  const bool writes = first ? ranks.rank() == *first : ranks.rank() == 0;
  return agree(ranks, writes ? write_text(output, list_of_parts(*mesh, parts)) : Result<>());
}

}  // namespace maille
