#include "text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace maille::tool {

namespace {

// Bytes of the UTF-8 character that begins there; 0: none does, or it would steer a terminal.
size_t printable_at(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  if (first < 0x80) return (first >= ' ' && first != 0x7f) || first == '\n' || first == '\t' ? 1 : 0;
  const size_t size = first >= 0xc2 && first < 0xe0   ? 2
                      : first >= 0xe0 && first < 0xf0 ? 3
                      : first >= 0xf0 && first < 0xf5 ? 4
                                                      : 0;
  if (size == 0 || text.size() < size) return 0;
  for (size_t i = 1; i < size; ++i) {
    if ((text[i] & '\xc0') != '\x80') return 0;
  }
  const bool control = first == 0xc2 && static_cast<unsigned char>(text[1]) < 0xa0;
  return control ? 0 : size;
}

// Names and texts of files are printed as they are, except for control characters: escape sequences from a
// hostile file could otherwise change the title or the contents of a terminal.
std::string printable(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const size_t size = printable_at(text);
    result += size == 0 ? "?" : text.substr(0, size);
    text.remove_prefix(std::max<size_t>(size, 1));
  }
  return result;
}

}  // namespace

void complain(std::string_view sentence) {
  say(fmt::format("maille: {}", sentence));
}

std::string sentence_of(const Error& error) {
  const auto has = [&](const char* text) { return error.message.find(text) != std::string::npos; };
  if (error.code == ErrorCode::memory_bound && has("allowed"))
    return error.message + "; `-M SIZE` allows more";
  // What was no .maille file at all, and what salvaging found out, need no such advice.
  if (error.code != ErrorCode::corrupt || has("not a .maille file") || has("salvaged")) return error.message;
  return error.message + "; `maille decompress --salvage` writes what is whole";
}

void say(std::string_view line) {
  // A closed standard error is no reason to fail.
  const std::string text = printable(line) + "\n";
  std::fwrite(text.data(), 1, text.size(), stderr);
}

void say_notes(std::string_view name, const std::vector<std::string>& notes, bool quiet) {
  if (quiet) return;
  for (const std::string& note : notes) say(fmt::format("maille: {}: note: {}", name, note));
}

bool tell_of_loss(const std::vector<std::string>& notes) {
  return std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
    return note.find("left out") != std::string::npos && !note.starts_with("facet normals follow");
  });
}

Result<> answer(std::string_view anything) {
  const std::string text = printable(anything);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    return failure(ErrorCode::write_failed,
                   fmt::format("cannot write standard output: {}", std::strerror(errno)));
  }
  return {};
}

double Stopwatch::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void Stopwatch::done(bool verbose, std::string_view step) const {
  if (verbose) say(fmt::format("maille: {}: {:.2f} s", step, seconds()));
}

std::string human_bytes(double bytes) {
  const char* const units[] = {"bytes", "kB", "MB", "GB", "TB"};
  size_t unit = 0;
  // 999.5 is where rounding would print 1000 of the smaller unit.
  while (bytes >= 999.5 && unit + 1 < std::size(units)) {
    bytes /= 1000;
    ++unit;
  }
  if (unit == 0) return fmt::format("{:.0f} {}", bytes, bytes == 1 ? "byte" : "bytes");
  return fmt::format("{:.{}f} {}", bytes, bytes < 9.995 ? 2 : bytes < 99.95 ? 1 : 0, units[unit]);
}

// ASCII only, and not by tolower(), whose result depends on the locale.
std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

std::string counted(uint64_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::string number(double value) {
  return fmt::format("{:.6g}", value);
}

std::string metadata_line(std::string_view key, std::string_view value) {
  // Chosen, not swept: with the key about what fits into a line of 120 characters.
  constexpr size_t front = 90;
  const auto lines = std::count(value.begin(), value.end(), '\n');
  if (lines > 0) return fmt::format("{}: {} lines of text\n", key, lines);
  if (value.size() <= front + 20) return fmt::format("{}: {}\n", key, value);
  size_t end = front;
  while (end > 0 && (static_cast<unsigned char>(value[end]) & 0xc0) == 0x80) --end;  // not inside a character
  return fmt::format("{}: {}... ({} characters)\n", key, value.substr(0, end), value.size());
}

std::string quotient(double part, double whole) {
  return whole == 0 ? "-" : fmt::format("{:.2f}", part / whole);
}

std::string type_text(Scalar type, uint32_t components) {
  return components == 1 ? maille::name_of(type) : fmt::format("{} x {}", maille::name_of(type), components);
}

const char* name_of(Mode mode) {
  switch (mode) {
    case Mode::single:
      return "single";
    case Mode::stream:
      return "stream";
    case Mode::random:
      return "random";
  }
  return "unknown";
}

const char* name_of(Order order) {
  return order == Order::keep ? "keep" : "canonical";
}

namespace {

// Width on the screen of UTF-8 text, as far as array names need it: one column per code point.
size_t width_of(const std::string& text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & '\xc0') != '\x80'; }));
}

}  // namespace

std::string Table::str() const {
  std::vector<size_t> widths(rows_.front().size(), 0);
  for (const auto& row : rows_) {
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  }
  std::string text;
  for (const auto& row : rows_) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      const std::string padding(widths[i] - width_of(row[i]), ' ');
      line += "  " + (i < left_ || i >= remarks_ ? row[i] + padding : padding + row[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace maille::tool
