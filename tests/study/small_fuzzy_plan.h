#pragma once
/// A small plan with fuzzy values that falls within half a second.

#include <string>
#include <vector>

#include "../product/plan_text.h"
#include "study/plan_mapping.h"

namespace topple::study {

/// A building of two bays that loses its front row, and its rear column soon after.
inline product::Plan read_small(const std::string& fuzzy) {
  std::string text = product::small_plan() + fuzzy;
  text = product::replaced(text, "time = \"2 s\"", "time = \"0.1 s\"");
  std::vector<Diagnostic> warnings;
  return product::read_plan(text, "plan.toml", warnings);
}

inline constexpr const char* strengths = R"toml([fuzzy]
concrete.C25.fc = { triangular = ["9 N/mm2", "25 N/mm2", "45 N/mm2"] }
concrete.C25.fct = { formula = "1.4 * ((fc - 8) / 10)^(2/3)" }
stage.1.charge.1.destroyed_length = { triangular = ["1 m", "1.2 m", "2 m"] }
storeys.load = { triangular = ["1 kN/m2", "1 kN/m2", "60 kN/m2"] }
)toml";

inline PlanMappingOptions quick() {
  PlanMappingOptions o;
  o.after = 0.4;
  o.tilt_times = {0.2, 0.4};
  return o;
}

}  // namespace topple::study
