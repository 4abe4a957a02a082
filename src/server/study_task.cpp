#include "server/study_task.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "base/error.h"
#include "record/provenance.h"
#include "study/page.h"
#include "study/plan_model.h"
#include "study/results.h"
#include "uncertainty/fan.h"

namespace topple::server {

namespace {

constexpr double kLookInterval = 0.5;  // from one look into the store to the next [s]

}  // namespace

StudyTask::StudyTask(int id, const product::Plan& plan, const StudySetting& setting,
                     std::function<void(const Json&, const Json&)> on_news)
    : id_(id), plan_(plan), setting_(setting), on_news_(std::move(on_news)) {
  if (plan.fuzzy.inputs.empty())
    throw InputError("E950", "the plan has no fuzzy values",
                     "write a [fuzzy] table into it (docs/plan.md) and apply it");
  if (!plan.fuzzy.random.empty())
    throw InputError("E950", "the plan has random values, whose studies are not shown here",
                     "study it with topple study, or leave [fuzzy.random] out");
  problem_ = study::make_plan_problem(plan, {}, setting.rules);
  Json identity = Json::parse(problem_.identity);
  identity["topple"] = setting.version;  // other programs give other answers
  problem_.identity = identity.dump();
  problem_.limit = setting.samples;
  problem_.seed = setting.seed;
  std::filesystem::create_directories(setting.folder);
  store_ = (std::filesystem::path(setting.folder) / "study.sqlite").string();
  now_ = {{"id", id_},
          {"state", "running"},
          {"title", plan.title},
          {"folder", setting.folder},
          {"done", 0},
          {"failed", 0},
          {"limit", setting.samples},
          {"seconds", 0},
          {"eta", nullptr},
          {"inputs", Json::array()},
          {"outputs", Json::array()},
          {"outcomes", Json::array()},
          {"bounds", Json::array()},
          {"possibilities", Json::array()},
          {"fans", nullptr},
          {"text", ""}};
  for (const study::Quantity& q : problem_.inputs) now_["inputs"].push_back({{"name", q.name}, {"unit", q.unit}});
  const study::PlanMapping mapping(plan, collapse::default_knowledge(), {});
  for (const study::PlanQuantity& q : mapping.outputs())
    now_["outputs"].push_back({{"name", q.name}, {"unit", q.symbol}});
  now_["fans"] = {{"time", numbers(mapping.trajectory_times())},
                  {"alpha", Json::array()},
                  {"low", Json::array()},
                  {"high", Json::array()}};
  for (const std::string& o : study::plan_outcomes()) now_["outcomes"].push_back(o);
  thread_ = std::thread([this] { run(); });
}

StudyTask::~StudyTask() {
  cancel_ = true;
  thread_.join();
}

Json StudyTask::describe() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

Json StudyTask::samples() const {
  const std::lock_guard lock(mutex_);
  return samples_;
}

std::vector<double> StudyTask::inputs_of(int sample) const {
  const std::lock_guard lock(mutex_);
  if (sample < 0 || sample >= static_cast<int>(samples_.size()))
    throw InputError("E920", fmt::format("study {} has no sample {}", id_, sample));
  std::vector<double> x;
  const Json& inputs = samples_[static_cast<std::size_t>(sample)]["inputs"];
  for (std::size_t i = 0; i < problem_.inputs.size(); ++i)
    x.push_back(inputs[i].get<double>() * problem_.inputs[i].unit_value);
  return x;
}

std::string StudyTask::words_of(int sample) const {
  const std::lock_guard lock(mutex_);
  std::string text = fmt::format("sample {}", sample);
  const Json& inputs = samples_.at(static_cast<std::size_t>(sample))["inputs"];
  for (std::size_t i = 0; i < problem_.inputs.size(); ++i)
    text += fmt::format("{} {} = {:.5g} {}", i == 0 ? ":" : ",", problem_.inputs[i].name, inputs[i].get<double>(),
                        problem_.inputs[i].unit);
  return text;
}

study::StudyResult StudyTask::read() const {
  study::Store store(store_, nullptr, 10);
  const auto row = store.find_study("main");
  if (!row) throw InputError("E930", "the study has not begun yet");
  return study::read_study(problem_, store, *row);
}

std::string StudyTask::results_json() const { return study::write_results_json(problem_, read()); }

std::string StudyTask::page_json() const {
  return study::to_page_json(problem_, read(), {setting_.version, record::now_utc(), plan_.text, plan_.path});
}

/// State, bounds and new samples; `state` is nullptr at the end.
void StudyTask::look(const study::StudyState* state) {
  if (state != nullptr &&
      std::chrono::duration<double>(std::chrono::steady_clock::now() - last_look_).count() < kLookInterval)
    return;
  last_look_ = std::chrono::steady_clock::now();
  Json news = Json::array();
  const study::StudyResult r = read();
  {
    const std::lock_guard lock(mutex_);
    if (state != nullptr) {
      now_["done"] = state->done;
      now_["failed"] = state->failed;
      now_["seconds"] = state->seconds;
      const double rate = state->seconds > 0 ? static_cast<double>(state->run_here) / state->seconds : 0;
      now_["eta"] =
          rate > 0 ? Json(static_cast<double>(std::max(0L, state->limit - state->done)) / rate) : Json(nullptr);
    }
    std::set<std::string> seen(seen_.begin(), seen_.end());
    for (const uncertainty::Sample& s : r.alpha.archive.samples()) {
      if (s.result.state == uncertainty::Result::State::NotRun) continue;
      const std::string hash = study::calc_job_hash("", s.x);
      if (!seen.insert(hash).second) continue;
      Json sample{{"index", samples_.size()}, {"inputs", Json::array()}, {"outputs", Json::array()}};
      for (std::size_t i = 0; i < problem_.inputs.size(); ++i)
        sample["inputs"].push_back(number(s.x[i] / problem_.inputs[i].unit_value));
      for (std::size_t i = 0; i < now_["outputs"].size(); ++i) {
        const std::string name = now_["outputs"][i]["name"];
        sample["outputs"].push_back(i < s.result.values.size()
                                        ? number(s.result.values[i] / study::find_output(problem_, name).unit_value)
                                        : Json(nullptr));
      }
      const bool ok = s.result.state == uncertainty::Result::State::Done;
      sample["outcome"] = ok ? study::name_of_outcome(r, s.result.outcome) : study::failed_name;
      sample["ok"] = ok;
      sample["membership"] = uncertainty::calc_membership(problem_.space, s.x);
      seen_.push_back(hash);
      samples_.push_back(sample);
      news.push_back(std::move(sample));
    }
    if (state == nullptr) {
      now_["done"] = samples_.size();
      now_["failed"] = std::count_if(samples_.begin(), samples_.end(), [](const Json& s) { return s["ok"] == false; });
    }
    Json bounds = Json::array();
    for (std::size_t i = 0; i < r.alpha.outputs.size() && i < r.outputs.size(); ++i) {
      Json b{{"output", r.outputs[i]}, {"alpha", Json::array()}, {"low", Json::array()}, {"high", Json::array()}};
      const double unit = study::find_output(problem_, r.outputs[i]).unit_value;
      for (const auto& l : r.alpha.outputs[i].levels)
        b["alpha"].push_back(l.alpha), b["low"].push_back(number(l.lower.value / unit)),
            b["high"].push_back(number(l.upper.value / unit));
      bounds.push_back(std::move(b));
    }
    now_["bounds"] = std::move(bounds);
    Json classes = Json::array();
    for (const auto& c : r.alpha.classes)
      classes.push_back({{"outcome", study::name_of_outcome(r, c.outcome)},
                         {"possibility", c.possibility},
                         {"necessity", number(uncertainty::calc_necessity(r.possibilities, c.outcome))},
                         {"runs", c.count}});
    now_["possibilities"] = std::move(classes);
    std::vector<double> levels;
    if (!r.alpha.outputs.empty())
      for (const auto& l : r.alpha.outputs.front().levels) levels.push_back(l.alpha);
    Json& fans = now_["fans"];
    for (const char* key : {"alpha", "low", "high"}) fans[key] = Json::array();
    if (!levels.empty())
      for (const uncertainty::FanLevel& f : uncertainty::calc_fan(problem_.space, r.alpha.archive, levels)) {
        fans["alpha"].push_back(f.alpha);
        // behind the angles stands the outline of debris [m]
        const auto angles = [T = fans["time"].size()](std::vector<double> curve) {
          curve.resize(std::min(T, curve.size()));
          return numbers(curve);
        };
        fans["low"].push_back(angles(f.lower));
        fans["high"].push_back(angles(f.upper));
      }
  }
  on_news_(describe(), news);
}

void StudyTask::run() {
  study::StudyOptions options;
  options.store = store_;
  options.source = plan_.text;
  options.source_name = plan_.path;
  options.pool.jobs = setting_.jobs;
  Progress progress;
  progress.cancel = &cancel_;
  const auto end = [this](const char* state, const std::string& text) {
    const std::lock_guard lock(mutex_);
    now_["state"] = state;
    now_["text"] = text;
    now_["eta"] = nullptr;
  };
  try {
    const study::StudyResult r = study::run_study(problem_, {{"plan", study::make_plan_runner}}, options, progress,
                                                  [this](const study::StudyState& s) { look(&s); });
    end(r.is_finished ? "finished" : "cancelled",
        r.is_finished ? uncertainty::to_text(r.ending) : "cancelled; the same study goes on");
    look(nullptr);
  } catch (const std::exception& e) {
    end("failed", e.what());
    on_news_(describe(), Json::array());
    return;
  }
  on_news_(describe(), Json::array());
}

}  // namespace topple::server
