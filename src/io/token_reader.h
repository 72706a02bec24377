#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include "base/bytes.h"
#include "io/budget.h"
#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {

/// Reads the words and numbers of a text in which line ends mean nothing, and knows where it is for messages.
/// From `comment` (if it is not 0) to the end of a line all is passed over.
class TokenReader {
 public:
  TokenReader(std::string_view text, std::string name, char comment = '\0')
      : scanner(text), name_(std::move(name)), comment_(comment) {}

  TextScanner scanner;

  const std::string& name() const { return name_; }
  void skip_white() { scanner.skip_white(comment_); }
  bool at_end() {
    skip_white();
    return scanner.at_end();
  }
  /// False, and not moved, when there is none.
  bool integer(int64_t& value) {
    skip_white();
    return scanner.integer(value);
  }
  bool number(Number& number) {
    skip_white();
    return scanner.number(number);
  }
  /// Empty at the end.
  std::string_view word() {
    skip_white();
    return scanner.word();
  }
  /// "file: line 12: there should be WHAT, but found "abc"".
  tl::unexpected<Error> expected(const std::string& what) {
    skip_white();
    return malformed_line(name_, scanner.line(),
                          "there should be " + what + ", but found " + found_at(scanner));
  }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return malformed_line(name_, scanner.line(), what);
  }
  // A count that a header claims. It is no bound for memory: ReadingPace takes that as elements are really
  // read.
  Result<uint64_t> count(const std::string& what) {
    int64_t value = 0;
    if (!integer(value) || value < 0) return expected("the number of " + what);
    return static_cast<uint64_t>(value);
  }

 private:
  std::string name_;
  char comment_;
};

/// Call step() before element `i` of `count`, of `bytes_each` in memory: it takes them from the budget as
/// they are read, 65,536 at a time, so that a claimed count costs nothing, and tells how far reading has
/// come.
class ReadingPace {
 public:
  ReadingPace(Budget& budget, const Progress& progress, uint64_t total)
      : budget_(budget), progress_(progress), total_(total) {}
  Result<> step(uint64_t i, uint64_t count, uint64_t bytes_each, uint64_t position) {
    if (i % interval != 0) return {};
    MAILLE_CHECK(budget_.take(std::min(interval, count - i), bytes_each));
    return report_progress(progress_, "reading",
                           total_ == 0 ? 1 : static_cast<double>(position) / static_cast<double>(total_));
  }

 private:
  static constexpr uint64_t interval = 1 << 16;
  Budget& budget_;
  const Progress& progress_;
  uint64_t total_;
};

/// Numbers of a text that does not tell their type: floats when all of them say no more than a float can,
/// otherwise doubles. Unlike NumberColumn it keeps doubles to the end, so that nothing is read twice but
/// memory is double.
class RealColumn {
 public:
  void add(const Number& number) {
    values_.push_back(number.value);
    // Rounded twice, the double may give another float than the text.
    fits_ = fits_ && number.fits_single &&
            bits_as<uint32_t>(static_cast<float>(number.value)) == bits_as<uint32_t>(number.single);
  }
  void add(double value) {
    values_.push_back(value);
    fits_ = false;
  }
  size_t size() const { return values_.size(); }
  Array take(std::string name, Domain domain, uint32_t components, Role role = Role::none) {
    Array array = make_array(std::move(name), domain, fits_ ? Scalar::f32 : Scalar::f64, components, role);
    array.resize(values_.size() / components);
    if (fits_) {
      std::transform(values_.begin(), values_.end(), array.values<float>().begin(),
                     [](double value) { return static_cast<float>(value); });
    } else {
      std::copy(values_.begin(), values_.end(), array.values<double>().begin());
    }
    return array;
  }

 private:
  std::vector<double> values_;
  bool fits_ = true;
};

}  // namespace maille
