#include "study/tie.h"

#include <memory>
#include <utility>

namespace topple::study {

void tie(uncertainty::Space& space, const product::Interaction& interaction,
         std::function<std::vector<double>(const uncertainty::Point&)> values_of) {
  const auto shared = std::make_shared<const product::Interaction>(interaction);
  const auto values = std::make_shared<const decltype(values_of)>(std::move(values_of));
  for (std::size_t i = 0; i < shared->constraints.size(); ++i)
    space.constraints.emplace_back(
        [values, shared, i](const uncertainty::Point& x) { return product::calc_excess(*shared, i, (*values)(x)); });
  if (shared->joint)
    space.joint = [values, shared](const uncertainty::Point& x) { return product::calc_joint(*shared, (*values)(x)); };
}

}  // namespace topple::study
