#pragma once

#include <maille/encode.h>
#include <maille/error.h>
#include <maille/mesh.h>

#include <charconv>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// What the command says: answers on standard output, everything else on standard error.
namespace maille::tool {

/// Prints "maille: <sentence>" on standard error.
void complain(std::string_view sentence);
/// The sentence of an error, with what to do about damage.
std::string sentence_of(const Error& error);
/// Prints a line on standard error.
void say(std::string_view line);
/// Prints each note on standard error, unless `quiet`.
void say_notes(std::string_view name, const std::vector<std::string>& notes, bool quiet);
/// Do notes of a reader say that something was left out? (Normals that follow from the positions are not
/// lost.)
bool tell_of_loss(const std::vector<std::string>& notes);
/// Prints an answer on standard output. Error: write_failed.
Result<> answer(std::string_view text);

/// Measures one step of a job; done() prints "maille: <step>: 1.23 s" on standard error if `verbose`.
class Stopwatch {
 public:
  Stopwatch() : start_(std::chrono::steady_clock::now()) {}
  double seconds() const;
  void done(bool verbose, std::string_view step) const;

 private:
  std::chrono::steady_clock::time_point start_;
};

/// "1.2 MB"; units of 1000, as disks and `ls --si` count.
std::string human_bytes(double bytes);
/// With small letters in the place of A to Z, whatever the locale.
std::string lower_case(std::string_view text);
/// "437645 points"; with the plural s unless it is one.
std::string counted(uint64_t count, std::string_view noun);
/// A number with no more digits than it needs, "0" for 0.
std::string number(double value);
/// The number that a text is, spaces around it left out; nothing where there is more or less than one number
/// of this type, whatever the locale.
template <class T>
std::optional<T> parse_number(std::string_view text) {
  const size_t first = text.find_first_not_of(' '), last = text.find_last_not_of(' ');
  if (first == std::string_view::npos) return std::nullopt;
  text = text.substr(first, last - first + 1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}
/// "key: value" and a line end. Of values of several lines only their number, of long ones the front: whole
/// files of OpenFOAM and scenes of glTF are such, and --json has them all.
std::string metadata_line(std::string_view key, std::string_view value);
/// part / whole with two decimals, "-" when whole is 0.
std::string quotient(double part, double whole);
/// "f32 x 3".
std::string type_text(Scalar type, uint32_t components);
/// "absolute", "lossless", ...
const char* name_of(Mode mode);
const char* name_of(Order order);

/// Columns of text, each line indented by two. All are aligned to the right but the first `left` and, with
/// `remarks`, the last one.
class Table {
 public:
  Table(std::vector<std::string> header, size_t left, bool remarks = false)
      : left_(left), remarks_(remarks ? header.size() - 1 : header.size()) {
    rows_.push_back(std::move(header));
  }
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  std::string str() const;

 private:
  size_t left_;
  size_t remarks_;  ///< the columns from here on are aligned to the left again
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace maille::tool
