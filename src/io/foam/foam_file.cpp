#include "io/foam/foam_file.h"

#include <maille/path.h>

#include <algorithm>
#include <filesystem>

#include "io/beside.h"
#include "io/gzip.h"
#include "io/text_scanner.h"

namespace maille {

namespace {

bool is_there(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(to_path(path), error);
}

/// The name under which a file is there: each file of a case may be packed.
std::string name_in(const std::string& folder, const std::string& name) {
  const std::string path = to_utf8(to_path(folder) / to_path(name));
  return !is_there(path) && is_there(path + ".gz") ? name + ".gz" : name;
}

}  // namespace

bool has_foam_file(const std::string& path) {
  return is_there(path) || is_there(path + ".gz");
}

Result<FoamReader> FoamReader::open(const std::string& folder, const std::string& name, const Limits& limits,
                                    std::optional<uint64_t> block) {
  FoamReader file;
  const std::string found = name_in(folder, name), path = folder + "/" + found;
  file.source_ = MAILLE_TRY(open_beside(folder + "/", found));
  file.bytes_ = MAILLE_TRY(InputBytes::load(*file.source_));
  std::string_view text = file.bytes_.text();
  if (is_gzip(file.bytes_.bytes())) {
    file.unpacked_ = MAILLE_TRY(gunzip(file.bytes_.bytes(), limits.mesh_bytes, path));
    text = {reinterpret_cast<const char*>(file.unpacked_.data()), file.unpacked_.size()};
  }
  file.name_ = path;
  file.size_ = text.size();
  file.begin_ = file.at_ = text.data();
  file.end_ = text.data() + text.size();
  MAILLE_CHECK(file.read_header());
  if (block) MAILLE_CHECK(file.enter_block(*block));
  return file;
}

/// Enters the block of one processor in a file of several: lists of bytes, one for each. Only the first one
/// begins with the header of the file that each of them is.
Result<> FoamReader::enter_block(uint64_t block) {
  if (class_ != "decomposedBlockData")
    return malformed("there should be a block of bytes for each processor");
  std::string_view header, bytes;
  for (uint64_t i = 0; i <= block; ++i) {
    int64_t count = 0;
    if (at_end())
      return malformed("there is no block " + std::to_string(block) + ", but only " + std::to_string(i));
    if (!label(count) || count < 0 || !take('(') || count >= end_ - at_)
      return malformed("there should be the bytes of block " + std::to_string(i));
    bytes = {at_, static_cast<size_t>(count)};
    at_ += count;
    if (!take(')')) return malformed("a block is longer or shorter than it says");
    if (i == 0) header = bytes.substr(0, bytes.find('}') + 1);
  }
  std::vector<std::byte> text;
  for (const std::string_view part : {block == 0 ? std::string_view() : header, bytes}) {
    const auto all = std::as_bytes(std::span(part));
    text.insert(text.end(), all.begin(), all.end());
  }
  unpacked_ = std::move(text);
  name_ += " (block " + std::to_string(block) + ")";
  size_ = unpacked_.size();
  begin_ = at_ = reinterpret_cast<const char*>(unpacked_.data());
  end_ = begin_ + unpacked_.size();
  return read_header();
}

Result<FoamReader> FoamReader::open_in_parts(const std::string& folder, const std::string& name) {
  FoamReader file;
  const std::string found = name_in(folder, name);
  file.name_ = folder + "/" + found;
  file.source_ = MAILLE_TRY(open_beside(folder + "/", found));
  file.size_ = file.source_->size();
  file.windowed_ = true;
  file.jump(0);
  const std::string_view front(file.at_, static_cast<size_t>(file.end_ - file.at_));
  if (is_gzip(std::as_bytes(std::span(front.data(), front.size()))))
    return failure(ErrorCode::unsupported, file.name_ + ": packed files cannot be read in parts");
  MAILLE_CHECK(file.read_header());
  return file;
}

tl::unexpected<Error> FoamReader::malformed(const std::string& what) const {
  if (unread_) return tl::unexpected(*unread_);
  return malformed_byte(name_, position(), what);
}

void FoamReader::jump(uint64_t to) {
  if (to >= window_at_ && to - window_at_ <= static_cast<uint64_t>(end_ - begin_)) {
    at_ = begin_ + (to - window_at_);
    if (windowed_) more(most_word);
    return;
  }
  window_at_ = std::min(to, size_);
  begin_ = at_ = end_ = window_.data();
  more(most_word);
}

/// Begins the window at the place where reading is; false: fewer bytes are left. An error of the source is
/// remembered, and comes from malformed().
bool FoamReader::move_window(size_t bytes) {
  const uint64_t here = position(), left = size_ - here;
  if (here + static_cast<uint64_t>(end_ - at_) < size_ && !unread_) {
    window_.resize(static_cast<size_t>(std::min<uint64_t>(window_bytes, left)));
    const auto room = std::as_writable_bytes(std::span(window_));
    if (auto read = source_->read_at(here, room); !read) {
      unread_ = read.error();
      window_.clear();
    }
    window_at_ = here;
    begin_ = at_ = window_.data();
    end_ = begin_ + window_.size();
  }
  return static_cast<size_t>(end_ - at_) >= bytes;
}

std::string_view FoamReader::word() {
  skip();
  const char* const from = at_;
  while (at_ != end_ && !TextScanner::is_white(*at_) && !is_sign(*at_)) ++at_;
  if (at_ == from && at_ != end_) ++at_;
  return {from, static_cast<size_t>(at_ - from)};
}

bool FoamReader::scalar(double& value) {
  skip();
  Number number;
  const char* const behind = parse_number(at_, end_, number);
  if (behind == nullptr) return false;
  value = number.value;
  at_ = behind;
  return true;
}

Result<uint64_t> FoamReader::begin_list(bool& values) {
  int64_t count = 0;
  if (!label(count) || count < 0) return malformed("there should be the length of a list");
  // No list is longer than the file but one that repeats a value.
  values = take('(');
  if (!values && count != 0 && !take('{'))
    return malformed("there should be \"(\" or \"{\" behind the length of a list");
  return static_cast<uint64_t>(count);
}

Result<> FoamReader::end_list(bool values) {
  if (!take(values ? ')' : '}')) return malformed("a list is longer or shorter than it says");
  return {};
}

Result<> FoamReader::labels(std::vector<int64_t>& out, Budget& budget) {
  bool values = false;
  const uint64_t count = MAILLE_TRY(begin_list(values));
  if (count == 0) return values ? end_list(values) : Result<>();
  if (values && count > size_) return malformed("a list is longer than the file");
  // A repeated value makes a long list of few bytes, so the budget is asked before.
  MAILLE_CHECK(budget.take(count, sizeof(int64_t)));
  int64_t value = 0;
  if (!values) {
    if (!label(value)) return malformed("there should be a number");
    out.insert(out.end(), count, value);
    return end_list(values);
  }
  for (uint64_t i = 0; i < count; ++i) {
    if (!next_label(value))
      return malformed("there should be number " + std::to_string(i) + " of " + std::to_string(count));
    out.push_back(value);
  }
  return end_list(values);
}

/// Skips blanks and comments; behind it there is a whole word or number, or the end.
void FoamReader::skip() {
  for (;;) {
    while (at_ != end_ && TextScanner::is_white(*at_)) ++at_;
    more(most_word);
    if (at_ == end_) return;
    if (TextScanner::is_white(*at_)) continue;
    if (*at_ != '/' || !skip_comment()) return;
  }
}

/// Skips a comment; false: there is none here. Goes through as many windows as it takes.
bool FoamReader::skip_comment() {
  if (end_ - at_ < 2 || (at_[1] != '/' && at_[1] != '*')) return false;
  const std::string_view ending = at_[1] == '/' ? "\n" : "*/";
  at_ += 2;
  for (;;) {
    const size_t end = std::string_view(at_, static_cast<size_t>(end_ - at_)).find(ending);
    if (end != std::string_view::npos) {
      at_ += end + (ending.size() == 2 ? 2 : 0);
      return true;
    }
    // The last character may be the first one of the ending, so it stays in the window.
    const auto left = static_cast<size_t>(end_ - at_);
    at_ = left >= ending.size() ? end_ - (ending.size() - 1) : at_;
    if (more(ending.size())) continue;
    at_ = end_;
    return true;
  }
}

Result<> FoamReader::read_header() {
  if (word() != "FoamFile" || !take('{')) return malformed("there should be a header \"FoamFile\"");
  while (!take('}')) {
    if (at_end()) return malformed("the file ends inside its header");
    const std::string key(word());
    skip();
    const char* const from = at_;
    for (bool quoted = false; at_ != end_ && (quoted || *at_ != ';'); ++at_)  // "LSB;label=32;scalar=64"
      quoted = quoted != (*at_ == '"');
    const std::string_view value(from, static_cast<size_t>(at_ - from));
    if (key == "format") binary_ = value == "binary";
    if (key == "class") class_ = value;
    if (key == "arch" && value.find("MSB") != std::string_view::npos) {
      return failure(ErrorCode::unsupported, name_ + ": its numbers are big-endian, which cannot be read");
    }
    if (key == "arch") {
      wide_label_ = value.find("label=64") != std::string_view::npos;
      wide_scalar_ = value.find("scalar=32") == std::string_view::npos;
    }
    take(';');
  }
  return {};
}

}  // namespace maille
