// maille-mpi: what `maille compress --pieces`, decompress and verify do, by many processes.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <numeric>

#include <maille/mpi.h>
#include <maille/parts.h>
#include <maille/series.h>
#include <maille/volume_file.h>

#include "program.h"

namespace maille {

Result<> agree(Ranks& ranks, const Result<>& mine) {
  // The largest of these numbers belongs to the first rank that failed; 0 means that none did.
  std::vector<uint64_t> failing = {mine ? 0 : ranks.size() - ranks.rank()};
  ranks.largest(failing);
  if (failing[0] == 0) return {};
  const auto first = static_cast<unsigned>(ranks.size() - failing[0]);
  std::vector<std::byte> told;
  if (ranks.rank() == first) {
    const std::string text = std::to_string(static_cast<int>(mine.error().code)) + " " + mine.error().message;
    const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
    told.assign(bytes, bytes + text.size());
  }
  const auto all = ranks.exchange(std::vector(ranks.size(), told));
  const std::string text(reinterpret_cast<const char*>(all[first].data()), all[first].size());
  const size_t blank = text.find(' ');
  return failure(static_cast<ErrorCode>(std::stoi(text.substr(0, blank))), text.substr(blank + 1));
}

}  // namespace maille

namespace {

using namespace maille;

struct Options {
  std::vector<std::string> files;  ///< inputs, then the output
  int effort = 5;
  uint64_t pieces = cells_of_volume_piece;
  bool as_is = false, any_order = false, force = false, quiet = false;
  double error = 0;
  uint64_t step = 0;
  double time = 0;
};

/// What a rank has read.
struct OwnPart {
  Mesh mesh;
  bool shared = false;  ///< in all ranks alike: each has read its own parts
  std::vector<uint64_t> points, cells;
  std::vector<std::string> notes;
};

std::string shortest(double number) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, number).ptr};
}

std::vector<uint64_t> counted_from(uint64_t first, uint64_t count) {
  std::vector<uint64_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}

/// Whole numbers as they are; none where there is no such array, or other values.
std::vector<uint64_t> numbers_of(const Mesh& mesh, const char* name, Domain domain) {
  const Array* const array = mesh.find(name, domain);
  if (array == nullptr || array->components != 1) return {};
  std::vector<uint64_t> numbers;
  const auto take = [&](auto zero) {
    for (const auto number : array->values<decltype(zero)>())
      numbers.push_back(static_cast<uint64_t>(number));
  };
  if (array->type == Scalar::i64) take(int64_t{});
  if (array->type == Scalar::u64) take(uint64_t{});
  if (array->type == Scalar::i32) take(int32_t{});
  if (array->type == Scalar::u32) take(uint32_t{});
  return numbers;
}

/// What is read: parts of one mesh, or a file, or one step of it.
struct Inputs {
  std::vector<std::string> paths;
  std::optional<SeriesEntry> step = {};
};

/// The step of a series that has this time; other inputs as they are.
Result<Inputs> at_time(const std::vector<std::string>& paths, double time) {
  if (paths.size() != 1 || !may_be_series(paths[0])) return Inputs{paths};
  const Result<std::vector<SeriesEntry>> series = read_series(paths[0]);
  if (!series) return tl::unexpected(series.error());
  if (series->empty()) return Inputs{paths};
  std::string times;
  for (const SeriesEntry& entry : *series) {
    if (entry.time == time && entry.step) return Inputs{{entry.path}, entry};
    if (entry.time == time) return Inputs{{entry.path}};
    times += (times.empty() ? "" : ", ") + shortest(entry.time);
  }
  return failure(ErrorCode::usage,
                 paths[0] + ": has no step of time " + shortest(time) + "; it has " + times);
}

/// The first rank reads everything.
Result<OwnPart> read_alone(const Inputs& inputs, Ranks& ranks) {
  OwnPart own;
  if (ranks.rank() != 0) return own;
  Result<ReadResult> read = inputs.step                ? read_series_entry(*inputs.step)
                            : inputs.paths.size() == 1 ? read_mesh(inputs.paths[0])
                                                       : read_parts(inputs.paths);
  if (!read) return tl::unexpected(read.error());
  own.mesh = std::move(read->mesh);
  own.notes = std::move(read->notes);
  own.points = counted_from(0, own.mesh.point_count());
  own.cells = counted_from(0, own.mesh.cell_count());
  return own;
}

/// Whether all ranks say so.
bool all_agree(Ranks& ranks, bool mine) {
  std::vector<uint64_t> against = {mine ? 0u : 1u};
  ranks.largest(against);
  return against[0] == 0;
}

std::vector<uint64_t> numbers_in(const std::vector<std::byte>& bytes) {
  std::vector<uint64_t> numbers(bytes.size() / sizeof(uint64_t));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), bytes.size());
  return numbers;
}

/// Sends each key to the rank that looks after it; those that came here.
std::vector<uint64_t> distributed(const std::vector<uint64_t>& keys, Ranks& ranks) {
  std::vector<std::vector<std::byte>> to(ranks.size());
  for (const uint64_t key : keys) {
    const auto* const bytes = reinterpret_cast<const std::byte*>(&key);
    std::vector<std::byte>& list = to[key % ranks.size()];
    list.insert(list.end(), bytes, bytes + sizeof key);
  }
  std::vector<uint64_t> all;
  for (const std::vector<std::byte>& bytes : ranks.exchange(std::move(to))) {
    const std::vector<uint64_t> numbers = numbers_in(bytes);
    all.insert(all.end(), numbers.begin(), numbers.end());
  }
  return all;
}

/// Whether each ghost cell of a rank is a cell of some rank.
bool ghosts_have_owners(const CellKeys& cells, Ranks& ranks) {
  std::vector<uint64_t> owners = distributed(cells.own, ranks);
  const std::vector<uint64_t> ghosts = distributed(cells.ghosts, ranks);
  std::sort(owners.begin(), owners.end());
  return all_agree(ranks, std::all_of(ghosts.begin(), ghosts.end(), [&](uint64_t ghost) {
                     return std::binary_search(owners.begin(), owners.end(), ghost);
                   }));
}

/// Each rank reads its share of the parts, if these number their points; else the first one reads all.
Result<OwnPart> read_shares(const std::vector<std::string>& parts, const Inputs& inputs, Ranks& ranks) {
  // The shares are as even as possible and leave no part out: the end of one rank's share is where the next
  // begins.
  const size_t first = parts.size() * ranks.rank() / ranks.size();
  const size_t end = parts.size() * (ranks.rank() + 1) / ranks.size();
  CellKeys cells;
  Result<ReadResult> read = read_parts(std::span(parts).subspan(first, end - first), {}, &cells);
  OwnPart own;
  own.shared = true;
  bool has_points = false, has_cells = false;
  if (read) {
    own.mesh = std::move(read->mesh);
    own.notes = std::move(read->notes);
    own.points = numbers_of(own.mesh, "GlobalPointIds", Domain::point);
    own.cells = numbers_of(own.mesh, "GlobalCellIds", Domain::cell);
    has_points = own.points.size() == own.mesh.point_count() && own.mesh.blocks.size() <= 1;
    has_cells = own.cells.size() == own.mesh.cell_count();
  }
  // Without global numbers the points that parts share cannot be joined by each rank for itself.
  // Nor does a rank know which cell has no owner: who reads all parts says it.
  if (!all_agree(ranks, has_points) || !ghosts_have_owners(cells, ranks)) return read_alone(inputs, ranks);
  const bool numbered = all_agree(ranks, has_cells);
  std::vector<uint64_t> counts(ranks.size());
  counts[ranks.rank()] = own.mesh.cell_count();
  ranks.add(counts);
  const uint64_t before = std::accumulate(counts.begin(), counts.begin() + ranks.rank(), uint64_t{0});
  // Cells belong to one part each, so their numbers may simply follow the order of the parts.
  if (!numbered) own.cells = counted_from(before, own.mesh.cell_count());
  return own;
}

Result<OwnPart> read_inputs(const Inputs& inputs, Ranks& ranks) {
  if (inputs.step) return read_alone(inputs, ranks);
  if (inputs.paths.size() > 1) return read_shares(inputs.paths, inputs, ranks);
  Result<std::vector<std::string>> parts = parts_of_mesh(inputs.paths[0]);
  if (!parts) return tl::unexpected(parts.error());
  return parts->empty() ? read_alone(inputs, ranks) : read_shares(*parts, inputs, ranks);
}

/// The same error in all ranks. `alone`: by the first rank.
Result<OwnPart> read_all(const Inputs& inputs, const Options& options, bool alone, Ranks& ranks) {
  Result<OwnPart> own = alone ? read_alone(inputs, ranks) : read_inputs(inputs, ranks);
  if (auto all = agree(ranks, own ? Result<>() : Result<>(tl::unexpected(own.error()))); !all)
    return tl::unexpected(all.error());
  for (const std::string& note : own->notes) {
    if (!options.quiet) std::fprintf(stderr, "maille-mpi: %s\n", note.c_str());
  }
  return own;
}

/// What `write` makes of the parts. Parts that contradict each other (values of a point, a cell in two of
/// them, arrays) are read again by the first rank: it joins them, and tells how, or says better what is wrong
/// with them.
template <class Write>
auto written(const Inputs& inputs, const Options& options, Ranks& ranks, const Write& write)
    -> decltype(write(RankPart())) {
  for (bool alone = false;; alone = true) {
    const Result<OwnPart> own = read_all(inputs, options, alone, ranks);
    if (!own) return tl::unexpected(own.error());
    auto report = write({&own->mesh, own->points, own->cells});
    const bool again = !report && own->shared && report.error().code == ErrorCode::malformed_input;
    if (!again || options.as_is) return report;
    if (ranks.rank() == 0 && !options.quiet)
      std::fprintf(stderr, "maille-mpi: note: the first rank reads all parts: %s\n",
                   report.error().message.c_str());
  }
}

Result<> append(const Options& options, MPI_Comm communicator) {
  const std::unique_ptr<Ranks> ranks = mpi::ranks(communicator);
  const auto write = [&](const RankPart& part) {
    return mpi::append_step(communicator, options.files.front(), options.time, part);
  };
  const Result<Inputs> inputs = at_time({options.files.begin() + 1, options.files.end()}, options.time);
  if (auto all = agree(*ranks, inputs ? Result<>() : Result<>(tl::unexpected(inputs.error()))); !all)
    return all;
  const auto report = written(*inputs, options, *ranks, write);
  if (!report) return tl::unexpected(report.error());
  if (ranks->rank() == 0 && !options.quiet) {
    std::printf("%s: step %llu at time %g; %llu bytes, by %u ranks\n", options.files.front().c_str(),
                static_cast<unsigned long long>(report->number), options.time,
                static_cast<unsigned long long>(report->file_bytes), ranks->size());
  }
  return {};
}

/// Of a file with several times one was taken: how the others get into the same file.
void note_other_times(const std::vector<std::string>& inputs, const std::string& output) {
  if (inputs.size() != 1 || !may_be_series(inputs[0])) return;
  const Result<std::vector<SeriesEntry>> series = read_series(inputs[0]);
  if (!series || series->size() < 2) return;
  std::fprintf(stderr,
               "maille-mpi: note: %s has %zu times, one of which was taken; `maille-mpi append --time T %s "
               "%s` adds each of the others\n",
               inputs[0].c_str(), series->size(), output.c_str(), inputs[0].c_str());
}

/// Who forgets the output would else lose the last input.
Result<> check_output(const Options& options, Ranks& ranks) {
  const std::string& path = options.files.back();
  std::error_code error;
  const bool is_there = ranks.rank() == 0 && !options.force && std::filesystem::exists(path, error);
  return agree(
      ranks, is_there ? failure(ErrorCode::usage, path + ": exists already; -f overwrites it") : Result<>());
}

Result<> compress(const Options& options, MPI_Comm communicator) {
  const std::unique_ptr<Ranks> ranks = mpi::ranks(communicator);
  if (auto all = check_output(options, *ranks); !all) return all;
  EncodeOptions encoding;
  encoding.mode = Mode::stream;
  encoding.effort = options.effort;
  encoding.order = options.any_order ? Order::canonical : Order::keep;
  if (options.error > 0) encoding.positions = {Tolerance::Kind::absolute, options.error};
  const auto write = [&](const RankPart& part) {
    return mpi::encode(communicator, part, options.files.back(), encoding,
                       {.cells_per_piece = options.pieces, .as_is = options.as_is});
  };
  const std::vector<std::string> inputs(options.files.begin(), options.files.end() - 1);
  const auto report = written({inputs}, options, *ranks, write);
  if (!report) return tl::unexpected(report.error());
  if (ranks->rank() == 0 && !options.quiet) note_other_times(inputs, options.files.back());
  if (ranks->rank() == 0 && !options.quiet) {
    std::printf("%s: %llu points, %llu cells; %llu bytes, by %u ranks\n", options.files.back().c_str(),
                static_cast<unsigned long long>(report->points),
                static_cast<unsigned long long>(report->cells),
                static_cast<unsigned long long>(report->file_bytes), ranks->size());
  }
  return {};
}

/// Decodes the pieces of a rank; its cells.
Result<uint64_t> count_cells(const std::string& path, const Ranks& ranks, uint64_t& expected) {
  Result<std::unique_ptr<Source>> source = file_source(path);
  if (!source) return tl::unexpected(source.error());
  Result<VolumeFile> file = VolumeFile::open(**source);
  if (!file) return tl::unexpected(file.error());
  expected = file->cells();
  // One piece after the other: a rank needs memory for one.
  uint64_t cells = 0;
  const uint64_t pieces = file->pieces();
  for (uint64_t p = pieces * ranks.rank() / ranks.size(); p < pieces * (ranks.rank() + 1) / ranks.size();
       ++p) {
    VolumeQuery query;
    query.pieces = std::vector<uint32_t>{static_cast<uint32_t>(p)};
    const Result<ExtractedVolume> found = file->extract(query);
    if (!found) return tl::unexpected(found.error());
    if (!found->problems.empty()) return failure(ErrorCode::corrupt, found->problems[0]);
    cells += found->cells_read;
  }
  return cells;
}

Result<> verify(const Options& options, MPI_Comm communicator) {
  const std::unique_ptr<Ranks> ranks = mpi::ranks(communicator);
  const std::string& path = options.files[0];
  uint64_t expected = 0;
  const Result<uint64_t> cells = count_cells(path, *ranks, expected);
  if (auto all = agree(*ranks, cells ? Result<>() : Result<>(tl::unexpected(cells.error()))); !all)
    return all;
  std::vector<uint64_t> sum = {*cells};
  ranks->add(sum);
  if (sum[0] != expected)
    return failure(ErrorCode::corrupt, path + ": its pieces have " + std::to_string(sum[0]) + " cells, not " +
                                           std::to_string(expected));
  if (ranks->rank() == 0 && !options.quiet)
    std::printf("%s: %llu cells are all there\n", path.c_str(), static_cast<unsigned long long>(sum[0]));
  return {};
}

/// Only calls that are safe in a signal handler. MPI_Abort() is not one of them; mpirun ends the other ranks.
extern "C" void stop(int signal) {
  mpi::remove_unfinished_file();
  std::_Exit(128 + signal);
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("maille for the ranks of a cluster: mpirun -n 8 maille-mpi compress flow.pvtu flow.maille");
  app.require_subcommand(1);
  CLI::App& compressing = *app.add_subcommand(
      "compress",
      "One file in pieces, the same for any number of ranks. Several inputs are parts of one mesh "
      "(VTU); parts with GlobalPointIds are read by all ranks, anything else by the first one.");
  compressing.add_option("files", options.files, "INPUT... OUTPUT")->required()->expected(2, 1 << 20);
  compressing.add_option("--effort", options.effort, "1 (fast) to 9 (small)")->check(CLI::Range(1, 9));
  compressing.add_option("--pieces", options.pieces, "cells of a piece, about")->check(CLI::PositiveNumber);
  compressing.add_option("-e,--error", options.error, "largest error of positions")
      ->check(CLI::PositiveNumber);
  compressing.add_flag("--as-is", options.as_is, "the part of each rank is a piece");
  compressing.add_flag("--any-order", options.any_order, "the order of points and cells may change");
  compressing.add_flag("-f,--force", options.force, "overwrite OUTPUT if it exists");
  compressing.add_flag("-q,--quiet", options.quiet, "errors only");
  CLI::App& appending =
      *app.add_subcommand("append",
                          "A step of time behind a file in pieces: the parts of the mesh with the values of "
                          "that time, or a series "
                          "of steps (.pvd, VTKHDF, Exodus, a case of OpenFOAM) that has one of that time.");
  appending.add_option("files", options.files, "FILE INPUT...")->required()->expected(2, 1 << 20);
  appending.add_option("--time", options.time, "the time of the step")->required();
  appending.add_flag("-q,--quiet", options.quiet, "errors only");
  CLI::App& decompressing = *app.add_subcommand(
      "decompress",
      "A .pvtu, and a .vtu beside it for each rank: its share of the pieces, with the numbers of points and "
      "cells in the whole mesh.");
  decompressing.add_option("files", options.files, "FILE OUT.pvtu")->required()->expected(2);
  decompressing.add_flag("-f,--force", options.force, "overwrite OUT.pvtu if it exists");
  decompressing.add_option("--step", options.step, "a step of time; 0 (default): the mesh");
  CLI::App& verifying = *app.add_subcommand("verify", "Decodes all pieces, each by one rank.");
  verifying.add_option("file", options.files, "FILE")->required()->expected(1);
  verifying.add_flag("-q,--quiet", options.quiet, "errors only");
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Only the first rank prints, otherwise the help would appear once for each rank.
    const int code = rank == 0 ? app.exit(error) : error.get_exit_code();
    return code == 0 ? 0 : static_cast<int>(ErrorCode::usage);
  }
  const auto decompress = [&]() -> Result<> {
    const std::unique_ptr<Ranks> ranks = mpi::ranks(MPI_COMM_WORLD);
    if (auto all = check_output(options, *ranks); !all) return all;
    return decompress_shares(options.files[0], options.files[1], options.step, *ranks);
  };
  const Result<> done = compressing.parsed()     ? compress(options, MPI_COMM_WORLD)
                        : appending.parsed()     ? append(options, MPI_COMM_WORLD)
                        : decompressing.parsed() ? decompress()
                                                 : verify(options, MPI_COMM_WORLD);
  if (done) return 0;
  if (rank == 0) std::fprintf(stderr, "maille-mpi: %s\n", done.error().message.c_str());
  return static_cast<int>(done.error().code);
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, stop);
  const int code = run(argc, argv);
  MPI_Finalize();
  return code;
}
