#pragma once
/// Single numbers for a fuzzy number (docs/theory/uncertainty.md, section 6).

#include <vector>

#include "uncertainty/fuzzy_number.h"

namespace topple::uncertainty {

/// Centre of the area under μ; the middle for a crisp number.
double calc_centroid(const FuzzyNumber&);
/// Mean of the middles of the cuts over alpha.
double calc_mean_of_midpoints(const FuzzyNumber&);
/// Where the falling branch meets the maximising set (x - l)/(r - l) of the support [l, r]: Jain's choice, which leans
/// to large values.
double calc_jain(const FuzzyNumber&);
/// Chen's choice between the maximising and the minimising set: l + (r - l) (U + 1 - V)/2, where U and V are the
/// degrees at which they meet the falling and the rising branch.
double calc_chen(const FuzzyNumber&);
/// H = -k ∫ [μ ln μ + (1-μ) ln(1-μ)] dx / reference [nat]. 0 for a crisp number or an interval, width/2 for a triangle.
/// Throws InputError E808 unless reference > 0.
double calc_entropy(const FuzzyNumber&, double reference = 1, double k = 1);
/// B = sum of the inputs' entropies / entropy of the result, each normalised by its reference; the larger, the less
/// does uncertainty of the inputs count. Infinite for a crisp result.
double calc_robustness(const std::vector<double>& input_entropies, double result_entropy);

}  // namespace topple::uncertainty
