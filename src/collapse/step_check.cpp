#include "collapse/step_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <limits>

#include "base/unit.h"
#include "record/told.h"

namespace topple::collapse {

namespace {

using record::Finding;
using record::Record;
using record::Status;

const Finding* find(const Record& r, const std::string& id) {
  const auto f = std::find_if(r.findings.begin(), r.findings.end(), [&id](const Finding& x) { return x.id == id; });
  return f == r.findings.end() ? nullptr : &*f;
}

constexpr double kLeastTilt = 0.01;  // below it nothing leans [rad]

double value_of(const Record& r, const std::string& id) {
  const Finding* f = find(r, id);
  return f == nullptr ? std::numeric_limits<double>::quiet_NaN() : f->value;
}

bool is_judgement(const Finding& f) {
  return f.id == "mechanism" || f.id.rfind("criterion.", 0) == 0 || f.id.rfind("clearance.", 0) == 0;
}

/// "Mechanism: fold, Direction": what half the step makes of the mechanism, criteria and clearances that it judges
/// otherwise.
std::string find_other_judgements(const Record& half, const Record& r) {
  std::string out;
  for (const Finding& f : r.findings) {
    if (!is_judgement(f)) continue;
    const Finding* other = find(half, f.id);
    if (other != nullptr && other->status == f.status && (f.id != "mechanism" || other->title == f.title)) continue;
    out += (out.empty() ? "" : ", ") + (f.id == "mechanism" && other != nullptr ? other->title : f.title);
  }
  return out;
}

bool is_ended(const Record& r) { return r.ending == "at_rest" || r.ending == "time_limit"; }

/// " First touchdown 4.91 s, here 4.92 s."; nothing where one of them has none.
std::string describe(const char* form, double half, double own, double unit) {
  if (!std::isfinite(half) || !std::isfinite(own)) return {};
  return " " + fmt::format(fmt::runtime(form), half / unit, own / unit);
}

}  // namespace

void add_step_check(const Record& half, const Knowledge& k, Record& r) {
  const auto add = [&r](const std::string& text, double value, Status status) {
    record::add_finding(r, {"verification.half_step", "Verification", "Half the time step", text, value, "1", status});
  };
  const double step = 1e3 * half.provenance.step;  // [ms]
  if (!is_ended(half)) {
    add(fmt::format("With {:.3g} ms there is no answer. {}", step, half.ending_text),
        std::numeric_limits<double>::quiet_NaN(), Status::Warning);
    return;
  }
  const double tilt = value_of(r, "mechanism"), half_tilt = value_of(half, "mechanism");
  const double touchdown = value_of(r, "touchdown.first"), half_touchdown = value_of(half, "touchdown.first");
  const std::string numbers = describe("First touchdown {:.2f} s, here {:.2f} s.", half_touchdown, touchdown, 1) +
                              describe("Tilt {:.1f} deg, here {:.1f} deg.", half_tilt, tilt, unit::deg) +
                              describe("Reach of the debris {:.1f} m, here {:.1f} m.", value_of(half, "debris.reach"),
                                       value_of(r, "debris.reach"), 1) +
                              describe("Error of the energy balance {:.2g} %, here {:.2g} %.",
                                       value_of(half, "verification.energy"), value_of(r, "verification.energy"), 0.01);
  const std::string others = find_other_judgements(half, r);
  const double scale = std::max(std::abs(tilt), std::abs(half_tilt));
  const double share = scale > kLeastTilt ? std::abs(tilt - half_tilt) / scale : 0;
  const bool is_late = std::isfinite(touchdown) != std::isfinite(half_touchdown) ||
                       std::abs(touchdown - half_touchdown) > k.verification_step_time;
  if (!others.empty()) {
    add(fmt::format("With {:.3g} ms other judgements: {}.{}", step, others, numbers), share, Status::Bad);
  } else if (is_late || share > k.verification_step_tilt) {
    add(fmt::format("With {:.3g} ms the same verdict, but numbers that hang on the step.{}", step, numbers), share,
        Status::Warning);
  } else {
    add(fmt::format("With {:.3g} ms the same verdict.{}", step, numbers), share, Status::Good);
  }
}

Record run_plan_at_two_steps(const product::Plan& plan, const Knowledge& k, const RunOptions& options,
                             const RunCallbacks& callbacks) {
  // The slower run's progress is shown, from this thread alone.
  std::atomic<double> half_done = 0;
  std::atomic<bool> stop = false;
  double whole = 1;
  const auto show = [&](double done) {
    if (callbacks.progress.report) callbacks.progress.report(std::min(done, half_done.load()), whole);
  };
  const bool is_beside = options.threads > 1;
  RunOptions half_options = options, own_options = options;
  half_options.step_share = 0.5 * options.step_share;
  if (is_beside) {
    half_options.threads = options.threads / 2;
    own_options.threads = options.threads - half_options.threads;
  }
  RunCallbacks half_callbacks, own_callbacks = callbacks;
  half_callbacks.progress.cancel = &stop;
  half_callbacks.progress.report = [&](double done, double) {
    half_done = done;
    if (callbacks.progress.is_cancelled()) stop = true;
    if (!is_beside) show(done);
  };
  own_callbacks.progress.report = [&](double done, double of) {
    whole = of;
    if (is_beside) {
      show(done);
    } else if (callbacks.progress.report) {
      callbacks.progress.report(done, of);
    }
  };
  std::future<Record> half = std::async(is_beside ? std::launch::async : std::launch::deferred,
                                        [&] { return run_plan(plan, k, half_options, half_callbacks); });
  const struct Stopper {
    std::atomic<bool>& stop;
    ~Stopper() { stop = true; }
  } stopper{stop};  // before the future waits, should this run throw or end early
  Record r = run_plan(plan, k, own_options, own_callbacks);
  if (!is_ended(r)) return r;
  while (is_beside && half.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) show(whole);
  const Record half_record = half.get();
  show(whole);
  add_step_check(half_record, k, r);
  return r;
}

}  // namespace topple::collapse
