#include "study/manager.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "base/error.h"
#include "study/evaluator.h"
#include "study/limits.h"
#include "study/permissible.h"
#include "study/requirement.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;
using uncertainty::Result;

/// Names of outputs and outcomes, numbered in the order in which the analysis meets them: the same in every repetition.
class Names {
 public:
  /// Throws InputError E823.
  Result translate(const Answer& a) {
    Result r;
    r.text = a.text;
    if (a.kind != Answer::Kind::Done) {
      r.state = Result::State::Failed;
      return r;
    }
    r.state = Result::State::Done;
    if (!has_outputs_) {
      for (const auto& [name, value] : a.outputs) outputs.push_back(name);
      has_outputs_ = true;
    }
    const auto complain = [this, &a] {
      std::string before, now;
      for (const std::string& name : outputs) before += (before.empty() ? "" : ", ") + name;
      for (const auto& [name, value] : a.outputs) now += (now.empty() ? "" : ", ") + name;
      throw InputError("E823",
                       fmt::format("the model gave the outputs {} at one point and {} at another",
                                   before.empty() ? "none" : before, now.empty() ? "none" : now),
                       "give the same outputs at every point, then give the command again");
    };
    if (a.outputs.size() != outputs.size()) complain();
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const auto found =
          a.outputs[i].first == outputs[i]
              ? a.outputs.begin() + static_cast<std::ptrdiff_t>(i)
              : std::find_if(a.outputs.begin(), a.outputs.end(), [&](const auto& o) { return o.first == outputs[i]; });
      if (found == a.outputs.end()) complain();
      r.values.push_back(found->second);
    }
    if (ordinates_ == 0) ordinates_ = a.trajectory.size();
    if (!a.trajectory.empty() && a.trajectory.size() != ordinates_)
      throw InputError("E823",
                       fmt::format("the model gave a trajectory of the length {} at one point and of the length {} at "
                                   "another",
                                   ordinates_, a.trajectory.size()),
                       "give values over the same grid at every point, then give the command again");
    const auto [place, is_new] = numbers_.try_emplace(a.outcome, static_cast<int>(outcomes.size()));
    if (is_new) outcomes.push_back(a.outcome);
    r.outcome = place->second;
    r.trajectory = a.trajectory;
    return r;
  }

  std::vector<std::string> outputs, outcomes;

 private:
  std::map<std::string, int> numbers_;
  bool has_outputs_ = false;
  std::size_t ordinates_ = 0;  // of trajectories; 0: none so far
};

Point complete(const Problem& p, const Point& x) {
  Point all = x;
  if (p.calc_derived)
    for (const double v : p.calc_derived(x)) all.push_back(v);
  return all;
}

/// The formula that has no value at a point, or empty.
std::string find_fault(const Problem& p, const Point& all) {
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!std::isfinite(all[i]))
      return i < p.inputs.size() ? "an input is not finite"
                                 : p.derived.at(i - p.inputs.size()).name + ": the formula has no value there";
  return {};
}

/// All that is needed to read the study again.
std::string make_study_definition(const Problem& p, const StudyOptions& options) {
  json d{{"kind", p.kind},
         {"file", options.source_name},
         {"text", options.source},
         {"identity", json::parse(p.identity)},
         {"settings", json::parse(p.settings)},
         {"levels", make_alpha_options(p).levels},
         {"limit", make_alpha_options(p).limit},
         {"seed", p.seed},
         {"permissible", p.permissible},
         {"drivers", p.has_drivers}};
  if (p.whole) d["confirm"] = p.confirm;
  if (!options.directory.empty()) d["directory"] = options.directory;
  return d.dump();
}

/// Whether two definitions are those of one study; its file may lie elsewhere.
bool are_alike(const std::string& a, const std::string& b) {
  json one = json::parse(a), other = json::parse(b);
  one.erase("file"), other.erase("file");
  return one == other;
}

/// Hashes of the answers whose outputs, or the length of whose trajectories, are not those of most others: an older
/// version kept them.
std::vector<std::string> find_strangers(const std::vector<StoredResult>& results) {
  const auto most = [](const auto& counts) {
    return std::max_element(counts.begin(), counts.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; });
  };
  std::map<std::vector<std::string>, int> names;
  std::map<std::size_t, int> lengths;
  for (const StoredResult& r : results)
    if (r.answer.kind == Answer::Kind::Done) {
      ++names[list_outputs(r.answer)];
      if (!r.answer.trajectory.empty()) ++lengths[r.answer.trajectory.size()];
    }
  std::vector<std::string> strangers;
  if (names.size() < 2 && lengths.size() < 2) return strangers;
  for (const StoredResult& r : results) {
    if (r.answer.kind != Answer::Kind::Done) continue;
    const bool has_other_length = !r.answer.trajectory.empty() && r.answer.trajectory.size() != most(lengths)->first;
    if (has_other_length || list_outputs(r.answer) != most(names)->first) strangers.push_back(r.hash);
  }
  return strangers;
}

/// Whether a stored point is one of this problem: formulas, numbers and constraints may have changed since it was run.
bool belongs_to(const Problem& p, const uncertainty::Box& support, const Point& stored) {
  const std::size_t n = p.inputs.size();
  if (stored.size() < n) return false;
  const Point x(stored.begin(), stored.begin() + static_cast<std::ptrdiff_t>(n));
  if (!uncertainty::is_in_cut(p.space, support, 0, x)) return false;
  return std::ranges::equal(stored, complete(p, x),
                            [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); });
}

std::vector<std::string> list_failures(const uncertainty::Archive& archive) {
  std::map<std::string, int> counts;
  for (const auto& s : archive.samples())
    if (s.result.state == Result::State::Failed) ++counts[s.result.text];
  std::vector<std::pair<std::string, int>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::vector<std::string> lines;
  for (const auto& [text, count] : sorted) lines.push_back(fmt::format("{} x {}", count, text));
  return lines;
}

/// Why whole runs failed.
void add_failures(const Confirmation& c, std::vector<std::string>& lines) {
  for (const Confirmation::Run& run : c.runs)
    if (run.whole.state == Result::State::Failed)
      lines.push_back(fmt::format("the whole run beside number {}: {}", run.sample, run.whole.text));
}

/// Whether a search for an outcome that was found with an input known has not come to its end.
bool has_open_knowing(const Insights& in) {
  return std::any_of(in.knowing.begin(), in.knowing.end(), [](const auto& f) {
    return std::any_of(f.classes.begin(), f.classes.end(),
                       [](const auto& c) { return c.possibility > 0 && !c.converged; });
  });
}

bool has_open_bounds(const std::vector<uncertainty::OutputBounds>& outputs) {
  for (const auto& o : outputs)
    for (const auto& l : o.levels)
      if ((l.lower.sample >= 0 && !l.lower.converged) || (l.upper.sample >= 0 && !l.upper.converged)) return true;
  return false;
}

bool has_open_bounds(const uncertainty::AlphaResult& alpha) {
  return has_open_bounds(alpha.outputs) ||
         std::ranges::any_of(alpha.classes, [](const auto& c) { return has_open_bounds(c.outputs); });
}

bool has_open_boxes(const Insights& in) {
  return std::ranges::any_of(in.boxes.boxes, [](const auto& b) { return b.kept && has_open_bounds(b.outputs); });
}

bool is_any_open(const std::vector<uncertainty::Possibility>& found) {
  return std::any_of(found.begin(), found.end(), [](const auto& c) { return !c.converged; });
}

/// All bounds in a fixed order: of all runs, then of each class.
template <class Alpha, class F>
void for_each_level(Alpha& alpha, F work) {
  for (auto& o : alpha.outputs)
    for (auto& l : o.levels) work(l);
  for (auto& c : alpha.classes)
    for (auto& o : c.outputs)
      for (auto& l : o.levels) work(l);
}

/// Answers batches out of the store, with the help of workers.
class Manager {
 public:
  Manager(const Problem& problem, const RunnerFactories& factories, const StudyOptions& options,
          const Progress& progress, const std::function<void(const StudyState&)>& watch)
      : problem_(problem),
        asked_problem_(&problem),
        factories_(factories),
        options_(options),
        progress_(progress),
        watch_(watch),
        model_(calc_model_hash(problem)),
        asked_model_(model_),
        store_(options.store, progress.cancel, options.pool.patience) {
    std::optional<StudyRow> there;
    std::vector<StoredResult> results;
    std::vector<std::string> strangers;
    row_ = {options.name, model_, make_study_definition(problem, options), "open", ""};
    do {  // until nobody else began or changed a study of this name meanwhile
      there = store_.find_study(options.name);
      if (there && there->model != model_) refuse(*there);
      if (there && options.is_new && !are_alike(there->definition, row_.definition))
        throw InputError("E822",
                         fmt::format("{} holds another study \"{}\"", hide_password(options.store), options.name),
                         "give another --name, or go on in that study's own folder");
      results = store_.load_results(model_);
      strangers = find_strangers(results);
      // what is refused changes nothing
      for (const StoredResult& r : results)
        if (std::ranges::find(strangers, r.hash) == strangers.end()) check_request(r.answer);
      store_.put_model(model_, make_model_definition(problem));
    } while (!store_.begin_study(row_, there));
    if (there && there->state == "finished" && !options.rerun_failed && strangers.empty()) finished_ = *there;
    if (options.accepted) options.accepted();
    release_dead_workers(store_);
    store_.forget_refusals(model_);
    if (options.rerun_failed) {
      store_.rerun_failed(model_);
      results = store_.load_results(model_);
    }
    if (!strangers.empty()) store_.rerun(strangers);
    for (StoredResult& r : results) known_.emplace(std::move(r.hash), std::move(r.answer));
    for (const std::string& hash : strangers) known_.erase(hash);
    start_pool();
  }

  void evaluate(std::span<const Point> batch, std::span<Result> out) {
    std::vector<std::string> hashes(batch.size()), open;
    std::vector<std::pair<std::string, Point>> jobs;
    std::vector<StoredResult> impossible;  // without a run
    for (std::size_t i = 0; i < batch.size(); ++i) {
      Point all = complete(*asked_problem_, batch[i]);
      if (const std::string fault = find_fault(*asked_problem_, all); !fault.empty()) {
        hashes[i] = calc_job_hash(asked_model_, all);
        if (known_.contains(hashes[i])) continue;
        Answer a;
        a.kind = Answer::Kind::Failed;
        a.text = fault;
        known_.emplace(hashes[i], a);
        impossible.push_back({hashes[i], std::move(all), std::move(a)});
        continue;
      }
      hashes[i] = calc_job_hash(asked_model_, all);
      if (known_.contains(hashes[i])) continue;
      open.push_back(hashes[i]);
      jobs.emplace_back(hashes[i], std::move(all));
    }
    if (!impossible.empty()) store_.add_impossible(asked_model_, impossible);
    if (!jobs.empty()) {
      store_.add_jobs(asked_model_, jobs);
      pool_->wake();
      arrived_ = static_cast<long>(batch.size() - jobs.size());  // were there before
      failed_arrived_ = std::ranges::count_if(hashes, [this](const std::string& hash) {
        const auto found = known_.find(hash);
        return found != known_.end() && found->second.kind != Answer::Kind::Done;
      });
      wait_for(open);
    }
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto found = known_.find(hashes[i]);
      if (found == known_.end()) continue;  // cancelled: not run
      check_request(found->second);
      try {
        out[i] = names_.translate(found->second);
      } catch (const InputError&) {
        store_.rerun({hashes[i]});  // workers in two places began with different forms
        throw;
      }
      ++asked_;
      failed_ += out[i].state == Result::State::Failed;
    }
    open_ = arrived_ = failed_arrived_ = 0;
    show(false);
  }

  StudyResult run() {
    uncertainty::AlphaOptions options = make_alpha_options(problem_);
    limit_ = options.limit;
    options.watch = [this](const uncertainty::AlphaResult& so_far, const uncertainty::Archive&) {
      result_.alpha = so_far;
      result_.outputs = names_.outputs;
      result_.outcomes = names_.outcomes;
      show(false);
    };
    Progress quiet;
    quiet.cancel = progress_.cancel;
    const Budget budget = calc_budget(problem_, limit_);
    uncertainty::Asker asker([this](auto batch, auto out) { evaluate(batch, out); }, quiet, nullptr, budget.bounds);
    StudyResult r;
    ask_for_drivers(problem_, budget, asker);
    const auto count_runs_of_limits = [&] {
      return budget.of_limit * count_open_limits(problem_, r, asker.archive(), names_.outputs);
    };
    const auto find_broken_limits = [&] {
      asker.set_limit(std::min(budget.possibilities, asker.asked() + count_runs_of_limits()));
      if (asker.can_go_on()) find_limits(r, problem_, asker, names_.outputs);
    };
    // possibilities before the bounds of each outcome, for which a quarter of the runs is kept
    options.before_classes = [&] {
      find_broken_limits();
      asker.set_limit(budget.possibilities - (budget.possibilities - asker.asked()) / 4);
      find_possibilities(r, asker);
      asker.set_limit(std::max(budget.bounds, asker.asked() + 3 * (budget.possibilities - asker.asked()) / 4));
      return r.possibilities.facets;
    };
    uncertainty::AlphaSearch search(problem_.space, asker, options);
    r.alpha = search.run();
    const int asked_by_bounds = asker.asked();
    const auto has_classes = [&r] { return r.alpha.classes.size() > 1; };
    if (!asker.is_cancelled() && !has_classes()) find_broken_limits();
    if (!asker.is_cancelled() && has_classes()) {
      asker.set_limit(budget.possibilities -
                      std::min(count_runs_of_limits(), (budget.possibilities - asker.asked()) / 2));
      find_possibilities(r, asker);
      find_broken_limits();
      if (!asker.is_cancelled() && budget.knowing > 0) {
        asker.set_limit(budget.outcomes);
        find_knowing(r, asker);
      }
    }
    if (!asker.is_cancelled() && !problem_.permissible.empty()) {
      const int before = asker.asked();
      asker.set_limit(before + budget.requirement);
      find_requirement(r, problem_, asker, names_.outputs, names_.outcomes);
      asker.set_limit(budget.limit - budget.in_boxes - (asker.asked() - before));
      find_boxes(r.insights, problem_, budget, asker, options.levels, names_.outputs, names_.outcomes);
      if (r.insights.has_boxes && !asker.is_cancelled() &&
          std::ranges::none_of(r.insights.boxes.boxes, [](const auto& b) { return b.kept; })) {
        // a check that was cut off goes on with what bounds inside boxes would have had
        asker.set_limit(budget.limit);
        find_boxes(r.insights, problem_, budget, asker, options.levels, names_.outputs, names_.outcomes);
      }
    }
    const bool has_boxes = r.insights.has_boxes;
    asker.set_limit(budget.limit - (has_boxes ? budget.in_boxes : 0));
    give_back(r, asker, search);
    asker.set_limit(budget.limit);
    if (problem_.permissible.empty()) look_further(r, asker, search);
    finish_boxes(r.insights, problem_, asker, options.levels, names_.outputs, names_.outcomes);
    if (has_boxes && asker.can_go_on()) {
      give_back(r, asker, search);
      finish_boxes(r.insights, problem_, asker, options.levels, names_.outputs, names_.outcomes);
    }
    if (asker.asked() > asked_by_bounds || has_classes()) {
      // further runs may have moved bounds
      std::vector<int> space_points;
      for (const auto& c : r.alpha.coverage) space_points.push_back(c.space_points);
      uncertainty::AlphaResult again =
          uncertainty::read_archive(problem_.space, asker.archive(), options.levels, space_points);
      again.ending = r.alpha.ending;
      keep_marks(r.alpha, again);
      r.alpha = std::move(again);
    }
    // later runs may have found more
    r.possibilities.classes = uncertainty::read_possibilities(problem_.space, asker.archive(), r.possibilities.classes);
    read_requirement(r, problem_, asker.archive(), names_.outputs, names_.outcomes);
    read_limits(r, problem_, asker.archive(), names_.outputs);
    r.ending = find_ending(r, asker);
    read_drivers(r.insights, problem_, budget, asker.archive());
    r.spread = find_spread_samples(problem_, budget, asker.archive());
    r.alpha.archive = asker.archive();
    r.alpha.ending = r.ending;
    r.outputs = names_.outputs;
    r.outcomes = names_.outcomes;
    r.failures = list_failures(r.alpha.archive);
    r.is_finished = !asker.is_cancelled();
    if (r.is_finished && problem_.whole) {
      result_ = r;
      confirm(r);
      r.is_finished = !progress_.is_cancelled();
    }
    pool_.reset();
    if (r.is_finished) {
      row_.state = "finished";
      json order = json::array();
      for (const auto& s : r.alpha.archive.samples()) order.push_back(calc_job_hash(model_, complete(problem_, s.x)));
      row_.summary = json{{"ending", uncertainty::to_text(r.ending)},
                          {"outputs", r.outputs},
                          {"outcomes", r.outcomes},
                          {"order", order},
                          {"marks", make_marks(r)},
                          {"insights", to_json(r.insights)}}
                         .dump();
      store_.put_study(row_);
    }
    result_ = r;
    show(true);
    return r;
  }

  /// Whether anything new was run.
  bool has_run() const { return run_here_ > 0; }

  /// A study that was finished before a command that is refused, or that ended before anything new was run, stays
  /// finished: all that it found is there.
  void keep_finished() {
    pool_.reset();
    if (finished_) store_.put_study(*finished_);
  }

 private:
  /// From where the last search ended; what has converged and still holds takes no runs.
  void find_possibilities(StudyResult& r, uncertainty::Asker& asker) const {
    uncertainty::PossibilityOptions o;
    o.seed = problem_.seed;
    o.known = r.possibilities.classes;
    o.facets = r.possibilities.facets;
    r.possibilities = uncertainty::find_possibilities(problem_.space, asker, o);
  }

  /// Outcomes with an input known: the runs that are there are shared evenly. Later passes look in other places.
  void find_knowing(StudyResult& r, uncertainty::Asker& asker, int pass = 0) const {
    const auto axes = std::count_if(problem_.space.inputs.begin(), problem_.space.inputs.end(),
                                    [](const auto& f) { return f.width() > 0; });
    uncertainty::PossibilityOptions o;
    o.seed = problem_.seed + 1000 * static_cast<std::uint64_t>(pass);
    if (pass > 0) o.spread = 100;
    const int each = asker.rest() / std::max(1, static_cast<int>(axes));
    r.insights.knowing = uncertainty::find_outcomes_of_knowing(problem_.space, asker, o, each, r.insights.knowing,
                                                               r.possibilities.facets);
  }

  /// What was kept for others and not used up goes to searches that had to end: first to possibilities of outcomes,
  /// which take what they need, and of the requirement and of limits, which leave three quarters to bounds, then to
  /// outcomes with an input known, the rest to bounds; and where those found a more possible run, to possibilities
  /// again.
  void give_back(StudyResult& r, uncertainty::Asker& asker, uncertainty::AlphaSearch& search) const {
    constexpr int most_passes = 3;
    const int limit = asker.limit();
    const auto settle = [&] {
      asker.set_limit(limit);
      if (asker.can_go_on() && r.alpha.classes.size() > 1) find_possibilities(r, asker);
      if (r.alpha.can_go_on) asker.set_limit(asker.asked() + asker.rest() / 4);
      if (asker.can_go_on()) find_requirement(r, problem_, asker, names_.outputs, names_.outcomes);
      if (asker.can_go_on()) find_limits(r, problem_, asker, names_.outputs);
      asker.set_limit(limit);
    };
    settle();
    for (int pass = 1; pass <= most_passes && !r.insights.knowing.empty() && asker.can_go_on(); ++pass) {
      if (pass > 1 && !has_open_knowing(r.insights)) break;
      asker.set_limit(limit - (r.alpha.can_go_on ? asker.rest() / 2 : asker.rest() / 10));
      find_knowing(r, asker, pass);
      settle();
    }
    // half of it for bounds within boxes, where there are boxes
    const int for_bounds = problem_.permissible.empty() ? limit : limit - asker.rest() / 2;
    for (const int part : {10, 0, 0, 0}) {
      asker.set_limit(for_bounds);
      if (!r.alpha.can_go_on || !asker.can_go_on()) break;
      if (part > 0 && r.alpha.classes.size() > 1) asker.set_limit(for_bounds - asker.rest() / part);
      r.alpha = search.go_on();
      settle();
    }
    asker.set_limit(limit);
  }

  /// What is left goes into spread points, until half of all runs are such, and into searches from what they meet: of
  /// an outcome in a small part of the support nothing is known before.
  void look_further(StudyResult& r, uncertainty::Asker& asker, uncertainty::AlphaSearch& search) const {
    const int axes = static_cast<int>(std::count_if(problem_.space.inputs.begin(), problem_.space.inputs.end(),
                                                    [](const auto& f) { return f.width() > 0; }));
    while (axes > 0 && asker.can_go_on()) {
      const int before = r.alpha.coverage.front().space_points;
      const int count = std::min(asker.limit() / 2 - before, asker.rest() / 2);
      if (count < 10 * axes) break;
      r.alpha = search.spread_on(count);
      // of a support without a width, as equations leave it, no place is met
      if (r.alpha.coverage.front().space_points == before) break;
      if (asker.can_go_on() && r.alpha.classes.size() > 1) find_possibilities(r, asker);
      if (asker.can_go_on()) find_limits(r, problem_, asker, names_.outputs);
    }
  }

  uncertainty::Ending find_ending(const StudyResult& r, const uncertainty::Asker& asker) const {
    using uncertainty::Ending;
    if (asker.is_cancelled()) return Ending::Cancelled;
    // searches leave what is less than a look to both sides of each input
    const bool is_used_up = asker.rest() <= 2 * std::ssize(problem_.inputs);
    // a search that had a part of the runs may have ended with them and left nothing open
    const bool is_alpha_open = r.alpha.ending == Ending::LimitReached ? is_used_up || has_open_bounds(r.alpha)
                                                                      : r.alpha.ending != Ending::Complete;
    const bool is_open = is_alpha_open || has_open_boxes(r.insights) || has_open_knowing(r.insights) ||
                         is_any_open(r.possibilities.classes) || is_any_open(r.requirement) || is_any_open(r.limits);
    if (!is_open) return Ending::Complete;
    // a search of bounds keeps a few runs for its last steps
    const bool is_cut = is_used_up || r.alpha.ending == Ending::LimitReached;
    return is_cut ? Ending::LimitReached : Ending::NotConverged;
  }

  [[noreturn]] void refuse(const StudyRow& there) {
    const std::string where = hide_password(options_.store);
    const char* help = "choose another folder or name, or delete it";
    json was = json::parse(store_.find_model(there.model).value_or("{}")),
         is = json::parse(make_model_definition(problem_));
    const auto take_build = [](json& definition) {
      json& identity = definition["identity"];
      if (!identity.is_object()) identity = json::object();
      std::string build = identity.value("topple", "");
      identity.erase("topple"), definition.erase("settings");
      return build;
    };
    const std::string old = take_build(was), now = take_build(is);
    if (was != is)
      throw InputError("E822", fmt::format("{} holds a study of another model or of other inputs", where), help);
    throw InputError(
        "E826",
        fmt::format("{} was begun with topple {}, and this is {}, which may give other answers", where, old, now),
        help);
  }

  void start_pool() {
    PoolOptions own = options_.pool;
    own.models = {asked_model_};  // programs of other studies may not be here
    pool_ = std::make_unique<Pool>(options_.store, factories_, own);
  }

  /// Whole runs of what a condensed model found.
  void confirm(StudyResult& r) {
    asked_problem_ = problem_.whole.get();
    asked_model_ = calc_model_hash(*asked_problem_);
    store_.put_model(asked_model_, make_model_definition(*asked_problem_));
    store_.forget_refusals(asked_model_);
    if (options_.rerun_failed) store_.rerun_failed(asked_model_);
    pool_.reset();
    start_pool();
    std::vector<Confirmation::Run> runs;
    std::vector<Point> points;
    for (const int sample : choose_confirmation(problem_.space, r.alpha, problem_.confirm)) {
      runs.emplace_back().sample = sample;
      points.push_back(r.alpha.archive[sample].x);
    }
    limit_ = static_cast<int>(points.size());
    before_ = {asked_, failed_, run_here_};
    start_ = Clock::now();
    is_confirming_ = true;
    show(true);
    std::vector<Result> results(points.size());
    evaluate(points, results);
    is_confirming_ = false;
    for (std::size_t i = 0; i < runs.size(); ++i) runs[i].whole = std::move(results[i]);
    r.confirmation = judge_confirmation(problem_.space, r.alpha, std::move(runs), problem_.confirm);
    add_failures(r.confirmation, r.failures);
    r.outcomes = names_.outcomes;
  }

  /// Where a better value has turned up, no search has converged.
  static void keep_marks(const uncertainty::AlphaResult& from, uncertainty::AlphaResult& to) {
    const auto keep = [](const std::vector<uncertainty::OutputBounds>& a, std::vector<uncertainty::OutputBounds>& b) {
      for (std::size_t o = 0; o < std::min(a.size(), b.size()); ++o)
        for (std::size_t k = 0; k < std::min(a[o].levels.size(), b[o].levels.size()); ++k) {
          const auto &x = a[o].levels[k], &y = b[o].levels[k];
          b[o].levels[k].lower.converged = x.lower.converged && x.lower.value == y.lower.value;
          b[o].levels[k].upper.converged = x.upper.converged && x.upper.value == y.upper.value;
        }
    };
    keep(from.outputs, to.outputs);
    // nobody searched for bounds of a class that alone has numbers: they are those of all runs
    const bool is_alone = count_outcomes(to) == 1;
    for (auto& c : to.classes)
      for (const auto& d : from.classes)
        if (c.outcome == d.outcome) keep(is_alone && !d.outputs.empty() ? from.outputs : d.outputs, c.outputs);
    to.run = from.run, to.batches = from.batches, to.searches = from.searches;
    to.rounds = from.rounds, to.rechecks = from.rechecks;
  }

  static json make_marks(const std::vector<uncertainty::Possibility>& possibilities) {
    json marks = json::array();
    for (const auto& p : possibilities)
      marks.push_back(
          {{"outcome", p.outcome}, {"resolution", p.resolution}, {"above", p.above}, {"converged", p.converged}});
    return marks;
  }

  /// What cannot be read off the samples.
  static json make_marks(const StudyResult& r) {
    json marks = json::object();
    json bounds = json::array(), coverage = json::array();
    for_each_level(r.alpha, [&](const auto& l) { bounds.push_back({l.lower.converged, l.upper.converged}); });
    for (const auto& c : r.alpha.coverage) coverage.push_back(c.space_points);
    marks["converged"] = bounds;
    marks["space_points"] = coverage;
    marks["classes"] = make_marks(r.possibilities.classes);
    marks["requirement"] = make_marks(r.requirement);
    marks["limits"] = make_marks(r.limits);
    return marks;
  }

  /// Whether there is what boxes are asked to keep, by the first answer.
  void check_request(const Answer& a) {
    if (is_request_checked_ || a.kind != Answer::Kind::Done) return;
    is_request_checked_ = true;
    if (!problem_.permissible.empty()) check_outputs(read_permissible(problem_.permissible, problem_), list_outputs(a));
  }

  void wait_for(std::vector<std::string>& open) {
    open_ = static_cast<long>(open.size());
    auto looked = Clock::now();
    double pause = 0.01;
    for (;;) {
      pool_->check();
      std::vector<StoredResult> found = store_.find_results(open);
      for (const StoredResult& r : found) check_request(r.answer);
      for (const StoredResult& r : found) failed_arrived_ += r.answer.kind != Answer::Kind::Done;
      for (StoredResult& r : found) known_.emplace(std::move(r.hash), std::move(r.answer));
      if (!found.empty()) {
        std::erase_if(open, [this](const std::string& hash) { return known_.contains(hash); });
        run_here_ += static_cast<long>(found.size());
        arrived_ += static_cast<long>(found.size());
        open_ = static_cast<long>(open.size());
        pause = 0.01;
      }
      show(false);
      if (open.empty()) return;
      if (progress_.is_cancelled()) {
        pool_->stop();
        return;
      }
      if (std::chrono::duration<double>(Clock::now() - looked).count() > 0.2) {
        looked = Clock::now();
        if (const auto refusal = store_.find_refusal(asked_model_)) {
          pool_->stop();
          const Refusal r = read_refusal(*refusal);
          throw InputError({r.diagnostic});
        }
        store_.quarantine(pool_->name());
        running_ = store_.count_running(asked_model_);
      }
      pool_->wait_for_news(pause);
      // many results at once cost less than each on its own
      pause = std::min(1.5 * pause, 0.25);
    }
  }

  void show(bool is_last) {
    if (!watch_) return;
    const auto now = Clock::now();
    if (!is_last && std::chrono::duration<double>(now - shown_).count() < 0.2) return;
    shown_ = now;
    StudyState s;
    s.done = asked_ + arrived_ - before_.asked, s.failed = failed_ + failed_arrived_ - before_.failed, s.open = open_,
    s.running = std::min(running_, open_);
    s.run_here = run_here_ - before_.run_here, s.answers = run_here_;
    s.limit = limit_, s.is_confirming = is_confirming_;
    s.seconds = std::chrono::duration<double>(now - start_).count();
    s.so_far = result_.outputs.empty() && result_.outcomes.empty() ? nullptr : &result_;
    watch_(s);
  }

  const Problem& problem_;
  const Problem* asked_problem_;  // that of the condensed or of the whole model
  const RunnerFactories& factories_;
  const StudyOptions& options_;
  const Progress& progress_;
  const std::function<void(const StudyState&)>& watch_;
  std::string model_, asked_model_;
  Store store_;
  StudyRow row_;
  std::optional<StudyRow> finished_;               // as it was found, to be put back
  std::unordered_map<std::string, Answer> known_;  // by hash
  std::unique_ptr<Pool> pool_;
  Names names_;
  StudyResult result_;  // so far
  long asked_ = 0, failed_ = 0, open_ = 0, running_ = 0, run_here_ = 0;
  struct {
    long asked = 0, failed = 0, run_here = 0;
  } before_;                               // whole runs, which have a rate of their own
  long arrived_ = 0, failed_arrived_ = 0;  // of the batch that is being run
  int limit_ = 0;
  bool is_confirming_ = false, is_request_checked_ = false;
  Clock::time_point start_ = Clock::now(), shown_ = start_;
};

}  // namespace

int count_outcomes(const uncertainty::AlphaResult& r) {
  return static_cast<int>(std::count_if(r.classes.begin(), r.classes.end(),
                                        [](const auto& c) { return c.outcome != uncertainty::failed_outcome; }));
}

uncertainty::AlphaOptions make_alpha_options(const Problem& p) {
  uncertainty::AlphaOptions options;
  if (!p.levels.empty()) options.levels = p.levels;
  if (p.limit > 0) options.limit = p.limit;
  options.seed = p.seed;
  for (std::size_t o = 0; o < p.outputs.size(); ++o)
    if (!p.outputs[o].is_searched) options.passive_outputs.push_back(static_cast<int>(o));
  return options;
}

StudyResult run_study(const Problem& problem, const RunnerFactories& factories, const StudyOptions& options,
                      const Progress& progress, const std::function<void(const StudyState&)>& watch) {
  uncertainty::check_space(problem.space);
  Manager manager(problem, factories, options, progress, watch);
  try {
    StudyResult r = manager.run();
    if (!r.is_finished && !manager.has_run()) manager.keep_finished();
    return r;
  } catch (const InputError&) {
    manager.keep_finished();
    throw;
  }
}

StudyResult read_study(const Problem& problem, Store& store, const StudyRow& row) {
  std::vector<StoredResult> results = store.load_results(row.model);
  for (const std::string& hash : find_strangers(results))
    std::erase_if(results, [&hash](const StoredResult& s) { return s.hash == hash; });
  StudyResult r;
  r.is_finished = row.state == "finished";
  json summary = json::parse(row.summary.empty() ? "{}" : row.summary);
  // in the order in which the analysis met them, if that is known
  if (summary.contains("order")) {
    std::unordered_map<std::string, std::size_t> place;
    for (const json& hash : summary["order"]) place.emplace(hash.get<std::string>(), place.size());
    std::erase_if(results, [&](const StoredResult& s) { return !place.contains(s.hash); });
    std::sort(results.begin(), results.end(),
              [&](const StoredResult& a, const StoredResult& b) { return place.at(a.hash) < place.at(b.hash); });
    // without all of its runs nothing that was found of them holds
    if (results.size() < place.size()) r.is_finished = false, summary = json::object();
  } else {
    const uncertainty::Box support = uncertainty::make_box(problem.space, 0);
    std::erase_if(results, [&](const StoredResult& s) { return !belongs_to(problem, support, s.inputs); });
  }
  Names names;
  const std::size_t n = problem.inputs.size();
  for (const StoredResult& s : results) {
    Point x(s.inputs.begin(), s.inputs.begin() + static_cast<std::ptrdiff_t>(std::min(n, s.inputs.size())));
    r.alpha.archive.add({std::move(x), names.translate(s.answer)});
  }
  const uncertainty::Archive archive = r.alpha.archive;
  const json marks = summary.value("marks", json::object());
  r.alpha = uncertainty::read_archive(problem.space, archive, make_alpha_options(problem).levels,
                                      marks.value("space_points", std::vector<int>()));
  r.alpha.archive = archive;
  r.outputs = names.outputs;
  r.outcomes = names.outcomes;
  r.failures = list_failures(archive);
  if (marks.contains("converged")) {
    const json& bounds = marks["converged"];
    std::size_t k = 0;
    for_each_level(r.alpha, [&](auto& l) {
      if (k >= bounds.size()) return;
      l.lower.converged = bounds[k][0];
      l.upper.converged = bounds[k][1];
      ++k;
    });
  }
  const auto take_marks = [&marks](const char* key, std::vector<uncertainty::Possibility>& possibilities) {
    for (uncertainty::Possibility& p : possibilities)
      for (const json& m : marks.value(key, json::array()))
        if (m.at("outcome") == p.outcome) {
          p.resolution = m.at("resolution");
          p.above = m.at("above");
          p.converged = m.at("converged");
        }
  };
  r.possibilities.classes = uncertainty::read_possibilities(problem.space, archive, {});
  take_marks("classes", r.possibilities.classes);
  read_requirement(r, problem, archive, names.outputs, names.outcomes);
  take_marks("requirement", r.requirement);
  read_limits(r, problem, archive, names.outputs);
  take_marks("limits", r.limits);
  const Budget budget = calc_budget(problem, make_alpha_options(problem).limit);
  if (summary.contains("insights")) read_json(r.insights, summary["insights"]);
  read_drivers(r.insights, problem, budget, archive);
  r.spread = find_spread_samples(problem, budget, archive);
  if (r.is_finished && problem.whole) {
    const std::string whole = calc_model_hash(*problem.whole);
    std::vector<Confirmation::Run> runs;
    std::vector<std::string> hashes;
    for (const int sample : choose_confirmation(problem.space, r.alpha, problem.confirm)) {
      runs.emplace_back().sample = sample;
      hashes.push_back(calc_job_hash(whole, complete(*problem.whole, r.alpha.archive[sample].x)));
    }
    std::unordered_map<std::string, Answer> answers;
    for (StoredResult& s : store.find_results(hashes)) answers.emplace(std::move(s.hash), std::move(s.answer));
    for (std::size_t i = 0; i < runs.size(); ++i)
      if (const auto found = answers.find(hashes[i]); found != answers.end())
        runs[i].whole = names.translate(found->second);
    r.confirmation = judge_confirmation(problem.space, r.alpha, std::move(runs), problem.confirm);
    add_failures(r.confirmation, r.failures);
    r.outcomes = names.outcomes;
  }
  if (r.is_finished) r.ending = uncertainty::Ending::Complete;
  for (const auto ending : {uncertainty::Ending::LimitReached, uncertainty::Ending::NotConverged})
    if (summary.value("ending", "") == uncertainty::to_text(ending)) r.ending = ending;
  r.alpha.ending = r.ending;
  return r;
}

}  // namespace topple::study
