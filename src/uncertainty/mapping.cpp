#include "uncertainty/mapping.h"

#include <utility>

namespace topple::uncertainty {

Evaluate make_evaluate(std::function<Result(const Point&)> model) {
  return [model = std::move(model)](std::span<const Point> batch, std::span<Result> out) {
    for (std::size_t i = 0; i < batch.size(); ++i) out[i] = model(batch[i]);
  };
}

Evaluate make_evaluate_values(std::function<std::vector<double>(const Point&)> model) {
  return make_evaluate([model = std::move(model)](const Point& x) {
    Result r;
    r.state = Result::State::Done;
    r.values = model(x);
    return r;
  });
}

}  // namespace topple::uncertainty
