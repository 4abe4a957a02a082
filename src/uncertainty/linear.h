#pragma once
/// Small dense vectors and linear systems.

#include <vector>

namespace topple::uncertainty {

/// The scalar product; a is as long as b, or shorter.
double dot(const std::vector<double>& a, const std::vector<double>& b);

/// Solves A x = b by elimination with pivots; A is destroyed, b becomes x. False if singular.
bool solve(std::vector<std::vector<double>>& A, std::vector<double>& b);

}  // namespace topple::uncertainty
