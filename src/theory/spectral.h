#pragma once

#include <maille/predict.h>

#include <vector>

namespace maille {

/// Weights by the graph of the stencil (after Ibarria, Lindstrom and Rossignac 2007): the values that are not
/// known are chosen together so that the energy in the eigenvectors of the graph's Laplacian with the highest
/// eigenvalue is smallest; what is still free then, for the next eigenvalue, and so on. The stencil is valid
/// and has edges.
std::vector<double> spectral_weights(const Stencil& stencil);

}  // namespace maille
