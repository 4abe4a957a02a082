#include "study_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/error.h"
#include "base/file.h"
#include "base/unit.h"
#include "collapse/knowledge.h"
#include "product/document.h"
#include "program.h"
#include "results.h"
#include "study/evaluator.h"
#include "study/inputs_file.h"
#include "study/permissible.h"
#include "study/plan_model.h"
#include "study/randomness.h"
#include "terminal.h"

namespace topple::apps {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

namespace {

constexpr const char* store_file = "study.sqlite";
constexpr const char* place_file = "study.json";  // instead of it, where the store is a server

std::vector<double> read_levels(const std::string& text) {
  std::vector<double> levels;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    double a = 0;
    const auto [stop, fault] = std::from_chars(text.data() + begin, text.data() + end, a);
    if (fault != std::errc() || stop != text.data() + end || !(a >= 0 && a <= 1))
      throw InputError(
          "E801",
          fmt::format("--alpha \"{}\": \"{}\" is no number between 0 and 1", text, text.substr(begin, end - begin)),
          "such as --alpha 0,0.25,0.5,0.75,1");
    levels.push_back(a);
    begin = end + 1;
  }
  return levels;
}

/// Complains of a file of fuzzy inputs that lacks its evaluator.
void check_for_plan(const std::string& file) {
  std::string text = read_file(file);
  if (text.starts_with("\xEF\xBB\xBF")) text = text.substr(3);
  product::Node document;
  try {
    document = product::parse_document(text, file);
  } catch (const InputError&) {
    return;  // who reads the plan says why
  }
  for (const product::Entry& e : document.entries)
    if (e.key == "inputs")
      throw InputError({{Severity::Error,
                         "E801",
                         {file, e.place.line, e.place.column},
                         static_cast<int>(e.key.size()),
                         "this is a file of fuzzy inputs, and no --evaluator is given",
                         "name the model: --evaluator \"command\"; a plan has its fuzzy values in [fuzzy]"}});
}

/// Complains of rules; `text` is then that which complaints point into.
void check_rules(const std::string& rules, const std::string& file, std::string& text) {
  try {
    (void)collapse::read_knowledge(rules, file);
  } catch (const InputError&) {
    text = rules;
    throw;
  }
}

/// Where the study is to lie. Throws InputError like make_place.
StudyPlace choose_place(const Arguments& a) {
  const fs::path folder = a.output;
  StudyPlace place;
  std::error_code failure;
  const bool is_on_server = fs::exists(folder / place_file, failure);
  const auto refuse = [&a](const std::string& what) {
    throw InputError("E822", fmt::format("{} holds {}", a.output, what), "choose another folder or name, or delete it");
  };
  if (a.study.store.empty()) {
    if (!is_on_server && !a.study.name.empty())
      throw InputError("E801", "--name: only a study on a server has a name", "leave it out, or give --store too");
    if (!is_on_server) {
      place.store = (folder / store_file).string();
      return place;
    }
    // a folder that was begun on a server goes on there
    place = find_place(a.output);
    if (!a.study.name.empty() && a.study.name != place.name) refuse(fmt::format("the study \"{}\"", place.name));
    return place;
  }
  if (!study::is_server(a.study.store))
    throw InputError("E820", fmt::format("--store \"{}\" is no server", a.study.store),
                     "such as postgresql://user@host/database; without --store a file in the folder is used");
  place.store = a.study.store;
  place.name = a.study.name;
  if (place.name.empty()) place.name = fs::absolute(folder).lexically_normal().filename().string();
  if (place.name.empty()) place.name = fs::absolute(folder).lexically_normal().parent_path().filename().string();
  if (is_on_server) {
    const StudyPlace there = find_place(a.output);
    const std::string store = study::hide_password(place.store);
    if (there.name != place.name || study::hide_password(there.store) != store)
      refuse(fmt::format("the study \"{}\" of {}, not \"{}\" of {}", there.name, there.store, place.name, store));
  } else if (fs::exists(folder / store_file, failure)) {
    refuse("a study in a file");
  } else {
    place.is_new = true;
  }
  return place;
}

}  // namespace

double read_seconds(const std::string& text, const char* option, double fallback) {
  if (text.empty()) return fallback;
  Quantity q = parse_quantity(text, Dimension::Time);
  if (!q.value) {
    const Quantity bare = parse_quantity(text, Dimension::Number);
    if (bare.value) q = bare;
  }
  if (!q.value || !(*q.value > 0) || !std::isfinite(*q.value))
    throw InputError("E801", fmt::format("{} \"{}\": {}", option, text, q.value ? "must be > 0" : q.problem),
                     "units: " + units_of(Dimension::Time));
  return *q.value;
}

void keep_runs_apart(study::Problem& p, const StudyPlace& place) {
  json identity = json::parse(p.identity);
  if (!study::is_server(place.store) || !identity.contains("command")) return;
  identity["study"] = place.name;
  p.identity = identity.dump();
}

StudyPlace make_place(const Arguments& a) {
  StudyPlace place = choose_place(a);
  make_folder(a.output);
  return place;
}

void keep_place(const std::string& folder, const StudyPlace& place) {
  if (!study::is_server(place.store)) return;
  const json written{{"store", study::hide_password(place.store)}, {"name", place.name}};
  replace_file((fs::path(folder) / place_file).string(), written.dump(1) + "\n");
}

bool remove_unused(const StudyPlace& place, const std::string& model, long answers) {
  std::error_code failure;
  if (study::is_server(place.store) || !fs::exists(place.store, failure)) return false;
  try {
    study::Store store(place.store, nullptr, 10, true);
    const study::Counts c = store.count(model);
    if (c.done + c.failed > 0 || store.count_studies().first > 1) return false;
  } catch (const InputError&) {
    // it did not come to its tables
  } catch (const study::DiskFailed&) {
    if (answers > 0) return false;
  }
  if (study::is_open_elsewhere(place.store)) return false;  // workers wait for it to go on
  for (const char* end : {"", "-wal", "-shm", "-journal"}) fs::remove(place.store + end, failure);
  return true;
}

StudyPlace find_place(const std::string& where) {
  if (study::is_server(where)) return {where, ""};
  const fs::path folder = where;
  if (fs::exists(folder / place_file)) {
    try {
      const json j = json::parse(read_file((folder / place_file).string()));
      return {j.at("store").get<std::string>(), j.at("name").get<std::string>()};
    } catch (const json::exception& e) {
      throw InputError("E820", fmt::format("{} cannot be understood: {}", (folder / place_file).string(), e.what()));
    }
  }
  if (fs::exists(folder / store_file)) return {(folder / store_file).string(), "main"};
  throw InputError("E820", fmt::format("there is no study in {}", where),
                   "name the folder that topple study got with -o");
}

study::RunnerFactories make_factories() {
  const auto make_plan_runner = [](const std::string& definition) {
    const std::string asked = json::parse(definition).at("identity").value("topple", "");
    if (asked != program_version())
      throw InputError("E826", fmt::format("the study is of topple {}, and this is {}", asked, program_version()),
                       "only the same build gives the same bits: use one on all machines");
    return study::make_plan_runner(definition);
  };
  const study::RunnerFactories models{{"evaluator", study::make_evaluator}, {"plan", make_plan_runner}};
  study::RunnerFactories all = models;
  all[study::random_kind] = [models](const std::string& definition) {
    return study::make_random_runner(definition, models);
  };
  return all;
}

study::Problem read_problem(const Arguments& a, std::string& text) {
  const StudyArguments& y = a.study;
  study::Problem p;
  if (y.evaluator.empty()) {
    check_for_plan(a.input);
    for (const auto& [is_given, option] :
         {std::pair(!y.timeout.empty(), "--timeout"), std::pair(y.one_shot, "--one-shot")})
      if (is_given)
        throw InputError("E801", std::string(option) + ": is for an evaluator, not for a plan", "leave it out");
    std::vector<Diagnostic> warnings;
    const product::Plan plan = product::read_plan_file(a.input, warnings, text);
    for (const Diagnostic& d : warnings) std::fputs(render(d, text, has_colour(stderr)).c_str(), stderr);
    study::PlanMappingOptions options;
    options.condensed = y.condensed;
    const std::string rules = a.knowledge.empty() ? std::string() : read_file(a.knowledge);
    if (!rules.empty()) check_rules(rules, a.knowledge, text);
    p = study::make_plan_problem(plan, options, rules);
    json identity = json::parse(p.identity);
    identity["topple"] = program_version();  // other programs give other answers
    study::set_plan_identity(p, identity.dump());
    if (y.confirm > 0) p.confirm = y.confirm;
  } else {
    if (y.condensed) throw InputError("E801", "--condensed: an evaluator is not condensed", "leave it out");
    if (!a.knowledge.empty())
      throw InputError("E801", "--knowledge: an evaluator has no rules; they are of a plan", "leave it out");
    text = read_file(a.input);
    if (text.starts_with("\xEF\xBB\xBF")) text = text.substr(3);
    p = study::read_inputs_text(text, a.input);
    study::set_evaluator(p, y.evaluator, read_seconds(y.timeout, "--timeout", 0), y.one_shot);
  }
  p.permissible = y.permissible;
  p.has_drivers = !y.no_drivers;
  if (!p.permissible.empty()) (void)study::read_permissible(p.permissible, p);  // complain before anything is run
  if (!y.alpha.empty()) p.levels = read_levels(y.alpha);
  if (y.samples > 0) p.limit = y.samples;
  if (y.seed >= 0) p.seed = static_cast<std::uint64_t>(y.seed);
  return p;
}

study::Problem read_problem(const study::StudyRow& row) {
  try {
    const json d = json::parse(row.definition);
    const std::string kind = d.at("kind");
    const std::string model = kind == study::random_kind ? d.at("identity").at("random").at("of") : d.at("kind");
    study::Problem p;
    if (model == "evaluator") {
      p = study::read_inputs_text(d.at("text"), d.at("file"));
    } else if (model == "plan") {
      const json& identity = d.at("identity");
      p = study::read_plan_problem(json{{"identity", identity}, {"settings", {{"path", d.at("file")}}}}.dump());
    } else {
      throw InputError("E820", fmt::format("this topple knows no studies of the kind {}", kind));
    }
    p.kind = kind;
    study::set_plan_identity(p, d.at("identity").dump());
    if (p.whole) p.confirm = d.at("confirm");
    p.settings = d.at("settings").dump();
    p.levels = d.at("levels").get<std::vector<double>>();
    p.limit = d.at("limit");
    p.seed = d.at("seed");
    p.permissible = d.value("permissible", "");
    p.has_drivers = d.value("drivers", true);
    return p;
  } catch (const json::exception& e) {
    throw InputError("E820", fmt::format("the study \"{}\" cannot be understood: {}", row.name, e.what()));
  }
}

study::PoolOptions make_pool_options(const StudyArguments& y) {
  study::PoolOptions o;
  o.jobs = y.is_jobs_given ? y.jobs : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  o.batch = y.batch;
  o.lease = read_seconds(y.lease, "--lease", o.lease);
  return o;
}

}  // namespace topple::apps
