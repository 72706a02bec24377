#include <fmt/format.h>
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/gltf.h>
#include <maille/io.h>

#include <algorithm>

#include "gltf.h"
#include "original_order.h"
#include "result.h"
#include "text.h"
#include "verbs.h"
#include "verdict.h"

namespace maille::tool {

namespace {

/// The .maille files of an asset, decoded, and what is said of them all.
struct GltfVerdict {
  Verdict all;
  std::vector<GltfPart> parts;
  std::vector<Mesh> meshes;
  std::vector<FileInfo> infos;
  int weight_bits = 0;  ///< to which weights were rounded

  bool lossless() const { return std::all_of(infos.begin(), infos.end(), all_lossless); }
};

std::string title_of(const GltfPart& part) {
  return fmt::format("buffer view {}", part.buffer_view);
}

Result<> decode_parts(const CommonOptions& common, GltfVerdict& verdict) {
  const Threads threads(common.threads);
  for (const GltfPart& part : verdict.parts) {
    const auto source = memory_source(Bytes(part.bytes), title_of(part));
    DecodeOptions decoding;
    decoding.limits.mesh_bytes = common.memory;
    decoding.executor = threads.executor();
    auto mesh = decode(*source, decoding);
    if (!mesh) {
      verdict.all.damage.push_back(mesh.error().message);
      continue;
    }
    verdict.all.points += mesh->point_count();
    verdict.all.cells += mesh->cell_count();
    verdict.meshes.push_back(*std::move(mesh));
    verdict.infos.push_back(TOOL_TRY(inspect(*source, decoding.limits)));
  }
  return {};
}

/// Joins the verdicts of several files: an array of the same name is in many of them, and its row shows the
/// largest of the bounds and errors.
void add_to(std::vector<ArrayVerdict>& all, const std::vector<ArrayVerdict>& arrays) {
  for (const ArrayVerdict& array : arrays) {
    const auto known = std::find_if(all.begin(), all.end(), [&](const ArrayVerdict& other) {
      return other.info.name == array.info.name && other.info.domain == array.info.domain;
    });
    if (known == all.end()) {
      all.push_back(array);
      continue;
    }
    ArrayDifference& sum = known->difference;
    sum.maximum = std::max(sum.maximum, array.difference.maximum);
    sum.maximum_norm = std::max(sum.maximum_norm, array.difference.maximum_norm);
    sum.maximum_relative = std::max(sum.maximum_relative, array.difference.maximum_relative);
    sum.root_mean_square = std::max(sum.root_mean_square, array.difference.root_mean_square);
    sum.unequal += array.difference.unequal;
    known->info.bound = std::max(known->info.bound, array.info.bound);
    known->info.lossless = known->info.lossless && array.info.lossless;
    known->good = known->good && array.good;
  }
}

/// File by file, as the lossy values of each were made from the primitives it holds.
Result<> hold_parts_against(const Source& original, const CommonOptions& common, GltfVerdict& verdict) {
  auto originals = gltf_originals(original, verdict.parts, {common.memory});
  if (!originals && originals.error().code != ErrorCode::differs) return tl::unexpected(originals.error());
  if (!originals) {
    differs(verdict.all, {originals.error().message});
    return {};
  }
  for (size_t i = 0; i < verdict.parts.size(); ++i) {
    Mesh& mesh = (*originals)[i];
    verdict.weight_bits = std::max(verdict.weight_bits, round_gltf_weights_as(mesh, verdict.meshes[i]));
    Verdict part;
    TOOL_CHECK(hold_against(mesh, verdict.meshes[i], verdict.infos[i], common, part));
    add_to(verdict.all.arrays, part.arrays);
    if (part.same) continue;
    verdict.all.same = false;
    for (const std::string& difference : part.differences)
      verdict.all.differences.push_back(fmt::format("{}: {}", title_of(verdict.parts[i]), difference));
  }
  return {};
}

Result<> hold_asset_against(const VerifyOptions& options, const Mesh& decoded, ProgressDisplay& progress,
                            GltfVerdict& verdict) {
  verdict.all.compared = true;
  const Input original = TOOL_TRY(open_input(options.original, options.original_format));
  const LoadedMesh loaded = TOOL_TRY(load(original, options.common, progress));
  if (loaded.mesh.cell_count() != decoded.cell_count()) {
    differs(verdict.all,
            {fmt::format("{} and {}", counted(loaded.mesh.cell_count(), "cell"), decoded.cell_count())});
    return {};
  }
  Comparison comparison;
  if (verdict.lossless()) comparison = compare(loaded.mesh, decoded, {});
  if (comparison.equal) return {};
  const auto format = format_of(*original.source);
  const bool is_gltf = format && (*format == "glb" || *format == "gltf");
  const bool is_plain = is_gltf && TOOL_TRY(parts_of_gltf(original)).empty();
  if (!is_plain && !verdict.lossless()) {
    return failure(
        ErrorCode::usage,
        fmt::format("{}: values in {} were rounded; compare it with the glTF file it was made from",
                    input_name(options.original), input_name(options.input)));
  }
  if (is_plain) TOOL_CHECK(hold_parts_against(*original.source, options.common, verdict));
  // Rounded weights are coded without loss, so they say nothing of it themselves.
  if (!verdict.lossless() || verdict.weight_bits != 0) return {};
  differs(verdict.all, std::move(comparison.differences));
  return {};
}

std::string text_of(const GltfVerdict& verdict, const VerifyOptions& options) {
  const Verdict& all = verdict.all;
  const std::string name = input_name(options.input);
  std::string text =
      all.damage.empty()
          ? fmt::format("{}: {} good, {}, {}\n", name, counted(verdict.parts.size(), ".maille file"),
                        counted(all.points, "point"), counted(all.cells, "triangle"))
          : fmt::format("{}: damaged\n", name);
  for (const std::string& one : all.damage) text += fmt::format("  {}\n", one);
  if (!all.compared) return text;
  const char* same = all.arrays.empty() ? "the same geometry, bit for bit"
                                        : "the same triangles, every array as exact as promised";
  text += fmt::format("against {}: {}\n", input_name(options.original),
                      all.same ? same : "different (A is the original, B the file)");
  for (const std::string& one : all.differences) text += fmt::format("  {}\n", one);
  if (verdict.weight_bits != 0)
    text += fmt::format("  weights are those of the original in multiples of 2^-{}\n", verdict.weight_bits);
  return all.arrays.empty() ? text : text + table_of(all.arrays);
}

Json json_of(const GltfVerdict& verdict, const VerifyOptions& options) {
  const Verdict& all = verdict.all;
  Json json = {{"file", input_name(options.input)}, {"damage", all.damage}};
  json.update({{"points", all.points}, {"triangles", all.cells}});
  if (!all.compared) return json;
  json.update({{"same", all.same}, {"lossless", verdict.lossless()}, {"differences", all.differences}});
  json["arrays"] = json_of(all.arrays);
  return json;
}

}  // namespace

Result<int> verify_gltf(const VerifyOptions& options, const Input& input) {
  GltfVerdict verdict;
  verdict.parts = TOOL_TRY(parts_of_gltf(input));
  TOOL_CHECK(decode_parts(options.common, verdict));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  if (verdict.all.damage.empty()) {
    // Accessors, too: counts and types that the files do not fit are found here.
    const LoadedMesh decoded = TOOL_TRY(load(input, options.common, progress));
    if (!options.original.empty()) TOOL_CHECK(hold_asset_against(options, decoded.mesh, progress, verdict));
  }
  if (options.common.json) {
    TOOL_CHECK(answer(dump(json_of(verdict, options))));
  } else if (!options.common.quiet) {
    TOOL_CHECK(answer(text_of(verdict, options)));
  }
  return verdict.all.exit_code();
}

}  // namespace maille::tool
