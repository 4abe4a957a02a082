#include "server/judged_branch.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>

namespace topple::server {

namespace {

constexpr double kSameTime = 1e-9;  // [s]

/// Frames around a time, and the share of the later one.
struct Between {
  std::size_t before = 0, after = 0;
  double share = 0;
};
Between find_frames(const std::vector<double>& time, double t) {
  const auto after = std::lower_bound(time.begin(), time.end(), t);
  if (after == time.begin()) return {0, 0, 0};
  if (after == time.end()) return {time.size() - 1, time.size() - 1, 0};
  const auto i = static_cast<std::size_t>(after - time.begin());
  if (time[i] - t < kSameTime) return {i, i, 0};
  if (t - time[i - 1] < kSameTime) return {i - 1, i - 1, 0};
  return {i - 1, i, (t - time[i - 1]) / (time[i] - time[i - 1])};
}

/// Value of a series of a branch at a time, between frames on a straight line.
double value_at(const std::vector<double>& time, const std::vector<double>& value, double t) {
  const Between f = find_frames(time, t);
  return f.share == 0 ? value[f.before] : (1 - f.share) * value[f.before] + f.share * value[f.after];
}

/// Frames of either within the time that both have, at most n of them.
std::vector<double> find_times(const std::vector<double>& a, const std::vector<double>& b, std::size_t n) {
  const double begin = std::max(a.front(), b.front()), end = std::min(a.back(), b.back());
  std::vector<double> all, times;
  std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  std::erase_if(all, [&](double t) { return t < begin || t > end; });
  const auto is_same = [](double x, double y) { return y - x < kSameTime; };
  all.erase(std::unique(all.begin(), all.end(), is_same), all.end());
  if (all.empty()) all.push_back(end);
  if (all.size() <= n) return all;
  for (std::size_t i = 0; i < n; ++i) times.push_back(all[i * (all.size() - 1) / (n - 1)]);
  return times;
}

Json describe_edits(const JudgedBranch& b) {
  Json edits = Json::array();
  for (const JudgedBranch::Edit& e : b.edits) edits.push_back({{"time", e.time}, {"text", e.text}});
  return edits;
}

}  // namespace

Json describe_findings(const JudgedBranch& b) {
  const record::Record& r = b.record;
  Json out{{"branch", b.branch}, {"ending", {{"kind", r.ending}, {"text", r.ending_text}}}, {"time", number(b.time)}};
  Json& findings = out["findings"] = Json::array();
  for (const record::Finding& f : r.findings) findings.push_back(describe_finding(f));
  Json& events = out["events"] = Json::array();
  for (const record::Event& e : r.events) events.push_back(describe_event(e));
  out["not_modelled"] = r.not_modelled;
  out["notes"] = b.notes;
  return out;
}

Json compare(const JudgedBranch& first, const JudgedBranch& second, int n) {
  const std::array<const record::Record*, 2> r{&first.record, &second.record};
  const std::vector<double> times = find_times(r[0]->time, r[1]->time, static_cast<std::size_t>(n));
  const double end = times.back();
  Json out{{"a", first.branch}, {"b", second.branch}, {"time", numbers(times)}, {"series", Json::array()}};
  // those that both have: a branch that has ended has more
  for (const record::Series& s : r[0]->series) {
    const auto other =
        std::find_if(r[1]->series.begin(), r[1]->series.end(), [&](const auto& o) { return o.id == s.id; });
    if (other == r[1]->series.end()) continue;
    Json entry{{"id", s.id}, {"title", s.title}, {"unit", s.unit}, {"group", s.group}};
    for (const std::size_t side : {0U, 1U}) {
      const std::vector<double>& series = side == 0 ? s.value : other->value;
      Json& values = entry[side == 0 ? "a" : "b"] = Json::array();
      for (const double t : times) values.push_back(number(value_at(r[side]->time, series, t)));
    }
    out["series"].push_back(std::move(entry));
  }
  // bodies of both by name; debris follows no calculation
  const auto place = [&](std::size_t side, std::size_t frame, std::size_t body) {
    const float* p = &r[side]->position[3 * (frame * r[side]->bodies.size() + body)];
    return Vec3{p[0], p[1], p[2]};
  };
  const auto place_at = [&](std::size_t side, double t, std::size_t body) {
    const Between f = find_frames(r[side]->time, t);
    return (1 - f.share) * place(side, f.before, body) + f.share * place(side, f.after, body);
  };
  std::map<std::string, std::size_t> index;
  for (std::size_t b = 0; b < r[1]->bodies.size(); ++b) index[r[1]->bodies[b].name] = b;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t b = 0; b < r[0]->bodies.size(); ++b)
    if (const auto it = index.find(r[0]->bodies[b].name); it != index.end() && r[0]->bodies[b].kind != "debris")
      pairs.emplace_back(b, it->second);
  const auto distances = [&](double t) {
    std::vector<std::pair<double, std::string>> list;
    for (const auto& [a, b] : pairs)
      list.emplace_back(norm(place_at(0, t, a) - place_at(1, t, b)), r[0]->bodies[a].name);
    return list;
  };
  Json& largest = out["largest"] = {{"time", times}, {"distance", Json::array()}};
  for (const double t : times) {
    double d = 0;
    for (const auto& [distance, name] : distances(t)) d = std::max(d, distance);
    largest["distance"].push_back(number(d));
  }
  auto last = distances(end);
  std::stable_sort(last.begin(), last.end(), [](const auto& x, const auto& y) { return x.first > y.first; });
  out["bodies"] = Json::array();
  for (std::size_t i = 0; i < std::min<std::size_t>(10, last.size()); ++i)
    out["bodies"].push_back({{"name", last[i].second}, {"distance", number(last[i].first)}});
  out["findings"] = Json::array();
  const bool is_one_start = first.start != nullptr && first.start == second.start;
  for (const record::Finding& f : r[0]->findings) {
    if (is_one_start && f.id == "stability.start") continue;
    const auto it =
        std::find_if(r[1]->findings.begin(), r[1]->findings.end(), [&](const auto& g) { return g.id == f.id; });
    const std::string other = it == r[1]->findings.end() ? "" : it->text;
    if (other != f.text) out["findings"].push_back({{"id", f.id}, {"title", f.title}, {"a", f.text}, {"b", other}});
  }
  for (const record::Finding& f : r[1]->findings)
    if (std::none_of(r[0]->findings.begin(), r[0]->findings.end(), [&](const auto& g) { return g.id == f.id; }))
      out["findings"].push_back({{"id", f.id}, {"title", f.title}, {"a", ""}, {"b", f.text}});
  out["edits"] = {{"a", describe_edits(first)}, {"b", describe_edits(second)}};
  return out;
}

}  // namespace topple::server
