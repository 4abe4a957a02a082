#pragma once
/// Fuzzy resistance curves: the alpha-level optimisation around the layered route.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "product/fuzzy_file.h"
#include "record/rcc_fuzzy.h"

namespace topple::apps {

struct FuzzyTask {
  std::vector<double> normal_forces;  // tension positive [N]
  char axis = 'y';
  int direction = 1;
  int threads = 1;  // results do not depend on it
};

/// Everything but provenance and title; nothing if it was cancelled.
///   say  called now and then with what is being done
std::optional<record::RccFuzzyReport> make_fuzzy_report(const product::SectionFile&, const product::FuzzyFile&,
                                                        const FuzzyTask&, const std::atomic<bool>& cancel,
                                                        const std::function<void(const std::string&)>& say);

}  // namespace topple::apps
