#pragma once
/// Small dense linear systems.

#include <vector>

namespace topple::uncertainty {

/// Solves A x = b by elimination with pivots; A is destroyed, b becomes x. False if singular.
bool solve(std::vector<std::vector<double>>& A, std::vector<double>& b);

}  // namespace topple::uncertainty
