#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <peers/packers.h>

#include <algorithm>

#include "bench_report.h"
#include "files.h"
#include "result.h"
#include "text.h"
#include "verbs.h"

// The user's own mesh at all levels, beside other codecs: the same integers for all of them, as in bench/.
namespace maille::tool {

namespace {

using bench::Codec;
using bench::Peer;
using bench::Row;

// Levels for the whole file, unless some were chosen: one of each kind.
const std::vector<int> usual_levels = {2, 5, 9};

/// Codecs that were asked for.
struct Selection {
  std::vector<Peer> peers;
  std::vector<std::unique_ptr<Codec>> levels;
  std::vector<const Codec*> codecs;  ///< rows of the table
  std::vector<const Peer*> missing;

  bool has(const std::string& name) const {
    return std::any_of(codecs.begin(), codecs.end(), [&](const Codec* c) { return c->name() == name; });
  }
};

bool chosen(const std::string& name, const std::vector<std::string>& words) {
  return words.empty() || std::any_of(words.begin(), words.end(), [&](const std::string& word) {
           return name.find(word) != std::string::npos;
         });
}

Result<> check_words(const Selection& selection, const BenchOptions& options) {
  std::vector<std::string> names;
  for (const auto& level : selection.levels) names.push_back(level->name());
  for (const Peer& peer : selection.peers) names.push_back(peer.name);
  for (const std::string& word : options.codecs) {
    if (std::any_of(names.begin(), names.end(), [&](const auto& name) { return chosen(name, {word}); }))
      continue;
    return failure(ErrorCode::usage, fmt::format("--codec: nothing is called '{}'; there are {}", word,
                                                 fmt::join(names, ", ")));
  }
  if (!options.against.empty() && !selection.has(options.against)) {
    return failure(ErrorCode::usage,
                   fmt::format("--against: '{}' is not in the table; give the whole name of a codec that is",
                               options.against));
  }
  return {};
}

Result<Selection> select(const BenchOptions& options) {
  Selection selection;
  for (int level = 1; level <= 9; ++level) {
    if (!options.levels.empty() &&
        std::find(options.levels.begin(), options.levels.end(), level) == options.levels.end())
      continue;
    selection.levels.push_back(bench::maille_codec(level));
    if (chosen(selection.levels.back()->name(), options.codecs))
      selection.codecs.push_back(selection.levels.back().get());
  }
  selection.peers = bench::peers();
  for (const Peer& peer : selection.peers) {
    if (!chosen(peer.name, options.codecs)) continue;
    if (peer.codec) {
      selection.codecs.push_back(peer.codec.get());
    } else {
      selection.missing.push_back(&peer);
    }
  }
  TOOL_CHECK(check_words(selection, options));
  return selection;
}

/// Tells the display of what has been done, codec by codec.
class Steps {
 public:
  Steps(ProgressDisplay& display, size_t count) : watch_(display.watch(0, "")), count_(count) {}
  void done() {
    ++done_;
    if (watch_) watch_({"measuring", static_cast<double>(done_) / static_cast<double>(count_)});
  }

 private:
  Progress watch_;
  size_t count_, done_ = 0;
};

/// Times all codecs in rounds, one after the other, so that a machine that slows down meanwhile slows all of
/// them.
void measure(const std::vector<const Codec*>& codecs, const BenchOptions& options, Steps& steps,
             BenchReport& report) {
  std::vector<std::string> unable;
  for (const Codec* codec : codecs) {
    if (codec->takes(report.workload.bits)) {
      report.rows.push_back(first_run(*codec, report.workload));
    } else {
      unable.push_back(codec->name());
    }
    steps.done();
  }
  for (size_t round = 1; round < options.repeat; ++round) {
    time_round(report.rows, report.workload, {options.repeat, options.repeat});
    steps.done();
  }
  if (!unable.empty()) {
    report.notes.push_back(fmt::format("not for this precision: {}", fmt::join(unable, ", ")));
  }
}

/// The whole file by maille, decoded and compared within the benchmark. Times are those of the calling
/// thread, so other programs disturb them less.
PackedFile packed_by_maille(const Mesh& mesh, int level) {
  PackedFile packed{fmt::format("maille -{}", level), 0, 0, {}, {}};
  const auto fail = [&packed](const Error& error) {
    packed.problem = error.message;
    return packed;
  };
  EncodeOptions options;
  options.effort = level;
  std::vector<std::byte> bytes;
  const double start = bench::thread_seconds();
  const auto encoded = encode(mesh, *memory_sink(bytes), options);
  packed.seconds = bench::thread_seconds() - start;
  if (!encoded) return fail(encoded.error());
  packed.bytes = bytes.size();
  const auto decoded = decode(*memory_source(bytes));
  if (!decoded) return fail(decoded.error());
  packed.exact = compare(mesh, *decoded).equal;
  return packed;
}

PackedFile packed_by(const bench::Packer& packer, Bytes file) {
  const double start = bench::thread_seconds();
  const auto size = packer.packed_size(file);
  const double seconds = bench::thread_seconds() - start;
  if (!size) return {packer.name, 0, seconds, {}, size.error().message};
  return {packer.name, *size, seconds, {}, {}};
}

Result<std::vector<PackedFile>> pack(const Input& input, const Mesh& mesh, const BenchOptions& options,
                                     Steps& steps) {
  std::vector<PackedFile> rows;
  std::vector<std::byte> file(input.source->size());
  TOOL_CHECK(input.source->read_at(0, file));
  for (const bench::Packer& packer : bench::packers()) {
    if (chosen(packer.name, options.codecs)) rows.push_back(packed_by(packer, file));
    steps.done();
  }
  for (const int level : options.levels.empty() ? usual_levels : options.levels) {
    if (chosen(fmt::format("maille -{}", level), options.codecs))
      rows.push_back(packed_by_maille(mesh, level));
    steps.done();
  }
  return rows;
}

// The codec asked for, or the first peer that is in the table, or what is there.
std::string yardstick(const BenchOptions& options, const Selection& selection, int bits) {
  if (!options.against.empty()) return options.against;
  for (const Peer& peer : selection.peers) {
    if (peer.codec && peer.codec->takes(bits) && selection.has(peer.name)) return peer.name;
  }
  return selection.codecs.empty() ? "" : selection.codecs.front()->name();
}

Result<BenchReport> measured(const std::string& path, const BenchOptions& options,
                             const Selection& selection) {
  const Input input = TOOL_TRY(open_input(path, options.input_format));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const LoadedMesh loaded = TOOL_TRY(load(input, options.common, progress));
  const auto surface = bench::surface_of(loaded.mesh);
  if (!surface)
    return failure(surface.error().code, fmt::format("{}: {}", input_name(path), surface.error().message));

  BenchReport report;
  report.file = input_name(path);
  report.file_bytes = input.source->size();
  report.workload = make_workload(*surface, options.bits);
  report.missing = selection.missing;
  report.against = yardstick(options, selection, options.bits);
  if (loaded.mesh.points.type == Scalar::f64) report.notes.push_back("64-bit positions were rounded to 32");
  const size_t levels = options.levels.empty() ? usual_levels.size() : options.levels.size();
  const size_t packs = options.whole_file ? bench::packers().size() + levels : 0;
  Steps steps(progress, selection.codecs.size() + options.repeat - 1 + packs);
  measure(selection.codecs, options, steps, report);
  if (options.whole_file) report.packed = TOOL_TRY(pack(input, loaded.mesh, options, steps));
  progress.clear();
  return report;
}

}  // namespace

// A file that cannot be read does not keep the others from being measured.
Result<int> run(const BenchOptions& options) {
  const Selection selection = TOOL_TRY(select(options));
  int code = 0, tables = 0;
  Json all = Json::array();
  for (const std::string& path : options.inputs) {
    const auto report = measured(path, options, selection);
    if (!report) {
      complain(report.error().message);
      code = static_cast<int>(report.error().code);
      continue;
    }
    if (!report->good() && code == 0) code = static_cast<int>(ErrorCode::differs);
    if (options.common.json) {
      all.push_back(bench_json(*report));
    } else {
      TOOL_CHECK(answer((tables++ > 0 ? "\n" : "") + bench_text(*report)));
    }
  }
  if (options.common.json) TOOL_CHECK(answer(dump(all)));
  return code;
}

}  // namespace maille::tool
