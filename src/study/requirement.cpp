#include "study/requirement.h"

#include <algorithm>

#include "base/error.h"
#include "study/permissible.h"

namespace topple::study {
namespace {

using uncertainty::failed_outcome;
using uncertainty::Possibility;
using uncertainty::Result;

/// What the search of outcomes knows of the classes of a requirement: of several outcomes the most possible one, and
/// the end only where all of them have come to it.
std::vector<Possibility> gather(const std::vector<Possibility>& outcomes, const uncertainty::Classify& classify) {
  std::vector<Possibility> all;
  for (const Possibility& p : outcomes) {
    Result run;
    run.state = p.outcome == failed_outcome ? Result::State::Failed : Result::State::Done;
    run.outcome = p.outcome;
    const int c = classify(run);
    const auto found = std::find_if(all.begin(), all.end(), [c](const Possibility& a) { return a.outcome == c; });
    if (found == all.end()) {
      all.push_back(p);
      all.back().outcome = c;
      continue;
    }
    const bool is_converged = found->converged && p.converged;
    if (p.possibility > found->possibility) *found = p;
    found->outcome = c, found->converged = is_converged || found->possibility >= 1;
  }
  return all;
}

}  // namespace

uncertainty::Classify make_requirement_classes(const Problem& p, const std::vector<std::string>& outputs,
                                               const std::vector<std::string>& outcomes) {
  if (p.permissible.empty()) return {};
  const Permissible asked = read_permissible(p.permissible, p);
  try {
    return [asked, &outputs, &outcomes, requirement = make_requirement(asked, outputs, outcomes),
            count = outcomes.size()](const Result& r) mutable {
      if (r.state != Result::State::Done) return failed_outcome;
      if (outcomes.size() != count) requirement = make_requirement(asked, outputs, outcomes), count = outcomes.size();
      return requirement(r) >= 0 ? kept_class : broken_class;
    };
  } catch (const InputError&) {
    return {};  // nothing has been run that has what it asks for
  }
}

bool is_of_outcomes(const Problem& p) {
  return !p.permissible.empty() && read_permissible(p.permissible, p).limits.empty();
}

void find_requirement(StudyResult& r, const Problem& p, uncertainty::Asker& asker,
                      const std::vector<std::string>& outputs, const std::vector<std::string>& outcomes) {
  if (p.permissible.empty() || is_of_outcomes(p)) return;
  uncertainty::PossibilityOptions o;
  o.classify = make_requirement_classes(p, outputs, outcomes);
  if (!o.classify) return;
  o.seed = p.seed;
  o.known = r.requirement;
  o.skipped = {failed_outcome};
  if (!r.insights.has_boxes) o.islands = 0;  // they take runs of the boxes
  r.requirement = uncertainty::find_possibilities(p.space, asker, o).classes;
}

void read_requirement(StudyResult& r, const Problem& p, const uncertainty::Archive& archive,
                      const std::vector<std::string>& outputs, const std::vector<std::string>& outcomes) {
  const uncertainty::Classify classify = make_requirement_classes(p, outputs, outcomes);
  if (!classify) return;
  std::vector<Possibility> known;
  if (is_of_outcomes(p)) {
    known = gather(r.possibilities.classes, classify);
  } else {
    known = r.requirement;
    std::erase_if(known, [](const Possibility& k) { return k.outcome == failed_outcome; });
    for (const Possibility& k : r.possibilities.classes)
      if (k.outcome == failed_outcome) known.push_back(k);
  }
  r.requirement = uncertainty::read_possibilities(p.space, archive, known, classify);
}

std::vector<RequirementClass> list_requirement(const Problem& p, const StudyResult& r) {
  const uncertainty::Classify classify = make_requirement_classes(p, r.outputs, r.outcomes);
  std::vector<RequirementClass> list;
  if (!classify) return list;
  uncertainty::PossibilityResult all;
  for (const auto& [c, name] : {std::pair(kept_class, "kept"), {broken_class, "broken"}, {failed_outcome, "failed"}}) {
    const auto runs = std::ranges::count_if(r.alpha.archive.samples(), [&, c = c](const uncertainty::Sample& s) {
      return s.result.state != Result::State::NotRun && classify(s.result) == c;
    });
    if (c == failed_outcome && runs == 0) continue;
    Possibility found;
    found.outcome = c, found.resolution = 1;
    for (const Possibility& f : r.requirement)
      if (f.outcome == c) found = f;
    list.push_back({name, runs, found});
    all.classes.push_back(found);
  }
  for (RequirementClass& c : list) {
    c.necessity = uncertainty::calc_necessity(all, c.found.outcome);
    c.is_necessity_converged = uncertainty::is_necessity_converged(all, c.found.outcome);
  }
  return list;
}

}  // namespace topple::study
