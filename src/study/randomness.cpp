#include "study/randomness.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/error.h"
#include "product/expression.h"
#include "study/evaluator.h"
#include "study/manager.h"
#include "study/store.h"
#include "study/story.h"
#include "uncertainty/randomness.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;
using uncertainty::Result;
using Kind = RandomStatistic::Kind;

constexpr const char* statistic_help =
    "mean(OUTPUT), sd(OUTPUT), q95(OUTPUT), p(OUTCOME), p(OUTPUT > NUMBER), p(failed)";
constexpr const char* method = "strata of Sobol points, uncorrelated";

struct KindName {
  Kind kind;
  const char* name;
};
constexpr KindName kind_names[] = {{Kind::Mean, "mean"},       {Kind::Deviation, "sd"},  {Kind::Quantile, "quantile"},
                                   {Kind::Outcome, "outcome"}, {Kind::Failed, "failed"}, {Kind::Above, ">"},
                                   {Kind::AtLeast, ">="},      {Kind::Below, "<"},       {Kind::AtMost, "<="}};

const char* name_of(Kind kind) {
  for (const KindName& k : kind_names)
    if (k.kind == kind) return k.name;
  return "";
}

std::string trim(std::string_view s) {
  const std::size_t a = s.find_first_not_of(" \t"), b = s.find_last_not_of(" \t");
  return a == std::string_view::npos ? std::string() : std::string(s.substr(a, b - a + 1));
}

std::string unquoted(const std::string& s) {
  return s.size() >= 2 && s.front() == '"' && s.back() == '"' ? s.substr(1, s.size() - 2) : s;
}

/// Reads one statistic; the first fault ends it.
struct StatisticReader {
  const std::string& text;
  const Problem& model;
  int runs;
  StatisticFault& fault;
  RandomStatistic out;

  bool fail(std::size_t offset, std::string message, std::string help = statistic_help) {
    fault = {offset, std::move(message), std::move(help)};
    return false;
  }

  bool find_name(const std::string& name, const std::vector<std::string>& known, const char* what, std::size_t at) {
    if (name.empty()) return fail(at, fmt::format("the name of an {} is wanted", what));
    if (known.empty() || std::find(known.begin(), known.end(), name) != known.end()) return true;
    return fail(at, fmt::format("there is no {} {}", what, product::quoted(name)),
                product::did_you_mean(name, known, "known here: " + product::list_of(known)));
  }
  bool find_output_name(const std::string& name, std::size_t at) {
    std::vector<std::string> known;
    for (const Quantity& q : model.outputs) known.push_back(q.name);
    return find_name(name, known, "output", at);
  }

  /// "95" of q95
  bool read_quantile(const std::string& digits) {
    double percent = 0;
    const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), percent);
    if (failure != std::errc() || end != digits.data() + digits.size())
      return fail(0, fmt::format("{} is no statistic", product::quoted("q" + digits)));
    if (!(percent > 0 && percent < 100))
      return fail(1, fmt::format("a quantile lies between 0 and 100 %, not at {}", digits), "such as q5 or q99.5");
    out.kind = Kind::Quantile;
    out.value = percent / 100;
    const double tail = std::min(out.value, 1 - out.value);
    // 1/2 a run beyond it; round-off of the percentage
    const int least = static_cast<int>(std::ceil(0.5 / tail * (1 - 1e-12)));
    if (runs < least)
      return fail(1, fmt::format("the quantile lies beyond the {} runs of a point", runs),
                  fmt::format("at least {} runs are wanted", least));
    return true;
  }

  /// What stands in p( )
  bool read_share(const std::string& inner, std::size_t at) {
    bool is_inside = false;
    std::size_t sign = std::string::npos;
    for (std::size_t i = 0; i < inner.size() && sign == std::string::npos; ++i) {
      if (inner[i] == '"') is_inside = !is_inside;
      if (!is_inside && (inner[i] == '<' || inner[i] == '>')) sign = i;
    }
    if (sign == std::string::npos) {
      out.of = unquoted(trim(inner));
      out.kind = out.of == "failed" ? Kind::Failed : Kind::Outcome;
      out.quantity.name = fmt::format("p({})", out.of);
      if (out.kind == Kind::Failed) return true;
      for (const Quantity& q : model.outputs)
        if (q.name == out.of)
          return fail(at, fmt::format("{} is an output, not an outcome", product::quoted(out.of)),
                      fmt::format("such as p({} > 3)", out.of));
      return find_name(out.of, model.outcomes, "outcome", at);
    }
    const bool has_equal = sign + 1 < inner.size() && inner[sign + 1] == '=';
    out.kind = inner[sign] == '>' ? (has_equal ? Kind::AtLeast : Kind::Above) : has_equal ? Kind::AtMost : Kind::Below;
    out.of = unquoted(trim(inner.substr(0, sign)));
    if (!find_output_name(out.of, at)) return false;
    const std::size_t begin = std::min(inner.find_first_not_of(" \t", sign + (has_equal ? 2 : 1)), inner.size());
    const std::string right = trim(inner.substr(begin));
    const auto [end, failure] = std::from_chars(right.data(), right.data() + right.size(), out.value);
    if (failure != std::errc() || !std::isfinite(out.value))
      return fail(at + begin, fmt::format("a number is wanted behind {}", name_of(out.kind)));
    const Quantity q = find_output(model, out.of);
    const std::string unit = trim(std::string_view(end, static_cast<std::size_t>(right.data() + right.size() - end)));
    if (!unit.empty() && unit != q.unit)
      return fail(at + begin, fmt::format("{} is shown in {}", out.of, q.unit.empty() ? "no unit" : q.unit),
                  "limits are in the units of results");
    out.quantity.name = fmt::format("p({} {} {})", out.of, name_of(out.kind), out.value);
    out.value *= q.unit_value;
    return true;
  }

  bool read() {
    const std::size_t open = text.find('('), close = text.find_last_not_of(" \t");
    if (open == std::string::npos || close == std::string::npos || text[close] != ')' || close < open)
      return fail(0, fmt::format("{} is no statistic", product::quoted(text)));
    const std::string word = trim(text.substr(0, open)), inner = text.substr(open + 1, close - open - 1);
    if (word == "p") return read_share(inner, open + 1);
    if (word == "mean")
      out.kind = Kind::Mean;
    else if (word == "sd")
      out.kind = Kind::Deviation;
    else if (word.size() < 2 || word[0] != 'q')
      return fail(0, fmt::format("{} is no statistic", product::quoted(word)));
    else if (!read_quantile(word.substr(1)))
      return false;
    out.of = unquoted(trim(inner));
    if (!find_output_name(out.of, open + 1)) return false;
    out.quantity = find_output(model, out.of);
    out.quantity.name = fmt::format("{}({})", word, out.of);
    out.quantity.is_searched = true;
    return true;
  }
};

uncertainty::Quantile make_quantile_function(const product::Distribution& d) {
  const std::string name = d.name;
  if (name == "normal") return uncertainty::make_normal();
  if (name == "lognormal") return uncertainty::make_lognormal();
  if (name == "gumbel") return uncertainty::make_gumbel();
  if (name == "uniform") return uncertainty::make_uniform();
  return uncertainty::make_weibull();
}

std::string name_of_coordinate(const Problem& p, int place) {
  const auto i = static_cast<std::size_t>(place);
  return i < p.inputs.size() ? p.inputs[i].name : p.derived.at(i - p.inputs.size()).name;
}

/// Of a point, in the order of the outputs.
std::vector<RandomStatistic> list_outputs_of(const Randomness& r) {
  std::vector<RandomStatistic> list = r.statistics;
  const bool is_told =
      std::any_of(list.begin(), list.end(), [](const RandomStatistic& s) { return s.kind == Kind::Failed; });
  if (r.most_failed > 0 && !is_told) {
    RandomStatistic failed;
    failed.kind = Kind::Failed;
    failed.of = "failed";
    failed.quantity.name = "p(failed)";
    list.push_back(std::move(failed));
  }
  return list;
}

/// The problem's randomness as part of its identity; a worker makes the model of it.
json make_identity(const Problem& p, const Randomness& r) {
  json inputs = json::array(), statistics = json::array(), formulas = json::array();
  for (const RandomInput& x : r.inputs) {
    json parameters = json::array();
    for (const RandomInput::Parameter& q : x.parameters)
      parameters.push_back(q.place >= 0 ? json(name_of_coordinate(p, q.place)) : json(q.value));
    inputs.push_back(
        {{"name", x.quantity.name}, {"distribution", x.distribution->name}, {"parameters", std::move(parameters)}});
  }
  for (const RandomStatistic& s : list_outputs_of(r))
    statistics.push_back({{"name", s.quantity.name}, {"kind", name_of(s.kind)}, {"of", s.of}, {"value", s.value}});
  for (const RandomFormula& f : r.formulas) formulas.push_back({f.name, f.text});
  return {{"of", r.of},
          {"fuzzy", p.inputs.size()},
          {"inputs", std::move(inputs)},
          {"formulas", std::move(formulas)},
          {"statistics", std::move(statistics)},
          {"method", method},
          {"runs", r.runs},
          {"seed", r.seed},
          {"most_failed", r.most_failed}};
}

/// A model with random inputs, made of what its identity says.
class RandomModel {
 public:
  RandomModel(const std::string& definition, const RunnerFactories& models) {
    json d = json::parse(definition);
    const json random = d.at("identity").at("random");
    const std::vector<std::string> names = d.at("inputs").get<std::vector<std::string>>();
    coordinates_ = names.size();
    fuzzy_ = random.at("fuzzy");
    if (const std::string there = random.at("method"); there != method)
      throw InputError(
          "E826", fmt::format("the study samples random inputs by \"{}\", which this topple does not know", there));
    std::vector<std::string> known(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(fuzzy_));
    std::vector<uncertainty::RandomVariable> variables;
    for (const json& x : random.at("inputs")) {
      known.push_back(x.at("name"));
      variables.push_back(make_variable(x, names));
    }
    for (const json& f : random.at("formulas")) {
      product::ExpressionFault fault;
      const std::string name = f.at(0);
      formulas_.emplace_back(name, product::Expression::parse(f.at(1), known, fault));
      if (!fault.message.empty()) throw InputError("E208", fmt::format("{}: {}", name, fault.message));
      known.push_back(name);
    }
    std::vector<uncertainty::Statistic> statistics;
    for (const json& s : random.at("statistics")) {
      names_.push_back(s.at("name"));
      statistics.push_back(make_statistic(s));
    }
    uncertainty::MonteCarloOptions options;
    options.samples = random.at("runs");
    options.batch = 1;  // all runs of one point
    options.seed = random.at("seed");
    options.most_failed = random.at("most_failed");
    const std::string kind = random.at("of");
    const auto factory = models.find(kind);
    if (factory == models.end())
      throw std::runtime_error(fmt::format("this topple knows no model of the kind \"{}\"", kind));
    d["kind"] = kind;
    d["inputs"] = known;
    d["identity"].erase("random");
    model_ = factory->second(d.dump());
    evaluate_ = uncertainty::with_monte_carlo(
        static_cast<int>(coordinates_), std::move(variables), [this](auto batch, auto out) { ask(batch, out); },
        std::move(statistics), options);
  }

  void run(std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
           const std::atomic<bool>& cancel) {
    cancel_ = &cancel;
    for (std::size_t i = 0; i < points.size() && !cancel.load(std::memory_order_relaxed); ++i) {
      const auto begin = std::chrono::steady_clock::now();
      refused_.reset(), silent_.reset();
      has_done_ = false;
      Result r;
      evaluate_({&points[i], 1}, {&r, 1});
      Answer a;
      if (refused_) {
        give(i, *refused_);
        return;
      }
      if (r.state == Result::State::NotRun) return;
      if (silent_ && !has_done_) {
        // where others have had answers it is a failed point as any
        silent_->line = r.text;
        a.kind = Answer::Kind::Refused;
        a.text = write_refusal(*silent_);
        give(i, std::move(a));
        return;
      }
      a.kind = r.state == Result::State::Done ? Answer::Kind::Done : Answer::Kind::Failed;
      a.text = r.text;
      for (std::size_t k = 0; k < names_.size() && a.kind == Answer::Kind::Done; ++k) {
        if (!std::isfinite(r.values[k])) {
          a.kind = Answer::Kind::Failed;
          a.text = names_[k] + " is not finite";
          a.outputs.clear();
          break;
        }
        a.outputs.emplace_back(names_[k], r.values[k]);
      }
      a.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      give(i, std::move(a));
    }
  }

 private:
  static uncertainty::RandomVariable make_variable(const json& x, const std::vector<std::string>& names) {
    uncertainty::RandomVariable v;
    const product::Distribution* d = product::find_distribution(x.at("distribution"));
    if (!d) throw InputError("E207", fmt::format("there is no distribution {}", x.at("distribution").dump()));
    // numbers are put beside what comes from the point
    std::array<double, 2> numbers{};
    std::array<int, 2> from{-1, -1};
    for (std::size_t i = 0; i < 2; ++i) {
      const json& p = x.at("parameters").at(i);
      if (p.is_number()) {
        numbers[i] = p;
        continue;
      }
      const auto found = std::find(names.begin(), names.end(), p.get<std::string>());
      if (found == names.end()) throw InputError("E207", fmt::format("there is no input {}", p.dump()));
      from[i] = static_cast<int>(v.parameters.size());
      v.parameters.push_back(static_cast<int>(found - names.begin()));
    }
    const auto complete = [numbers, from](std::span<const double> given) {
      std::array<double, 2> all = numbers;
      for (std::size_t i = 0; i < 2; ++i)
        if (from[i] >= 0) all[i] = given[static_cast<std::size_t>(from[i])];
      return all;
    };
    v.quantile = [complete, quantile = make_quantile_function(*d)](double u, std::span<const double> given) {
      const std::array<double, 2> all = complete(given);
      return quantile(u, all);
    };
    v.find_fault = [complete, d, name = x.at("name").get<std::string>()](std::span<const double> given) {
      const std::array<double, 2> all = complete(given);
      const std::string fault = product::find_distribution_fault(*d, all[0], all[1]);
      return fault.empty() ? fault : name + ": " + fault;
    };
    return v;
  }

  /// Index of a name in a list, which grows by it.
  static int number_of(std::vector<std::string>& list, const std::string& name) {
    const auto found = std::find(list.begin(), list.end(), name);
    if (found == list.end()) {
      list.push_back(name);
      return static_cast<int>(list.size()) - 1;
    }
    return static_cast<int>(found - list.begin());
  }

  uncertainty::Statistic make_statistic(const json& s) {
    Kind kind = Kind::Mean;
    for (const KindName& k : kind_names)
      if (s.at("kind") == k.name) kind = k.kind;
    const double value = s.at("value");
    if (kind == Kind::Failed) return uncertainty::make_probability(uncertainty::failed_outcome);
    if (kind == Kind::Outcome) return uncertainty::make_probability(number_of(outcomes_, s.at("of")));
    const int output = number_of(outputs_, s.at("of"));
    if (kind == Kind::Mean) return uncertainty::make_mean(output);
    if (kind == Kind::Deviation) return uncertainty::make_deviation(output);
    if (kind == Kind::Quantile) return uncertainty::make_quantile(output, value);
    using uncertainty::Side;
    const Side side = kind == Kind::Above     ? Side::Above
                      : kind == Kind::AtLeast ? Side::AtLeast
                      : kind == Kind::Below   ? Side::Below
                                              : Side::AtMost;
    return uncertainty::make_share(output, side, value);
  }

  /// All runs of a point. What crashed in the batch is run alone, so that it takes no others with it.
  void ask(std::span<const Point> batch, std::span<Result> out) {
    std::vector<Point> points;
    std::vector<std::size_t> place;  // in the batch
    for (std::size_t i = 0; i < batch.size(); ++i) {
      // fuzzy inputs, what follows from them, random inputs
      Point x(batch[i].begin(), batch[i].begin() + static_cast<std::ptrdiff_t>(fuzzy_));
      x.insert(x.end(), batch[i].begin() + static_cast<std::ptrdiff_t>(coordinates_), batch[i].end());
      std::string fault;
      for (const auto& [name, formula] : formulas_) {
        x.push_back(formula.evaluate(x));
        if (!std::isfinite(x.back()) && fault.empty()) fault = name + ": the formula has no value there";
      }
      if (!fault.empty()) {
        out[i].state = Result::State::Failed;
        out[i].text = fault;
        continue;
      }
      points.push_back(std::move(x));
      place.push_back(i);
    }
    std::vector<Answer> answers(points.size());
    const auto run = [&](std::size_t first, std::size_t count) {
      model_(
          std::span<const Point>(points).subspan(first, count),
          [&](std::size_t i, Answer a) { take(answers[first + i], std::move(a)); }, *cancel_);
    };
    const auto can_go_on = [&] { return !refused_ && !cancel_->load(std::memory_order_relaxed); };
    if (!points.empty()) run(0, points.size());
    // a program that has answered none of them, each started once, or that hangs, is given up
    const auto is_silent = [&](bool were_all_asked) {
      return silent_ && !has_done_ && (were_all_asked || silent_->line.starts_with(no_answer_within));
    };
    for (int attempt = 2; attempt <= most_attempts && !is_silent(attempt > 2); ++attempt)
      for (std::size_t i = 0; i < points.size() && can_go_on() && !is_silent(false); ++i)
        if (answers[i].kind == Answer::Kind::Crashed) run(i, 1);
    for (std::size_t i = 0; i < points.size() && !refused_; ++i) {
      Result& r = out[place[i]];
      const Answer& a = answers[i];
      if (a.kind == Answer::Kind::Done) {
        r.state = Result::State::Done;
        for (const std::string& name : outputs_)
          for (const auto& [given, value] : a.outputs)
            if (given == name) r.values.push_back(value);
        const auto found = std::find(outcomes_.begin(), outcomes_.end(), a.outcome);
        r.outcome = static_cast<int>(found - outcomes_.begin());
      } else if (a.kind == Answer::Kind::Failed || (a.kind == Answer::Kind::Crashed && can_go_on())) {
        r.state = Result::State::Failed;
        r.text = a.text;
      }
    }
  }

  /// An answer, or its refusal where its outputs are not those of others or lack what is asked for.
  void take(Answer& to, Answer a) {
    // a program that has not answered yet: some of a point's runs may crash, and which come first must not count
    if (a.kind == Answer::Kind::Refused)
      if (const Refusal r = read_refusal(a.text); r.diagnostic.code == no_answer_code) {
        silent_ = r;
        a.kind = Answer::Kind::Crashed;
        a.text = r.line;
      }
    if (a.kind == Answer::Kind::Done) {
      if (!form_) form_ = form_of(a);
      a = compare_form(a, *form_);
      if (a.kind == Answer::Kind::Done && form_->ordinates == 0) form_->ordinates = a.trajectory.size();
      for (const std::string& name : outputs_)
        if (a.kind == Answer::Kind::Done && !std::binary_search(form_->outputs.begin(), form_->outputs.end(), name))
          a = refuse(name);
      // a name of an output where that of an outcome is wanted lacks a limit
      for (const std::string& name : outcomes_)
        if (a.kind == Answer::Kind::Done && a.outcome != name &&
            std::binary_search(form_->outputs.begin(), form_->outputs.end(), name))
          a = refuse(fmt::format("statistics: {} is an output, not an outcome", product::quoted(name)),
                     fmt::format("such as p({} > 3)", name));
    }
    if (a.kind == Answer::Kind::Refused && !refused_) refused_ = a;
    has_done_ = has_done_ || a.kind == Answer::Kind::Done;
    to = std::move(a);
  }

  Answer refuse(const std::string& name) const {
    return refuse(fmt::format("statistics: the model has no output {}", product::quoted(name)),
                  product::did_you_mean(name, form_->outputs, "its outputs: " + product::list_of(form_->outputs)));
  }
  static Answer refuse(const std::string& what, const std::string& help) {
    Refusal r;
    r.diagnostic = {Severity::Error, "E825", {}, 1, what, help};
    Answer a;
    a.kind = Answer::Kind::Refused;
    a.text = write_refusal(r);
    return a;
  }

  std::size_t coordinates_ = 0, fuzzy_ = 0;  // of points
  std::vector<std::pair<std::string, product::Expression>> formulas_;
  std::vector<std::string> names_;               // of statistics
  std::vector<std::string> outputs_, outcomes_;  // of the model that statistics ask for
  Runner model_;
  uncertainty::Evaluate evaluate_;
  std::optional<AnswerForm> form_;
  std::optional<Answer> refused_;
  std::optional<Refusal> silent_;  // the program's that has given no answer at all
  bool has_done_ = false;          // a run of the point has
  const std::atomic<bool>* cancel_ = nullptr;
};

}  // namespace

RandomStatistic read_statistic(const std::string& text, const Problem& model, int runs, StatisticFault& fault) {
  StatisticReader reader{text, model, runs, fault, {}};
  reader.read();
  return reader.out;
}

std::vector<RandomStatistic> read_statistics(const product::RandomSettings& settings, const Problem& model,
                                             product::Complaints& complaints) {
  std::vector<RandomStatistic> list;
  for (const product::Word& word : settings.statistics) {
    StatisticFault fault;
    RandomStatistic s = read_statistic(word.text, model, settings.runs, fault);
    if (fault.message.empty() && std::any_of(list.begin(), list.end(), [&](const RandomStatistic& other) {
          return other.quantity.name == s.quantity.name;
        }))
      fault = {0, product::quoted(s.quantity.name) + " is asked for twice", "once is enough"};
    if (!fault.message.empty()) {
      product::Place place = word.place;
      place.column += 1 + static_cast<int>(fault.offset);  // behind the quotation mark
      place.width = std::max(1, place.width - 2 - static_cast<int>(fault.offset));
      complaints.error("E825", place, "statistics: " + fault.message, fault.help);
      continue;
    }
    list.push_back(std::move(s));
  }
  return list;
}

std::array<double, 2> find_extremes(const product::Distribution& d, const std::array<std::array<double, 2>, 2>& ends,
                                    int runs) {
  const uncertainty::Quantile quantile = make_quantile_function(d);
  std::array<double, 2> out{INFINITY, -INFINITY};
  for (const double first : ends[0])
    for (const double second : ends[1])
      for (const double u : {0.5 / runs, (runs - 0.5) / runs}) {
        const double x = quantile(u, std::array{first, second});
        out = {std::min(out[0], x), std::max(out[1], x)};
      }
  return out;
}

void set_random(Problem& p, Randomness r) {
  json identity = json::parse(p.identity);
  identity["random"] = make_identity(p, r);
  p.identity = identity.dump();
  p.kind = random_kind;
  p.outputs.clear();
  for (const RandomStatistic& s : list_outputs_of(r)) p.outputs.push_back(s.quantity);
  p.outcomes.clear();
  p.random = std::make_shared<const Randomness>(std::move(r));
}

Runner make_random_runner(const std::string& definition, const RunnerFactories& models) {
  const auto model = std::make_shared<RandomModel>(definition, models);
  return [model](std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
                 const std::atomic<bool>& cancel) { model->run(points, give, cancel); };
}

std::string tell_randomness(const Problem& p) {
  const Randomness& r = *p.random;
  std::string text = fmt::format(
      "Each run is a point of the fuzzy inputs, at which the model was run {} times: outputs are statistics of these "
      "inner "
      "runs, whose random inputs have the same probabilities at every point.",
      r.runs);
  for (const RandomInput& x : r.inputs) {
    const std::string d = x.distribution->name;
    const auto words = [&](std::size_t i) {
      const RandomInput::Parameter& q = x.parameters[i];
      const Quantity unit = x.distribution->has_shape && i == 1 ? Quantity{} : x.quantity;
      return q.place >= 0 ? name_of_coordinate(p, q.place) : words_of_value(unit, q.value);
    };
    const char* sentence =
        d == "normal"      ? "{} is distributed normally with the mean {} and the standard deviation {}."
        : d == "lognormal" ? "{} is distributed log-normally with the mean {} and the standard deviation {}."
        : d == "gumbel"    ? "{} is distributed after Gumbel with the mean {} and the standard deviation {}."
        : d == "weibull"   ? "{} is distributed after Weibull with the scale {} and the shape {}."
                           : "{} is distributed evenly between {} and {}.";
    text += " " + fmt::format(fmt::runtime(sentence), x.quantity.name, words(0), words(1));
  }
  if (r.most_failed > 0)
    text += fmt::format(
        " Up to {:g} % of the inner runs of a point may fail: means, deviations and quantiles are those of the others.",
        100 * r.most_failed);
  return text;
}

std::string tell_random_cost(const Problem& p) {
  const long n = p.random->runs, points = make_alpha_options(p).limit;
  std::string text = fmt::format("Random inputs: each point takes {} runs of the model, {} points take at most {} runs",
                                 n, points, n * points);
  if (p.whole) text += fmt::format(", and whole runs beside them {} more", n * p.confirm);
  return text + ".";
}

json make_random_json(const Problem& p) {
  json out = json::parse(p.identity).at("random");
  json inputs = json::array();
  for (std::size_t k = 0; k < p.random->inputs.size(); ++k) {
    const RandomInput& x = p.random->inputs[k];
    json parameters = json::array();
    for (std::size_t i = 0; i < 2; ++i) {
      const RandomInput::Parameter& q = x.parameters[i];
      const double unit = x.distribution->has_shape && i == 1 ? 1 : x.quantity.unit_value;
      json one{{"name", x.distribution->parameters[i]}};
      if (q.place >= 0)
        one["input"] = name_of_coordinate(p, q.place);
      else
        one["value"] = q.value / unit;
      parameters.push_back(std::move(one));
    }
    inputs.push_back({{"name", x.quantity.name},
                      {"unit", x.quantity.unit},
                      {"distribution", x.distribution->name},
                      {"parameters", std::move(parameters)}});
  }
  return {{"inputs", std::move(inputs)},
          {"runs", out.at("runs")},
          {"seed", out.at("seed")},
          {"most_failed", out.at("most_failed")},
          {"method", out.at("method")}};
}

}  // namespace topple::study
