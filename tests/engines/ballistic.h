#pragma once
/// The smallest engine behind the adapter: bodies that nothing holds, in closed form. docs/engines.md walks through it.

#include "engines/course.h"
#include "engines/engine.h"

namespace topple::engines::example {

class BallisticEngine : public Engine {
 public:
  std::string name() const override { return "ballistic"; }
  std::string version() const override { return "1"; }

  std::vector<Unsupported> find_unsupported(const mbs::Model& model, const mbs::Options&) const override {
    std::vector<Unsupported> out;
    for (size_t i = 0; i < model.joints.size(); ++i)
      out.push_back({place_of("joints", i, model.joints[i].name), "joints"});
    for (size_t i = 0; i < model.springs.size(); ++i)
      out.push_back({place_of("springs", i, model.springs[i].name), "springs"});
    // ... and so on for everything else that a model can hold
    for (size_t i = 0; i < model.bodies.size(); ++i)
      if (!model.bodies[i].shapes.empty())
        out.push_back({place_of("bodies", i, model.bodies[i].name) + ".shapes", "contact"});
    return out;
  }

 protected:
  mbs::Summary solve(const mbs::Model& model, const mbs::Options& options) const override {
    Course course(model, options);
    if (!course.start(0)) return course.finish(0);  // 0: steps of any length
    const Motion start = course.motion();
    const auto at = [&](double t) {
      Motion m = start;
      for (size_t b = 0; b < model.bodies.size(); ++b) {
        if (model.bodies[b].fixed) continue;
        m.v_WB[b] += t * model.gravity;
        m.X_WB[b].p += t * start.v_WB[b] + (0.5 * t * t) * model.gravity;
        m.X_WB[b].q = exp_rotation(t * start.w_WB[b]) * start.X_WB[b].q;  // of bodies with equal moments of inertia
      }
      return m;
    };
    const auto no_reactions = [] { return Reactions{}; };
    long steps = 0;
    auto verdict = course.accept(0, start, {}, {}, no_reactions);
    while (verdict != Course::Verdict::Stop) {
      const double t = course.next_stop();
      verdict = course.accept(t, at(t), {}, {}, no_reactions);
      ++steps;
    }
    return course.finish(steps);
  }
};

}  // namespace topple::engines::example
