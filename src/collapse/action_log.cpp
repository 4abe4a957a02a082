#include "collapse/action_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "base/error.h"
#include "base/file.h"
#include "base/hash.h"
#include "collapse/edit_json.h"
#include "record/provenance.h"

namespace topple::collapse {

namespace {

using Json = nlohmann::ordered_json;

std::string dump(const Json& j) { return j.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// The values of the rules, so that a log made with others is not taken for the same.
std::string calc_rules_hash(const Knowledge& k) {
  std::string text;
  for (const Rule& r : k.rules) text += fmt::format("{}={:.17g};", r.id, r.value);
  return calc_sha256(text);
}

product::Plan read_quietly(const std::string& text, const std::string& path) {
  std::vector<Diagnostic> warnings;
  return product::read_plan(text, path, warnings);
}

/// What a run depends on beside the plan, as the head of a log says it.
Json describe_setting(const Knowledge& k, const RunOptions& run) {
  return {{"rules_sha256", calc_rules_hash(k)},
          {"frame_rate", run.frame_rate},
          {"duration", run.duration},
          {"step", run.step}};
}

/// Lines that have their end.
std::vector<std::string> whole_lines(const std::string& text) {
  std::vector<std::string> lines;
  for (size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    lines.push_back(text.substr(at, end - at));
  return lines;
}

std::optional<LogSummary> summarise(const std::string& path, const std::string& plan_sha256, const Json& setting,
                                    const std::string& program) {
  LogSummary s;
  s.path = path;
  try {
    const std::vector<std::string> lines = whole_lines(read_file(path));
    if (lines.size() < 2) return std::nullopt;
    const Json head = parse_command(lines.front());
    if (head.at("topple_log") != 1 || head.at("program") != program || head.at("plan_sha256") != plan_sha256)
      return std::nullopt;
    for (const auto& [key, value] : setting.items())
      if (head.at(key) != value) return std::nullopt;
    s.created = head.at("created");
    for (size_t i = 1; i < lines.size(); ++i) {
      const Json entry = parse_command(lines[i]);
      if (entry.at("action") != "reached") ++s.actions;
      s.time = std::max(s.time, entry.at("time").get<double>());
      if (entry.contains("made")) s.branches = std::max(s.branches, entry.at("made").get<int>());
    }
  } catch (const std::exception&) { return std::nullopt; }
  if (s.actions == 0 && !(s.time > 0)) return std::nullopt;
  return s;
}

/// Whether a session that lives writes it.
bool is_held(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool held = flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  close(file);
  return held;
}

/// The path, or with the first number behind it under which `take` finds no file.
///   take  whether it could; errno tells why not
template <class F>
std::string take_free_name(const std::string& path, const F& take) {
  const std::filesystem::path wanted(path);
  for (int n = 1; n < 100000; ++n) {
    std::string name =
        n == 1
            ? path
            : (wanted.parent_path() / (wanted.stem().string() + "-" + std::to_string(n) + wanted.extension().string()))
                  .string();
    if (take(name)) return name;
    if (errno != EEXIST) break;
  }
  throw std::runtime_error(path + ": the action log cannot be written: " + std::strerror(errno));
}

int open_new(std::string& path) {
  int file = -1;
  path = take_free_name(path, [&file](const std::string& name) {
    file = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
    return file >= 0;
  });
  (void)flock(file, LOCK_EX | LOCK_NB);  // for as long as the session lives
  return file;
}

}  // namespace

LoggedSteering::LoggedSteering(const product::Plan& plan, const Knowledge& k, SteeringOptions options,
                               SteeringCallbacks callbacks, const std::string& path, SamplePlan sample_plan)
    : plan_(plan), sample_plan_(std::move(sample_plan)), path_(path) {
  Json header{{"topple_log", 1},
              {"program", "topple " + options.run.program_version},
              {"created", record::now_utc()},
              {"plan_path", plan.path},
              {"plan_sha256", calc_sha256(plan.text)},
              {"plan_text", plan.text}};
  header.update(describe_setting(k, options.run));
  steering_ = std::make_unique<Steering>(k, std::move(options), std::move(callbacks));
  steering_->add_root(plan, "main");
  if (!path_.empty()) file_ = open_new(path_);
  try {
    write(header);
  } catch (...) {  // nobody could go on with a log without its head
    close(file_);
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
    throw;
  }
}

LoggedSteering::~LoggedSteering() {
  if (file_ >= 0) close(file_);
  std::error_code ignored;
  if (!is_kept_ && !path_.empty()) std::filesystem::remove(path_, ignored);
}

void LoggedSteering::keep_as(const std::string& path) {
  is_kept_ = true;
  if (file_ < 0) return;
  const std::string own = std::exchange(
      path_, take_free_name(path, [&](const std::string& name) { return link(path_.c_str(), name.c_str()) == 0; }));
  std::error_code ignored;
  std::filesystem::remove(own, ignored);
}

void LoggedSteering::reserve(const Json& command) const {
  constexpr off_t beside = 1024;  // the rest of a line, and a line with what was reached
  if (file_ < 0) return;
  const off_t end = lseek(file_, 0, SEEK_END), length = static_cast<off_t>(dump(command).size()) + beside;
  // file systems that cannot reserve find out as they write
  if (end >= 0 && fallocate(file_, FALLOC_FL_KEEP_SIZE, end, length) != 0 &&
      (errno == ENOSPC || errno == EDQUOT || errno == EFBIG))
    throw std::runtime_error(path_ + ": the action log has no room for the action: " + std::strerror(errno));
}

void LoggedSteering::write(const Json& entry) {
  const std::string line = dump(entry);
  if (file_ >= 0) {
    const std::string whole = line + "\n";
    const off_t begin = lseek(file_, 0, SEEK_END);
    size_t done = 0;
    while (done < whole.size()) {
      const ssize_t n = ::write(file_, whole.data() + done, whole.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) {
        std::string why = std::strerror(errno);
        is_broken_ = true;
        // half a line would spoil what comes after it
        if (done > 0 && (begin < 0 || ftruncate(file_, begin) != 0)) why += "; its last line is not whole";
        throw std::runtime_error(path_ + ": the action log cannot be written: " + why);
      }
      done += static_cast<size_t>(n);
    }
  }
  lines_.push_back(line);
  if (on_line) on_line(line);
}

bool LoggedSteering::is_action(const std::string& c) {
  return is_edit(c) || c == "branch" || c == "rename" || c == "switch" || c == "undo" || c == "plan.apply" ||
         c == "sample";
}

Steering::Made LoggedSteering::perform(const Json& command) {
  Steering& s = *steering_;
  const std::string word = read_text(command, "command");
  const int id = s.active().id;
  const long step = s.active().run().has_begun() ? s.cursor_step() : 0;
  const double time = s.active().run().has_begun() ? s.cursor_time() : 0;
  const Cursor cursor = s.cursor();
  if (is_broken_)
    throw std::runtime_error(path_ + ": the action log could not take an action, so none can be done any more");
  reserve(command);
  // what was computed beyond a cursor in the past is done again, too
  const Branch& from = s.active();
  const bool is_left = word == "switch" || (!cursor.is_live && word != "rename");
  Steering::Made made;
  if (is_edit(word)) {
    made = s.edit(read_edit(command), read_text(command, "name", ""), read_flag(command, "in_place", false));
  } else if (word == "branch") {
    check_keys(command, {"name", "time"});
    made = s.fork(read_text(command, "name", ""));
  } else if (word == "undo") {
    check_keys(command, {});
    made = s.undo();
  } else if (word == "rename") {
    check_keys(command, {"name"});
    const int which = command.contains("branch") ? read_integer(command, "branch", 1, 1 << 30) : id;
    s.rename(which, read_text(command, "name"));
    made.branch = &s.branch(which);
  } else if (word == "switch") {
    check_keys(command, {});
    s.switch_to(read_integer(command, "branch", 1, 1 << 30));
    made.branch = &s.active();
  } else if (word == "plan.apply") {
    check_keys(command, {"text", "name"});
    made.branch = &s.add_root(read_quietly(read_text(command, "text"), plan_.path), read_text(command, "name", ""));
    made.text = "the plan from its start";
  } else if (word == "sample") {
    check_keys(command, {"name", "inputs", "words", "text"});
    if (!sample_plan_) throw InputError("E930", "samples cannot be played here");
    std::vector<double> inputs;
    if (!command.contains("inputs") || !command["inputs"].is_array())
      throw InputError("E912", "\"inputs\" must be numbers");
    for (const Json& x : command["inputs"]) inputs.push_back(x.is_number() ? x.get<double>() : std::nan(""));
    made.branch = &s.add_root(sample_plan_(read_quietly(read_text(command, "text"), plan_.path), inputs),
                              read_text(command, "name", ""));
    made.branch->sample = read_text(command, "words", "");
    made.text = "a sample from its start";
  } else {
    throw InputError("E911", "\"" + word + "\" is not an action");
  }
  if (is_left) note_reached(from);
  Json entry{{"seq", ++seq_}, {"action", word}, {"branch", id}, {"step", step}, {"time", time}};
  if (!cursor.is_live) entry["frame"] = cursor.frame;
  entry["made"] = made.branch->id;
  entry["command"] = command;
  for (const char* key : {"id", "session"}) entry["command"].erase(key);
  write(entry);
  return made;
}

void LoggedSteering::note_reached() { note_reached(steering_->active()); }

void LoggedSteering::note_reached(const Branch& b) {
  if (!b.run().has_begun()) return;
  const auto it = reached_.find(b.id);
  if (it != reached_.end() && it->second == b.steps()) return;
  reached_[b.id] = b.steps();
  write({{"seq", ++seq_}, {"action", "reached"}, {"branch", b.id}, {"step", b.steps()}, {"time", b.frontier()}});
}

std::optional<LogSummary> find_earlier_log(const std::string& path, const std::string& plan_sha256, const Knowledge& k,
                                           const RunOptions& run) {
  namespace fs = std::filesystem;
  const fs::path wanted(path);
  const std::string stem = wanted.stem().string(), ending = wanted.extension().string();
  const auto is_one = [&](const fs::path& p) {
    const std::string name = p.stem().string();
    if (p.extension() != ending || name.compare(0, stem.size(), stem) != 0) return false;
    const std::string number = name.substr(stem.size());
    return number.empty() ||
           (number.size() > 1 && number[0] == '-' &&
            std::all_of(number.begin() + 1, number.end(), [](unsigned char c) { return std::isdigit(c) != 0; }));
  };
  std::vector<std::pair<fs::file_time_type, std::string>> found;
  std::error_code fault;
  for (fs::directory_iterator it(wanted.parent_path(), fault), end; !fault && it != end; it.increment(fault)) {
    std::error_code ignored;
    if (is_one(it->path()) && it->is_regular_file(ignored))
      found.emplace_back(it->last_write_time(ignored), it->path().string());
  }
  std::sort(found.rbegin(), found.rend());
  for (const auto& [time, name] : found)
    if (auto s = summarise(name, plan_sha256, describe_setting(k, run), "topple " + run.program_version);
        s && !is_held(name))
      return s;
  return std::nullopt;
}

ReplayResult replay(const std::string& log, const std::string& name, const Knowledge& k, SteeringOptions options,
                    const SamplePlan& sample_plan, const Progress& progress, const SteeringCallbacks& callbacks,
                    const std::string& path) {
  ReplayResult result;
  int line = 0;
  const auto fail = [&](const std::string& code, const std::string& message, const std::string& help = {}) {
    Diagnostic d;
    d.code = code;
    d.where = {name, line, 1};
    d.message = message;
    d.help = help;
    throw InputError({d});
  };
  const std::vector<std::string> lines = whole_lines(log);
  result.was_cut = !log.empty() && log.back() != '\n';
  // one step, and how far the log is done with it; false: no further
  const auto advance = [&](Steering& s, double share) {
    if (progress.report && s.active().steps() % 64 == 0)
      progress.report(line - 1 + std::clamp(share, 0.0, 1.0), static_cast<double>(lines.size()));
    return !progress.is_cancelled() && s.advance();
  };
  for (const std::string& text : lines) {
    ++line;
    try {
      const Json entry = parse_command(text);
      if (!entry.is_object())
        fail("E942", "this line is not a JSON object", "an action log is written by topple steer");
      if (line == 1) {
        if (!entry.contains("topple_log")) fail("E942", "this is not an action log of topple steer");
        if (entry.at("topple_log") != 1) fail("E942", "this program reads action logs of version 1");
        const std::string program = entry.at("program");
        if (program != "topple " + options.run.program_version)
          fail("E943", "the log was written by " + program, "only the same version gives the same bits");
        if (entry.at("rules_sha256") != calc_rules_hash(k))
          fail("E943", "the log was made with other knowledge rules", "give them with --knowledge");
        const std::string plan_text = entry.at("plan_text");
        if (calc_sha256(plan_text) != entry.at("plan_sha256").get<std::string>())
          fail("E942", "the plan in the log is not the one that its hash says");
        options.run.frame_rate = entry.at("frame_rate");
        options.run.duration = entry.at("duration");
        options.run.step = entry.at("step");
        // its own log is there once it has come as far: half of it would be taken for the last session
        result.steering =
            std::make_unique<LoggedSteering>(read_quietly(plan_text, entry.at("plan_path")), k, options, callbacks,
                                             path.empty() ? path : path + ".part", sample_plan);
        result.steering->hold_back();
        continue;
      }
      Steering& s = result.steering->steering();
      const std::string action = entry.at("action");
      Branch& b = s.branch(entry.at("branch"));
      const long step = entry.at("step");
      if (s.active().id != b.id) s.switch_to(b.id);
      s.begin(b);
      if (entry.contains("frame")) {
        // the cursor was in the past; nothing beyond its frame is needed
        const size_t frame = entry.at("frame");
        const double first = static_cast<double>(b.frames()), way = static_cast<double>(frame) + 1 - first;
        while (b.frames() <= frame && advance(s, (static_cast<double>(b.frames()) - first) / way)) {}
        if (progress.is_cancelled()) return result;
        s.rewind_to_frame(frame);
      } else {
        const double first = static_cast<double>(b.steps()), way = static_cast<double>(step) - first;
        while (b.steps() < step && advance(s, (static_cast<double>(b.steps()) - first) / way)) {}
        if (progress.is_cancelled()) return result;
        s.go_live();
      }
      if (progress.report) progress.report(line, static_cast<double>(lines.size()));
      if (s.cursor_step() != step) fail("E943", fmt::format("branch {} does not come to step {} again", b.id, step));
      if (action == "reached") {
        result.steering->note_reached();
      } else {
        const Steering::Made made = result.steering->perform(entry.at("command"));
        if (made.branch->id != entry.at("made").get<int>()) fail("E943", "the action makes another branch than it did");
        ++result.actions;
      }
    } catch (const Json::exception& e) {
      fail("E942", std::string("this line lacks something, or has something else in its place: ") + e.what());
    } catch (const InputError& e) {
      // what an action is refused for has no place of its own
      if (const Diagnostic& d = e.first_error(); d.where.file.empty()) fail(d.code, d.message, d.help);
      throw;
    }
  }
  if (result.steering == nullptr) {
    line = 1;
    fail("E942", "there is no whole line in the log");
  }
  result.steering->keep_as(path);
  return result;
}

}  // namespace topple::collapse
