#include <fmt/format.h>
#include <maille/file.h>
#include <maille/io.h>
#include <maille/random_access.h>
#include <maille/volume_file.h>

#include "files.h"
#include "gltf.h"
#include "in_parts.h"
#include "mesh_info.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

/// Where a mesh of mode random lies, for --box and --sphere of extract: the root of its levels knows.
std::optional<Sphere> sphere_of(const Source& source, const FileInfo& info) {
  if (info.mode != Mode::random) return {};
  const auto file = File::open(source);
  return file && file->levels() > 0 ? std::optional(file->sphere()) : std::nullopt;
}

std::string corner_text(const Vector3& corner) {
  return fmt::format("{:.6g}, {:.6g}, {:.6g}", corner[0], corner[1], corner[2]);
}

/// "low to high" of each component.
std::string range_text(const PieceInfo::Field& field) {
  std::string text;
  for (const PieceInfo::Field::Component& range : field.components) {
    if (!text.empty()) text += "; ";
    text += range.low > range.high ? "none" : fmt::format("{:.4g} to {:.4g}", range.low, range.high);
  }
  return text;
}

Result<std::string> pieces_text(const VolumeFile& file) {
  std::vector<std::string> head = {"piece", "cells", "points", "bytes", "lowest corner", "highest corner"};
  for (const StreamArray& array : file.description().arrays) head.push_back(array.name);
  Table table(head, 0);
  for (uint32_t p = 0; p < file.pieces(); ++p) {
    const PieceInfo info = TOOL_TRY(file.info(p));
    std::vector<std::string> row = {fmt::format("{}", p),
                                    fmt::format("{}", info.cells),
                                    fmt::format("{}", info.points),
                                    fmt::format("{}", info.bytes),
                                    info.box ? corner_text(info.box->low) : "",
                                    info.box ? corner_text(info.box->high) : ""};
    for (const PieceInfo::Field& field : info.fields) row.push_back(range_text(field));
    row.resize(head.size());
    table.row(row);
  }
  return table.str();
}

Result<Json> pieces_json(const VolumeFile& file) {
  Json pieces = Json::array();
  for (uint32_t p = 0; p < file.pieces(); ++p) {
    const PieceInfo info = TOOL_TRY(file.info(p));
    Json piece = {{"cells", info.cells}, {"points", info.points}, {"bytes", info.bytes}};
    if (info.box) piece["box"] = {info.box->low.x, info.box->high.x};
    Json fields = Json::array();
    for (const PieceInfo::Field& field : info.fields) {
      Json components = Json::array();
      for (const PieceInfo::Field::Component& range : field.components) {
        // Without numbers there is no range.
        if (range.low > range.high) {
          components.push_back(nullptr);
        } else {
          components.push_back({{"low", range.low}, {"high", range.high}, {"mean", range.mean}});
        }
      }
      fields.push_back({{"name", field.name},
                        {"domain", maille::name_of(field.domain)},
                        {"components", components},
                        {"nans", field.nans}});
    }
    piece["arrays"] = fields;
    pieces.push_back(piece);
  }
  return pieces;
}

}  // namespace

namespace {

/// A mesh in another format has no description: it is read.
Result<int> run_on_mesh(const InfoOptions& options, const Input& input) {
  const std::string name = input_name(options.input);
  if (options.tree || options.pieces || options.chunks)
    return failure(ErrorCode::usage, name + ": --tree, --pieces and --chunks are for .maille files");
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const LoadedMesh loaded = TOOL_TRY(load(input, options.common, progress));
  // A reader goes by the extension, then by the first bytes; this tells which of them it was.
  const std::string format = input.format.empty()
                                 ? format_of(options.input).value_or(format_of(*input.source).value_or(""))
                                 : input.format;
  const uint64_t bytes = bytes_of_input(input, loaded.files_beside);
  TOOL_CHECK(answer(options.common.json ? dump(mesh_info_json(loaded.mesh, name, format, bytes))
                                        : mesh_info_text(loaded.mesh, name, format, bytes)));
  return 0;
}

}  // namespace

Result<int> run(const InfoOptions& options) {
  if (const auto gltf = TOOL_TRY(open_compressed_gltf(options.input))) return info_of_gltf(options, *gltf);
  const Input input = TOOL_TRY(open_input(options.input, options.input_format, options.fetch_limit));
  const bool is_foreign =
      !input.is_maille && (!input.format.empty() || format_of(options.input) || format_of(*input.source));
  if (is_foreign) return run_on_mesh(options, input);
  TOOL_CHECK(check_maille(input));
  const FileInfo info = TOOL_TRY(inspect(*input.source, {options.common.memory}));
  const std::string name = input_name(options.input);
  const std::optional<Sphere> sphere = sphere_of(*input.source, info);
  if (options.pieces && info.mode != Mode::stream)
    return failure(ErrorCode::usage, name + ": --pieces is for volumes, files of mode stream");
  if (options.pieces && !in_pieces(info))
    say_notes(name, {"is not in pieces: it counts as one, of which nothing more is known before it is read"},
              options.common.quiet);
  if (options.common.json) {
    Json json = info_json(info, name, sphere);
    if (options.pieces) json["pieces"] = TOOL_TRY(pieces_json(TOOL_TRY(VolumeFile::open(*input.source))));
    TOOL_CHECK(answer(dump(json)));
  } else {
    std::string text = info_text(info, name, sphere, options.tree, options.chunks);
    if (options.pieces) text += TOOL_TRY(pieces_text(TOOL_TRY(VolumeFile::open(*input.source))));
    TOOL_CHECK(answer(text));
  }
  for (const std::string& problem : info.problems) complain(name + ": " + problem);
  return info.problems.empty() ? 0 : static_cast<int>(ErrorCode::corrupt);
}

Result<int> run(const PrintText& options) {
  TOOL_CHECK(answer(options.text));
  return 0;
}

}  // namespace maille::tool
