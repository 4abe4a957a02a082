#include "study/evaluator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "study/process.h"
#include "uncertainty/mapping.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

/// Characters before the byte `offset`.
int count_characters(const std::string& text, std::size_t offset) {
  int count = 0;
  for (std::size_t i = 0; i < std::min(offset, text.size()); ++i) count += (text[i] & 0xC0) != 0x80;
  return count;
}

/// Whether a line is the beginning of a JSON text.
bool breaks_off(const std::string& line) {
  try {
    return json::parse(line).is_discarded();
  } catch (const json::parse_error& e) { return e.byte > line.size(); } catch (const json::exception&) {
  }
  return false;
}

/// Where a member stands in the line, for the caret.
std::size_t find_member(const std::string& line, const std::string& name) {
  const std::size_t found = line.find(json(name).dump(-1, ' ', false, json::error_handler_t::replace));
  return found == std::string::npos ? 0 : found;
}

/// Takes note of the first key that an object has twice.
class KeyWatch {
 public:
  bool note(json::parse_event_t event, const json& parsed) {
    switch (event) {
      case json::parse_event_t::object_start:
        open_.emplace_back();
        break;
      case json::parse_event_t::object_end:
        open_.pop_back();
        break;
      case json::parse_event_t::key: {
        const auto& name = parsed.get_ref<const std::string&>();
        ++seen_[name];
        if (!open_.back().insert(name).second && !twice) twice = name, count = seen_[name];
        break;
      }
      default:
        break;
    }
    return true;
  }
  std::optional<std::string> twice;
  int count = 0;  // so many keys of this name stand in the line up to there

 private:
  std::vector<std::set<std::string>> open_;
  std::map<std::string, int> seen_;
};

/// Where the key of this name begins that is the `count`-th of all objects.
std::size_t find_key(const std::string& line, const std::string& name, int count) {
  const std::string token = json(name).dump(-1, ' ', false, json::error_handler_t::replace);
  std::size_t found = line.find(token);
  for (std::size_t at = found; at != std::string::npos; at = line.find(token, at + 1)) {
    const std::size_t next = line.find_first_not_of(" \t", at + token.size());
    if (next == std::string::npos || line[next] != ':') continue;
    found = at;
    if (--count == 0) break;
  }
  return found == std::string::npos ? 0 : found;
}

struct Reader {
  const std::string& line;
  const std::string& command;

  Answer refuse(std::size_t offset, std::string message, std::string help = {}) const {
    return make_refused("E824", offset, std::move(message), std::move(help));
  }
  Answer make_refused(const char* code, std::size_t offset, std::string message, std::string help) const {
    Refusal r;
    r.diagnostic = {Severity::Error,
                    code,
                    {fmt::format("answer of \"{}\"", command), 1, 1 + count_characters(line, offset)},
                    1,
                    std::move(message),
                    std::move(help)};
    r.line = line.substr(0, 1000);
    Answer a;
    a.kind = Answer::Kind::Refused;
    a.text = write_refusal(r);
    return a;
  }

  /// The word that stands for a number that is none, where JSON breaks off.
  std::string find_no_number(std::size_t at) const {
    // the parser may stop within the word or behind its sign
    const auto is_letter = [this](std::size_t i) { return std::isalpha(static_cast<unsigned char>(line[i])) != 0; };
    std::size_t begin = std::min(at, line.size()), end = begin;
    while (begin > 0 && is_letter(begin - 1)) --begin;
    while (end < line.size() && is_letter(end)) ++end;
    std::string word = line.substr(begin, end - begin), small = word;
    for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const char* known : {"nan", "inf", "infinity"})
      if (small == known) return word;
    return {};
  }

  Answer read(int& id) const {
    json j;
    KeyWatch keys;
    try {
      j = json::parse(line, [&keys](int, json::parse_event_t event, json& parsed) { return keys.note(event, parsed); });
    } catch (const json::parse_error& e) {
      const std::size_t at = e.byte > 0 ? e.byte - 1 : 0;
      if (const std::string word = find_no_number(at); !word.empty())
        return refuse(at, word + " is no number in JSON",
                      "give null where there is no value: the run counts as failed");
      return refuse(at, "this is not JSON",
                    "each line of its output must be one JSON object; other words belong on standard error");
    } catch (const json::out_of_range& e) {
      // the exception quotes the number
      const std::string what = e.what();
      const std::size_t begin = what.find('\'') + 1, end = what.rfind('\'');
      const std::size_t at = begin > 0 && end > begin ? line.find(what.substr(begin, end - begin)) : std::string::npos;
      return refuse(at == std::string::npos ? 0 : at, "a number is too large for 64 bits",
                    "give null where there is no value: the run counts as failed");
    }
    if (keys.twice)
      return refuse(find_key(line, *keys.twice, keys.count), fmt::format("the key \"{}\" is given twice", *keys.twice),
                    "each key stands once in an object");
    const char* form = "an answer looks like {\"outputs\": {\"z\": 1.5}, \"outcome\": \"stands\"}";
    if (!j.is_object()) return refuse(0, "a JSON object is wanted", form);
    if (j.contains("id")) {
      const json& number = j["id"];
      // beyond int it would come to be another point's
      if (!number.is_number_integer() || number.get<double>() < 0 || number.get<double>() > 1e9)
        return refuse(find_member(line, "id"), "id: the number of the point is wanted");
      id = number.get<int>();
    }
    Answer a;
    a.kind = Answer::Kind::Done;
    const json failed = j.value("failed", json());
    if (!failed.is_null() && !failed.is_string() && !failed.is_boolean())
      return refuse(find_member(line, "failed"), "failed: a text is wanted");
    if (!failed.is_null() && failed != json(false)) {
      a.kind = Answer::Kind::Failed;
      a.text = failed.is_string() ? failed.get<std::string>() : "the evaluator says so";
      return a;
    }
    // null stands for what is left out
    if (j.contains("outcome") && !j["outcome"].is_null()) {
      const json& o = j["outcome"];
      if (o.is_string())
        a.outcome = o.get<std::string>();
      else if (o.is_number_integer() || o.is_boolean())
        a.outcome = o.dump();
      else
        return refuse(find_member(line, "outcome"), "outcome: a text is wanted");
      if (a.outcome.empty())
        return refuse(find_member(line, "outcome"), "outcome: the name is empty", "leave it out where there is none");
    }
    if (j.contains("trajectory") && !j["trajectory"].is_null()) {
      if (!j["trajectory"].is_array()) return refuse(find_member(line, "trajectory"), "trajectory: a list is wanted");
      for (const json& v : j["trajectory"]) {
        if (!v.is_number() && !v.is_null())
          return refuse(find_member(line, "trajectory"), "trajectory: numbers are wanted");
        a.trajectory.push_back(v.is_null() ? std::nan("") : v.get<double>());
      }
    }
    const bool is_nested = j.contains("outputs");
    if (is_nested && !j["outputs"].is_object())
      return refuse(find_member(line, "outputs"), "outputs: an object is wanted", form);
    const auto is_known = [](const std::string& name) {
      return name == "id" || name == "outcome" || name == "trajectory" || name == "failed";
    };
    if (is_nested)
      for (const auto& [name, v] : j.items())
        if (!is_known(name) && name != "outputs")
          return refuse(find_member(line, name), fmt::format("\"{}\" means nothing beside outputs", name),
                        "a number belongs into outputs; other members are id, outcome, trajectory and failed");
    const json& outputs = is_nested ? j["outputs"] : j;
    for (const auto& [name, v] : outputs.items()) {
      if (!is_nested && is_known(name)) continue;
      if (name.empty()) return refuse(find_member(line, name), "an output has no name", form);
      if (!v.is_number() && !v.is_null()) return refuse(find_member(line, name), name + ": a number is wanted", form);
      const double x = v.is_null() ? std::nan("") : v.get<double>();
      if (!(std::abs(x) <= uncertainty::most_value)) {
        a.kind = Answer::Kind::Failed;
        a.text = std::isfinite(x) ? fmt::format("{} is larger than {:.3g}", name, uncertainty::most_value)
                                  : name + " is not finite";
      }
      a.outputs.emplace_back(name, x);
    }
    if (a.outputs.empty() && a.outcome.empty()) return refuse(0, "there are neither outputs nor an outcome", form);
    if (a.kind == Answer::Kind::Failed) a.outputs.clear();
    return a;
  }
};

/// One running command and what it is asked.
class Evaluator {
 public:
  explicit Evaluator(const std::string& definition) {
    const json j = json::parse(definition);
    for (const json& name : j.at("inputs")) names_.push_back(name.get<std::string>());
    command_ = j.at("identity").at("command").get<std::string>();
    const json settings = j.value("settings", json::object());
    timeout_ = settings.value("timeout", 0.0);
    is_one_shot_ = settings.value("one_shot", false);
  }

  void run(std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
           const std::atomic<bool>& cancel) {
    std::vector<bool> is_answered(points.size(), false);
    bool is_fresh = prepare();
    // numbers go on while a process lives, so that no answer counts for a later point
    std::string request;
    const auto send = [&] {
      if (is_fresh || first_ > most_points) first_ = 0;
      request.clear();
      for (std::size_t i = 0; i < points.size(); ++i)
        request += write_request(first_ + static_cast<int>(i), names_, points[i]);
      process_.send(request, is_one_shot_);
    };
    if (!is_fresh)
      if (std::string line; find_surplus(line)) {
        const Reader reader{line, command_};
        process_.end();
        if (!points.empty())
          give(0, reader.refuse(0, "this is an answer to no question", "answer each point once, in one line"));
        return;
      }
    send();
    std::size_t open = points.size(), next = 0;
    auto last = Clock::now();
    const auto give_open = [&](Answer::Kind kind, const std::string& text) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (is_answered[i]) continue;
        Answer a;
        a.kind = kind;
        a.text = text;
        a.seconds = std::chrono::duration<double>(Clock::now() - last).count();
        give(i, a);
      }
    };
    const auto refuse_silent = [&](const std::string& all, const std::string& last_one, const char* help) {
      give_open(Answer::Kind::Refused, write_refusal(make_silent(all, last_one, help)));
    };
    while (open > 0) {
      std::string line;
      const double patience = find_patience(is_fresh && open == points.size());
      const auto waited = [&last] { return std::chrono::duration<double>(Clock::now() - last).count(); };
      // lines that say nothing give it no more time
      Process::Event event = process_.next_line(line, patience > 0 ? std::max(patience - waited(), 1e-6) : 0, cancel);
      const bool is_blank = event == Process::Event::Line && line.find_first_not_of(" \t") == std::string::npos;
      if (is_blank && patience > 0 && waited() > patience) event = Process::Event::TimeOut;
      if (event == Process::Event::Cancelled) {
        process_.end();
        return;
      }
      if (event == Process::Event::TimeOut) {
        process_.end();
        // the text stays with the results: nothing that was measured
        const std::string what = fmt::format("{} {} s", no_answer_within, timeout_);
        if (!has_answered_ && ++waits_in_vain_ >= most_waits) {
          const std::string all =
              fmt::format("was started {} times and gave no answer within {} s", waits_in_vain_, patience);
          refuse_silent(all, what, "--timeout gives it more time");
        } else {
          // among several nobody knows which one hangs; they will be asked one by one
          give_open(points.size() == 1 ? Answer::Kind::Failed : Answer::Kind::Crashed, what);
        }
        return;
      }
      if (event == Process::Event::Closed) {
        const std::string ending = process_.find_ending();
        if (!is_fresh && open == points.size()) {
          // it ended after its last answer: programs may answer one point each
          is_fresh = prepare();
          send();
          last = Clock::now();
          continue;
        }
        // a shell's way to say so; a program that has answered is there
        if (!has_answered_ && (ending.starts_with("exit code 127") || ending.starts_with("exit code 126"))) {
          give_open(Answer::Kind::Refused, write_refusal(make_missing(ending)));
          return;
        }
        const std::string words = ending.empty() ? "" : ": " + ending;
        if (!has_answered_ && ++starts_in_vain_ >= most_starts) {
          const std::string all =
              fmt::format("was started {} times and ended without an answer each time", starts_in_vain_);
          refuse_silent(all + words, fmt::format("{}{}", ended_without_answer, words),
                        "give it a point by hand to see what it says");
        } else {
          give_open(Answer::Kind::Crashed, fmt::format("{}{}", ended_without_answer, words));
        }
        return;
      }
      if (event == Process::Event::TooLong) {
        const Reader reader{line, command_};
        while (next < points.size() && is_answered[next]) ++next;
        process_.end();
        give(next, reader.refuse(0, fmt::format("the line is longer than {} MB", Process::longest_line >> 20),
                                 "each answer is one line of at most so much; is the end of the line missing?"));
        return;
      }
      if (is_blank) continue;
      if (!process_.is_whole() && breaks_off(line)) continue;  // it ended while it wrote
      while (next < points.size() && is_answered[next]) ++next;
      int id = first_ + static_cast<int>(next);
      Answer a = read_answer_line(line, command_, id);
      const int given = id;
      id -= first_;
      if (id < 0 || id >= static_cast<int>(points.size()) || is_answered[static_cast<std::size_t>(id)]) {
        const Reader reader{line, command_};
        a = reader.refuse(find_member(line, "id"), fmt::format("id: there is no open point {}", given),
                          "give back the id of the point");
        id = static_cast<int>(next);
      }
      const auto now = Clock::now();
      a.seconds = std::chrono::duration<double>(now - last).count();
      a.line = std::move(line), a.source = command_;
      if (is_fresh && open == points.size()) start_time_ = std::max(start_time_, a.seconds);
      last = now;
      const bool is_refused = a.kind == Answer::Kind::Refused;
      has_answered_ = has_answered_ || !is_refused;
      is_answered[static_cast<std::size_t>(id)] = true;
      --open;
      give(static_cast<std::size_t>(id), std::move(a));
      if (is_refused) {
        process_.end();
        return;
      }
    }
    first_ += static_cast<int>(points.size());
    if (is_one_shot_) process_.end();
  }

 private:
  /// Whether a new process was started.
  bool prepare() {
    if (process_.is_running() && !is_one_shot_) return false;
    process_.start(command_);
    return true;
  }

  Refusal make_missing(const std::string& ending) const {
    Refusal r;
    r.diagnostic = {Severity::Error,
                    "E827",
                    {},
                    1,
                    fmt::format("the command \"{}\" cannot be started: {}", command_, ending),
                    "name the program with its folder, and make scripts executable (chmod +x)"};
    return r;
  }

  /// `last` is what the last point's failure would have been.
  Refusal make_silent(const std::string& what, const std::string& last, const char* help) const {
    Refusal r;
    r.line = last;
    r.diagnostic = {Severity::Error, no_answer_code, {}, 1, fmt::format("the command \"{}\" {}", command_, what), help};
    return r;
  }

  /// How long to wait for the next answer [s]: the first one behind a start has what the program needed to start before
  /// on top, and the very first one ten times as long as others. Not where every answer needs a start.
  double find_patience(bool is_first) const {
    if (!is_first || is_one_shot_ || timeout_ <= 0) return timeout_;
    return has_answered_ ? timeout_ + start_time_ : 10 * timeout_;
  }

  /// A line that it has written although nothing was open.
  bool find_surplus(std::string& line) {
    process_.look();
    while (process_.take_line(line))
      if (line.find_first_not_of(" \t") != std::string::npos) return true;
    return false;
  }

  static constexpr const char* ended_without_answer = "the evaluator ended without an answer";
  static constexpr int most_points = 1'000'000'000 / 2;
  std::vector<std::string> names_;
  int first_ = 0;  // number of the first point of a call
  std::string command_;
  double timeout_ = 0;
  bool is_one_shot_ = false;
  bool has_answered_ = false;
  double start_time_ = 0;  // longest time from a start to its first answer [s]
  static constexpr int most_starts = 10, most_waits = 3;
  int starts_in_vain_ = 0, waits_in_vain_ = 0;  // before the first answer of all
  Process process_;
};

}  // namespace

std::string write_request(int id, const std::vector<std::string>& names, const Point& x) {
  json inputs = json::object();
  for (std::size_t i = 0; i < names.size(); ++i) inputs[names[i]] = x.at(i);
  return json{{"id", id}, {"inputs", inputs}}.dump() + "\n";
}

Answer read_answer_line(const std::string& line, const std::string& command, int& id) {
  return Reader{line, command}.read(id);
}

std::string write_refusal(const Refusal& r) {
  const Diagnostic& d = r.diagnostic;
  return json{{"file", d.where.file}, {"column", d.where.column}, {"code", d.code},
              {"message", d.message}, {"help", d.help},           {"line", r.line}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

Refusal read_refusal(const std::string& text) {
  const json j = json::parse(text);
  Refusal r;
  r.diagnostic = {Severity::Error, j.at("code"), {}, 1, j.at("message"), j.at("help")};
  if (const std::string file = j.at("file"); !file.empty()) r.diagnostic.where = {file, 1, j.at("column")};
  r.line = j.at("line");
  return r;
}

std::vector<std::string> list_outputs(const Answer& a) {
  std::vector<std::string> names;
  for (const auto& [name, value] : a.outputs) names.push_back(name);
  std::sort(names.begin(), names.end());
  return names;
}

AnswerForm form_of(const Answer& a) { return {list_outputs(a), a.trajectory.size()}; }

Answer compare_form(const Answer& a, const AnswerForm& form) {
  if (a.kind != Answer::Kind::Done) return a;
  const std::vector<std::string> here = list_outputs(a), &elsewhere = form.outputs;
  if (here == elsewhere) {
    if (a.trajectory.empty() || form.ordinates == 0 || a.trajectory.size() == form.ordinates) return a;
    return Reader{a.line, a.source}.make_refused(
        "E823", find_member(a.line, "trajectory"),
        fmt::format("the model gave a trajectory of the length {} at this point and of the length {} at others",
                    a.trajectory.size(), form.ordinates),
        "give values over the same grid at every point (null where there is none), or leave the trajectory out");
  }
  const auto join = [](const std::vector<std::string>& names) {
    return names.empty() ? std::string("none") : fmt::format("{}", fmt::join(names, ", "));
  };
  // at the first name that is new, or at the list that lacks one
  std::size_t offset = find_member(a.line, "outputs");
  for (const auto& [name, value] : a.outputs)
    if (!std::binary_search(elsewhere.begin(), elsewhere.end(), name)) {
      offset = find_member(a.line, name);
      break;
    }
  return Reader{a.line, a.source}.make_refused(
      "E823", offset,
      fmt::format("the model gave the outputs {} at this point and {} at others", join(here), join(elsewhere)),
      "give the same outputs at every point, or {\"failed\": \"why\"} where one has no value; another model wants "
      "another folder");
}

Runner make_evaluator(const std::string& definition) {
  const auto evaluator = std::make_shared<Evaluator>(definition);
  return [evaluator](std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
                     const std::atomic<bool>& cancel) { evaluator->run(points, give, cancel); };
}

}  // namespace topple::study
