#include "mbs/batch.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "base/error.h"
#include "base/parallel.h"
#include "mbs/course.h"
#include "mbs/joint_rows.h"

namespace topple::mbs {

namespace {

/// Whether the kernel of hinges in a plane has it: about y, not about -y.
bool is_planar_hinge(const Joint& j) {
  return j.kind == Joint::Kind::Revolute && is_about_y(to_matrix(normalized(j.X_PF.q))) &&
         is_about_y(to_matrix(normalized(j.X_CM.q)));
}

/// What differs in the build; empty if nothing does.
std::string find_difference(const Model& base, const Model& varied) {
  if (varied.bodies.size() != base.bodies.size()) return "the number of bodies";
  if (varied.joints.size() != base.joints.size()) return "the number of joints";
  if (varied.elements.size() != base.elements.size()) return "the number of elements";
  for (size_t i = 0; i < base.elements.size(); ++i)
    if (varied.elements[i].a != base.elements[i].a || varied.elements[i].b != base.elements[i].b)
      return "the bodies of elements[" + std::to_string(i) + "]";
  for (size_t i = 0; i < base.elements.size(); ++i)
    if ((varied.elements[i].stations.size() == 2) != (base.elements[i].stations.size() == 2))
      return "the stations of elements[" + std::to_string(i) + "], a whole member in only one of both";
  for (size_t i = 0; i < base.joints.size(); ++i) {
    const Joint &a = base.joints[i], &b = varied.joints[i];
    if (a.kind != b.kind) return "the kind of joints[" + std::to_string(i) + "]";
    if (a.parent != b.parent || a.child != b.child) return "the bodies of joints[" + std::to_string(i) + "]";
    if (base.is_planar && varied.is_planar && is_planar_hinge(a) != is_planar_hinge(b))
      return "the direction of the axis of joints[" + std::to_string(i) + "]";
  }
  if (varied.rotational_elements.size() != base.rotational_elements.size()) return "the number of rotational elements";
  for (size_t i = 0; i < base.rotational_elements.size(); ++i)
    if (varied.rotational_elements[i].joint != base.rotational_elements[i].joint)
      return "the joint of rotational_elements[" + std::to_string(i) + "]";
  return {};
}

/// Throws InputError if a variation did more than change numbers.
void check_build(const Model& base, const Model& varied, size_t sample) {
  const std::string difference = find_difference(base, varied);
  if (difference.empty()) return;
  throw InputError("E602", "variation " + std::to_string(sample) + " changes " + difference,
                   "variations change numbers; bodies, joints and elements stay");
}

/// Lanes for W samples of one build.
Lanes make_batch(const System& build, size_t W) {
  Lanes l;
  l.W = W;
  l.is_batch = true;
  l.is_planar = build.lanes->is_planar;
  l.sums_in_plane = build.model.is_planar;
  l.allocate_bodies(build.B);
  l.allocate_elements(build.elements.size());
  const auto body = [&](int b) { return static_cast<std::uint32_t>(b < 0 ? static_cast<int>(build.B) : b); };
  for (const CompiledElement& e : build.elements) {
    l.planes[l.body_a.size()] = e.zone.plane;
    l.single[l.body_a.size()] = e.zone.stations < 2;
    l.body_a.push_back(body(e.a));
    l.body_b.push_back(body(e.b));
  }
  l.list_entries(build.incidence);
  for (size_t slot = 0; slot < l.element_blocks * W; ++slot) l.clear_slot(slot);
  return l;
}

/// Throws InputError if other elements than before leave the plane of a planar model.
void check_planes(const Lanes& lanes, const System& s, size_t sample) {
  if (s.lanes->is_planar != lanes.is_planar || s.model.is_planar != lanes.sums_in_plane)
    throw InputError("E602", "variation " + std::to_string(sample) + " turns bodies out of their planes or into them",
                     "all variations of a planar model move in its planes, or none");
  for (size_t e = 0; e < s.elements.size(); ++e)
    if (s.elements[e].zone.plane != lanes.planes[e])
      throw InputError(
          "E602",
          "variation " + std::to_string(sample) + " turns " +
              (e < s.E ? "elements[" + std::to_string(e) : "rotational_elements[" + std::to_string(e - s.E)) +
              "] out of its plane or into it",
          "all variations of a planar model have it in its plane, or none");
}

/// Runs the samples [first, last), one in each lane.
void run_lanes(const Model& model, const std::vector<Variation>& variations, const BatchOptions& options, size_t first,
               size_t last, std::vector<Summary>& out, const std::function<void()>& done) {
  struct Sample {
    std::optional<System> system;
    std::optional<Course> course;
  };
  const size_t W = kernel::lanes();
  std::vector<Sample> samples(last - first);
  std::vector<System*> active(W, nullptr);
  const auto end = [&](size_t i) {
    out[first + i] = samples[i].course->finish();
    active[i] = nullptr;
    if (options.on_end) options.on_end(first + i, out[first + i]);
    done();
  };
  std::optional<Lanes> lanes;
  const std::shared_ptr<StiffnessFactor> factor = make_stiffness_factor();
  for (size_t i = 0; i < samples.size(); ++i) {
    Model varied = model;
    if (variations[first + i]) variations[first + i](varied);
    check_build(model, varied, first + i);
    Options run = options.run;
    run.threads = 1;
    run.samplings.clear();
    run.on_frame = nullptr;
    run.on_happening = nullptr;
    run.progress = {};
    run.progress.cancel = options.progress.cancel;
    if (options.on_frame) run.on_frame = [&options, sample = first + i](const View& v) { options.on_frame(sample, v); };
    if (options.on_happening)
      run.on_happening = [&options, sample = first + i](const Happening& h) { options.on_happening(sample, h); };
    samples[i].system.emplace(varied, run);
    System& s = *samples[i].system;
    s.stiffness_factor = factor;
    samples[i].course.emplace(s);
    if (!samples[i].course->begin()) {
      end(i);
      continue;
    }
    if (!lanes) lanes = make_batch(s, W);
    check_planes(*lanes, s, first + i);
    s.join_batch(*lanes, i);
    active[i] = &s;
  }
  if (lanes) lanes->share_constants();
  const auto is_running = [](const System* s) { return s != nullptr; };
  while (std::any_of(active.begin(), active.end(), is_running)) {
    advance_together(*lanes, active);
    for (size_t i = 0; i < samples.size(); ++i)
      if (active[i] != nullptr && !samples[i].course->follow()) end(i);
  }
}

}  // namespace

bool is_same_build(const Model& a, const Model& b) { return find_difference(a, b).empty(); }

std::vector<Summary> run_batch(const Model& model, const std::vector<Variation>& variations,
                               const BatchOptions& options) {
  check_model(model);
  std::vector<Summary> out(variations.size());
  const size_t W = kernel::lanes(), batches = (variations.size() + W - 1) / W;
  std::mutex mutex;
  size_t finished = 0;
  const auto done = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    ++finished;
    if (options.progress.report)
      options.progress.report(static_cast<double>(finished), static_cast<double>(variations.size()));
  };
  const bool complete = parallel_for(
      batches, options.threads,
      [&](size_t batch) {
        run_lanes(model, variations, options, batch * W, std::min(variations.size(), (batch + 1) * W), out, done);
      },
      options.progress.cancel);
  if (!complete)
    for (Summary& s : out)
      if (s.message.empty()) {
        s.ending = Summary::Ending::Cancelled;
        s.message = "cancelled before it began";
      }
  return out;
}

}  // namespace topple::mbs
