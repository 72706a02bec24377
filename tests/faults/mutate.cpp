// Damages files and asks everything of them: every answer must be an error of a fitting kind or a valid mesh;
// where the checksums are not mended, the right one; in bounded memory. mutate [--seconds S] COUNT [FIRST],
// COUNT of damaged files for each mode and six times as many for the readers, in S seconds of a processor at
// most; mutate --flips COUNT [FIRST], COUNT files of all modes with one to three wrong bits, which are
// decoded alone. The last lines are a table for docs/reliability.md; its questions are what fuzzers call
// executions.

#include <maille/file.h>
#include <maille/io.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <map>

#include "faults/counting_memory.h"
#include "faults/entry_points.h"
#include "faults/mutations.h"
#include "faults/seeds.h"
#include "support/codec.h"
#include "support/data.h"
#include "support/files.h"
#include "support/random_mesh.h"
#include "support/sample_mesh.h"

namespace maille::testing {
namespace {

constexpr Limits limits{uint64_t{64} << 20};
/// What may be allocated beyond the limit.
constexpr uint64_t slack = uint64_t{8} << 20;
/// A reader is asked one question, a decoder six to nine: so all get about as many.
constexpr uint64_t foreign_each = 6;

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Counts {
  uint64_t files = 0, mended = 0;
  uint64_t intact = 0, other = 0, error = 0, over_limit = 0, wrong = 0;
  uint64_t most_memory = 0;
  double most_seconds = 0;
  double dearest_byte = 0, intact_byte = 0;  ///< seconds for each byte of a file, at most

  uint64_t questions() const { return intact + other + error + over_limit; }
};

/// Each answer of one file, counted.
class Run {
 public:
  /// group: of one mode or of readers, whose files are numbered together.
  Run(std::string group, std::string name, uint64_t number)
      : group_(std::move(group)), name_(std::move(name)), number_(number) {}

  void finding(Counts& counts, const std::string& what, const std::vector<std::byte>& file) const {
    ++counts.wrong;
    const std::string path = "found-" + group_ + "-" + std::to_string(number_);
    write_bytes(path, file);
    std::printf("%s, number %llu (%s): %s\n", name_.c_str(), static_cast<unsigned long long>(number_),
                path.c_str(), what.c_str());
    std::fflush(stdout);
  }

 private:
  std::string group_, name_;
  uint64_t number_;
};

void count_answers(const std::vector<Answer>& answers, const Seed& seed, const Mutation& damaged,
                   const Run& run, Counts& counts) {
  for (const Answer& answer : answers) {
    if (const std::string fault = fault_of(answer); !fault.empty()) run.finding(counts, fault, damaged.bytes);
    if (answer.error) {
      ++(answer.error->code == ErrorCode::memory_bound ? counts.over_limit : counts.error);
      continue;
    }
    const bool same = answer.may_be_part || differences_between(seed.mesh, *answer.mesh, true).empty();
    ++(same ? counts.intact : counts.other);
    if (!same && !damaged.mended)
      run.finding(counts, answer.asked + ": another mesh, and no word", damaged.bytes);
  }
}

/// Calls work() and looks at what it took.
template <class Work>
void measured(Counts& counts, const Run& run, const std::vector<std::byte>& file, Work work) {
  const uint64_t before = memory().live;
  watch_memory();
  const double start = processor_seconds();
  try {
    work();
  } catch (const std::exception& thrown) {
    run.finding(counts, std::string("thrown: ") + thrown.what(), file);
  }
  const double seconds = processor_seconds() - start;
  counts.most_seconds = std::max(counts.most_seconds, seconds);
  counts.dearest_byte =
      std::max(counts.dearest_byte, seconds / static_cast<double>(std::max<size_t>(file.size(), 1)));
  const uint64_t taken = memory().most - before;
  counts.most_memory = std::max(counts.most_memory, taken);
  if (taken > limits.mesh_bytes + slack)
    run.finding(counts, "takes " + std::to_string(taken >> 20) + " MiB", file);
}

/// What a byte of the dearest intact file takes: the least of three times, as other programs run beside.
double dearest_of(const std::vector<const Seed*>& seeds) {
  double dearest = 0;
  for (const Seed* seed : seeds) {
    double least = 1e9;
    for (int time = 0; time < 3; ++time) {
      const double start = processor_seconds();
      ask_everything(seed->bytes, limits);
      least = std::min(least, processor_seconds() - start);
    }
    dearest = std::max(dearest, least / static_cast<double>(seed->bytes.size()));
  }
  return dearest;
}

/// Files of one mode, damaged one by one.
class DamagedMode {
 public:
  DamagedMode(Mode mode, std::string name, const std::vector<Seed>& all, Counts& counts)
      : mode_(mode), name_(std::move(name)), all_(all), counts_(counts) {
    for (const Seed& seed : all) {
      if (seed.mode == mode) seeds_.push_back(&seed);
    }
    counts_.intact_byte = dearest_of(seeds_);
  }

  void ask(uint64_t number) const {
    Random random(number * 4 + static_cast<uint64_t>(mode_));
    const Seed& seed = *seeds_[random.below(seeds_.size())];
    const Mutation damaged = mutated(seed, all_, random);
    ++counts_.files;
    counts_.mended += damaged.mended ? 1 : 0;
    const Run run(name_, seed.name, number);
    std::vector<Answer> answers;
    measured(counts_, run, damaged.bytes, [&] { answers = ask_everything(damaged.bytes, limits); });
    count_answers(answers, seed, damaged, run, counts_);
  }

 private:
  Mode mode_;
  std::string name_;
  const std::vector<Seed>& all_;
  Counts& counts_;
  std::vector<const Seed*> seeds_;
};

struct ForeignFile {
  std::string name;
  std::vector<std::byte> bytes;
};

/// The sample in every format that is written, and the files of tests/formats that other programs wrote.
/// Those that a child process reads (HDF5) have fuzzing of their own.
std::vector<ForeignFile> foreign_files() {
  std::vector<ForeignFile> files;
  const auto add = [&](const std::string& name, std::vector<std::byte> bytes) {
    if (!name.ends_with(".vtkhdf") && !bytes.empty() && bytes.size() < 100000)
      files.push_back({name, std::move(bytes)});
  };
  for (const FormatInfo& format : formats()) {
    for (const bool ascii : {false, true}) {
      std::vector<std::byte> bytes;
      const auto sink = memory_sink(bytes);
      WriteOptions options;
      options.format = format.name;
      options.ascii = ascii;
      RandomMeshOptions plain;
      plain.faces = 30;
      plain.pathologies = plain.special_values = false;
      const Mesh mesh = random_surface(3, plain);
      if (format.writable && write_mesh(mesh, *sink, options)) add("x" + format.extensions[0], bytes);
      bytes.clear();
      if (format.writable && write_mesh(sample_mesh(), *sink, options))
        add("x" + format.extensions[0], bytes);
    }
  }
  const auto place = std::filesystem::path(sample_path("x")).parent_path();
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(place)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const auto& path : paths) {
    if (std::filesystem::is_regular_file(path)) add(path.filename().string(), read_bytes(path));
  }
  return files;
}

void damage_foreign(const std::vector<ForeignFile>& files, uint64_t number, Counts& counts) {
  Random random(number * 4 + 3);
  const ForeignFile& file = files[random.below(files.size())];
  const std::vector<std::byte> damaged =
      mutated_text(file.bytes, files[random.below(files.size())].bytes, random);
  ++counts.files;
  const Run run("readers", file.name, number);
  measured(counts, run, damaged, [&] {
    ReadOptions options;
    options.limits = limits;
    const auto read = read_mesh(*memory_source(Bytes(damaged), file.name), options);
    if (!read) {
      ++(read.error().code == ErrorCode::memory_bound ? counts.over_limit : counts.error);
      if (read.error().message.empty()) run.finding(counts, "an error without a word", damaged);
      return;
    }
    ++counts.other;
    if (const auto valid = validate(read->mesh); !valid)
      run.finding(counts, "not valid: " + valid.error().message, damaged);
  });
}

/// What was found before: tests/corrupt.
void ask_known(Counts& counts) {
  for (const char* folder : {"maille", "pieces"}) {
    const std::filesystem::path place = std::filesystem::path(tests_folder()) / "corrupt" / folder;
    for (const auto& entry : std::filesystem::directory_iterator(place)) {
      if (entry.path().extension() != ".maille") continue;
      const std::vector<std::byte> file = read_bytes(entry.path());
      const Run run("before", entry.path().filename().string(), counts.files++);
      std::vector<Answer> answers;
      measured(counts, run, file, [&] { answers = ask_everything(file, limits); });
      for (const Answer& answer : answers) {
        ++(answer.error ? counts.error : counts.other);
        if (const std::string fault = fault_of(answer); !fault.empty()) run.finding(counts, fault, file);
      }
    }
  }
}

/// Wrong bits, as from storage that fails: each file must end in an error, or still give its own mesh.
int flip(uint64_t count, uint64_t first) {
  const std::vector<Seed> seeds = maille_seeds();
  Counts counts;
  for (uint64_t number = first; number < first + count; ++number) {
    Random random(number);
    const Seed& seed = seeds[random.below(seeds.size())];
    std::vector<std::byte> damaged = seed.bytes;
    for (uint64_t times = 1 + random.below(3); times > 0; --times)
      damaged[random.below(damaged.size())] ^= static_cast<std::byte>(1u << random.below(8));
    ++counts.files;
    const auto mesh = decode(*memory_source(Bytes(damaged)));
    const bool same = mesh && differences_between(seed.mesh, *mesh, true).empty();
    ++(!mesh ? counts.error : same ? counts.intact : counts.other);
    if (mesh && !same) Run("flips", seed.name, number).finding(counts, "another mesh, and no word", damaged);
  }
  std::printf("| flipped files | error | the same mesh | another mesh |\n|---|---|---|---|\n");
  std::printf("| %llu | %llu | %llu | %llu |\n", static_cast<unsigned long long>(counts.files),
              static_cast<unsigned long long>(counts.error), static_cast<unsigned long long>(counts.intact),
              static_cast<unsigned long long>(counts.other));
  return counts.wrong == 0 ? 0 : 1;
}

/// The table; its answer is the number of findings.
uint64_t print_table(const std::map<std::string, Counts>& all) {
  uint64_t wrong = 0;
  std::printf(
      "| | files | checksums mended | questions | answers: the same or a part | another mesh | error "
      "| over the limit | findings | most memory, MiB | longest, s | us a byte, at most | of intact files "
      "|\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [name, counts] : all) {
    std::printf(
        "| %s | %llu | %llu | %llu | %llu | %llu | %llu | %llu | %llu | %.1f | %.3f | %.1f | %.1f |\n",
        name.c_str(), static_cast<unsigned long long>(counts.files),
        static_cast<unsigned long long>(counts.mended), static_cast<unsigned long long>(counts.questions()),
        static_cast<unsigned long long>(counts.intact), static_cast<unsigned long long>(counts.other),
        static_cast<unsigned long long>(counts.error), static_cast<unsigned long long>(counts.over_limit),
        static_cast<unsigned long long>(counts.wrong), static_cast<double>(counts.most_memory) / 1048576,
        counts.most_seconds, 1e6 * counts.dearest_byte, 1e6 * counts.intact_byte);
    wrong += counts.wrong;
  }
  return wrong;
}

/// Modes and readers take turns, so that a run which is stopped by the clock has as many files of each.
int run(uint64_t count, uint64_t first, double seconds) {
  const std::vector<Seed> seeds = maille_seeds();
  const std::vector<ForeignFile> foreign = foreign_files();
  std::map<std::string, Counts> all;
  ask_known(all["found before"]);
  const std::array<DamagedMode, 3> modes = {DamagedMode(Mode::single, "single", seeds, all["single"]),
                                            DamagedMode(Mode::stream, "stream", seeds, all["stream"]),
                                            DamagedMode(Mode::random, "random", seeds, all["random"])};
  const double start = processor_seconds();
  for (uint64_t number = first; number < first + count && processor_seconds() - start < seconds; ++number) {
    for (const DamagedMode& mode : modes) mode.ask(number);
    for (uint64_t turn = 0; turn < foreign_each; ++turn)
      damage_foreign(foreign, number * foreign_each + turn, all["readers"]);
  }
  return print_table(all) == 0 ? 0 : 1;
}

}  // namespace
}  // namespace maille::testing

int main(int count, char** arguments) {
  bool flips = false;
  double seconds = 1e9;
  std::vector<uint64_t> numbers;
  for (int i = 1; i < count; ++i) {
    if (std::strcmp(arguments[i], "--flips") == 0) {
      flips = true;
    } else if (std::strcmp(arguments[i], "--seconds") == 0 && i + 1 < count) {
      seconds = std::strtod(arguments[++i], nullptr);
    } else {
      numbers.push_back(std::strtoull(arguments[i], nullptr, 10));
    }
  }
  const uint64_t files = !numbers.empty() ? numbers[0] : 1000;
  const uint64_t first = numbers.size() > 1 ? numbers[1] : 0;
  return flips ? maille::testing::flip(files, first) : maille::testing::run(files, first, seconds);
}
