#include "farfield/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/hash.h"
#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/keeper.h"
#include "farfield/checkpoint.h"
#include "farfield/fragments.h"
#include "farfield/motion.h"
#include "farfield/rubble.h"
#include "mbs/model_check.h"
#include "record/told.h"

namespace topple::farfield {

namespace {

using Clock = std::chrono::steady_clock;
using record::Status;

/// A building swings about where it stands while its mean speed is below so many times rest.speed: 0.1 m/s, a swing of
/// 3 cm at half a hertz.
constexpr double kSwing = 5;

/// It has turned back once, and may be settled, when its mean speed has fallen below this share of the largest one
/// since the charge: a quarter of the energy in motion.
constexpr double kTurned = 0.5;

/// Out-of-balance over load to which a wait is settled: twice that of the dead load, and far less than the swing that
/// is passed over.
constexpr double kSettled = 2e-3;

/// Accepted difference between reactions and weight: what a thousandth out of balance at every node adds up to.
constexpr double kReaction = 0.01;

/// Mass that may be added for a longer step, over the building's, before the answer is another building's.
constexpr double kMuchAddedMass = 0.02;
/// From this share on the run is refused.
constexpr double kAbsurdAddedMass = 1;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

fem::ExplicitOptions make_options(const collapse::Knowledge& k, double scaled_step, int threads) {
  fem::ExplicitOptions o;
  o.friction = k.contact_body_friction;
  o.scaled_step = scaled_step;
  o.threads = threads;
  return o;
}

MassScaling find_scaling(const fem::ExplicitSystem& system, const MeshReport& mesh, double scaled_step) {
  return {scaled_step, system.added_mass(), system.added_mass() / mesh.mesh.mass, system.scaled_elements()};
}

bool adds_much(const MassScaling& s) { return s.share > kMuchAddedMass; }

/// Throws E677.
void check_added_mass(const MassScaling& s, const MeshReport& mesh) {
  if (s.share < kAbsurdAddedMass) return;
  throw InputError(
      "E677",
      fmt::format("a scaled step of {:.3g} ms would add {:.2g} times the building's mass to it", 1e3 * s.step, s.share),
      fmt::format("give one that adds a per cent or two; without any the mesh bears {:.4g} ms",
                  1e3 * fem::calc_step_share({}) * mesh.mesh.critical_step));
}

/// Moves the elements and shows them as the manager's bodies.
class Course {
 public:
  Course(const product::Plan& plan, const collapse::Knowledge& k, const FeOptions& fe, const FeCallbacks& callbacks,
         const collapse::RunOptions& run, const mbs::Model& model, const collapse::ModelMap& map,
         const mbs::Options& options)
      : plan_(plan),
        k_(k),
        fe_(fe),
        options_(options),
        model_(model),
        map_(map),
        whole_(make_whole(plan, k, fe.grid, model, map)),
        mesh_(calc_mesh_report(plan, whole_)),
        system_(whole_.fe, make_options(k, fe.scaled_step, run.threads)),
        scaling_(find_scaling(system_, mesh_, fe.scaled_step)),
        motion_(plan, whole_, model, map, fe.grid.size) {
    check_added_mass(scaling_, mesh_);
    if (callbacks.on_mesh) callbacks.on_mesh(mesh_, scaling_.describe());
    key_ = calc_sha256(fmt::format("{}\n{}{} {} {} {} {} {} {}", plan.text, collapse::write_rules(k),
                                   run.program_version, fe.grid.size, fe.grid.least_across, fe.grid.snap_share,
                                   fe.scaled_step, fe.skip_quiet, options.frame_interval));
    for (const collapse::Firing& f : map.schedule)
      if (!f.fails) schedule_.push_back(f);
    last_firing_ = schedule_.empty() ? 0 : schedule_.back().time;
    state_.zone_state.assign(model.elements.size() + model.rotational_elements.size(), 0);
    state_.has_touched.assign(model.bodies.size(), 0);
    on_relaxed_ = callbacks.on_relaxed;
    on_timing_ = callbacks.on_timing;
    on_checkpoint_ = callbacks.on_checkpoint;
    on_lost_checkpoint_ = callbacks.on_lost_checkpoint;
    settle_.cancel = options_.progress.cancel;
    if (callbacks.on_settling)
      settle_.report = [call = callbacks.on_settling](double steps, double) { call(static_cast<int>(steps)); };
  }

  mbs::Summary run() {
    start_ = Clock::now();
    mbs::Summary s;
    s.step = system_.step();
    s.highest_frequency = 2 / mesh_.mesh.critical_step;
    if (fe_.resume) {
      std::vector<std::byte> bytes;
      state_ = read_checkpoint(fe_.checkpoint, key_, bytes);
      system_.read_snapshot(bytes);
      if (options_.duration + 0.5 * system_.step() < time())
        throw InputError("E674",
                         fmt::format("{}: the run has come to {:.4g} s, and is to end at {:.4g} s", fe_.checkpoint,
                                     time(), options_.duration),
                         "go on to a later time, or start without --resume");
      for (const auto& entry : state_.shown) {
        if (const mbs::View* v = std::get_if<mbs::View>(&entry)) options_.on_frame(*v);
        if (const mbs::Happening* h = std::get_if<mbs::Happening>(&entry)) options_.on_happening(*h);
      }
    } else {
      state_.relaxation = system_.relax({}, settle_);
      if (on_relaxed_) on_relaxed_(state_.relaxation);
      if (!state_.relaxation.converged) {
        s.ending =
            options_.progress.is_cancelled() ? mbs::Summary::Ending::Cancelled : mbs::Summary::Ending::NoEquilibrium;
        s.message = state_.relaxation.text;
        if (s.ending == mbs::Summary::Ending::NoEquilibrium) s.message += describe_overload();
      }
    }
    s.equilibrium_iterations = state_.relaxation.steps;
    s.equilibrium_residual = state_.relaxation.residual;
    if (state_.relaxation.converged) s.ending = advance();
    s.time = time();
    s.steps = static_cast<long>(system_.steps());
    s.shortest_step = system_.step();
    s.energy_error = state_.released > 0 ? state_.energy_error / state_.released : 0;
    if (s.ending == mbs::Summary::Ending::Diverged) s.message = "positions are no longer finite";
    s.wall_time = state_.wall_time + calc_seconds();
    if (on_timing_) on_timing_(system_.timing());
    return s;
  }

  /// Members and places that have moved farthest and yielded most, in clauses behind others.
  std::string describe_overload() const;
  void add_findings(record::Record& r) const;

 private:
  double time() const { return system_.time() + state_.offset; }
  double calc_seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double frame_time(long long frame) const { return static_cast<double>(frame) * options_.frame_interval; }

  mbs::Summary::Ending advance() {
    using Ending = mbs::Summary::Ending;
    Clock::time_point kept = Clock::now();
    for (;;) {
      if (!state_.is_settling)
        if (const std::optional<Ending> ending = go_to_next_stop()) return *ending;
      state_.is_settling = true;
      if (!skip_quiet()) {
        keep();
        return Ending::Cancelled;
      }
      state_.is_settling = false;
      const bool due = std::chrono::duration<double>(Clock::now() - kept).count() >= fe_.checkpoint_interval;
      if (due) keep(), kept = Clock::now();
    }
  }

  /// To the next frame, charge or the end; nothing if the run goes on from there.
  std::optional<mbs::Summary::Ending> go_to_next_stop() {
    using Ending = mbs::Summary::Ending;
    Progress progress;
    progress.cancel = options_.progress.cancel;
    const double frame = frame_time(state_.next_frame);
    const bool has_firing = state_.next_firing < schedule_.size();
    const double firing = has_firing ? schedule_[state_.next_firing].time : std::numeric_limits<double>::infinity();
    const double until = std::min({frame, firing, options_.duration});
    const double half_step = 0.5 * system_.step();
    if (until > time() + half_step) {
      switch (system_.advance(until - state_.offset, progress)) {
        case fem::ExplicitEnding::ReachedTime:
          break;
        case fem::ExplicitEnding::Cancelled:
          keep();
          return Ending::Cancelled;
        case fem::ExplicitEnding::Diverged:
          return Ending::Diverged;
      }
    }
    if (frame <= until) {
      show_frame(frame);
      ++state_.next_frame;
      if (options_.progress.report) options_.progress.report(frame, options_.duration);
    }
    if (until >= options_.duration) return Ending::TimeLimit;
    if (firing <= until) fire(schedule_[state_.next_firing++]);
    if (is_at_rest()) return Ending::AtRest;
    return std::nullopt;
  }

  void keep() {
    if (fe_.checkpoint.empty()) return;
    RunState now = state_;
    now.wall_time += calc_seconds();
    try {
      write_checkpoint(fe_.checkpoint, key_, now, system_.write_snapshot());
    } catch (const std::runtime_error& e) {  // a full disk takes no results
      if (on_lost_checkpoint_) on_lost_checkpoint_(e.what());
      return;
    }
    if (on_checkpoint_) on_checkpoint_();
  }

  void show(const mbs::Happening& h) {
    options_.on_happening(h);
    state_.shown.emplace_back(h);
  }

  void show_frame(double at) {
    mbs::View v = motion_.calc_view(system_, at);
    add_ledger(v.energy);
    state_.energy_error = std::max(state_.energy_error, std::abs(v.energy.residual));
    state_.released = std::max(state_.released, v.energy.released);
    const double speed = motion_.calc_speed(v);
    note_quiet(state_.quiet_since, speed < k_.rest_speed, at);
    note_quiet(state_.swings_since, speed < kSwing * k_.rest_speed, at);
    state_.swing.most_speed = std::max(state_.swing.most_speed, speed);
    state_.swing.has_turned = speed < kTurned * state_.swing.most_speed;
    state_.swing.path.push_back(motion_.calc_upper_place(v));
    note_early_damage();
    if (!state_.has_fragments && !state_.shown.empty()) look_at_fragments(false, at);
    show_changes(v);
    options_.on_frame(v);
    state_.shown.emplace_back(std::move(v));
    state_.foot_forces.push_back(motion_.calc_foot_forces(system_));
  }

  /// A landing between frames: from the last one on in free fall, which adds at most g times the frame's length to the
  /// speed; the energy of all bodies as it grew between the last two, as the impact takes some of it at once.
  mbs::Landing carry_on(size_t b, double time) const {
    const mbs::View *last = nullptr, *before = nullptr;
    for (auto entry = state_.shown.rbegin(); entry != state_.shown.rend() && !before; ++entry)
      if (const mbs::View* v = std::get_if<mbs::View>(&*entry)) (last ? before : last) = v;
    if (!last) return {};
    const double since = time - last->time;
    const Vec3 v = last->v_WB[b] + since * model_.gravity;
    const Vec3 w_B = transpose_times(to_matrix(last->X_WB[b].q), last->w_WB[b]);
    const double k = last->energy.kinetic;
    return {last->centre[b] + since * last->v_WB[b],
            0.5 * last->mass[b] * dot(v, v) + 0.5 * dot(w_B, model_.bodies[b].inertia * w_B),
            -last->mass[b] * dot(v, model_.contact.normal),
            before ? k + (k - before->energy.kinetic) / (last->time - before->time) * since : k};
  }

  /// Touchdowns and changes of zones since the last frame.
  void show_changes(const mbs::View& v) {
    const std::vector<double>& touchdowns = system_.touchdowns();
    std::vector<mbs::Happening> list;
    for (size_t b = 0; b < model_.bodies.size() && b < touchdowns.size(); ++b) {
      if (touchdowns[b] < 0 || state_.has_touched[b] || model_.bodies[b].fixed) continue;
      state_.has_touched[b] = 1;
      mbs::Happening h;
      h.kind = mbs::Happening::Kind::GroundContact;
      h.time = touchdowns[b] + state_.offset;
      h.index = static_cast<int>(b);
      h.landing = carry_on(b, h.time);
      if (v.mass[b] > 0) h.speed = std::max(0.0, h.landing.momentum / v.mass[b]);  // of its mass centre
      list.push_back(h);
    }
    std::stable_sort(list.begin(), list.end(),
                     [](const mbs::Happening& a, const mbs::Happening& b) { return a.time < b.time; });
    for (const mbs::Happening& h : list) show(h);
    for (size_t z = 0; z < state_.zone_state.size(); ++z) {
      const auto now = static_cast<unsigned char>(v.element_state[z]);
      if (now <= state_.zone_state[z]) continue;
      state_.zone_state[z] = now;
      const bool is_rotational = z >= map_.elements.size();
      const collapse::ZoneEntry& entry = is_rotational ? map_.rotationals[z - map_.elements.size()] : map_.elements[z];
      if (entry.firing_time <= v.time) continue;  // the charge did that
      mbs::Happening h;
      h.time = v.time;
      h.index = static_cast<int>(z);
      switch (v.element_state[z]) {
        case mbs::ElementState::Yielded:
          h.kind = mbs::Happening::Kind::ElementYielded;
          break;
        case mbs::ElementState::Softening:
          h.kind = mbs::Happening::Kind::ElementSoftening;
          break;
        default:
          h.kind = mbs::Happening::Kind::ElementBroken;
          h.reason = "removal of its elements";
      }
      show(h);
    }
  }

  void fire(const collapse::Firing& f) {
    for (size_t c = 0; c < whole_.charges.size(); ++c)
      if (whole_.charges[c].stage == f.stage && whole_.charges[c].charge == f.charge)
        system_.release(static_cast<int>(c));
    state_.quiet_since = state_.swings_since = -1;
    state_.swing = {};
    state_.swing.path = {motion_.calc_upper_place(motion_.calc_view(system_, f.time))};
    for (size_t e = 0; e < map_.events.size(); ++e) {
      const collapse::EventEntry& entry = map_.events[e];
      if (entry.stage != f.stage || entry.charge != f.charge || entry.is_aftermath) continue;
      mbs::Happening h;
      h.kind = mbs::Happening::Kind::EventFired;
      h.time = f.time;
      h.index = static_cast<int>(e);
      show(h);
    }
  }

  bool is_at_rest() const {
    return state_.next_firing == schedule_.size() && state_.quiet_since >= 0 &&
           time() - std::max(state_.quiet_since, last_firing_) >= k_.rest_time;
  }

  static void note_quiet(double& since, bool is_quiet, double at) {
    if (!is_quiet) since = -1;
    if (is_quiet && since < 0) since = at;
  }

  /// The elements' ledger begins anew when they are settled; the record's goes on.
  void add_ledger(mbs::Energy& e) const {
    const mbs::Energy& base = state_.ledger;
    e.gravity += base.gravity;
    e.plastic += base.plastic;
    e.damping += base.damping;
    e.friction += base.friction;
    e.contact_loss += base.contact_loss;
    e.removed += base.removed;
    e.residual += base.residual;
    e.released += base.released;
  }
  static double calc_sum(const mbs::Energy& e) {
    return e.kinetic + e.gravity + e.elastic + e.contact + e.plastic + e.damping + e.friction + e.contact_loss +
           e.removed;
  }

  /// What only swings about where it stands comes to rest in the wait before the next charge: it is settled without
  /// motion, and the plan's clock put forward to two frames before the charge. That may be after its first swing, if
  /// this went at least as far as where it comes to rest, or when it has been swinging for a while. What finds no
  /// equilibrium so is followed in time. False: cancelled.
  [[nodiscard]] bool skip_quiet() {
    if (!fe_.skip_quiet || state_.next_firing == schedule_.size() || state_.swings_since < 0) return true;
    const bool is_first = time() - state_.swings_since < k_.rest_time;
    if (is_first && (!state_.swing.has_turned || state_.swing.is_short)) return true;
    const long long to =
        static_cast<long long>(std::floor(schedule_[state_.next_firing].time / options_.frame_interval)) - 1;
    if (to <= state_.next_frame) return true;
    if (!state_.unsettled.empty() && state_.unsettled.back().firing == state_.next_firing) return true;
    mbs::Energy before = motion_.calc_view(system_, time()).energy;
    add_ledger(before);
    const std::vector<std::byte> swinging = system_.write_snapshot();
    fem::RelaxationOptions settling;
    settling.tolerance = kSettled;
    const fem::RelaxationSummary relaxed = system_.relax(settling, settle_);
    if (!relaxed.converged) {
      system_.read_snapshot(swinging);
      if (options_.progress.is_cancelled()) return false;
      if (is_first) {
        state_.swing.is_short = true;
        return true;
      }
      state_.unsettled.push_back({state_.next_firing, time(), relaxed.residual, relaxed.steps});
      return true;
    }
    const mbs::View settled = motion_.calc_view(system_, time());
    if (is_first && !state_.swing.has_passed(motion_.calc_upper_place(settled))) {
      system_.read_snapshot(swinging);
      state_.swing.is_short = true;
      return true;
    }
    state_.ledger = {};
    const mbs::Energy& after = settled.energy;
    state_.ledger.gravity = before.gravity - after.gravity;
    state_.ledger.plastic = before.plastic - after.plastic;
    state_.ledger.friction = before.friction - after.friction;
    state_.ledger.contact_loss = before.contact_loss - after.contact_loss;
    state_.ledger.removed = before.removed - after.removed;
    state_.ledger.residual = before.residual - after.residual;
    state_.ledger.released = before.released - after.released;
    // what swung has been damped
    mbs::Energy now = after;
    add_ledger(now);
    state_.ledger.damping = calc_sum(before) - calc_sum(now);
    const double jump = frame_time(to) - frame_time(state_.next_frame);
    state_.skipped.push_back({time(), time() + jump, relaxed.settlement});
    state_.offset += jump;
    state_.next_frame = to;
    state_.swings_since = state_.quiet_since = -1;
    return true;
  }

  /// Weight of what moves against the force of the ground in the first frame, over the weight.
  double calc_start_reaction_error() const {
    const auto* v = state_.shown.empty() ? nullptr : std::get_if<mbs::View>(&state_.shown.front());
    if (!v) return 0;
    double weight = 0;
    for (size_t b = 0; b < model_.bodies.size(); ++b)
      if (!model_.bodies[b].fixed) weight += v->mass[b] * norm(model_.gravity);
    for (size_t e = 0; e < whole_.is_stump.size(); ++e)  // what mass scaling added has weight too
      if (whole_.is_stump[e] == 0) weight += system_.added_mass(static_cast<int>(e)) * norm(model_.gravity);
    return weight > 0 ? std::abs(norm(v->ground_force) - weight) / weight : 0;
  }

  /// As of each frame until a part lands.
  void note_early_damage() {
    const std::vector<double>& touchdowns = system_.touchdowns();
    double& landing = state_.early_damage.landing;
    if (landing >= 0) return;
    for (size_t b = 0; b < model_.bodies.size() && b < touchdowns.size(); ++b)
      if (touchdowns[b] >= 0 && !model_.bodies[b].fixed)
        landing = landing < 0 ? touchdowns[b] : std::min(landing, touchdowns[b]);
    state_.early_damage.note(system_, whole_.fe.elements.size());
  }

  /// When the upper block first touches down, and again at the end if it never did.
  void look_at_fragments(bool at_end, double at) {
    const std::vector<double>& touchdowns = system_.touchdowns();
    bool has_touched = false;
    for (size_t b = 0; b < map_.bodies.size() && b < touchdowns.size(); ++b)
      has_touched |= map_.bodies[b].is_upper && touchdowns[b] >= 0;
    if (!has_touched && !at_end) return;
    state_.has_fragments = true;
    state_.fragments_time = at;
    state_.fragments = find_fragments(plan_, whole_, system_, list_zones(), fe_.grid.size, state_.early_damage);
  }

  /// The manager's zones as they stand in the record.
  std::vector<record::ZoneInfo> list_zones() const {
    std::vector<record::ZoneInfo> zones;
    const auto add = [&zones](const collapse::ZoneEntry& z) {
      zones.push_back({z.name, z.member, z.subsystem, z.body_a, z.body_b, z.p_W});
    };
    for (const collapse::ZoneEntry& z : map_.elements) add(z);
    for (const collapse::ZoneEntry& z : map_.rotationals) add(z);
    return zones;
  }

 public:
  void finish() {
    if (!state_.has_fragments && !state_.shown.empty()) look_at_fragments(true, time());
  }

 private:
  const product::Plan& plan_;
  const collapse::Knowledge& k_;
  const FeOptions& fe_;
  const mbs::Options options_;
  const mbs::Model& model_;
  const collapse::ModelMap& map_;
  Whole whole_;
  MeshReport mesh_;
  fem::ExplicitSystem system_;
  MassScaling scaling_;
  Motion motion_;
  std::string key_;
  std::vector<collapse::Firing> schedule_;
  double last_firing_ = 0;
  RunState state_;
  Clock::time_point start_;
  Progress settle_;
  std::function<void(const fem::RelaxationSummary&)> on_relaxed_;
  std::function<void(const fem::ExplicitSystem::Timing&)> on_timing_;
  std::function<void()> on_checkpoint_;
  std::function<void(const std::string&)> on_lost_checkpoint_;
};

std::string Course::describe_overload() const {
  double farthest = 0, most = 0;
  int moved = -1, yielded = -1;  // elements
  for (size_t e = 0; e < whole_.fe.elements.size(); ++e) {
    for (const int n : whole_.fe.elements[e].node) {
      const double way = norm(system_.p(n) - whole_.fe.nodes[static_cast<size_t>(n)]);
      if (way > farthest) farthest = way, moved = static_cast<int>(e);
    }
    const double strain = system_.plastic_strain(static_cast<int>(e));
    if (strain > most) most = strain, yielded = static_cast<int>(e);
  }
  const auto place_of = [&](int e, const char* what) {
    const Cell& c = whole_.grid.cells[static_cast<size_t>(e)];
    return fmt::format("; {} {} ({:.1f}, {:.1f}, {:.1f}) m", plan_.members[static_cast<size_t>(c.member)].name, what,
                       c.centre.x, c.centre.y, c.centre.z);
  };
  std::string text;
  if (yielded >= 0) text += place_of(yielded, "yields most, at");
  if (moved >= 0) text += place_of(moved, "has moved farthest, from");
  return text;
}

void Course::add_findings(record::Record& r) const {
  const auto add = [&r](const std::string& id, const char* title, const std::string& text, double value,
                        const char* unit, Status status) {
    record::add_finding(r, {id, "Finite elements", title, text, value, unit, status});
  };
  add_fragment_findings(plan_, state_.fragments, state_.fragments_time, r);
  judge_rubble(plan_, whole_.fe, system_.debris(), r);
  std::string text;
  for (const std::string& line : describe(mesh_)) text += (text.empty() ? "" : " ") + line;
  add("farfield.mesh", "Mesh", text, mesh_.mesh.elements, "1", Status::Info);
  if (scaling_.mass > 0)
    add("farfield.scaled", "Mass scaling", scaling_.describe(), scaling_.mass, "kg",
        adds_much(scaling_) ? Status::Warning : Status::Info);
  add("farfield.settling", "Dead load",
      fmt::format("Put on without motion in {} steps: {:.1e} of the load is out of balance, the building settled by up "
                  "to {:.1f} mm.",
                  state_.relaxation.steps, state_.relaxation.residual, 1e3 * state_.relaxation.settlement),
      state_.relaxation.residual, "1", state_.relaxation.converged ? Status::Good : Status::Bad);
  const fem::ExplicitEnergy e = system_.calc_energy();
  const double inner = e.elastic + e.plastic + e.plastic_hourglass + e.removed_internal;
  const double corner = inner > 0 ? (e.corner_hourglass + e.plastic_corner) / inner : 0;
  const double all = inner > 0 ? (e.elastic_hourglass + e.plastic_hourglass) / inner : 0;
  add("farfield.hourglass", "Stabilisation of elements",
      fmt::format(
          "Modes that no beam theory knows hold {:.2g} % of the internal energy at the end (accepted: 5 %); all "
          "that varies inside elements, which is bending too, {:.2g} %.",
          100 * corner, 100 * all),
      corner, "1", corner <= 0.05 ? Status::Good : Status::Warning);
  int charged = 0, torn = 0, crushed = 0, degenerate = 0;
  double mass = 0;
  for (const fem::Removal& x : system_.removals()) {
    charged += x.cause == fem::RemovalCause::Charge;
    torn += x.cause == fem::RemovalCause::Tension;
    crushed += x.cause == fem::RemovalCause::Compression;
    degenerate += x.cause == fem::RemovalCause::Degenerate;
    mass += x.mass;
  }
  add("farfield.removed", "Elements that went",
      fmt::format("{} by charges, {} torn, {} crushed, {} out of shape; {:.1f} t in all. Of what was not charged {} "
                  "pieces stay as debris.",
                  charged, torn, crushed, degenerate, mass / unit::t, system_.debris().size()),
      mass, "kg", Status::Info);
  for (const auto& s : state_.skipped)
    add(fmt::format("farfield.skipped.{}", &s - state_.skipped.data() + 1), "Wait passed over",
        fmt::format("At {:.2f} s the building only swung about where it stands. It was settled without motion, and the "
                    "clock was put forward to {:.2f} s; it stands within {:.1f} mm of where it was last at rest.",
                    s[0], s[1], 1e3 * s[2]),
        s[1] - s[0], "s", Status::Info);
  for (size_t i = 0; i < state_.unsettled.size(); ++i)
    add(fmt::format("farfield.unsettled.{}", i + 1), "Wait followed in time",
        fmt::format(
            "At {:.2f} s the building seemed to swing about where it stands, but found no equilibrium there: {:.1e} "
            "of the load was out of balance after {} steps without motion. The wait was not passed over.",
            state_.unsettled[i].time, state_.unsettled[i].residual, state_.unsettled[i].steps),
        kNone, "", Status::Warning);
  for (size_t i = 0; i < whole_.notes.size(); ++i)
    add(fmt::format("farfield.note.{}", i + 1), "Left out", whole_.notes[i], kNone, "", Status::Warning);

  for (record::Finding& f : r.findings) {
    if (f.id != "verification.equilibrium" || !state_.relaxation.converged) continue;
    // settled to a thousandth of the load, not to round-off; charges that fire at once are at work in the first frame
    const bool early = !schedule_.empty() && schedule_.front().time <= 0;
    // against the elements' weight: cells may lie with another body than the plan's metres do
    if (!early) f.value = calc_start_reaction_error();
    f.text = fmt::format("{:.1e} of the load is out of balance (accepted: {:.1e})", state_.relaxation.residual,
                         fem::RelaxationOptions{}.tolerance);
    if (!early)
      f.text += fmt::format(", and the reactions of the ground differ from the weight by {:.1e} of it", f.value);
    f.text += ".";
    f.status = early || f.value < kReaction ? Status::Good : Status::Bad;
  }
  for (record::Finding& f : r.findings)
    if (f.id == "verification.step")
      f.text = fmt::format("{:.4f} ms in {} steps; the worst element alone bears {:.4f} ms.", 1e3 * system_.step(),
                           system_.steps(), 1e3 * mesh_.mesh.critical_step);
  // rows of the grid that stand on the ground
  for (size_t row = 0; row < plan_.row_names.size(); ++row) {
    record::Series s{
        "ground_force_row_" + plan_.row_names[row], "Load on row " + plan_.row_names[row], "N", "force", {}};
    bool has = false;
    for (const std::vector<double>& forces : state_.foot_forces) {
      double sum = 0;
      for (size_t f = 0; f < whole_.feet.size(); ++f) {
        const product::Member& m = plan_.members[static_cast<size_t>(whole_.feet[f].member)];
        if (m.kind != product::MemberKind::Column || m.row_a != static_cast<int>(row)) continue;
        has = true;
        sum += forces[f];
      }
      s.value.push_back(sum);
    }
    if (has && s.value.size() == r.time.size()) r.series.push_back(std::move(s));
  }
}

/// The elements crack within bays and panels, which the multibody model does not; what they lack is something else.
void say_what_is_not_modelled(record::Record& r) {
  const std::string here =
      "cracks that close again after bars have yielded, slip and buckling of single bars, at which face the bars of a "
      "section lie and which way they run (concrete and bars are one material: a beam with its bars at the wrong face "
      "stands), failure by shear, buckling of members beyond what their elements do; rubble in reach and hill";
  for (std::string& s : r.not_modelled)
    if (s.rfind("cracking and crushing of slabs", 0) == 0) s = here;
  // of zones alone: elements beside a charge are weakened wherever they are
  r.findings.erase(std::remove_if(r.findings.begin(), r.findings.end(),
                                  [](const record::Finding& f) { return f.title == "Damage without effect"; }),
                   r.findings.end());
  for (record::Finding& f : r.findings)
    if (f.id == "not_modelled") f.text = collapse::tell_not_modelled(r.not_modelled);
}

}  // namespace

std::string MassScaling::describe() const {
  if (!(mass > 0)) return "";
  const std::string text =
      fmt::format("{} elements got {:.2f} t more mass ({:.2g} % of all), so that they bear a step of {:.4f} ms.",
                  elements, mass / unit::t, 100 * share, 1e3 * step);
  return adds_much(*this)
             ? text + " It has weight too: this is the answer of another building. Choose a shorter scaled step."
             : text;
}

MassScaling calc_mass_scaling(const Whole& whole, const MeshReport& mesh, const collapse::Knowledge& k,
                              double scaled_step) {
  const MassScaling s = find_scaling({whole.fe, make_options(k, scaled_step, 1)}, mesh, scaled_step);
  check_added_mass(s, mesh);
  return s;
}

Whole make_whole(const product::Plan& plan, const collapse::Knowledge& k, const GridOptions& grid, int threads) {
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(plan, k, map, threads);
  return make_whole(plan, k, grid, model, map);
}

record::Record run_plan(const product::Plan& plan, const collapse::Knowledge& k, const collapse::RunOptions& run,
                        const FeOptions& fe, const collapse::RunCallbacks& callbacks, const FeCallbacks& fe_callbacks) {
  const double duration = run.duration > 0 ? run.duration : plan.analysis.duration;
  if (fe.scaled_step <= duration) mbs::check_step(fe.scaled_step, duration);  // longer ones add mass
  std::unique_ptr<Course> course;
  // the manager's model must live as long as the course
  mbs::Model model;
  collapse::ModelMap map;
  record::Record r =
      collapse::run_plan(plan, k, run, callbacks, "finite elements",
                         [&](const mbs::Model& m, const collapse::ModelMap& described, const mbs::Options& options) {
                           model = m;
                           map = described;
                           course = std::make_unique<Course>(plan, k, fe, fe_callbacks, run, model, map, options);
                           mbs::Summary s = course->run();
                           course->finish();
                           return s;
                         });
  say_what_is_not_modelled(r);
  if (course) course->add_findings(r);
  return r;
}

}  // namespace topple::farfield
