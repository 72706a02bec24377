#pragma once

#include <maille/error.h>
#include <functional>
#include <string_view>

namespace maille {

/// The value of an expression of #eval and #calc: numbers, $variables, + - * / %, parentheses and the usual
/// functions of one or two numbers. `variable` gives the value of a name without '$'. Error
/// (malformed_input): what is not understood, without a place.
Result<double> evaluate_foam_expression(std::string_view text,
                                        const std::function<Result<double>(std::string_view)>& variable);

}  // namespace maille
