// Derivatives of a graph's nodes with respect to its inputs, as further nodes of the graph.
//
// Forward mode: each node's derivative follows from the derivatives of its operands. Zeros fold
// away (graph.h), so a sparse Jacobian costs its nonzero entries only.
#pragma once

#include <vector>

#include "harness/generate/graph.h"

namespace loopbench::generate {

/// Nodes of d outputs[i] / d inputs[j] at [j * outputs.size() + i]: column after column.
/// `values` are numbers of all nodes at the point of recording; they decide which operand of a
/// minimum or maximum is differentiated, and these decisions become comparisons of the graph.
/// At |0| the derivative is not defined and becomes NaN.
std::vector<int> Differentiate(Graph& graph, const std::vector<int>& outputs,
                               const std::vector<int>& inputs, const std::vector<double>& values);

}  // namespace loopbench::generate
