#include "io/foam/foam_expression.h"

#include <cmath>
#include <string>

#include "base/result.h"
#include "io/numbers.h"

namespace maille {

namespace {

constexpr double pi = 3.14159265358979323846;

// All functions take two numbers, so that one table holds them; those of fewer arguments ignore the rest.
struct Function {
  std::string_view name;
  unsigned arguments;
  double (*of)(double, double);
};

// OpenFOAM's names of functions of the standard library.
constexpr Function functions[] = {
    {"pi", 0, [](double, double) { return pi; }},
    {"degToRad", 1, [](double x, double) { return x * pi / 180; }},
    {"radToDeg", 1, [](double x, double) { return x * 180 / pi; }},
    {"sin", 1, [](double x, double) { return std::sin(x); }},
    {"cos", 1, [](double x, double) { return std::cos(x); }},
    {"tan", 1, [](double x, double) { return std::tan(x); }},
    {"asin", 1, [](double x, double) { return std::asin(x); }},
    {"acos", 1, [](double x, double) { return std::acos(x); }},
    {"atan", 1, [](double x, double) { return std::atan(x); }},
    {"sinh", 1, [](double x, double) { return std::sinh(x); }},
    {"cosh", 1, [](double x, double) { return std::cosh(x); }},
    {"tanh", 1, [](double x, double) { return std::tanh(x); }},
    {"exp", 1, [](double x, double) { return std::exp(x); }},
    {"log", 1, [](double x, double) { return std::log(x); }},
    {"log10", 1, [](double x, double) { return std::log10(x); }},
    {"sqrt", 1, [](double x, double) { return std::sqrt(x); }},
    {"cbrt", 1, [](double x, double) { return std::cbrt(x); }},
    {"sqr", 1, [](double x, double) { return x * x; }},
    {"mag", 1, [](double x, double) { return std::fabs(x); }},
    {"fabs", 1, [](double x, double) { return std::fabs(x); }},
    {"floor", 1, [](double x, double) { return std::floor(x); }},
    {"ceil", 1, [](double x, double) { return std::ceil(x); }},
    {"round", 1, [](double x, double) { return std::round(x); }},
    {"neg", 1, [](double x, double) { return x < 0 ? 1.0 : 0.0; }},
    {"pos", 1, [](double x, double) { return x >= 0 ? 1.0 : 0.0; }},
    {"pow", 2, [](double x, double y) { return std::pow(x, y); }},
    {"atan2", 2, [](double x, double y) { return std::atan2(x, y); }},
    {"hypot", 2, [](double x, double y) { return std::sqrt(x * x + y * y); }},
    {"min", 2, [](double x, double y) { return x < y ? x : y; }},
    {"max", 2, [](double x, double y) { return x > y ? x : y; }},
};

// A recursive descent over sums, products and factors, evaluated while it is read. The results are doubles by
// the machine's libm: dictionaries describe meshes, and no decoder depends on them.
class Evaluator {
 public:
  Evaluator(std::string_view text, const std::function<Result<double>(std::string_view)>& variable)
      : text_(text), variable_(variable) {}

  Result<double> run() {
    const double value = MAILLE_TRY(sum());
    skip();
    if (at_ < text_.size()) return bad("'" + std::string(text_.substr(at_)) + "' is not understood");
    return value;
  }

 private:
  static tl::unexpected<Error> bad(const std::string& what) {
    return failure(ErrorCode::malformed_input, "expression: " + what);
  }
  void skip() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos)
      ++at_;
  }
  bool take(char c) {
    skip();
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  // Sums and differences from left to right, as products below.
  Result<double> sum() {
    double value = MAILLE_TRY(product());
    for (;;) {
      if (take('+')) {
        value += MAILLE_TRY(product());
      } else if (take('-')) {
        value -= MAILLE_TRY(product());
      } else {
        return value;
      }
    }
  }

  Result<double> product() {
    double value = MAILLE_TRY(factor());
    for (;;) {
      if (take('*')) {
        value *= MAILLE_TRY(factor());
      } else if (take('/')) {
        value /= MAILLE_TRY(factor());
      } else if (take('%')) {
        value = std::fmod(value, MAILLE_TRY(factor()));
      } else {
        return value;
      }
    }
  }

  Result<double> factor() {
    // Bounds the recursion, as any input may come here: no sensible expression is that deep. Chosen, not
    // swept.
    if (++depth_ > 200) return bad("too many parentheses");
    const auto value = [&]() -> Result<double> {
      // Signs go through factor() again, so a long row of them counts as depth as well.
      if (take('-')) return -MAILLE_TRY(factor());
      if (take('+')) return factor();
      if (take('(')) {
        const double inner = MAILLE_TRY(sum());
        if (!take(')')) return bad("a ')' is missing");
        return inner;
      }
      if (take('$')) return variable();
      return number_or_function();
    }();
    --depth_;
    return value;
  }

  // Colons belong to names, as in "constant::mathematical::pi".
  static bool in_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == ':';
  }
  std::string_view name() {
    const size_t begin = at_;
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  // "$name" or "${name}"; the value comes from the dictionary around.
  Result<double> variable() {
    if (!take('{')) return variable_(name());
    const std::string_view braced = name();
    if (!take('}')) return bad("a '}' is missing");
    return variable_(braced);
  }

  Result<double> number_or_function() {
    skip();
    Number number;
    const char* const begin = text_.data() + at_;
    const char* const end = text_.data() + text_.size();
    // Numbers begin with a digit or a point: signs are read by factor(), and "inf" or "nan" are no numbers
    // here.
    if (begin != end && ((*begin >= '0' && *begin <= '9') || *begin == '.')) {
      const char* const behind = parse_number(begin, end, number);
      if (behind == nullptr) return bad("no number where one is expected");
      at_ += static_cast<size_t>(behind - begin);
      return number.value;
    }
    std::string_view called = name();
    if (called == "constant::mathematical::pi") return pi;
    if (called.substr(0, 6) == "Foam::") called.remove_prefix(6);
    for (const Function& function : functions) {
      if (called == function.name) return call(function);
    }
    return bad("'" + std::string(called.empty() ? text_.substr(at_) : called) + "' is not understood");
  }

  Result<double> call(const Function& function) {
    double arguments[2] = {0, 0};
    if (!take('(')) return bad("'" + std::string(function.name) + "' takes parentheses");
    for (unsigned i = 0; i < function.arguments; ++i) {
      if (i > 0 && !take(',')) return bad("'" + std::string(function.name) + "' takes two numbers");
      arguments[i] = MAILLE_TRY(sum());
    }
    if (!take(')')) return bad("a ')' is missing");
    return function.of(arguments[0], arguments[1]);
  }

  std::string_view text_;
  const std::function<Result<double>(std::string_view)>& variable_;
  size_t at_ = 0;
  unsigned depth_ = 0;
};

}  // namespace

Result<double> evaluate_foam_expression(std::string_view text,
                                        const std::function<Result<double>(std::string_view)>& variable) {
  return Evaluator(text, variable).run();
}

}  // namespace maille
