#include "batch.h"

#include <maille/path.h>

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "files.h"
#include "in_parts.h"
#include "result.h"
#include "text.h"

namespace maille::tool {

namespace fs = std::filesystem;

void take_inputs(Batch& batch, std::string& input, std::string& output,
                 const std::function<bool(const std::string& path)>& is_input) {
  const bool several = !batch.inputs.empty() || !batch.output_folder.empty() || batch.recursive;
  if (!several && (output.empty() || !is_input(output))) return;
  std::vector<std::string> all = {input};
  if (!output.empty()) all.push_back(output);
  batch.inputs.insert(batch.inputs.begin(), all.begin(), all.end());
  output.clear();
}

namespace {

/// A case of OpenFOAM is one mesh, though it is a folder of many files.
bool is_case(const fs::path& folder) {
  std::error_code error;
  return fs::is_directory(folder / "constant/polyMesh", error);
}

/// A folder without slashes at its end, so that it has a name.
std::string without_slashes(const std::string& given) {
  std::string path = is_url(given) ? given : to_utf8(to_path(given));
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

/// What is in a folder, by name; links to folders are not followed, hidden files are left alone.
std::vector<std::string> files_below(const std::string& folder,
                                     const std::function<bool(const std::string& path)>& is_wanted) {
  std::vector<std::string> found;
  std::error_code error;
  fs::recursive_directory_iterator each(to_path(folder), fs::directory_options::skip_permission_denied,
                                        error),
      end;
  for (; !error && each != end; each.increment(error)) {
    const fs::path& path = each->path();
    const bool is_folder = each->is_directory(error);
    if (to_utf8(path.filename()).starts_with(".")) {
      if (is_folder) each.disable_recursion_pending();
    } else if (is_folder && is_case(path)) {
      found.push_back(to_utf8(path));
      each.disable_recursion_pending();
    } else if (!is_folder && is_wanted(to_utf8(path))) {
      found.push_back(to_utf8(path));
    }
  }
  // The system lists folders in any order; users and tests want one.
  std::sort(found.begin(), found.end());
  return found;
}

/// An input and where its output goes, below the output folder.
struct Found {
  std::string input, place;
};

Result<std::vector<Found>> find_inputs(const Batch& batch,
                                       const std::function<bool(const std::string& path)>& is_wanted) {
  std::vector<Found> all;
  for (const std::string& given : batch.inputs) {
    if (given == "-")
      return failure(ErrorCode::usage, "standard input is one mesh; with several inputs name files only");
    const std::string name = without_slashes(given);
    std::error_code error;
    if (!batch.recursive || !fs::is_directory(to_path(name), error) || is_case(to_path(name))) {
      all.push_back({name, is_url(name) ? with_extension(name, "") : name.substr(begin_of_name(name))});
      continue;
    }
    const std::vector<std::string> below = files_below(name, is_wanted);
    if (below.empty())
      return failure(ErrorCode::usage, name + ": this folder holds no file that the verb takes");
    for (const std::string& path : below)
      all.push_back({path, to_utf8(to_path(path).lexically_relative(to_path(name)))});
  }
  return all;
}

/// Two names of one file are mostly an input and an output that was meant to be another file, and a name that
/// is there neither as a file nor as a mesh is mostly an output.
Result<> check_inputs(const Batch& batch, const std::function<bool(const std::string& path)>& is_wanted) {
  std::set<std::string> files;
  for (const std::string& input : batch.inputs) {
    if (is_url(input) || input == "-") continue;
    std::error_code error;
    if (!fs::exists(to_path(input), error) && !is_wanted(input)) {
      return failure(ErrorCode::usage,
                     input +
                         ": there is no such file; each of several inputs gets an output of its own, "
                         "beside it or in --output-folder DIR");
    }
    if (!files.insert(to_utf8(fs::weakly_canonical(to_path(input), error))).second)
      return failure(ErrorCode::usage, input + ": is named twice; name another output, or each input once");
  }
  return {};
}

}  // namespace

Result<std::vector<BatchItem>> items_of(const Batch& batch,
                                        const std::function<bool(const std::string& path)>& is_wanted) {
  TOOL_CHECK(check_inputs(batch, is_wanted));
  const std::vector<Found> found = TOOL_TRY(find_inputs(batch, is_wanted));
  std::vector<BatchItem> items;
  std::map<std::string, size_t> uses;
  for (const Found& each : found) {
    const bool beside = batch.output_folder.empty();
    const std::string whole =
        beside ? each.input : to_utf8(to_path(batch.output_folder) / to_path(each.place));
    items.push_back({each.input, with_extension(whole, "")});
    ++uses[items.back().stem];
  }
  for (size_t i = 0; i < items.size(); ++i) {
    // "a.ply" and "a.obj" would both be written as "a.maille": then their extensions stay.
    if (uses[items[i].stem] > 1) items[i].stem += to_utf8(to_path(found[i].input).extension());
  }
  return items;
}

namespace {

struct Totals {
  uint64_t done = 0, input_bytes = 0, output_bytes = 0;
};

void say_totals(const Totals& totals, const std::vector<std::string>& failures, double seconds) {
  say(fmt::format("{}: {} -> {} (ratio {}), {:.2f} s{}", counted(totals.done, "file"),
                  human_bytes(static_cast<double>(totals.input_bytes)),
                  human_bytes(static_cast<double>(totals.output_bytes)),
                  quotient(static_cast<double>(totals.input_bytes), static_cast<double>(totals.output_bytes)),
                  seconds, failures.empty() ? "" : fmt::format("; {} failed:", failures.size())));
  for (const std::string& failure : failures) say("  " + failure);
}

Result<BatchAnswer> run_on(const BatchItem& item,
                           const std::function<Result<BatchAnswer>(const BatchItem&)>& run_one) {
  std::error_code error;
  const fs::path folder = to_path(item.stem).parent_path();
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) return failure(ErrorCode::write_failed, to_utf8(folder) + ": " + error.message());
  return run_one(item);
}

}  // namespace

int run_batch(const std::vector<BatchItem>& items, const CommonOptions& common,
              const std::function<Result<BatchAnswer>(const BatchItem&)>& run_one) {
  const Stopwatch whole;
  Totals totals;
  std::vector<std::string> failures;
  int worst = 0;
  for (const BatchItem& item : items) {
    const auto answer = run_on(item, run_one);
    // The highest code of all files: scripts need one number, and messages tell the rest.
    worst = std::max(worst, answer ? answer->code : static_cast<int>(answer.error().code));
    if (!answer) {
      failures.push_back(sentence_of(answer.error()));
      complain(failures.back());
      // Any other error concerns this input only, and the rest may still succeed.
      if (answer.error().code == ErrorCode::cancelled) break;
      continue;
    }
    ++totals.done;
    std::error_code ignored;
    totals.input_bytes += answer->input_bytes;
    totals.output_bytes +=
        bytes_of_output(answer->output, fs::is_directory(to_path(answer->output), ignored));
  }
  if (!common.quiet && !common.json) say_totals(totals, failures, whole.seconds());
  return worst;
}

}  // namespace maille::tool
