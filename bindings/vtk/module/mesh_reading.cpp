#include "mesh_reading.h"

#include <maille/executor.h>
#include <maille/http.h>
#include <maille/volume_file.h>

#include <map>
#include <mutex>

namespace maille_vtk {

using namespace maille;

Result<std::shared_ptr<const Source>> open(const std::string& name) {
  if (is_url(name)) {
    auto source = http_source(name);
    if (!source) return tl::unexpected(std::move(source).error());
    return std::shared_ptr<const Source>(std::move(*source));
  }
  auto source = file_source(name);
  if (!source) return tl::unexpected(std::move(source).error());
  return std::shared_ptr<const Source>(std::move(*source));
}

Executor* threads(unsigned count) {
  if (count == 1) return nullptr;
  static std::mutex* const lock = new std::mutex;
  static auto* const executors = new std::map<unsigned, std::unique_ptr<Executor>>;
  const std::lock_guard<std::mutex> guard(*lock);
  std::unique_ptr<Executor>& executor = (*executors)[count];
  if (!executor) executor = thread_executor(count);
  return executor.get();
}

namespace {

/// The parts whose middle is in the share of one process, with the parts laid one behind the other by their
/// numbers of cells. Each part goes to exactly one process, and shares are about equal.
template <class Part, class CellsOf>
Result<std::vector<Part>> share_of(const std::vector<Part>& parts, const Request& request, CellsOf cells_of) {
  std::vector<uint64_t> cells;
  uint64_t all = 0;
  for (const Part& part : parts) {
    const Result<uint64_t> count = cells_of(part);
    if (!count) return tl::unexpected(count.error());
    cells.push_back(*count);
    all += *count;
  }
  std::vector<Part> share;
  uint64_t before = 0;
  for (size_t i = 0; i < parts.size(); ++i) {
    // Parts without any cells all go to the first process.
    const double middle = (static_cast<double>(before) + static_cast<double>(cells[i]) / 2) /
                          static_cast<double>(std::max<uint64_t>(all, 1));
    const auto owner = std::min(static_cast<unsigned>(middle * request.pieces), request.pieces - 1);
    if (owner == request.piece) share.push_back(parts[i]);
    before += cells[i];
  }
  return share;
}

Region region_of(const Request& request) {
  Region region;
  region.box = request.box;
  return region;
}

Result<Answer> read_charts(const Source& source, const Request& request) {
  auto file = File::open(source, request.options);
  if (!file) return tl::unexpected(std::move(file).error());
  auto selection = file->select(region_of(request), request.detail);
  if (!selection) return tl::unexpected(std::move(selection).error());
  if (request.pieces > 1) {
    auto share = share_of(selection->charts, request, [&](const ChartPlace& place) -> Result<uint64_t> {
      return file->info(place).map([](const ChartInfo& chart) { return chart.faces; });
    });
    if (!share) return tl::unexpected(std::move(share).error());
    selection->charts = std::move(*share);
  }
  Answer answer;
  auto mesh = file->salvage(*selection, answer.problems);
  if (!mesh) return tl::unexpected(std::move(mesh).error());
  answer.mesh = request.box ? clip(*mesh, region_of(request)) : std::move(*mesh);
  return answer;
}

Result<Answer> read_pieces(const Source& source, const Request& request) {
  auto file = VolumeFile::open(source, request.options);
  if (!file) return tl::unexpected(std::move(file).error());
  VolumeQuery query;
  query.region = region_of(request);
  if (request.pieces > 1) {
    auto wanted = file->select(query);
    if (!wanted) return tl::unexpected(std::move(wanted).error());
    auto share = share_of(*wanted, request, [&](uint32_t piece) -> Result<uint64_t> {
      return file->info(piece).map([](const PieceInfo& info) { return info.cells; });
    });
    if (!share) return tl::unexpected(std::move(share).error());
    query.pieces = std::move(*share);
  }
  auto found = file->extract(query);
  if (!found) return tl::unexpected(std::move(found).error());
  return Answer{std::move(found->mesh), std::move(found->problems)};
}

}  // namespace

Result<Answer> read(const Source& source, const FileInfo& info, const Request& request) {
  if (request.is_whole()) {
    auto mesh = decode(source, request.options);
    if (!mesh) return tl::unexpected(std::move(mesh).error());
    return Answer{std::move(*mesh), {}};
  }
  if (info.mode == Mode::random) return read_charts(source, request);
  if (info.mode == Mode::stream) return read_pieces(source, request);
  // A file of mode single cannot be read in parts, so the first process has all of it.
  if (request.piece > 0) return Answer{};
  auto mesh = decode(source, request.options);
  if (!mesh) return tl::unexpected(std::move(mesh).error());
  return Answer{request.box ? clip(*mesh, region_of(request)) : std::move(*mesh), {}};
}

}  // namespace maille_vtk
