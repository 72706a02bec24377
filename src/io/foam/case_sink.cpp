#include "io/foam/case_sink.h"

#include <maille/path.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <vector>

#include "base/result.h"
#include "base/scratch_file.h"
#include "io/foam/foam_case.h"

namespace maille {
namespace {

namespace fs = std::filesystem;

// Two sinks in one: the mesh goes to `mesh_` at once, files of the case wait in one scratch file until the
// mesh is committed. So a case never has fields of a mesh that was not written.
class CaseSink final : public FolderSink {
 public:
  CaseSink(std::unique_ptr<FolderSink> mesh, std::string folder, bool overwrite)
      : mesh_(std::move(mesh)), folder_(std::move(folder)), overwrite_(overwrite) {}

  Result<> begin_file(const std::string& file) override {
    of_mesh_ = true;
    return mesh_->begin_file(file);
  }
  Result<bool> begin_case_file(const std::string& path) override {
    if (!is_plain_foam_path(path))
      return failure(ErrorCode::usage,
                     name() + ": \"" + path.substr(0, 80) + "\" is no name for a file of a case");
    std::error_code error;
    const bool there = fs::exists(to_path(folder_) / to_path(path), error);
    const bool of_user = path.starts_with("constant/") || path.starts_with("system/");
    // Files of "constant" and "system" that are there belong to the user, and no file is written twice.
    if ((there && of_user) || !paths_.insert(path).second) return false;
    if (there && !overwrite_)
      return failure(ErrorCode::usage, folder_ + "/" + path + ": exists already; -f overwrites it");
    if (!waiting_) waiting_ = MAILLE_TRY(ScratchFile::create(folder_));
    files_.push_back({path, waiting_->size()});
    of_mesh_ = false;
    return true;
  }
  Result<> write(Bytes bytes) override { return of_mesh_ ? mesh_->write(bytes) : waiting_->append(bytes); }
  Result<> commit() override {
    MAILLE_CHECK(mesh_->commit());
    for (size_t i = 0; i < files_.size(); ++i) {
      const uint64_t end = i + 1 < files_.size() ? files_[i + 1].begin : waiting_->size();
      MAILLE_CHECK(write_file(files_[i].path, files_[i].begin, end));
    }
    return {};
  }
  std::string name() const override { return mesh_->name(); }

 private:
  struct Waiting {
    std::string path;
    uint64_t begin;
  };
  Result<> write_file(const std::string& path, uint64_t begin, uint64_t end) {
    const fs::path file = to_path(folder_) / to_path(path);
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    const auto sink = MAILLE_TRY(file_sink(to_utf8(file)));
    constexpr uint64_t at_once = uint64_t{1} << 20;
    std::vector<std::byte> bytes;
    for (; begin < end; begin += bytes.size()) {
      bytes.resize(static_cast<size_t>(std::min(at_once, end - begin)));
      MAILLE_CHECK(waiting_->read_at(begin, bytes));
      MAILLE_CHECK(sink->write(bytes));
    }
    MAILLE_CHECK(sink->commit());
    // OpenFOAM would not know which of the two is meant.
    fs::remove(to_path(to_utf8(file) + ".gz"), error);
    return {};
  }

  std::unique_ptr<FolderSink> mesh_;
  std::string folder_;
  bool overwrite_, of_mesh_ = true;
  std::optional<ScratchFile> waiting_;
  std::vector<Waiting> files_;
  std::set<std::string> paths_;
};

}  // namespace

std::unique_ptr<FolderSink> case_sink(std::unique_ptr<FolderSink> mesh, const std::string& folder,
                                      bool overwrite) {
  return std::make_unique<CaseSink>(std::move(mesh), folder, overwrite);
}

}  // namespace maille
