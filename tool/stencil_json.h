#pragma once

#include <maille/predict.h>

#include <string>

#include "summary.h"

// Stencils and their weights as JSON.
namespace maille::tool {

/// A stencil of the user's own: see `maille stencil --help`. `name` is what messages call the file. Error:
/// malformed_input.
Result<Stencil> stencil_from_json(const std::string& text, const std::string& name);

Json prediction_json(const Stencil& stencil, const PredictionRule& rule, const Prediction& prediction);

}  // namespace maille::tool
