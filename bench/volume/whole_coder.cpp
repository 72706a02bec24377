#include "whole_coder.h"

#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/io.h>
#include <maille/out_of_core.h>
#include <stdlib.h>
#include <time.h>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>

namespace maille::bench {
namespace {

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Keeps the shortest time.
class Stopwatch {
 public:
  Stopwatch(double& wall, double& cpu) : wall_(wall), cpu_(cpu) {}
  ~Stopwatch() {
    keep(wall_, seconds_of(CLOCK_MONOTONIC) - wall_begin_);
    keep(cpu_, seconds_of(CLOCK_PROCESS_CPUTIME_ID) - cpu_begin_);
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  static void keep(double& least, double time) { least = least == 0 ? time : std::min(least, time); }
  double& wall_;
  double& cpu_;
  double wall_begin_ = seconds_of(CLOCK_MONOTONIC), cpu_begin_ = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
};

/// Cells in a piece of the rows "pieces": 16 of them in the pipe of a million, so that two threads have the
/// same work.
constexpr uint64_t cells_in_piece = 65'536;

EncodeOptions options_with(Executor& executor) {
  EncodeOptions options;
  options.mode = Mode::stream;
  options.effort = 5;
  options.order = Order::keep;
  options.executor = &executor;
  return options;
}

void take(WholeCoder& row, const tl::expected<void, Error>& done) {
  if (!done) row.verdict = "failed: " + done.error().message;
}

void check(WholeCoder& row, const Mesh& mesh, const Mesh& back) {
  const Comparison same = compare(mesh, back, {.same_order = true});
  if (!same.equal) row.verdict = "differs: " + (same.differences.empty() ? "" : same.differences[0]);
}

WholeCoder in_memory(const Mesh& mesh, unsigned threads, unsigned rounds,
                     std::optional<uint64_t> cells_per_part = std::nullopt) {
  WholeCoder row{.from = cells_per_part ? "memory, pieces" : "memory", .threads = threads};
  const auto executor = thread_executor(threads);
  EncodeOptions encoding = options_with(*executor);
  encoding.most_cells_per_part = cells_per_part;
  for (unsigned round = 0; round < rounds && row.verdict == "exact"; ++round) {
    std::vector<std::byte> bytes;
    {
      const Stopwatch watch(row.encode_seconds, row.encode_cpu_seconds);
      const auto report = encode(mesh, *memory_sink(bytes), encoding);
      if (!report) row.verdict = "failed: " + report.error().message;
    }
    const auto source = memory_source(std::move(bytes));
    Result<Mesh> back;
    {
      const Stopwatch watch(row.decode_seconds, row.decode_cpu_seconds);
      DecodeOptions options;
      options.executor = executor.get();
      back = decode(*source, options);
    }
    if (!back) row.verdict = "failed: " + back.error().message;
    if (back && round == 0) check(row, mesh, *back);
  }
  return row;
}

Result<> write_vtu(const Mesh& mesh, const std::string& path) {
  auto sink = file_sink(path);
  if (!sink) return tl::unexpected(sink.error());
  const auto written = write_mesh(mesh, **sink, {});
  if (!written) return tl::unexpected(written.error());
  return (*sink)->commit();
}

Result<> compress(const std::string& from, const std::string& to, Executor& executor) {
  const auto source = unmapped_source(from);
  if (!source) return tl::unexpected(source.error());
  const auto mesh = open_mesh_source(**source);
  if (!mesh) return tl::unexpected(mesh.error());
  const auto sink = file_sink(to);
  if (!sink) return tl::unexpected(sink.error());
  const auto report = encode(**mesh, **sink, options_with(executor));
  if (!report) return tl::unexpected(report.error());
  return {};
}

Result<> decompress(const std::string& from, const std::string& to, Executor& executor) {
  const auto source = unmapped_source(from);
  if (!source) return tl::unexpected(source.error());
  const auto description = describe(**source);
  if (!description) return tl::unexpected(description.error());
  const auto sink = vtu_sink(to, *description);
  if (!sink) return tl::unexpected(sink.error());
  DecodeOptions options;
  options.executor = &executor;
  return decode(**source, **sink, options);
}

WholeCoder from_file_to_file(const Mesh& mesh, unsigned threads, unsigned rounds) {
  WholeCoder row{.from = "VTU", .threads = threads};
  std::string folder = (std::filesystem::temp_directory_path() / "maille-bench-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) {
    row.verdict = "failed: no folder for temporary files";
    return row;
  }
  const std::string vtu = folder + "/mesh.vtu", packed = folder + "/mesh.maille", back = folder + "/back.vtu";
  const auto executor = thread_executor(threads);
  take(row, write_vtu(mesh, vtu));
  for (unsigned round = 0; round < rounds && row.verdict == "exact"; ++round) {
    {
      const Stopwatch watch(row.encode_seconds, row.encode_cpu_seconds);
      take(row, compress(vtu, packed, *executor));
    }
    const Stopwatch watch(row.decode_seconds, row.decode_cpu_seconds);
    take(row, decompress(packed, back, *executor));
  }
  const auto read = read_mesh(back);
  if (read) check(row, mesh, read->mesh);
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return row;
}

}  // namespace

std::vector<WholeCoder> measure_whole_coder(const Mesh& mesh, unsigned rounds) {
  return {in_memory(mesh, 1, rounds), in_memory(mesh, 2, rounds), in_memory(mesh, 1, rounds, cells_in_piece),
          in_memory(mesh, 2, rounds, cells_in_piece), from_file_to_file(mesh, 2, rounds)};
}

}  // namespace maille::bench
