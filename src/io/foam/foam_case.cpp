// Folders and files of a case of OpenFOAM.
#include "io/foam/foam_case.h"

#include <maille/path.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

namespace fs = std::filesystem;

/// What is kept as text. Dictionaries take some kilobytes; what is larger is data. All three chosen, not
/// swept; the sum keeps a case's texts far below the 16 MiB of metadata that a file holds.
constexpr uint64_t most_text_bytes = uint64_t{64} << 10;
constexpr uint64_t most_texts_bytes = uint64_t{2} << 20;
constexpr int most_folders_deep = 4;

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

// Sorted, as the order in which a file system lists its entries means nothing, and files must come out the
// same.
std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error)) {
    if (error) break;
    entries.push_back(entry->path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

bool has_files(const fs::path& folder) {
  const auto entries = sorted_entries(folder);
  std::error_code error;
  return std::any_of(entries.begin(), entries.end(),
                     [&](const fs::path& entry) { return fs::is_regular_file(entry, error); });
}

/// Whether a folder is the mesh, surfaces and the like; they are no text.
bool is_of_mesh(const std::string& name) {
  constexpr std::string_view others[] = {"polyMesh", "triSurface", "geometry", "extendedFeatureEdgeMesh"};
  return std::find(std::begin(others), std::end(others), name) != std::end(others);
}

/// Collects small files of text, in the order of their paths, to a bounded depth. Whatever is not kept is
/// told.
class TextCollector {
 public:
  TextCollector(std::string folder, std::vector<std::string>& notes)
      : folder_(std::move(folder)), notes_(notes) {}

  void collect(const std::string& inside, int depth) {
    for (const fs::path& entry : sorted_entries(to_path(folder_) / to_path(inside))) {
      const std::string name = to_utf8(entry.filename());
      const std::string path = inside.empty() ? name : inside + "/" + name;
      if (name.starts_with(".") || name.ends_with("~") || is_of_mesh(name)) continue;
      if (is_folder(entry) && depth > 0) collect(path, depth - 1);
      if (is_folder(entry)) continue;
      add(path);
    }
  }
  std::vector<FoamText> take() { return std::move(texts_); }

 private:
  void add(const std::string& path) {
    std::error_code error;
    const fs::path file = to_path(folder_) / to_path(path);
    // A link may lead out of the case, so it is not followed.
    const bool own = fs::is_regular_file(file, error) && !fs::is_symlink(file, error);
    const uint64_t size = own ? fs::file_size(file, error) : most_text_bytes + 1;
    taken_ += error ? 0 : std::min(size, most_text_bytes);
    if (error || size > most_text_bytes || taken_ > most_texts_bytes || !is_plain_foam_path(path))
      return leave(path);
    std::ifstream in(file, std::ios::binary);
    std::string text(std::istreambuf_iterator<char>(in), {});
    const bool plain = std::all_of(text.begin(), text.end(), [](char c) {
      return static_cast<unsigned char>(c) >= ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\f';
    });
    if (!in.good() && !in.eof()) return leave(path);
    // The file may have grown since its size was asked for.
    if (!plain || text.size() > most_text_bytes) return leave(path);
    texts_.push_back({path, std::move(text)});
  }
  void leave(const std::string& path) {
    notes_.push_back(path + ": left out; small files of text are kept, and fields");
  }

  std::string folder_;
  std::vector<std::string>& notes_;
  std::vector<FoamText> texts_;
  uint64_t taken_ = 0;
};

}  // namespace

std::vector<FoamTime> foam_times_in(const std::string& folder) {
  std::vector<FoamTime> times;
  for (const fs::path& entry : sorted_entries(to_path(folder))) {
    const std::string name = to_utf8(entry.filename());
    const auto value = foam_time_of(name);
    if (value && is_folder(entry) && has_files(entry)) times.push_back({name, *value});
  }
  std::stable_sort(times.begin(), times.end(),
                   [](const FoamTime& a, const FoamTime& b) { return a.value < b.value; });
  return times;
}

std::optional<double> foam_time_of(const std::string& name) {
  const char* const end = name.data() + name.size();
  Number number;
  const bool begins = !name.empty() && (std::isdigit(static_cast<unsigned char>(name[0])) != 0 ||
                                        name[0] == '-' || name[0] == '+' || name[0] == '.');
  if (!begins || parse_number(name.data(), end, number) != end || !std::isfinite(number.value)) return {};
  return number.value;
}

FoamCasePath foam_case_of(const std::string& path) {
  fs::path folder = to_path(path);
  if (folder.has_relative_path() && folder.filename().empty()) folder = folder.parent_path();  // "case/"
  if (!is_folder(folder)) folder = folder.parent_path();
  if (folder.empty()) folder = ".";
  FoamCasePath found;
  if (is_folder(folder / "constant" / "polyMesh")) {
    found.folder = to_utf8(folder);
    found.times = foam_times_in(found.folder);
    return found;
  }
  const std::string name = to_utf8(folder.filename());
  const auto value = foam_time_of(name);
  const fs::path around = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
  if (!value || !is_folder(around / "constant" / "polyMesh")) return found;
  found.folder = to_utf8(around);
  found.times = foam_times_in(found.folder);
  found.time = FoamTime{name, *value};
  return found;
}

// Paths come back from .maille files of anybody, and are written below a folder of the user's.
bool is_plain_foam_path(const std::string& path) {
  if (path.empty() || path.size() > 400) return false;
  for (const fs::path& part : to_path(path)) {
    const std::string name = to_utf8(part);
    if (name.empty() || name[0] == '.' || name[0] == '/' || name[0] == '-' || name[0] == '~') return false;
    const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
      return static_cast<unsigned char>(c) >= 0x80 || std::isalnum(static_cast<unsigned char>(c)) != 0 ||
             std::string_view("_.:+-(),=%@").find(c) != std::string_view::npos;
    });
    if (!plain) return false;
  }
  return true;
}

std::vector<FoamText> read_foam_texts(const std::string& folder, const std::string& inside,
                                      std::vector<std::string>& notes) {
  TextCollector collector(folder, notes);
  collector.collect(inside, most_folders_deep);
  return collector.take();
}

}  // namespace maille
