#include "study/limits.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "study/requirement.h"

namespace topple::study {
namespace {

using uncertainty::failed_outcome;
using uncertainty::Possibility;
using uncertainty::Result;

std::optional<std::size_t> find_index(const std::vector<std::string>& outputs, const std::string& name) {
  const auto at = std::find(outputs.begin(), outputs.end(), name);
  if (at == outputs.end()) return std::nullopt;
  return static_cast<std::size_t>(at - outputs.begin());
}

bool has_value(const Result& r, std::size_t output) {
  return output < r.values.size() && std::isfinite(r.values[output]);
}

/// Classes of runs by one limit; nothing where no run has its output. A run without a value is as one that failed.
uncertainty::Classify make_classes(const Limit& limit, const std::vector<std::string>& outputs) {
  const std::optional<std::size_t> index = find_index(outputs, limit.output);
  if (!index) return {};
  return [limit, i = *index](const Result& r) {
    return !has_value(r, i) ? failed_outcome : is_broken(limit, r.values[i]) ? broken_class : kept_class;
  };
}

/// What is known of breaking a limit, with the class that its own search gives it.
std::vector<Possibility> find_known(const StudyResult& r, int limit) {
  for (Possibility k : r.limits)
    if (k.outcome == limit) {
      k.outcome = broken_class;
      return {k};
    }
  return {};
}

/// Breaking a limit, of which no run in the support need be there.
std::optional<Possibility> read_limit(const Problem& p, const StudyResult& r, const uncertainty::Archive& archive,
                                      const std::vector<std::string>& outputs, int limit) {
  const uncertainty::Classify classify = make_classes(p.limits[static_cast<std::size_t>(limit)], outputs);
  if (!classify) return std::nullopt;
  for (Possibility& c : uncertainty::read_possibilities(p.space, archive, find_known(r, limit), classify))
    if (c.outcome == broken_class) {
      c.outcome = limit;
      return c;
    }
  return std::nullopt;
}

std::vector<int> list_open(const Problem& p, const StudyResult& r, const uncertainty::Archive& archive,
                           const std::vector<std::string>& outputs) {
  std::vector<int> open;
  for (int k = 0; k < std::ssize(p.limits); ++k)
    if (const auto c = read_limit(p, r, archive, outputs, k); c && !c->converged) open.push_back(k);
  return open;
}

}  // namespace

bool is_broken(const Limit& limit, double value, double left) {
  switch (limit.kind) {
    case Limit::Kind::Reach:
    case Limit::Kind::Direction:
      return value + left > limit.least;
    case Limit::Kind::Clearance:
      return value - left < limit.least;
    case Limit::Kind::Screening:
      break;
  }
  return value + left >= limit.least;
}

std::vector<LimitFinding> list_limits(const Problem& p, const StudyResult& r) {
  std::vector<LimitFinding> all;
  const uncertainty::Archive& archive = r.alpha.archive;
  const int core = archive.find(uncertainty::calc_centre(p.space));
  for (int k = 0; k < std::ssize(p.limits); ++k) {
    const Limit& limit = p.limits[static_cast<std::size_t>(k)];
    const std::optional<std::size_t> index = find_index(r.outputs, limit.output),
                                     left = find_index(r.outputs, limit.left);
    if (!index) continue;
    LimitFinding f;
    f.limit = k;
    for (const uncertainty::Sample& s : archive.samples()) {
      const double degree = uncertainty::calc_membership(p.space, s.x);
      if (!(degree >= 0) || !has_value(s.result, *index)) continue;
      const double value = s.result.values[*index];
      ++f.runs;
      f.least = std::min(f.least, value), f.most = std::max(f.most, value);
      if (is_broken(limit, value)) {
        ++f.broken;
        if (value > limit.above) f.above = std::max(f.above, degree);
      } else {
        f.open += left && has_value(s.result, *left) && is_broken(limit, value, s.result.values[*left]);
      }
    }
    if (f.runs == 0) continue;
    if (core >= 0 && has_value(archive[core].result, *index))
      f.is_core_broken = is_broken(limit, archive[core].result.values[*index]);
    f.found = read_limit(p, r, archive, r.outputs, k).value_or(Possibility{k, 0, 1, -1, 0, false});
    all.push_back(f);
  }
  return all;
}

int count_open_limits(const Problem& p, const StudyResult& r, const uncertainty::Archive& archive,
                      const std::vector<std::string>& outputs) {
  return static_cast<int>(list_open(p, r, archive, outputs).size());
}

void find_limits(StudyResult& r, const Problem& p, uncertainty::Asker& asker, const std::vector<std::string>& outputs) {
  const std::vector<int> open = list_open(p, r, asker.archive(), outputs);
  const int limit = asker.limit();
  auto rest = static_cast<int>(open.size());
  for (const int k : open) {
    if (!asker.can_go_on()) break;
    asker.set_limit(asker.asked() + asker.rest() / rest--);
    uncertainty::PossibilityOptions o;
    o.classify = make_classes(p.limits[static_cast<std::size_t>(k)], outputs);
    o.seed = p.seed + 1000 * static_cast<std::uint64_t>(k);
    o.known = find_known(r, k);
    o.skipped = {kept_class, failed_outcome};
    std::erase_if(r.limits, [k](const Possibility& c) { return c.outcome == k; });
    for (Possibility& c : uncertainty::find_possibilities(p.space, asker, o).classes) {
      c.outcome = k;
      r.limits.push_back(c);
    }
    asker.set_limit(limit);
  }
}

void read_limits(StudyResult& r, const Problem& p, const uncertainty::Archive& archive,
                 const std::vector<std::string>& outputs) {
  std::vector<Possibility> all;
  for (int k = 0; k < std::ssize(p.limits); ++k)
    if (const auto c = read_limit(p, r, archive, outputs, k)) all.push_back(*c);
  r.limits = std::move(all);
}

}  // namespace topple::study
